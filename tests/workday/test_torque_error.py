"""The torque error of a demo: where the limit is rendered instead of the model, nothing counts."""

from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.device import Specimen, average_torque, load_specimen
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe
from scissorcal.workday.demo.day import torque_error


class _Exact:
    """Stands for a package that knows the truth up to a factor, and nothing beyond a limit."""

    def __init__(self, specimen: Specimen, factor: float, ceiling: float) -> None:
        self._specimen, self._factor, self._ceiling = specimen, factor, ceiling

    def kernel(self) -> "_Exact":
        return self

    def step_many(
        self,
        opening: NDArray[np.float64],
        rate: NDArray[np.float64],
        advance: NDArray[np.float64],
    ) -> dict[str, NDArray[np.float64]]:
        places = np.linspace(opening[0], opening[-1], 500)
        torque = average_torque(self._specimen, places, rate[0], -advance[0])
        kept = np.minimum(self._factor * torque, self._ceiling)
        return {"torque": np.interp(-opening, -places, kept)}


def test_a_press_is_judged_where_it_can_be_rendered() -> None:
    """Over a scene that presses beyond the torque limit at its nearest contacts."""
    recipe, specimen = builtin_recipe("press-only"), load_specimen("soft-pad")
    wide = {"opening_deg": (12.0, 50.0), "contact_mm": (15.0, 60.0)}
    recipe = recipe.model_copy(update={"scene": recipe.scene.model_copy(update=wide)})
    exact = torque_error(cast(Any, _Exact(specimen, 1.0, 1.5)), specimen, recipe)
    assert exact < 0.01
    off = torque_error(cast(Any, _Exact(specimen, 1.1, 1.5)), specimen, recipe)
    assert off == pytest.approx(0.1, abs=0.01)


def test_a_scene_beyond_its_limit_has_nothing_to_compare() -> None:
    recipe, specimen = builtin_recipe("press-only"), load_specimen("soft-pad")
    limits = recipe.limits.model_copy(update={"torque_Nm": 1e-6})
    beyond = recipe.model_copy(update={"limits": limits})
    with pytest.raises(InputError, match=r"limits\.torque_Nm"):
        torque_error(cast(Any, _Exact(specimen, 1.0, 1.5)), specimen, beyond)
