"""Sweeps in which the blades stuck are found from the encoder, and their slips left out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.calibration.signals.soundness import STUCK, Steadiness, steadiness
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.recording import SAMPLE_DTYPE, Joint, Recording, Stroke

TRAVEL = 0.5
COUNTS = (4096, 20_000, 131_072, 1_000_000, 4_000_000)


def swept(
    speeds: dict[float, float],
    *,
    counts: int = 131_072,
    jitter: float = 0.0,
    tick_s: float = 1e-3,
    period_s: float = 0.1,
    seed: int = 0,
) -> Recording:
    """Closing and opening at speeds; the blades rest for a share of each ``period_s``."""
    rng = np.random.default_rng(seed)
    step = 2.0 * np.pi / counts
    parts, labels, strokes = [], [], []
    for speed, rest in speeds.items():
        for sense, kind in ((-1.0, "closing"), (1.0, "opening")):
            time = np.arange(0.0, TRAVEL / speed, tick_s)
            phase = np.remainder(time / period_s, 1.0)
            rate = np.where(phase < rest, 0.0, speed / (1.0 - rest) if rest < 1.0 else 0.0)
            way = np.cumsum(rate) * tick_s
            parts.append((0.8 if sense < 0 else 0.8 - TRAVEL) + sense * way)
            labels.append(np.full(len(time), len(strokes)))
            strokes.append(Stroke(len(strokes), kind, speed, -1))
    opening = np.concatenate(parts)
    samples = np.zeros(len(opening), SAMPLE_DTYPE)
    samples["sequence"] = np.arange(len(opening))
    samples["device_time_us"] = np.round(1e6 * tick_s * np.arange(len(opening)))
    shown = opening + jitter * step * rng.standard_normal(len(opening))
    samples["opening"] = step * np.round(shown / step)
    samples["motor_torque"] = 0.01
    samples["stroke"] = np.concatenate(labels)
    return Recording("friction", samples, tuple(strokes), source="made", device={"name": "rig"})


@settings(max_examples=20)
@given(
    counts=st.sampled_from(COUNTS),
    tick_us=st.sampled_from([250, 1000, 4000]),
    jitter=st.floats(0.0, 1.0),
    factor=st.floats(1.0, 30.0),
    seed=st.integers(0, 9),
)
def test_steady_motion_is_never_called_stuck(
    counts: int, tick_us: int, jitter: float, factor: float, seed: int
) -> None:
    """From the speeds on at which two readings 30 ms apart differ by a step, and not below."""
    speed = min(max(0.02, 2.0 * np.pi / counts / 0.03) * factor, 2.0)
    made = swept({speed: 0.0}, counts=counts, jitter=jitter, tick_s=1e-6 * tick_us, seed=seed)
    found = steadiness((made,))
    assert found.stuck == ()
    assert all(row.at_rest < STUCK for row in found.rows)


@settings(max_examples=15)
@given(
    counts=st.sampled_from(COUNTS[2:]),
    rest=st.floats(0.15, 0.9),
    speed=st.floats(0.05, 0.3),
    jitter=st.floats(0.0, 1.0),
)
def test_the_share_of_rest_is_found(counts: int, rest: float, speed: float, jitter: float) -> None:
    made = swept({speed: rest, 1.0: 0.0}, counts=counts, jitter=jitter, period_s=0.2)
    found = steadiness((made,))
    # Rests are seen but for the time over which motion is judged, at most 8 steps' way at 3 sd.
    blind = 8.0 * max(1.0, 4.3 * np.hypot(jitter, 0.3)) * 2.0 * np.pi / counts / speed / 0.2
    assert found.rows[0].at_rest <= rest + 0.05
    assert found.rows[0].at_rest >= rest - max(blind, 0.005 / 0.2) - 0.05
    assert found.rows[1].at_rest < STUCK


def test_a_speed_that_stuck_is_told_with_the_speed_from_which_motion_was_steady() -> None:
    found = steadiness((swept({0.05: 0.5, 0.12: 0.0, 0.5: 0.0}, period_s=0.3),))
    assert found.stuck == (0, 1)
    assert found.steady_from == 0.12
    verdict = found.verdict()
    assert verdict.status == "not_evaluated"
    assert "at rest: friction at 0.05 rad/s is not measured; steady from 0.12" in verdict.why
    fine = steadiness((swept({0.05: 0.0}),)).verdict()
    assert (fine.status, fine.why) == ("pass", "The joint slid in every sweep, from 0.05 rad/s on.")
    every = steadiness((swept({0.05: 0.5}, period_s=0.3),)).verdict()
    assert every.status == "fail"
    assert "no faster sweep was steady" in every.why


def test_slips_of_a_stuck_stroke_are_left_out_and_nothing_else() -> None:
    made = swept({0.05: 0.5, 0.12: 0.0}, period_s=0.3, counts=1_000_000)
    every = weigh((made,), 75.0)
    found = steadiness((made,))
    kept = found.kept(every)
    stuck = np.isin(every.bins.stroke, found.stuck)
    slow = np.abs(every.bins.rate) < 0.12
    np.testing.assert_array_equal(kept.bins.moving, every.bins.moving & ~(stuck & slow))
    assert np.count_nonzero(every.bins.moving & stuck & slow) > 100
    none = Steadiness((), (), Joint())
    assert none.kept(every) is every


def test_imported_motion_is_not_judged() -> None:
    made = replace(swept({0.05: 0.5}, period_s=0.3), device={})
    assert steadiness((made,)).rows == ()


def test_strokes_are_numbered_across_recordings() -> None:
    steady, stuck = swept({0.3: 0.0, 0.6: 0.0}), swept({0.05: 0.6, 0.6: 0.0}, period_s=0.3)
    found = steadiness((steady, stuck))
    assert found.stuck == (4, 5)
    assert [row.speed for row in found.rows] == pytest.approx([0.05, 0.3, 0.6])
    assert found.steady_from == 0.3
