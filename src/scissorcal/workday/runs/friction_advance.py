"""The fit of the sledge's friction: its run in a workspace."""

from scissorcal.calibration.friction.advance import fit_friction_advance
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import Made, Request
from scissorcal.workday.runs.friction import fitted

STREAM = 5
"""Which stream of random numbers of a seed is this fit's."""


def fit(engine: Engine, request: Request) -> Made:
    """Fit mass and friction to the used recordings of the sledge's empty motion."""
    settings = engine.recipe.fit.advance
    return fitted(fit_friction_advance, settings, "friction-advance", STREAM, engine, request)
