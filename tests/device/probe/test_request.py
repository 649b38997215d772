"""What a person is told before a probe: every motion that may come, and how far it goes."""

import pytest

from scissorcal.device.probe.probe import probe, request_of
from scissorcal.kernel import Capability
from scissorcal.recipe.library import builtin_recipe
from scissorcal.recipe.schema import Recipe
from tests.strange_device import StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")
CLEAR = "Take everything out from between the blades, let go of the handles and keep clear: "
PUSHED = CLEAR + "the motors move the blades by up to 2 degrees each push, both ways"


def creeping(creep: bool) -> Recipe:
    probing = RECIPE.rig.probe.model_copy(update={"creep": creep})
    rig = RECIPE.rig.model_copy(update={"probe": probing})
    return RECIPE.model_copy(update={"rig": rig})


@pytest.mark.parametrize(
    ("sledge", "creep", "told"),
    [
        (False, False, "."),
        (True, False, ", and the sledge by up to 2 mm each push."),
        (False, True, "; then the blades slowly to both stops (60 degrees)."),
        (
            True,
            True,
            ", and the sledge by up to 2 mm each push; then the blades slowly to both stops "
            "(60 degrees).",
        ),
    ],
)
def test_every_motion_is_told(sledge: bool, creep: bool, told: str) -> None:
    identity = VirtualPort(StrangeDevice()).identity
    if not sledge:
        without = identity.capabilities & ~int(Capability.ADVANCE_MOTOR)
        identity = identity._replace(capabilities=without)
    assert request_of(creeping(creep), identity) == PUSHED + told


def test_what_is_told_is_asked_before_anything_moves_and_holds() -> None:
    device = StrangeDevice(seed=1)
    told: list[str] = []

    def confirm(request: str) -> None:
        told.append(request)
        assert device.largest_torque == device.largest_force == 0.0

    link = VirtualPort(device)
    sledge = device.sledge.place
    probe(link, RECIPE, confirm=confirm)
    assert told == [request_of(RECIPE, link.identity)]
    assert abs(device.sledge.place - sledge) < 4e-3  # two pushes, one each way
