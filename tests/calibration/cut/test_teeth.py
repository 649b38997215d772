"""The line of the teeth: found where it is, not where it is not, never at a harmonic."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.cut.teeth import Line, PhaseSignal, find_line

SPEEDS = ((0.1, 40.0), (0.25, 16.0), (0.6, 6.7))
"""Stroke speeds (rad/s) and samples a tooth."""
CYCLES = 90


def sawtooth(place, kappa=0.7):
    """A tooth that loads evenly and lets go."""
    return (1.0 - kappa) * (place % 1.0 - 0.5)


def stretch(rng, index, speed, ticks, *, ratio=1.0, jitter=0.05, height=1.0, noise=0.3):
    """One stretch: the true period is ``ratio`` times the expected, teeth differ by ``jitter``."""
    count = int(CYCLES * ticks)
    phase = np.arange(count) / ticks
    lengths = ratio * (1.0 + jitter * rng.standard_normal(3 * CYCLES))
    ends = np.concatenate([[0.0], np.cumsum(lengths)]) + rng.uniform()
    teeth = np.interp(phase, ends, np.arange(len(ends)))
    torque = height * sawtooth(teeth) + noise * np.diff(rng.standard_normal(count + 1))
    return signal(index, speed, phase, torque)


def signal(index, speed, phase, torque):
    """With 20 segments of as many samples."""
    ends = np.linspace(0, len(phase) - 1, 21).astype(int)
    return PhaseSignal(index, speed, phase, torque, ends)


def day(seed, strokes=6, **changes):
    rng = np.random.default_rng(seed)
    pairs = [SPEEDS[k % 3] for k in range(strokes)]
    return [stretch(rng, k, *pair, **changes) for k, pair in enumerate(pairs)]


def found(signals, near=False) -> Line | None:
    zeros, ones = ([np.full(20, value) for _ in signals] for value in (0.0, 1.0))
    return find_line(signals, zeros, ones, near)


@pytest.mark.parametrize("ratio", [0.6, 0.83, 1.0, 1.3, 2.1])
def test_the_ratio_of_periods_is_recovered(ratio):
    line = found(day(int(100 * ratio), ratio=ratio))
    assert line is not None
    assert line.ratio == pytest.approx(ratio, abs=max(0.004 * ratio, 4 * line.sd * ratio))
    assert line.sd < 0.012
    assert line.log_period == pytest.approx(np.log(ratio), abs=4 * line.sd)
    assert line.at_two_speeds
    assert max(line.half, line.third) < 0.3


def test_the_mean_ratio_over_many_days_is_right_within_three_tenths_of_a_percent():
    """Days of six strokes, 5 % of jitter: the mean of 12 has an error of 0.1 %."""
    lines = [found(day(seed, ratio=1.15), near=False) for seed in range(12)]
    ratios = np.array([line.ratio for line in lines if line is not None])
    assert len(ratios) == 12
    assert ratios.mean() / 1.15 == pytest.approx(1.0, abs=0.003)
    z = (ratios / 1.15 - 1.0) / np.array([line.sd for line in lines])
    assert np.sqrt(np.mean(z**2)) < 1.8


def test_a_near_period_needs_no_search():
    signals = day(40, ratio=1.02)
    near, searched = found(signals, near=True), found(signals)
    assert near.ratio == pytest.approx(searched.ratio, rel=3e-3)


@pytest.mark.parametrize("noise", [0.3, 0.5])
def test_noise_that_grows_with_the_frequency_does_not_bias_the_line(noise):
    """Differences of white noise, with more than the teeth's height as standard deviation."""
    lines = [found(day(seed, ratio=0.9, noise=noise)) for seed in range(60, 66)]
    ratios = [line.ratio for line in lines if line is not None]
    assert len(ratios) == 6
    assert np.mean(ratios) == pytest.approx(0.9, rel=4e-3)


@pytest.mark.parametrize("jitter", [0.0, 0.01, 0.03])
def test_sharp_teeth_are_not_taken_at_a_harmonic(jitter):
    """A regular sawtooth has half its fundamental's amplitude at twice the frequency."""
    for seed in range(4):
        line = found(day(80 + seed, ratio=1.4, jitter=jitter, noise=0.05))
        assert line is not None
        assert line.ratio == pytest.approx(1.4, rel=0.02)


@pytest.mark.parametrize("days", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_there_is_no_line_in_noise(days):
    """White torque and its differences; teeth are believed at two speeds, and that on no day.

    One speed alone passes by chance in one of 10^7, any of 60 periods in less than one of 10^5.
    """
    half = days // 2
    seen = [found(day(seed, strokes=3, height=0.0, noise=1.0)) for seed in range(half)]
    rng = np.random.default_rng(7)
    for _ in range(half):
        signals = day(0, strokes=3, height=0.0)
        white = [
            signal(s.stretch, s.stroke_speed, s.phase, rng.standard_normal(len(s.phase)))
            for s in signals
        ]
        seen.append(found(white))
    assert sum(line is not None and line.at_two_speeds for line in seen) == 0
    assert sum(line is not None for line in seen) <= 2


def test_encoder_counts_that_alias_move_with_the_speed():
    """A line whose period in time is fixed lies at another period in the crack's phase."""
    rng = np.random.default_rng(9)
    signals = []
    for k in range(9):
        speed, ticks = SPEEDS[k % 3]
        count = int(CYCLES * ticks)
        time = np.arange(count)
        torque = np.sin(2 * np.pi * time / 9.0 + rng.uniform(0, 6.28))
        torque += 0.2 * rng.standard_normal(count)
        signals.append(signal(k, speed, time / ticks, torque))
    line = found(signals)
    assert line is None or not line.at_two_speeds


def test_two_speeds_must_differ_and_agree():
    line = found(day(3, strokes=6))
    assert line is not None

    def at(*speeds):
        return replace(line, speeds=speeds).at_two_speeds

    assert at((0.1, 1.0, 50.0), (0.25, 1.01, 50.0))
    assert not at((0.1, 1.0, 50.0), (0.12, 1.0, 50.0))
    assert not at((0.1, 1.0, 50.0), (0.25, 1.2, 50.0))
    assert not at((0.1, 1.0, 50.0), (0.25, 1.0, 5.0))


def test_strokes_too_fast_for_their_teeth_are_ignored():
    rng = np.random.default_rng(11)
    fast = [stretch(rng, k, 1.5, 1.6, ratio=1.0, noise=0.01) for k in range(4)]
    line = found(fast)
    assert line is None or not line.at_two_speeds


def test_without_strokes_there_is_no_line():
    assert found([]) is None
