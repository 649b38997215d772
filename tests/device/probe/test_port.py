"""The probe on a pseudo-terminal, in real time, against the independent device.

In virtual time: test_recovery.py and test_refusals.py.
"""

import pytest

from scissorcal.device.link import open_link
from scissorcal.device.probe.probe import ProbeRefusedError, probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.recipe import builtin_recipe
from tests.strange_device import FAULTS, Person, StrangeDevice, serve_on_pty

pytestmark = pytest.mark.realtime

RECIPE = builtin_recipe("paper-80gsm")
BRAKED_S = 0.015
"""How long a stalled computer leaves a torque on: BRAKE_AFTER_MS and some ticks."""


def most_rate(device: StrangeDevice) -> float:
    """The rate that the bounds of the probe allow, with one stall of this computer beyond them."""
    limits = RECIPE.rig.probe
    return (
        limits.largest_rate_rad_per_s + limits.largest_torque_Nm / device.blades.inertia * BRAKED_S
    )


def test_a_rig_on_a_port_is_probed_in_real_time() -> None:
    device = StrangeDevice(FAULTS["none"], seed=1)
    with serve_on_pty(device) as port, open_link(port) as link:
        result = probe(RigSession(link, RECIPE, Operator(Person(device))))
    assert result.facts["real_time"] == 1.0
    assert result.force_zero_N is not None
    assert abs(result.force_zero_N.mean) < 0.01
    assert device.largest_torque <= RECIPE.rig.probe.largest_torque_Nm * (1.0 + 1e-6)
    assert device.largest_rate < most_rate(device)


def test_a_reversed_motor_on_a_port_is_named() -> None:
    device = StrangeDevice(FAULTS["motor reversed"], seed=1)
    refusal = pytest.raises(ProbeRefusedError, match="Positive torque closes the blades")
    with serve_on_pty(device) as port, open_link(port) as link, refusal:
        probe(RigSession(link, RECIPE, Operator(Person(device))))
    assert device.largest_rate < most_rate(device)
