"""A torque above the limit for one tick: told on heavy blades, and never by an accident."""

import pytest

from scissorcal.device.probe.probe import ProbeRefusedError, probe
from scissorcal.recipe.library import builtin_recipe
from scissorcal.verdicts import Verdict
from tests.strange_device import Faults, StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")
LATE_S = (0.0, 0.0005, 0.001, 0.0015)
"""Each way: 0 to 3 ms together; what falls between two ticks waits for the next."""


def heavy(late_s: float = 0.0, *, clips: bool = True) -> Faults:
    """Blades that one tick at the limit cannot bring above the bounds."""
    return Faults(inertia=3e-3, clips=clips, delay_to_host_s=late_s, delay_to_device_s=late_s)


def clipping_of(link: VirtualPort) -> Verdict:
    found = probe(link, RECIPE, confirm=lambda request: None)
    return next(verdict for verdict in found.verdicts if verdict.check == "clipping")


@pytest.mark.parametrize("late_s", LATE_S)
def test_a_heavy_device_that_clips_passes(late_s: float) -> None:
    device = StrangeDevice(heavy(late_s), seed=1)
    assert clipping_of(VirtualPort(device)).status == "pass"
    assert device.largest_rate < RECIPE.rig.probe.largest_rate_rad_per_s


@pytest.mark.parametrize("late_s", LATE_S)
def test_a_heavy_device_that_does_not_clip_is_refused(late_s: float) -> None:
    device = StrangeDevice(heavy(late_s, clips=False), seed=1)
    with pytest.raises(ProbeRefusedError, match="must clip what exceeds its limit"):
        clipping_of(VirtualPort(device))
    assert device.largest_rate < RECIPE.rig.probe.largest_rate_rad_per_s
