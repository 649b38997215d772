"""Idle seconds show the zero of the drive; anything else does not."""

import numpy as np
import pytest

from scissorcal.calibration.signals.zeros import idle_noise, idle_periods, idle_zero
from scissorcal.recording import SAMPLE_DTYPE, Recording

ZERO, NOISE = 4e-4, 1e-3


def recording(
    idle_s: float = 1.5,
    command: float = 0.02,
    creep: float = 0.0,
    settling: float = 0.0,
    step: float = 5e-5,
) -> Recording:
    """Two seconds of motion, then motors off at 0.01 rad, to which they settle within 0.1 s."""
    rng = np.random.default_rng(5)
    moving, still = 2000, round(1000 * idle_s)
    samples = np.zeros(moving + still, SAMPLE_DTYPE)
    samples["device_time_us"] = 1000 * np.arange(len(samples))
    samples["opening"][:moving] = 0.5 + 0.3 * np.sin(np.arange(moving) / 200)
    samples["opening"][moving:] = 0.01 + creep * np.arange(still)
    samples["opening"][moving:] += settling * np.exp(-np.arange(still) / 20.0)
    samples["opening"] = np.round(samples["opening"] / step) * step
    samples["torque_command"][:moving] = command
    samples["motor_torque"] = ZERO + NOISE * rng.standard_normal(len(samples))
    samples["motor_torque"][:moving] += command
    samples["stroke"] = np.where(np.arange(len(samples)) < moving, 0, -1)
    return Recording("cut", samples, source="cut.mcap")


def test_an_idle_second_gives_the_drives_zero():
    drive = idle_zero((recording(),))
    assert abs(drive.mean - ZERO) < 3 * drive.sd
    assert drive.sd == pytest.approx(NOISE / np.sqrt(1500), rel=0.5)
    assert drive.seconds == pytest.approx(1.5)
    assert idle_noise((recording(),)) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize("step", [1e-6, 5e-5, 8e-4], ids=lambda step: f"steps of {step:g} rad")
def test_blades_that_settle_are_at_rest_behind_any_encoder(step):
    """A zero moved by 1 N m while they still move (5 mrad to go) is not in it."""
    moved = recording(settling=5e-3, step=step)
    moved.samples["motor_torque"][2000:2010] += 1.0
    (period,) = idle_periods(moved)
    assert 1.4 < period.seconds < 1.5
    assert abs(period.drive - ZERO) < 3 * period.sd


@pytest.mark.parametrize(
    "changes",
    [{"idle_s": 0.5}, {"creep": 1e-5}, {"command": 0.0}],
    ids=["too short", "the blades creep", "nothing says when motors were off"],
)
def test_without_an_idle_second_there_is_no_zero(changes):
    assert idle_zero((recording(**changes),)) is None
    assert idle_noise((recording(**changes),)) == 0.0
