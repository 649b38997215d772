"""Zeros of the second rig's sensors change neither the material nor friction."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_cut, fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.recipe import Recipe
from scissorcal.recording import Recording
from tests.second_rig import capture_cut, capture_friction, draw_truth, fine, recipe_for

SEED = 9301


def recipe_of(rig: object) -> Recipe:
    """One sheet and one law of each kind, so that a draft takes seconds."""
    recipe = recipe_for(rig, sheets=1)
    cut = recipe.fit.cut.model_copy(update={"critic": False, "load_share": "none"})
    friction = recipe.fit.friction.model_copy(
        update={"critic": False, "law": "stribeck+angle", "symmetry": "asymmetric"}
    )
    fit = recipe.fit.model_copy(update={"cut": cut, "friction": friction})
    return recipe.model_copy(update={"fit": fit})


def recorded(torque_Nm: float, force_N: float) -> tuple[Recipe, Recording, Recording]:
    rng = np.random.default_rng(SEED)
    day = draw_truth(fine(), rng)
    zeros = replace(day.sensors, torque_zero_Nm=torque_Nm, force_zero_N=force_N)
    rig = replace(day, sensors=zeros)
    recipe = recipe_of(rig)
    return recipe, capture_friction(rig, recipe, rng)[0], capture_cut(rig, recipe, rng)[0]


def fitted(recipe: Recipe, empty: Recording, cut: Recording) -> FitResult:
    rng = np.random.default_rng(0)
    friction = fit_friction((empty,), recipe.fit.friction, effort="draft", rng=rng)
    return fit_cut((cut,), recipe, friction, effort="draft", rng=rng)


@pytest.mark.slow
def test_zeros_do_not_change_the_material() -> None:
    plain = fitted(*recorded(0.0, 0.0))
    recipe, empty, cut = recorded(5e-3, 0.2)
    shifted = fitted(recipe, empty, cut)
    moved = np.flatnonzero(cut.samples["stroke"] >= 0)
    bare = replace(cut, samples=cut.samples[moved[0] - 200 : moved[-1] + 200])
    for fit in (shifted, fitted(recipe, empty, bare)):
        verdict = next(one for one in fit.verdicts if one.check == "torque zero")
        assert verdict.status == "pass"
        assert "subtracted" in verdict.why
        assert verdict.value is not None
        # The bare recording rests for 0.4 s: its zero is another one, by no more than it states.
        share = 0.0 if fit is shifted else verdict.value
        for name in ("fracture_energy", "response_force"):
            one, other = plain.parameter(name), fit.parameter(name)
            allowed = 0.1 * one.sd + share * abs(one.mean)
            assert other.mean == pytest.approx(one.mean, abs=allowed)
