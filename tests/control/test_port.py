"""A path on a port: the servo in its own process, the rig served by another; host's clock.

In virtual time: test_follow.py.
"""

import time
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.control.follow import Job, control
from scissorcal.control.mechanics import RigMechanics
from scissorcal.control.settings import Material
from scissorcal.device import Operator, RigSession, SimProcess, load_specimen, open_link
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey
from scissorcal.model import Plane
from scissorcal.recipe import builtin_recipe
from scissorcal.tracking import PlatePose, fixed_pose, level_plate
from tests.control.virtual import mechanics, points

pytestmark = pytest.mark.realtime

SPECIMEN = load_specimen("office-paper")
MATERIAL = Material(1e4, 0.2, 1.0)
RECIPE = builtin_recipe("paper-80gsm")


def rig() -> RigMechanics:
    """As far as it is known where no probe measured the delay."""
    return replace(mechanics(SPECIMEN), delay_s=2e-3)


def pose() -> tuple[np.ndarray, np.ndarray]:
    assert SPECIMEN.plate is not None
    return level_plate(SPECIMEN.plate.place_mm, SPECIMEN.plate.pitch_deg)


def test_a_path_is_followed_through_a_port() -> None:
    asked: list[float] = []
    still = fixed_pose(*pose())

    def source(now_s: float, samples: np.ndarray) -> PlatePose | None:
        asked.append(now_s)
        return still(now_s, samples)

    job = Job(points(20.0, 30.0), Plane(), source, MATERIAL, 0.15)
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)  # a busy machine is not what is tested
        before_s = time.monotonic()
        result = control(RigSession(link, RECIPE, Operator(print)), rig(), job)
        link.configure(ConfigKey.STREAM, 1.0)
        assert link.state().flags & 1 == 0, "the motors stayed on"
    figures = result.figures
    assert before_s < asked[-1] < time.monotonic()
    assert figures.touches >= 1
    assert figures.reached_share == 1.0
    assert 0.0 < figures.force_rms_N < 0.5
    assert figures.path_rms_mm < 1.0
    assert result.report.overrun == 0


def test_a_supervisor_that_hangs_leaves_the_rig_without_torque() -> None:
    """For longer than the servo's patience: damping first, then a stop of its own."""
    slept: list[float] = []

    def hang(done: float, sentence: str) -> None:
        if not slept and "following" in sentence and done > 0.1:
            slept.append(done)
            time.sleep(2.0)

    job = Job(points(20.0, 60.0), Plane(), fixed_pose(*pose()), MATERIAL, 0.15)
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        link.configure(ConfigKey.BRAKE_AFTER_MS, 500.0)
        with pytest.raises(DeviceError, match=r"supervisor|damping"):
            control(RigSession(link, RECIPE, Operator(print, progress=hang)), rig(), job)
        link.configure(ConfigKey.STREAM, 1.0)
        assert link.state().flags & 1 == 0, "the motors stayed on"
    assert slept
