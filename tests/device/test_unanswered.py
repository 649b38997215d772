"""Blades that a last command may throw are refused by the keys that decide it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.session import MOST_ENERGY_J, refuse_unanswered
from scissorcal.errors import DeviceError
from scissorcal.recipe import Recipe, builtin_recipe
from scissorcal.recording import Estimate
from tests.device.recipes import changed
from tests.device.test_link import IDENTITY

KNOWN = Estimate(2.1e-4, 5e-6)
WIDE = IDENTITY._replace(torque_limit=10.0, opening_min=0.0, opening_max=1.0)


def recipe_of(torque_Nm: float, brake_after_ms: float) -> Recipe:
    line: dict[str, object] = {"brake_after_ms": brake_after_ms}
    return changed("paper-80gsm", limits={"torque_Nm": torque_Nm}, rig__line=line)


@pytest.mark.parametrize("torque_Nm", [0.3, 1.0])
def test_the_defaults_pass_on_a_usual_rig(torque_Nm: float) -> None:
    assert builtin_recipe("paper-80gsm").rig.line.brake_after_ms == 10.0
    assert refuse_unanswered(recipe_of(torque_Nm, 10.0), WIDE, KNOWN) == ""


def test_a_refusal_names_both_keys_the_rate_and_what_would_do() -> None:
    with pytest.raises(DeviceError) as refused:
        refuse_unanswered(recipe_of(1.0, 50.0), WIDE, KNOWN)
    said = str(refused.value)
    assert "would reach 238 rad/s" in said
    assert "At more than 69 rad/s they hold 0.5 J" in said
    assert "limits.torque_Nm to 0.28 or less" in said
    assert "rig.line.brake_after_ms to 14 or less" in said


def test_blades_whose_travel_is_too_short_for_so_much_energy_pass() -> None:
    short = WIDE._replace(opening_max=0.4)
    assert refuse_unanswered(recipe_of(1.0, 1000.0), short, KNOWN) == ""


def test_an_inertia_that_is_not_known_or_not_well_enough_is_said_with_what_to_do() -> None:
    assert "found no inertia" in refuse_unanswered(recipe_of(1.0, 12.0), WIDE, None)
    said = refuse_unanswered(recipe_of(1.0, 14.0), WIDE, Estimate(2.1e-4, 6e-5))
    assert "not known well enough" in said
    assert "device probe" in said
    assert "limits.torque_Nm" in said


@given(
    torque=st.floats(0.01, 10.0),
    brake_ms=st.floats(1.0, 1000.0),
    inertia=st.floats(5e-5, 3e-3),
)
def test_what_passes_holds_no_more_energy(torque: float, brake_ms: float, inertia: float) -> None:
    recipe = recipe_of(torque, brake_ms)
    energy = min((torque * brake_ms * 1e-3) ** 2 / (2.0 * inertia), torque * 1.0)
    try:
        said = refuse_unanswered(recipe, WIDE, Estimate(inertia, 0.0))
    except DeviceError:
        assert energy > MOST_ENERGY_J * (1.0 - 1e-9)
        return
    assert said == ""
    assert energy <= MOST_ENERGY_J * (1.0 + 1e-9)
    assert math.isfinite(energy)
