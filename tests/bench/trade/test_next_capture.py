"""Simulated captures: of the fitted law, equal for all settings, and what follows for the next."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from scissorcal.bench.trade.assemble import captures_of, on_captures
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import fit_case
from scissorcal.bench.trade.knobs.effort import Effort
from scissorcal.bench.trade.knobs.rate import Rate
from scissorcal.bench.trade.next_capture import (
    CAPTURES,
    NEXT_CAPTURE,
    Recapture,
    by_choice,
    next_capture,
    recaptured,
    upper_limit,
)
from scissorcal.bench.trade.point import Curve, Point, Setting
from scissorcal.bench.trade.study import capture_tasks, key_of
from scissorcal.bench.trade.torque import BAND_WORST, WORST
from scissorcal.errors import MissingError
from tests.bench.made_trade import made_case
from tests.bench.trade.captured import captured


def record(choice: tuple[str, str] | None, repeat: int, share: float) -> dict[str, object]:
    choices = [] if choice is None else [list(choice)]
    outcome = {WORST: share, BAND_WORST: 2.0 * share}
    return {"knob": NEXT_CAPTURE, "choices": choices, "repeat": repeat, "outcome": outcome}


def test_the_limit_holds_for_nine_of_ten_next_values() -> None:
    """In 20,000 trials the share is within four standard errors of 0.9."""
    rng = np.random.default_rng(29)
    values = rng.normal(5.0, 2.0, size=(20_000, CAPTURES + 1))
    held = np.mean([row[-1] <= upper_limit(row[:-1]) for row in values])
    assert abs(held - 0.9) < 4.0 * np.sqrt(0.09 / len(values))
    middle, spread = values[0, :4].mean(), values[0, :4].std(ddof=1)
    wanted = middle + stats.t.ppf(0.9, 3) * spread * np.sqrt(1.25)
    assert upper_limit(values[0, :4]) == pytest.approx(wanted)


def test_one_value_shows_no_scatter() -> None:
    with pytest.raises(ValueError, match="no scatter"):
        upper_limit([1.0])


def test_a_setting_that_is_better_loses_nothing() -> None:
    found = next_capture([0.01, 0.02, 0.04], [0.01, 0.01, 0.02])
    assert (found.captures, found.loss) == (3, 0.0)
    assert next_capture([0.01, 0.02], [0.02, 0.03]).loss == pytest.approx(0.01)


def test_settings_compare_on_the_captures_that_both_have() -> None:
    draft = ("effort", "draft")
    records = [record(None, k, 0.01 * k) for k in range(4)]
    records += [record(draft, k, 0.01 * k + 0.001) for k in (1, 2)]
    records.append({"knob": NEXT_CAPTURE, "choices": [], "repeat": 4, "failed": "It broke."})
    records.append({"knob": "effort", "choices": [], "repeat": 0})
    assert set(by_choice(records, WORST)[draft]) == {1, 2}
    labels = ("draft", "standard", "thorough")
    points = tuple(Point(Setting(n, 1.0, present=n == "standard"), {}, {}) for n in labels)
    found = on_captures(Curve("effort", "", "", "", points), records).points
    assert [p.next_capture and p.next_capture.captures for p in found] == [2, 4, None]
    assert found[0].next_capture is not None
    assert found[0].next_capture.loss == pytest.approx(0.001)


def test_only_what_changes_the_fits_needs_captures() -> None:
    case = made_case()
    assert not captures_of(case, Effort(), []).needed  # without a fit nothing can be simulated
    records = [record(None, k, 0.01 * k) for k in range(4)]
    scatter = captures_of(case, Effort(), records).scatter
    assert scatter == pytest.approx(upper_limit([0.0, 0.02, 0.04, 0.06]))
    assert captures_of(case, Rate(), records).scatter is None


def test_each_setting_is_tried_on_the_same_captures() -> None:
    present, draft = capture_tasks(), capture_tasks(("effort", "draft"))
    assert len(present) == len(draft) == CAPTURES
    assert [task.repeat for task in present] == [task.repeat for task in draft]
    assert len({task.key for task in (*present, *draft)}) == 2 * CAPTURES
    one = draft[0]
    told = {"knob": one.knob, "label": one.label, "repeat": 0, "choices": [["effort", "draft"]]}
    assert key_of(told) == one.key


@pytest.fixture(scope="module")
def fitted() -> Case:
    case = captured("paper-80gsm")
    cut, friction, _, _ = fit_case(case, 0)
    return replace(case, cut_fit=cut, friction_fit=friction)


def test_a_simulated_capture_is_of_the_law_that_was_fitted(fitted: Case) -> None:
    """Equal motion, other noise; fitted again it gives the torque that it was simulated of."""
    first, again, other = (recaptured(fitted, repeat) for repeat in (0, 0, 1))
    for name in ("friction", "cut"):
        (own,), (same,), (new,), (old,) = (
            getattr(one, name) for one in (first, again, other, fitted)
        )
        assert np.array_equal(own.samples, same.samples)
        assert not np.array_equal(own.samples["motor_torque"], new.samples["motor_torque"])
        assert np.array_equal(own.samples["stroke"], old.samples["stroke"])
    knob = Recapture(())
    sample = knob.measure(fitted, knob.settings(fitted)[0], 0)
    assert 0.0 < knob.errors(fitted, sample, None)[WORST].value < 0.05


def test_no_capture_is_simulated_without_a_fit_of_friction() -> None:
    with pytest.raises(MissingError, match="no fit of friction"):
        recaptured(made_case(), 0)


def test_draft_is_measured_without_the_law_that_another_fit_chose(fitted: Case) -> None:
    assert fitted.cut_fit is not None
    usual = fitted.cut_fit.candidate
    other = f"{usual}, load-dependent friction"
    cut, _, _, _ = fit_case(replace(fitted, cut_fit=replace(fitted.cut_fit, candidate=other)), 0)
    assert cut is not None
    assert cut.candidate == usual == "power response, rippled fracture"
