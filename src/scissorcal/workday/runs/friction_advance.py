"""The fit of the carriage's friction: its run in a workspace."""

from typing import TYPE_CHECKING

from scissorcal.workday.runs.friction import fitted

if TYPE_CHECKING:
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.fit import Made, Request

STREAM = 5
"""Which stream of random numbers of a seed is this fit's."""


def fit(engine: "Engine", request: "Request") -> "Made":
    """Fit mass and friction to the used recordings of the carriage's empty motion."""
    from scissorcal.calibration.friction.advance import fit_friction_advance

    settings = engine.recipe.fit.advance
    return fitted(fit_friction_advance, settings, "friction-advance", STREAM, engine, request)
