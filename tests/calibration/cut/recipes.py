"""Recipes and friction fits that tests of cuts share."""

import tomllib
from pathlib import Path

import numpy as np

from scissorcal.calibration import FitResult, fit_friction
from scissorcal.recipe import Recipe
from tests.calibration.truth import SPEEDS, Truth, friction_recording

RECIPES = Path(__file__).resolve().parents[3] / "recipes"


def paper(**cut) -> Recipe:
    """Thin paper between two moving blades; the critic is left out."""
    facts = tomllib.loads((RECIPES / "paper-80gsm.toml").read_text(encoding="utf-8"))
    facts["fit"]["friction"] = {"law": "coulomb+viscous", "symmetry": "asymmetric"}
    facts["fit"]["cut"].update({"critic": False, "load_share": "none", **cut})
    return Recipe.model_validate(facts)


def pressing(**cut) -> Recipe:
    """A block that is pressed and not cut, known at 0.5 mm."""
    facts = tomllib.loads((RECIPES / "press-only.toml").read_text(encoding="utf-8"))
    facts["fit"]["cut"].update({"reference_indentation_mm": 0.5, "critic": False, **cut})
    return Recipe.model_validate(facts)


def friction_of(
    truth: Truth, rng: np.random.Generator, speeds: tuple[float, ...] = SPEEDS
) -> FitResult:
    """Friction from empty sweeps of a truth."""
    settings, recording = paper().fit.friction, friction_recording(truth, rng, speeds)
    return fit_friction((recording,), settings, effort="draft", rng=rng)
