"""What a person is told before a probe: every motion that may come, and how far it goes."""

import pytest

from scissorcal.device.probe.hand_pass import CLOSE, OPEN
from scissorcal.device.probe.probe import probe, request_of
from scissorcal.device.session import Operator, RigSession
from scissorcal.kernel import Capability
from scissorcal.recipe import builtin_recipe
from tests.strange_device import Person, StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")
PUSHED = (
    "Take everything out from between the blades, leave them half open, let go of the handles and "
    "keep clear: the motors move the blades by up to 3.5 degrees each push, both ways"
)


@pytest.mark.parametrize(
    ("carriage", "told"), [(False, "."), (True, ", and the carriage by up to 2 mm each push.")]
)
def test_every_motion_is_told(carriage: bool, told: str) -> None:
    identity = VirtualPort(StrangeDevice()).identity
    if not carriage:
        without = identity.capabilities & ~int(Capability.ADVANCE_MOTOR)
        identity = identity._replace(capabilities=without)
    assert request_of(RECIPE, identity) == PUSHED + told


def test_what_is_told_is_asked_before_anything_moves_and_holds() -> None:
    device = StrangeDevice(seed=1)
    person = Person(device)

    def confirm(request: str) -> None:
        person(request)
        assert device.largest_torque == device.largest_force == 0.0

    link = VirtualPort(device)
    carriage = device.carriage.place
    probe(RigSession(link, RECIPE, Operator(confirm)))
    assert person.heard == [CLOSE, OPEN, request_of(RECIPE, link.identity)]
    assert abs(device.carriage.place - carriage) < 4e-3  # pushes, both ways
