"""A device that refuses BRAKE_AFTER_MS is judged by what it does without commands."""

from unittest.mock import patch

import pytest

from scissorcal.device.probe.probe import ProbeRefusedError, probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.recipe import Recipe, builtin_recipe
from scissorcal.recording import ProbeResult
from tests.strange_device import FAULTS, Faults, Person, StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")


def asking(brake_after_ms: float) -> Recipe:
    line = RECIPE.rig.line.model_copy(update={"brake_after_ms": brake_after_ms})
    return RECIPE.model_copy(update={"rig": RECIPE.rig.model_copy(update={"line": line})})


def probed(faults: Faults, recipe: Recipe = RECIPE) -> ProbeResult:
    """A probe that ends before it pushes."""
    device = StrangeDevice(faults, 1)
    with (
        patch("scissorcal.device.probe.probe._push"),
        patch("scissorcal.device.probe.probe._push_carriage"),
    ):
        return probe(RigSession(VirtualPort(device), recipe, Operator(Person(device))))


def status(result: ProbeResult) -> dict[str, str]:
    return {verdict.check: verdict.status for verdict in result.verdicts}


def test_a_deaf_watchdog_is_refused_although_the_device_refuses_the_value() -> None:
    with pytest.raises(ProbeRefusedError, match="its watchdog is deaf") as caught:
        probed(FAULTS["watchdog deaf, BRAKE_AFTER_MS refused"])
    found = status(caught.value.result)
    assert (found["watchdog"], found["watchdog value"]) == ("fail", "not_evaluated")


@pytest.mark.parametrize("own_ms", [200.0, 1000.0])
def test_a_longer_value_of_its_own_is_late_but_not_deaf(own_ms: float) -> None:
    own = Faults(refuses_brake_after=True, brake_after_ms=own_ms)
    with pytest.raises(ProbeRefusedError, match=f"brakes after {own_ms:.4g} ms") as caught:
        probed(own)
    assert "deaf" not in str(caught.value)
    assert "rig.line.brake_after_ms" in str(caught.value)


def test_a_value_that_the_device_takes_is_no_warning() -> None:
    found = status(probed(FAULTS["none"]))
    assert found["watchdog"] == "pass"
    assert "watchdog value" not in found


def test_the_recipe_may_ask_for_the_value_that_the_device_has() -> None:
    own = Faults(refuses_brake_after=True, brake_after_ms=100.0)
    assert status(probed(own, asking(100.0)))["watchdog"] == "pass"


def test_the_default_is_enough_where_the_recipe_asks_for_less() -> None:
    assert status(probed(Faults(refuses_brake_after=True), asking(2.0)))["watchdog"] == "pass"
