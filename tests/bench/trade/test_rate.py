"""Loop rate: strokes, rendered against continuous torque, time of a frame, stability margin."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.bench.trade import frame_time
from scissorcal.bench.trade.assemble import curve_of
from scissorcal.bench.trade.frame_time import frame_time_s
from scissorcal.bench.trade.knobs.rate import (
    ALONE,
    IN_HAND,
    NO_PORT,
    NO_RIG,
    Rate,
    known_rig,
    margin,
)
from scissorcal.bench.trade.models import kernel_model
from scissorcal.bench.trade.recommend import choices_of
from scissorcal.bench.trade.rendered import (
    PEAK_OVER_MEAN,
    Stroke,
    continuous_torques,
    hand_strokes,
    rendered_error,
)
from scissorcal.bench.trade.torque import AVERAGE, WORST
from scissorcal.errors import ScissorcalError, needs_unix
from scissorcal.kernel import estimated_rates
from tests.bench.trade.cases import case, linear, pressing


def test_a_stroke_closes_and_opens_with_the_rate_that_is_its_derivative():
    stroke = Stroke(0.9, 0.2, 0.5, 0.02)
    time = np.linspace(0.0, 1.0, 2001)
    opening, rate = stroke.at(time)
    assert opening[[0, 1000, -1]] == pytest.approx([0.9, 0.2, 0.9])
    assert rate == pytest.approx(np.gradient(opening, time), abs=2e-3)
    assert rate.min() == pytest.approx(-PEAK_OVER_MEAN * 0.7 / 0.5)


def test_strokes_cover_openings_and_rates_of_the_scene():
    one = case()
    strokes = hand_strokes(one.recipe)
    assert {(s.wide, s.narrow) for s in strokes} == {one.recipe.scene.opening_rad[::-1]}
    peaks = [-stroke.at(np.array([0.5 * stroke.half_s]))[1][0] for stroke in strokes]
    assert peaks == pytest.approx(np.geomspace(0.1, 1.0, 3))
    contacts = [stroke.contact_m for stroke in hand_strokes(pressing().recipe)]
    assert contacts == pytest.approx(np.linspace(*pressing().recipe.scene.contact_m, 3))


def test_a_system_without_the_loop_gives_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise needs_unix("The loop at a port")

    monkeypatch.setattr(frame_time, "run_loop", refused)
    one = case()
    with pytest.raises(ScissorcalError, match="this system lacks"):
        frame_time_s(kernel_model(one), hand_strokes(one.recipe)[0], 1000.0, one.recipe.limits)


def test_estimated_rates_are_the_servos_low_pass_of_differences():
    tick_s, cutoff_Hz = 1e-3, 100.0
    rates = estimated_rates(1e-3 * np.arange(50), tick_us=1000, cutoff_Hz=cutoff_Hz)
    share = 2.0 * math.pi * cutoff_Hz * tick_s
    share /= 1.0 + share
    assert rates == pytest.approx(1.0 - (1.0 - share) ** np.arange(50), abs=2e-4)
    with pytest.raises(ValueError, match="at least 1 us"):
        estimated_rates([0.0], tick_us=0, cutoff_Hz=0.0)


def test_holding_errs_by_half_a_tick_of_the_torques_slope():
    """A smooth torque without friction: held over T it is off by T/2 |d(tau)/dt| on average."""
    one = pressing()
    tables, limit = kernel_model(one), one.recipe.limits.torque_Nm
    strokes = [replace(hand_strokes(one.recipe)[0], half_s=0.4)]
    continuous = continuous_torques(tables, strokes, limit)
    slope = np.abs(np.gradient(continuous[0].astype(float), 1.0 / 64_000.0)).mean()
    for rate_Hz in (125.0, 1000.0, 8000.0):
        found = rendered_error(tables, strokes, rate_Hz, limit)
        assert found["moments"] == pytest.approx(0.5 / rate_Hz * slope, rel=0.05)
        assert found["average"] <= found["moments"] * 1.01
        assert found["largest"] == np.abs(continuous[0]).max()


def test_the_loops_own_time_is_measured_and_an_early_end_is_an_error():
    one = case(kappa=0.75)
    tables, limits = kernel_model(one), one.recipe.limits
    stroke = hand_strokes(one.recipe)[1]
    assert frame_time_s(tables, stroke, 1000.0, limits, frames=50) > 0.0
    nowhere = replace(stroke, wide=math.nan)
    with pytest.raises(ScissorcalError, match="4 of the last 20 frames"):
        frame_time_s(tables, nowhere, 1000.0, limits, frames=50)


def test_needed_over_allowed_stiffness_is_proportional_to_the_tick():
    one = case(kappa=0.75)
    rig = known_rig(one)
    assert rig is not None
    facts, step_rad = rig
    assert step_rad == pytest.approx(4.8e-5)
    tables = kernel_model(one)
    slow, fast = (margin(one, tables, facts, rate) for rate in (500.0, 1000.0))
    assert slow["in_hand"] == pytest.approx(2.0 * fast["in_hand"])
    assert slow["alone"] > slow["in_hand"]
    assert known_rig(replace(one, friction_fit=None)) is None


def test_the_knob_measures_each_rate_against_the_continuous_torque():
    one = pressing(opening_rate_rad_per_s=(0.5, 1.0))
    knob = pickle.loads(pickle.dumps(Rate()))
    settings = {setting.value: setting for setting in knob.settings(one)}
    assert [rate for rate, setting in settings.items() if setting.present] == [1000.0]
    assert knob.applied(one, settings[250.0]).recipe.scene.loop_rate_Hz == 250.0
    found = {rate: knob.measure(one, settings[rate], 0) for rate in (125.0, 4000.0)}
    errors = {rate: knob.errors(one, sample, None) for rate, sample in found.items()}
    assert errors[4000.0][AVERAGE].value < 0.1 * errors[125.0][AVERAGE].value
    assert errors[125.0][WORST].share > errors[125.0][AVERAGE].share > 0.0
    assert errors[125.0][IN_HAND].value == pytest.approx(32.0 * errors[4000.0][IN_HAND].value)
    assert found[125.0].notes == (NO_PORT,)
    imported = replace(one, friction=(), cut=())
    assert NO_RIG in knob.measure(imported, settings[125.0], 0).notes


def rate_curve(**margins):
    """The curve of three rates whose torque is right, with margins as a record keeps them."""
    torque = {"average": 1e-4, "worst": 1e-3, "moments": 1e-3, "largest": 1.0}
    records = [
        {
            "knob": "rate",
            "label": f"{rate} Hz",
            "repeat": 0,
            "baseline_s": 0.02,
            "costs": {"share of a core": [1e-5 * rate, ""]},
            "outcome": {**torque, **margins},
            "notes": [],
            "rejected": [],
        }
        for rate in (500, 1000, 2000)
    ]
    return curve_of(pressing(), Rate(), records, 0.01)


def test_where_stability_is_infinite_or_unknown_no_slower_loop_is_recommended():
    allowed = rate_curve(in_hand=0.1, alone=0.2)
    assert choices_of([allowed]) == (("rate", "500 Hz"),)
    assert all(point.unbounded == () for point in allowed.points)
    nothing, unknown = rate_curve(in_hand=0.1, alone=None), rate_curve()
    for found, why in ((nothing, f"{ALONE} is infinite"), (unknown, f"{IN_HAND} is not known")):
        assert choices_of([found]) == (("rate", "1000 Hz"),)
        assert why in found.points[0].unbounded
        assert f"No setting below 1000 Hz is recommended, since {why}." in found.sentences[0]
        assert f"500 Hz would save 50 % share of a core, but its {why}." in found.sentences[0]


def test_nothing_rendered_has_no_rate():
    assert "linear joint" in Rate().missing(linear())
    assert "no fit of the material" in Rate().missing(replace(case(), cut_fit=None))
    assert "no fit of friction" in Rate().missing(replace(case(), friction_fit=None))
