"""The ladder of camera models, cheap to rich, judged on photographs they have not seen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.camera.bundle import (
    DEGREES_OF_FREEDOM,
    SHARED,
    Bundle,
    SeenBoard,
    Structure,
    fit_bundle,
    fit_pose,
)
from scissorcal.vision.geometry.camera import PARAMETERS

Array = NDArray[np.float64]

FOLDS = 5
_SQUARE = (("fx", "fy"), ("cx",), ("cy",))


def _structure(*camera: tuple[str, ...]) -> Structure:
    groups = (*camera, ("bulge_x",), ("bulge_y",))
    spread = np.zeros((len(SHARED), len(groups)))
    for column, group in enumerate(groups):
        for name in group:
            spread[SHARED.index(name), column] = 1.0
    return Structure(tuple(group[0] if len(group) == 1 else "f" for group in groups), spread)


RUNGS: tuple[tuple[str, Structure], ...] = (
    ("no distortion", _structure(*_SQUARE)),
    ("k1", _structure(*_SQUARE, ("k1",))),
    ("k1, k2", _structure(*_SQUARE, ("k1",), ("k2",))),
    ("k1, k2, p1, p2", _structure(*_SQUARE, ("k1",), ("k2",), ("p1",), ("p2",))),
    (
        "k1, k2, p1, p2, oblong pixels",
        _structure(*((name,) for name in PARAMETERS if name != "k3")),
    ),
    ("k1, k2, p1, p2, k3, oblong pixels", _structure(*((name,) for name in PARAMETERS))),
)
"""Pixels are square (fx = fy) but on the upper two rungs. The board may bulge on every rung."""


@dataclass(frozen=True)
class Rung:
    """One camera model on all photographs, and on those it had not seen.

    ``unseen_px`` is the rms there, ``behind`` (views,) the negative log-likelihood of each left-out
    photograph less that of the best rung.
    """

    name: str
    bundle: Bundle
    unseen_px: float
    behind: Array
    equivalent: bool = False
    chosen: bool = False


def climb(
    views: Sequence[SeenBoard], start: Array, tell: Callable[[float, str], None]
) -> tuple[Rung, ...]:
    """Fit every rung to all photographs, and to all but each fifth part of them in turn.

    A rung counts as good as the best where it is behind by less than one standard error of the
    paired differences over photographs. The cheapest such is chosen: what a richer one gains, the
    data cannot tell from chance.
    """
    shared = start
    bundles = []
    for _, structure in RUNGS:
        bundles.append(fit_bundle(views, structure, shared))
        shared = bundles[-1].shared
    sd = bundles[-1].sd_px
    losses, errors = [], []
    for index, (name, structure) in enumerate(RUNGS):
        tell(0.8 * index / len(RUNGS), f"camera: {name}")
        residuals = unseen_residuals(views, structure, bundles[index])
        losses.append(np.array([_surprise(residual, sd) for residual in residuals]))
        errors.append(float(np.sqrt(np.mean(np.concatenate(residuals) ** 2) * 2.0)))
    best = losses[int(np.argmin([loss.mean() for loss in losses]))]
    rows = []
    chosen = False
    for (name, _), bundle, loss, error in zip(RUNGS, bundles, losses, errors, strict=True):
        behind = loss - best
        spread = float(behind.std(ddof=1)) / np.sqrt(len(views))
        equivalent = float(behind.mean()) <= spread
        rows.append(Rung(name, bundle, error, behind, equivalent, equivalent and not chosen))
        chosen = chosen or equivalent
    return tuple(rows)


def unseen_residuals(
    views: Sequence[SeenBoard], structure: Structure, whole: Bundle
) -> list[Array]:
    """Residuals of each photograph under a camera fitted without it; its pose is its own."""
    folds = min(FOLDS, len(views))
    found: list[Array] = [np.empty((0, 2))] * len(views)
    for fold in range(folds):
        seen = [index for index in range(len(views)) if index % folds != fold]
        trained = fit_bundle(
            [views[index] for index in seen], structure, whole.shared, whole.poses[seen]
        )
        for index in range(fold, len(views), folds):
            found[index] = fit_pose(views[index], trained.shared, whole.poses[index])
    return found


def _surprise(residual: Array, sd: float) -> float:
    """Negative log-likelihood of corner errors under the fit's Student-t, but for a constant."""
    nu = DEGREES_OF_FREEDOM
    return float(0.5 * (nu + 2.0) * np.sum(np.log1p(np.sum(residual**2, axis=1) / (nu * sd**2))))
