"""The fit of friction: its run in a workspace, and the axis that it identifies."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.model.mechanism import AxisLaw
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.workday.engine import Engine
from scissorcal.workday.facts import UNFINISHED
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import Made, Request

if TYPE_CHECKING:
    from collections.abc import Callable

STREAM = 0
"""Which stream of random numbers of a seed is this fit's."""


def fit(engine: Engine, request: Request) -> Made:
    """Fit friction to the used recordings of empty motion."""
    return fitted(fit_friction, engine.recipe.fit.friction, "friction", STREAM, engine, request)


def fitted(
    fit_by: "Callable[..., FitResult]",
    settings: object,
    kind: CaptureKind,
    stream: int,
    engine: Engine,
    request: Request,
) -> Made:
    """Fit an axis by its function and settings to the used recordings of a kind."""
    request.progress(0.0, f"{kind}: reading recordings")
    result = fit_by(
        used_recordings(engine.workspace, engine.recipe, kind, engine.index),
        settings,
        effort=request.effort,
        rng=np.random.default_rng([request.seed, stream]),
        run=FrictionRun(
            progress=request.progress,
            checkpoint=request.checkpoint,
            last_chosen=request.last_model or None,
            stop=request.stop,
            critic=request.critic,
            tolerance=0.01 * engine.recipe.scene.tolerance_percent,
        ),
    )
    return Made(finished(result, request))


def finished(result: FitResult, request: Request) -> FitResult:
    """The result with the identity of its inputs; marked as unfinished where time ran out."""
    if not (result.rejected and request.stop()):
        return replace(result, inputs_hash=request.inputs_hash)
    note = (
        "The time allowed was used up before the fit was finished. Run 'scissorcal fit' again with "
        "a larger --max-minutes."
    )
    marked = f"{UNFINISHED}{request.inputs_hash}"
    return replace(result, inputs_hash=marked, notes=(*result.notes, note))


def axis_of_fit(fit: FitResult, unit: str) -> AxisLaw:
    """One axis from its fit of friction, at the medians of the posterior; ``unit`` of inertia."""
    values = {p.name: p.q50 for p in (*fit.parameters, *fit.nuisance)}
    if not values.get("inertia", 0.0) > 0.0:
        raise MissingError(
            f"The fit of {fit.what} has no inertia in {unit}: capture friction with an excitation "
            f"('scissorcal capture {fit.words}'), then 'scissorcal fit {fit.words}'."
        )
    return AxisLaw.of_fit(values, angle_centre(fit), 0.0)


def angle_centre(fit: FitResult) -> float:
    """The angle (rad) about which a fit's friction changes along the stroke."""
    centre = float(fit.structure.get("angle_center", float("nan")))
    return centre if math.isfinite(centre) else float(np.nanmedian(fit.series.opening))
