"""The fitted laws as the report evaluates them: one model with all draws, one at the best point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.calibration import cutting_from
from scissorcal.calibration.result import FitResult
from scissorcal.model import Cutting
from scissorcal.package.build import pick_draws
from scissorcal.package.exact import ExactModel, FitDraws, central_model, exact_model
from scissorcal.report.reduce import Array, thinned

MOST_DRAWS = 200


@dataclass(frozen=True)
class Law:
    """What would be rendered: ``drawn`` over posterior draws, ``central`` at the best point."""

    drawn: ExactModel
    central: ExactModel


def law_of(cut: FitResult, friction: FitResult | None) -> Law | None:
    """Join a cut with the friction that is rendered; None where either has no usable numbers."""
    if cut.what != "cut" or not _usable(cut) or (friction is not None and not _usable(friction)):
        return None
    picked = pick_draws(cut, friction, np.random.default_rng(0))
    drawn = [
        FitDraws(
            fit.structure, tuple(p.name for p in fit.parameters), picked[f"draws/{fit.what}.npy"]
        )
        for fit in (cut, friction)
        if fit is not None
    ]
    return Law(
        exact_model(drawn[0], drawn[1] if friction else None),
        central_model(_centre(cut), _centre(friction) if friction else None),
    )


def cutting_of(fit: FitResult, values: Array | None = None) -> Cutting | None:
    """The cut's model at its best point, or at parameters (..., p) in the fit's order."""
    if fit.what != "cut" or not _usable(fit):
        return None
    given = fit.map_point if values is None else values
    named = {p.name: np.asarray(given[..., i]) for i, p in enumerate(fit.parameters)}
    return cutting_from(dict(fit.structure), named)


def some_draws(fit: FitResult, most: int = MOST_DRAWS) -> Array:
    """At most so many posterior draws, evenly taken, shape (k, parameters)."""
    return fit.draws[thinned(np.arange(len(fit.draws)), most)]


def named(fits: Sequence[FitResult], what: str) -> FitResult | None:
    """The first fit of a kind."""
    return next((fit for fit in fits if fit.what == what), None)


def _usable(fit: FitResult) -> bool:
    wanted = {"response", "edge"} if fit.what == "cut" else {"angle_center"}
    known = wanted <= set(fit.structure) and len(fit.parameters) > 0 and len(fit.draws) > 1
    return known and bool(np.all(np.isfinite(fit.draws)) and np.all(np.isfinite(fit.map_point)))


def _centre(fit: FitResult) -> FitDraws:
    names = tuple(parameter.name for parameter in fit.parameters)
    return FitDraws(fit.structure, names, fit.map_point[None, :])
