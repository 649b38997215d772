"""Clocks against the host's: drift and offset under jitter, jumps, restarts, clocks that stand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.stats import binom

from scissorcal.aliases import Array
from scissorcal.errors import DeviceError
from scissorcal.tracking.clocks import USUAL_DRIFT, ClockWatch, fit_clock

REMEDY = "Restart the camera."
CAMERA_HZ = 33.0
LEAST_DELAY_S = 0.06


def late(rng: np.random.Generator, count: int) -> Array:
    """Delays of pictures: 60 to 100 ms, and some of half a second."""
    return LEAST_DELAY_S + 0.04 * rng.random(count) + 0.5 * (rng.random(count) < 0.02)


def pairs(rng: np.random.Generator, drift_ppm: float, count: int = 1000) -> tuple[Array, Array]:
    """Own times of a jittering camera, and the host's times of arrival."""
    own = np.cumsum(rng.uniform(0.8, 1.2, count)) / CAMERA_HZ
    return own, 5.0 + own / (1.0 + 1e-6 * drift_ppm) + late(rng, count)


def watched(own: Array, host: Array, block: int = 1) -> ClockWatch:
    watch = ClockWatch("The camera's clock", REMEDY)
    for start in range(0, len(own), block):
        watch.add(own[start : start + block], host[start : start + block])
    return watch


@pytest.mark.parametrize("drift_ppm", [-300.0, 0.0, 50.0, 500.0])
def test_drift_and_offset_are_as_sure_as_they_say(drift_ppm: float) -> None:
    """Of 200 clocks, as many errors within two standard deviations as 95 % allow (1 false alarm in
    1000), and no fewer than a normal has within one.

    The standard deviation of the time counts the mean of what the earliest arrivals were late by.
    """
    rng = np.random.default_rng(round(1000 + drift_ppm))
    drifts, ends = [], []
    for _ in range(200):
        own, host = pairs(rng, drift_ppm)
        fit = fit_clock(own, host)
        drifts.append((fit.drift_ppm - drift_ppm) / fit.drift_sd_ppm)
        at = float(own[-1])
        true = 5.0 + at / (1.0 + 1e-6 * drift_ppm) + LEAST_DELAY_S
        ends.append((fit.host(at) - true) / fit.sd_s(at))
    least = binom.ppf(0.001, 200, 0.95) / 200
    for scores in (drifts, ends):
        assert np.mean(np.abs(scores) < 2.0) >= least
    assert np.mean(np.abs(drifts) < 1.0) < 0.9
    assert abs(np.mean(drifts)) < 0.3


@given(
    st.lists(st.tuples(st.floats(0, 100), st.floats(-1e6, 1e6)), min_size=3, max_size=30),
)
def test_the_line_is_that_of_the_linear_program(points: list[tuple[float, float]]) -> None:
    from scissorcal.tracking.clocks import _under

    x = np.sort(np.array([a for a, _ in points]))
    y = np.array([b for _, b in points])
    x = x - x.mean()
    if x[-1] - x[0] < 1e-3 or min(-x[0], x[-1]) < 1e-6:
        return
    level, slope = _under(x, y)
    above = y - level - slope * x
    scale = 1.0 + np.abs(y).max()
    assert above.min() > -1e-9 * scale * (1.0 + np.abs(x).max() / np.diff(x).max())
    best = linprog([-1.0, 0.0], np.column_stack([np.ones_like(x), x]), y, bounds=[(None, None)] * 2)
    assert best.status == 0
    assert level == pytest.approx(-best.fun, rel=1e-6, abs=1e-6 * scale)


def test_a_rig_at_1_khz_is_known_to_microseconds() -> None:
    """30 ppm, delays of a tenth of a millisecond, one frame in a hundred 10 ms late."""
    rng = np.random.default_rng(3)
    own = 1e-3 * np.arange(20_000)
    host = own / (1.0 + 30e-6) + rng.exponential(1e-4, own.size)
    host += 0.01 * (rng.random(own.size) < 0.01)
    watch = watched(own, host, block=50)
    assert watch.fit.drift_ppm == pytest.approx(30.0, abs=1.0)
    assert watch.fit.host(20.0) == pytest.approx(20.0 / (1.0 + 30e-6), abs=2e-5)
    assert not watch.jumps
    assert "ppm faster than this computer's" in watch.sentence


def test_both_ways_between_the_clocks_agree() -> None:
    own, host = pairs(np.random.default_rng(0), 80.0)
    fit = fit_clock(own, host)
    assert fit.own(fit.host(12.3)) == pytest.approx(12.3, abs=1e-9)
    assert fit.sd_s(60.0) > fit.sd_s(15.0)


def test_few_pairs_give_an_offset_and_no_drift() -> None:
    fit = fit_clock([1.0, 1.03, 1.06], [7.08, 7.09, 7.14])
    assert fit.drift == 0.0
    assert fit.drift_sd == USUAL_DRIFT
    assert fit.host(1.0) == pytest.approx(7.06, abs=1e-9)
    with pytest.raises(ValueError, match="at least one pair"):
        fit_clock([], [])


@pytest.mark.parametrize("seed", range(5))
def test_jitter_alone_is_no_jump(seed: int) -> None:
    assert not watched(*pairs(np.random.default_rng(seed), 500.0, 3000)).jumps


@pytest.mark.parametrize("by_s", [0.03, -0.03, 3.0, -3.0])
def test_a_jump_is_found_once_and_the_line_begins_anew(by_s: float) -> None:
    own, host = pairs(np.random.default_rng(7), 100.0, 2000)
    own[1000:] += by_s
    watch = watched(own, host)
    (jump,) = watch.jumps
    assert jump.by_s == pytest.approx(by_s, abs=0.02 + 0.02 * abs(by_s))
    assert host[1000] - 0.6 < jump.host_s < host[1000] + 1.5
    assert watch.fit.drift_ppm == pytest.approx(100.0, abs=60.0)
    at = float(own[-1])
    assert watch.fit.host(at) == pytest.approx(5.06 + (at - by_s) / 1.0001, abs=2e-3)
    way = "ahead" if by_s > 0 else "back"
    assert "The camera's clock runs" in watch.sentence
    assert f"It jumped {way} by" in watch.sentence
    assert REMEDY in watch.sentence


def test_pictures_that_overtake_each_other_are_no_jump() -> None:
    """Delays of 60 to 100 ms at 33 Hz: every third picture comes before an earlier one."""
    own, host = pairs(np.random.default_rng(12), 80.0, 2000)
    host = own / (1.0 + 80e-6) + LEAST_DELAY_S + 0.1 * np.random.default_rng(1).random(own.size)
    order = np.argsort(host)
    watch = watched(own[order], host[order])
    assert not watch.jumps
    assert watch.fit.drift_ppm == pytest.approx(80.0, abs=4.0 * watch.fit.drift_sd_ppm)


def test_what_waited_when_the_line_was_opened_is_no_jump() -> None:
    """A second of frames comes 40 ms late, the rest at once."""
    own = 1e-3 * np.arange(8_000)
    host = own + np.random.default_rng(2).exponential(1e-4, own.size)
    host[:1000] += 0.04
    watch = watched(own, host, block=50)
    assert not watch.jumps
    assert watch.fit.host(8.0) == pytest.approx(8.0, abs=1e-4)


def test_a_restarted_device_begins_anew() -> None:
    own, host = pairs(np.random.default_rng(8), 40.0, 900)
    own[600:] -= own[600] - 0.2
    watch = watched(own, host)
    (jump,) = watch.jumps
    assert jump.by_s < -10.0
    soonest = np.min(host[600:] - own[600:])
    assert watch.fit.host(float(own[-1])) == pytest.approx(own[-1] + soonest, abs=2e-3)


def test_a_clock_that_stands_is_refused() -> None:
    own, host = pairs(np.random.default_rng(9), 0.0, 300)
    own[200:] = own[200]
    with pytest.raises(DeviceError, match=r"camera's clock stands: .* for 1\.\d s\. Restart"):
        watched(own, host)


@pytest.mark.parametrize("ratio", [1.002, 0.995])
def test_a_drift_beyond_the_limit_is_refused_with_its_figure(ratio: float) -> None:
    own, host = pairs(np.random.default_rng(10), 0.0)
    ppm = round(1e6 * (ratio - 1.0), -3)
    with pytest.raises(DeviceError, match=r"ppm against this computer's over") as refused:
        watched(ratio * own, host)
    found = float(str(refused.value).split("runs ")[1].split(" ")[0])
    assert found == pytest.approx(ppm, abs=400.0)


@pytest.mark.parametrize("ratio", [2.0, 1000.0, 0.1])
def test_a_clock_in_another_unit_is_refused(ratio: float) -> None:
    own, host = pairs(np.random.default_rng(11), 0.0)
    with pytest.raises(DeviceError, match=r"ppm against|another unit"):
        watched(ratio * own, host)


def test_a_clock_that_has_sent_nothing_is_not_known() -> None:
    watch = ClockWatch("The rig's clock", REMEDY)
    assert not watch.known
    assert watch.sentence == "The rig's clock has sent no time."
    with pytest.raises(DeviceError, match="has sent no time yet"):
        _ = watch.fit
