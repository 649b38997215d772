"""Made recordings of empty motion: what is prescribed is one motion, and its torque is the law."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.extremes.made_friction import (
    HIGH,
    LOW,
    RAMP,
    TICK_S,
    MadeFriction,
    record,
    sweeps,
)

SPEEDS = (0.1, 1.5)


@pytest.mark.parametrize("speed", SPEEDS)
def test_a_sweep_goes_from_end_to_end_at_its_speed(speed: float) -> None:
    motion = sweeps((speed,), 1)
    assert [stroke.kind for stroke in motion.strokes] == ["closing", "opening"]
    for index, (begin, end) in enumerate(((HIGH, LOW), (LOW, HIGH))):
        of_sweep = motion.stroke == index
        opening, rate = motion.opening[of_sweep], motion.rate[of_sweep]
        # its first and last samples are half a tick from the ends, where it moves slowly
        assert opening[[0, -1]] == pytest.approx([begin, end], abs=1e-6)
        assert np.all(rate * (end - begin) >= 0.0)
        assert np.abs(rate).max() == pytest.approx(speed)


@pytest.mark.parametrize("speed", SPEEDS)
def test_rate_and_acceleration_are_derivatives_of_the_opening(speed: float) -> None:
    """By central differences over two ticks of h, on which the jerk is j at most.

    The opening's are off by h^2 j / 6 at most, the rate's by h j / 4 where the jerk jumps, at the
    ends of a ramp, and by less within it.
    """
    motion = sweeps((speed,), 1)
    jerk = speed * (np.pi / (RAMP * (HIGH - LOW) / speed)) ** 2 / 2.0
    for index in (0, 1):
        of_sweep = motion.stroke == index
        opening, rate, acceleration = (
            values[of_sweep] for values in (motion.opening, motion.rate, motion.acceleration)
        )
        slope = (opening[2:] - opening[:-2]) / (2.0 * TICK_S)
        assert np.abs(slope - rate[1:-1]).max() <= TICK_S**2 / 6.0 * jerk + 1e-12
        change = (rate[2:] - rate[:-2]) / (2.0 * TICK_S)
        assert np.abs(change - acceleration[1:-1]).max() <= TICK_S / 3.0 * jerk


def test_the_torque_is_the_law_of_what_moves() -> None:
    motion, truth = sweeps(SPEEDS, 1), replace(MadeFriction(), noise=0.0)
    made = record(motion, truth, np.random.default_rng(1)).samples
    opens = motion.rate > 0.0
    level = 0.013 * opens - 0.016 * ~opens
    expected = 2e-4 * motion.acceleration + level + 0.002 * motion.rate
    assert made["motor_torque"] == pytest.approx(expected, abs=1e-15)
    assert np.abs(made["opening"] - motion.opening).max() <= truth.step / 2.0 + 1e-12
