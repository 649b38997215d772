"""The fit of friction: its run in a workspace, and the axis that it identifies."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.calibration.friction.advance import fit_friction_advance
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.model.friction import AxisLaw
from scissorcal.workday.engine import Engine
from scissorcal.workday.facts import UNFINISHED
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import Made, Request

if TYPE_CHECKING:
    pass

STREAM, STREAM_ADVANCE = 0, 5
"""Which streams of random numbers of a seed are these fits'."""


def fit(engine: Engine, request: Request) -> Made:
    """Fit friction to the used recordings of empty motion."""
    return _fitted(engine, request, "friction")


def fit_advance(engine: Engine, request: Request) -> Made:
    """Fit mass and friction to the used recordings of the carriage's empty motion."""
    return _fitted(engine, request, "friction-advance")


def _fitted(
    engine: Engine, request: Request, kind: Literal["friction", "friction-advance"]
) -> Made:
    request.run.tell(0.0, f"{kind}: reading recordings")
    recordings = used_recordings(engine.workspace, engine.recipe, kind, engine.index)
    tolerance = 0.01 * engine.recipe.scene.tolerance_percent
    run = FrictionRun(**vars(request.run), critic=request.critic, tolerance=tolerance)
    settings, effort = engine.recipe.fit, request.effort
    if kind == "friction":
        rng = np.random.default_rng([request.seed, STREAM])
        result = fit_friction(recordings, settings.friction, effort=effort, rng=rng, run=run)
    else:
        rng = np.random.default_rng([request.seed, STREAM_ADVANCE])
        result = fit_friction_advance(recordings, settings.advance, effort=effort, rng=rng, run=run)
    return Made(finished(result, request))


def finished(result: FitResult, request: Request) -> FitResult:
    """The result with the identity of its inputs; marked as unfinished where time ran out."""
    stop = request.run.stop
    if not (result.rejected and stop and stop()):
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
