"""Fits of one case with one candidate law, all other choices as the present fits have them."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.fit_model import CutRun
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.recipe.schema import Recipe

Changes = Mapping[str, Any]


@dataclass(frozen=True)
class Refitted:
    """Both fits with a candidate in them, and the processor seconds of those that were made."""

    friction: FitResult | None
    cut: FitResult | None
    seconds: float


def as_fitted(case: Case) -> Recipe:
    """The recipe with every discrete choice as the present fits made it, nothing left to compare.

    >>> from scissorcal.recipe.library import builtin_recipe
    >>> case = Case(builtin_recipe("paper-80gsm"), (), (), None, (), None, None, "draft")
    >>> as_fitted(case).fit.cut.response
    'power'
    """
    recipe = case.recipe
    if case.cut_fit is not None:
        chosen = case.cut_fit.structure
        recipe = with_cut(
            recipe,
            response=str(chosen["response"]),
            rate_damping="fit" if chosen.get("rate_damping") else "none",
            load_share="fit" if chosen.get("load_share") else "none",
            **({} if chosen["fracture"] == "none" else {"fracture": str(chosen["fracture"])}),
        )
    if case.friction_fit is not None:
        chosen = case.friction_fit.structure
        symmetry = "symmetric" if chosen["symmetric"] else "asymmetric"
        recipe = with_friction(recipe, law=str(chosen["law"]), symmetry=symmetry)
    return recipe


def with_cut(recipe: Recipe, **changes: Any) -> Recipe:
    """The recipe with other settings of ``fit.cut``."""
    return _with_fit(recipe, "cut", changes)


def with_friction(recipe: Recipe, **changes: Any) -> Recipe:
    """The recipe with other settings of ``fit.friction``."""
    return _with_fit(recipe, "friction", changes)


def with_scene(recipe: Recipe, **changes: Any) -> Recipe:
    """The recipe with other settings of ``scene``."""
    return recipe.model_copy(update={"scene": recipe.scene.model_copy(update=changes)})


def refit(case: Case, recipe: Recipe, repeat: int, *, friction_too: bool) -> Refitted:
    """Fit the cut again by a changed recipe, and friction before it where that changes too.

    At the case's effort; random numbers follow from the case's seed and ``repeat``. Raises what the
    fits raise, MissingError without the friction that a cut needs.
    """
    rng = np.random.default_rng([case.seed, repeat])
    friction, cut = case.friction_fit, case.cut_fit
    began = time.process_time()
    if friction_too:
        friction = fit_friction(case.friction, recipe.fit.friction, effort=case.effort, rng=rng)
    if case.cut:
        if friction is None:
            raise MissingError("There is no fit of friction, which the fit of a cut needs.")
        cut = fit_cut(
            case.cut,
            recipe,
            friction,
            effort=case.effort,
            rng=rng,
            run=CutRun(edge=case.edge, edge_verdicts=case.edge_verdicts),
        )
    return Refitted(friction, cut, time.process_time() - began)


def holdout_rms(fit: FitResult) -> float:
    """Rms error on strokes that the chosen candidate was not fitted to, in the unit of the effort.

    NaN where the fit does not state it.
    """
    chosen = next((row for row in fit.candidates if row.get("chosen")), {})
    return float(chosen.get("held_out_rms", float("nan")))


def _with_fit(recipe: Recipe, part: str, changes: Changes) -> Recipe:
    section = getattr(recipe.fit, part).model_copy(update=dict(changes))
    return recipe.model_copy(update={"fit": recipe.fit.model_copy(update={part: section})})
