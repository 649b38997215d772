"""Fits of one case with one candidate law, all other choices as the present fits have them."""

import time
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.fit_model import CutRun
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.session import identity_of
from scissorcal.device.trajectory import friction_plan
from scissorcal.errors import MissingError, ScissorcalError
from scissorcal.recipe.schema import CaptureCut, CaptureFriction, Recipe

Changes = Mapping[str, Any]


def as_fitted(case: Case) -> Recipe:
    """The recipe with every discrete choice as the present fits made it, nothing left to compare.

    >>> from scissorcal.recipe.load import builtin_recipe
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


def refit(
    case: Case, recipe: Recipe, repeat: int, *, friction_too: bool
) -> tuple[FitResult | None, FitResult | None, float]:
    """Fit the cut again by a changed recipe, and friction before it where that changes too.

    Gives friction, cut and the processor seconds. At the case's effort; random numbers follow from
    the case's seed and ``repeat``. Raises what the fits raise, MissingError without the friction
    that a cut needs.
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
    return friction, cut, time.process_time() - began


def holdout_rms(fit: FitResult) -> float:
    """Rms error on strokes that the chosen candidate was not fitted to, in the unit of the effort.

    NaN where the fit does not state it.
    """
    chosen = next((row for row in fit.candidates if row.get("chosen")), {})
    return float(chosen.get("held_out_rms", float("nan")))


def _with_fit(recipe: Recipe, part: str, changes: Changes) -> Recipe:
    section = getattr(recipe.fit, part).model_copy(update=dict(changes))
    return recipe.model_copy(update={"fit": recipe.fit.model_copy(update={part: section})})


Section = TypeVar("Section", CaptureFriction, CaptureCut)


def needed_minutes(case: Case, friction_speeds: int, cut_speeds: int) -> float | None:
    """Planned minutes of motion with so many of the recipe's speeds, pauses excluded.

    A law with k parameters over the rate needs motion at k speeds at least; repeats, strokes,
    sheets and the excitation stay as the recipe has them. None where the recordings do not state
    the rig, or where the recipe cannot be planned on it.
    """
    known = next((one for one in case.friction if "schema_hash" in one.device), None)
    if known is None:
        return None
    identity, capture = identity_of(known.device, known.source), case.recipe.capture
    fewer = capture.model_copy(
        update={
            "friction": _with_speeds(capture.friction, friction_speeds),
            "cut": _with_speeds(capture.cut, cut_speeds),
        }
    )
    recipe = case.recipe.model_copy(update={"capture": fewer})
    plans = (friction_plan, cut_plan) if case.cut else (friction_plan,)
    try:
        return sum(plan(recipe, identity).duration_s for plan in plans) / 60.0
    except ScissorcalError:
        return None


def _some_speeds(speeds: Sequence[float], count: int) -> tuple[float, ...]:
    """So many of some speeds, spread over their range: the middle one alone, or both ends and more.

    >>> _some_speeds((0.05, 0.12, 0.3, 0.7, 1.5), 1), _some_speeds((0.05, 0.12, 0.3, 0.7, 1.5), 3)
    ((0.3,), (0.05, 0.3, 1.5))
    """
    ordered = sorted(set(speeds))
    if count == 1:
        return (ordered[len(ordered) // 2],)
    picked = np.unique(np.round(np.linspace(0, len(ordered) - 1, min(count, len(ordered)))))
    return tuple(ordered[int(index)] for index in picked)


def _with_speeds(section: Section, count: int) -> Section:
    speeds = _some_speeds(section.speeds_rad_per_s, count)
    return section.model_copy(update={"speeds_rad_per_s": speeds})
