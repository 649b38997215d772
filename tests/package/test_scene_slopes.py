"""Slopes of the torque over a scene: what cannot be felt anywhere is refused."""

import pytest

from scissorcal.calibration import expected_cut, expected_friction
from scissorcal.errors import InputError
from scissorcal.package.scene_slopes import torque_knowledge
from scissorcal.recipe import builtin_recipe


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("paper-80gsm", {"contact_mm": (900.0, 1000.0)}),
        (
            "press-only",
            {"contact_mm": (55.0, 70.0), "opening_deg": (45.0, 50.0), "render_friction": False},
        ),
    ],
)
def test_a_scene_where_nothing_is_felt_is_refused(name: str, changed: dict[str, object]) -> None:
    """Its bands would be NaN: shares of no torque."""
    recipe = builtin_recipe(name)
    recipe = recipe.model_copy(update={"scene": recipe.scene.model_copy(update=changed)})
    friction = expected_friction(recipe)
    with pytest.raises(InputError, match="Nowhere in the scene"):
        torque_knowledge(recipe, friction, expected_cut(recipe, friction))
