"""Rendered pictures and the virtual rig show one plate, by code that neither shares."""

import numpy as np
import pytest

from scissorcal.device import load_specimen, plate_pose
from scissorcal.recipe import builtin_recipe
from scissorcal.vision.sim.sim_camera import sim_plate_scene, touched_plate


@pytest.mark.parametrize("name", ["paper-80gsm", "cotton-cloth", "press-only"])
def test_the_plate_stands_where_the_rig_touches_it(name: str) -> None:
    recipe = builtin_recipe(name)
    assert recipe.specimen is not None
    touched = load_specimen(recipe.specimen).plate
    assert touched is not None
    axes, place = plate_pose(touched, 0.0)
    for seed in (0, 5):
        seen = sim_plate_scene(recipe, seed, touched_plate(recipe.specimen)).rig_plate
        np.testing.assert_allclose(seen.rotation, np.stack(axes, axis=1), atol=1e-12)
        np.testing.assert_allclose(seen.shift_m, place, atol=1e-15)


def test_without_a_stated_place_it_is_drawn() -> None:
    recipe = builtin_recipe("paper-80gsm")
    first, second = (sim_plate_scene(recipe, seed).rig_plate for seed in (0, 1))
    assert np.abs(first.shift_m - second.shift_m).max() > 1e-4
