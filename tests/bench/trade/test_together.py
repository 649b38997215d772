"""All recommended settings at once: one measurement with the fits made up, and its errors."""

import numpy as np
import pytest

from scissorcal.bench.trade import together
from scissorcal.bench.trade.fits import PROCESSOR, fits_outcome
from scissorcal.bench.trade.knob import KNOBS, make_knob
from scissorcal.bench.trade.models import BYTES
from scissorcal.bench.trade.point import Quantity, Sample, Setting
from scissorcal.bench.trade.together import PRESENT, RECOMMENDED, Together
from scissorcal.bench.trade.torque import BAND_WORST, WORST
from tests.bench.trade.cases import case


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list:
    """Cases whose fits were asked for; fits are the case's own, and no step is timed."""
    asked = []

    def fit_case(one, repeat):
        asked.append(one)
        return one.cut_fit, one.friction_fit, {PROCESSOR: Quantity(2.0, "s")}, ("a check",)

    def package_costs(one, model, compiled, rng):
        return {BYTES: Quantity(float(sum(a.nbytes for a in compiled.arrays.values())), "B")}

    monkeypatch.setattr(together, "fit_case", fit_case)
    monkeypatch.setattr(together, "package_costs", package_costs)
    return asked


def test_the_choices_reach_the_fits_and_the_tables_and_errors_are_of_what_is_rendered(fitted):
    one = case(kappa=0.75)
    choices = (("effort", "standard"), ("tables", "float32, tolerance 10 %"))
    knob = Together(choices)
    present, recommended = knob.settings(one)
    assert (present.label, recommended.label) == (PRESENT, RECOMMENDED)
    now, then = knob.measure(one, present, 0), knob.measure(one, recommended, 0)
    assert [each.effort for each in fitted] == ["draft", "standard"]
    assert then.costs[BYTES].value < now.costs[BYTES].value
    assert (then.costs[PROCESSOR].value, then.rejected) == (2.0, ("a check",))
    reference = Sample({}, fits_outcome(one, one.cut_fit, one.friction_fit))
    errors = [knob.errors(one, sample, reference) for sample in (now, then)]
    assert 0.0 < errors[0][WORST].share < 0.01
    rendered, exact = then.outcome["rendered"], reference.outcome["torque"]
    away = np.subtract(np.array(rendered, float), np.array(exact, float))
    assert errors[1][WORST].value == pytest.approx(np.nanmax(np.abs(away)))
    assert errors[1][WORST].value > 2.0 * errors[0][WORST].value
    assert errors[1][BAND_WORST].value == 0.0
    assert knob.errors(one, now, None) == {}


class Fitted:
    """A fit of an edge, of which only the posterior is used."""

    edge_posterior = "an edge"


def test_time_of_photographs_counts_and_their_edge_is_fitted_with(fitted, monkeypatch):
    one = case()
    choice = Setting("2 photographs", 2.0, {"count": 2, "factor": 1})
    monkeypatch.setattr(together, "_choice", lambda *_: (make_knob("photographs"), choice))
    monkeypatch.setattr(together, "fit_edge", lambda *_: (Fitted, 3.0))
    knob = Together((("photographs", "2 photographs"),))
    sample = knob.measure(one, knob.settings(one)[1], 0)
    assert sample.costs[PROCESSOR].value == 5.0
    assert fitted[-1].edge == Fitted.edge_posterior


def test_what_a_measurement_at_once_does_not_hold_says_so():
    assert {name for name in KNOBS if not make_knob(name).combined} == {"rate", "edge", "plate"}
    assert {name for name in KNOBS if not make_knob(name).of_torque} == {"plate"}
