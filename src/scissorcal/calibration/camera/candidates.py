"""Candidate camera models, simplest first, compared on photographs they have not seen."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.camera.bundle import (
    DEGREES_OF_FREEDOM,
    SHARED,
    Bundle,
    SeenBoard,
    Structure,
    fit_bundle,
    fit_pose,
)
from scissorcal.calibration.camera.uncertainty import camera_covariance
from scissorcal.calibration.candidates import Account, CandidateRow, compare
from scissorcal.vision.geometry.camera import PARAMETERS

FOLDS = 5
_SQUARE = (("fx", "fy"), ("cx",), ("cy",))


def _structure(*camera: tuple[str, ...]) -> Structure:
    groups = (*camera, ("bulge_x",), ("bulge_y",))
    spread = np.zeros((len(SHARED), len(groups)))
    for column, group in enumerate(groups):
        for name in group:
            spread[SHARED.index(name), column] = 1.0
    return Structure(tuple(group[0] if len(group) == 1 else "f" for group in groups), spread)


CANDIDATES: tuple[tuple[str, Structure], ...] = (
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
"""Pixels are square (fx = fy) in all but the last two. The board may bulge in every candidate."""


@dataclass(frozen=True)
class CameraCandidate:
    """One camera model fitted to all photographs; ``unseen_px`` is its rms on unseen ones."""

    row: CandidateRow
    bundle: Bundle
    unseen_px: float

    def as_row(self) -> dict[str, Any]:
        """The row that reports and files hold."""
        row = asdict(self.row)
        return {"free": row.pop("parameters"), "unseen_px": self.unseen_px, **row}


def compare_cameras(
    views: Sequence[SeenBoard], start: Array, tell: Callable[[float, str], None]
) -> tuple[CameraCandidate, ...]:
    """Fit every model to all photographs, and to all but each fifth part of them in turn.

    Models are compared by :func:`~.calibration.candidates.compare`, photographs being the units.
    The log density of a photograph counts as many corners as err independently: its share is one
    over the squared stretch that :func:`camera_covariance` finds.
    """
    shared, bundles = start, []
    for _, structure in CANDIDATES:
        bundles.append(fit_bundle(views, structure, shared))
        shared = bundles[-1].shared
    densities, errors = [], []
    for index, (name, structure) in enumerate(CANDIDATES):
        tell(0.8 * index / len(CANDIDATES), f"camera: {name}")
        residuals = unseen_residuals(views, structure, bundles[index])
        densities.append([_log_density(residual, bundles[-1].sd_px) for residual in residuals])
        errors.append(float(np.sqrt(np.mean(np.concatenate(residuals) ** 2) * 2.0)))
    share = camera_covariance(bundles[-1]).stretch ** -2
    rows = compare(
        [name for name, _ in CANDIDATES],
        [len(structure.names) for _, structure in CANDIDATES],
        [Account(share * np.array(densities))],
    )
    return tuple(map(CameraCandidate, rows, bundles, errors))


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


def _log_density(residual: Array, sd: float) -> float:
    """Log density of corner errors under the fit's Student-t, up to a constant."""
    nu = DEGREES_OF_FREEDOM
    return -float(0.5 * (nu + 2.0) * np.sum(np.log1p(np.sum(residual**2, axis=1) / (nu * sd**2))))
