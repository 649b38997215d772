"""Fit the camera to its photographs: candidate models compared, or constants imported."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.camera.bundle import (
    DEGREES_OF_FREEDOM,
    SHARED,
    Bundle,
    SeenBoard,
    fit_bundle,
    fit_pose,
)
from scissorcal.calibration.camera.checks import (
    FEWEST_VIEWS,
    OUTLYING,
    camera_verdicts,
    refuse_outside,
    refuse_parallel,
    refuse_undetermined,
    uncovered_notes,
)
from scissorcal.calibration.camera.result import CameraFit, ViewError
from scissorcal.calibration.camera.uncertainty import (
    camera_covariance,
    halves,
    pixel_map,
)
from scissorcal.calibration.candidates import Account, CandidateRow, compare
from scissorcal.errors import MissingError
from scissorcal.identity import file_digest
from scissorcal.recipe.priors import CameraPriors
from scissorcal.verdicts import Check
from scissorcal.vision.camera_files import CameraFile
from scissorcal.vision.geometry.board_pose import Corners, check_detections
from scissorcal.vision.geometry.camera import PARAMETERS, Camera, usual_camera
from scissorcal.vision.targets.detect import Detection

_DRAWS = 500


def fit_camera(
    seen: Sequence[Detection],
    *,
    rng: np.random.Generator,
    priors: CameraPriors = CameraPriors(),
    inputs_hash: str = "",
    progress: Progress | None = None,
) -> CameraFit:
    """Fit focal length, centre and distortion, and say how well they are known.

    ``seen`` is what `scissorcal.vision.find_board` found in each photograph. Corner errors follow a
    Student-t, so that a bad corner does little harm. The distortion model is the simplest that
    photographs left out do not distinguish from the best. The covariance counts that the corners of
    one photograph err together. Photographs that fit far worse than the others are named, none is
    dropped. ``priors`` are the recipe's.

    Raises MissingError with fewer than three photographs, InputError where these are of different
    sizes or a corner lies outside of its photograph, VerdictError where they do not determine
    the focal length: all taken with the board at one slant.
    """
    tell = progress or (lambda _share, _sentence: None)
    if len(seen) < FEWEST_VIEWS:
        raise MissingError(_too_few(len(seen)))
    check_detections(seen)
    width, height = seen[0].width, seen[0].height
    views = [seen_board(detection, priors) for detection in seen]
    start = usual_camera(width, height).parameters
    refuse_outside(views, width, height)
    refuse_parallel(views, start)
    tell(0.0, "camera: first fit")
    first = fit_bundle(views, CANDIDATES[0][1], np.append(start, [0.0, 0.0]))
    refuse_undetermined(first, width, height)
    if any(detection.board.kind == "markers" for detection in seen):
        lens = Camera.of(fit_bundle(views, _BENDING, first.shared).camera, width, height)
        unbent = [replace(photo, pixels=Corners.of(photo).unbent(lens).pixels) for photo in seen]
        views = [seen_board(detection, priors) for detection in unbent]
    compared = compare_cameras(views, first.shared, tell)
    ((chosen, bundle, _),) = (candidate for candidate in compared if candidate[0].chosen)
    refuse_undetermined(bundle, width, height)
    covariance, stretch = camera_covariance(bundle)
    camera = Camera.of(bundle.camera, width, height, covariance)
    region, share = seen_region([view.pixels for view in views], width, height)
    tell(0.85, "camera: two halves apart")
    rivals = [b.camera for row, b, _ in compared if row.equivalent and not row.chosen]
    places, cross = pixel_map(camera, stretch, halves(views, bundle), region, rivals)
    rows = _views(seen, bundle)
    return CameraFit(
        camera=camera,
        origin="fitted",
        board=seen[0].board.name,
        candidate=chosen.name,
        candidates=tuple(_candidate_facts(row, unseen_px) for row, _, unseen_px in compared),
        draws=rng.multivariate_normal(bundle.camera, covariance, _DRAWS, method="eigh"),
        views=rows,
        bulge_mm=(float(1e3 * bundle.shared[-2]), float(1e3 * bundle.shared[-1])),
        noise_px=bundle.sd_px,
        stretch=stretch,
        region=region,
        region_share=share,
        pixel_map=places,
        cross=cross,
        verdicts=camera_verdicts(camera, rows, places, cross),
        inputs_hash=inputs_hash,
        sources=tuple(detection.source for detection in seen),
        notes=uncovered_notes(places, share),
    )


def _candidate_facts(row: CandidateRow, unseen_px: float) -> dict[str, Any]:
    """The row of a candidate that reports and files hold."""
    facts = asdict(row)
    return {"free": facts.pop("parameters"), "unseen_px": unseen_px, **facts}


def seen_board(detection: Detection, priors: CameraPriors) -> SeenBoard:
    """Give a detection as the bundle's arrays."""
    size = detection.board.width_m, detection.board.height_m
    return SeenBoard(
        detection.source, detection.points, detection.pixels, size, 1e-3 * priors.bulge_sd_mm
    )


def seen_region(pixels: Sequence[Array], width: int, height: int) -> tuple[Array, float]:
    """Convex outline (k, 2) of all corners, and its share of the picture."""
    import cv2

    points = np.concatenate(list(pixels)).astype(np.float32)
    outline = np.asarray(cv2.convexHull(points), dtype=np.float64).reshape(-1, 2)
    area = float(cv2.contourArea(outline.astype(np.float32)))
    return outline, area / (width * height)


def _tilt_of(pose: Array) -> float:
    """Angle (rad) between a board and the picture's plane, from its pose (6,)."""
    import cv2

    turn, _ = cv2.Rodrigues(pose[:3])
    return float(np.arccos(np.clip(abs(turn[2, 2]), 0.0, 1.0)))


def _views(seen: Sequence[Detection], bundle: Bundle) -> tuple[ViewError, ...]:
    rms = bundle.rms_px
    middle = float(np.median(rms))
    rows = []
    for detection, pose, residual, error in zip(
        seen, bundle.poses, bundle.residuals, rms, strict=True
    ):
        rows.append(
            ViewError(
                name=detection.source,
                corners=len(residual),
                rms_px=float(error),
                worst_px=float(np.linalg.norm(residual, axis=1).max()),
                square_px=detection.square_px,
                distance_m=float(np.linalg.norm(pose[3:])),
                tilt_deg=float(np.degrees(_tilt_of(pose))),
                outlying=bool(error > OUTLYING * middle),
                pose=tuple(float(value) for value in pose),
            )
        )
    return tuple(rows)


def _too_few(count: int) -> str:
    if count == 0:
        reason = "There is no photograph of a board"
    else:
        had = "One photograph alone" if count == 1 else "Two photographs"
        reason = f"{had} cannot fit a camera"
    return (
        f"{reason}: take 15 with 'scissorcal capture camera --image board-*.jpg', with the board "
        f"near and far, in every corner and tilted every way; {FEWEST_VIEWS} are the least."
    )


FOLDS = 5
_SQUARE = (("fx", "fy"), ("cx",), ("cy",))


def _free(*camera: tuple[str, ...]) -> Array:
    """How the shared parameters move (11, p) with groups of the camera's and the two bulges."""
    groups = (*camera, ("bulge_x",), ("bulge_y",))
    spread = np.zeros((len(SHARED), len(groups)))
    for column, group in enumerate(groups):
        for name in group:
            spread[SHARED.index(name), column] = 1.0
    return spread


CANDIDATES: tuple[tuple[str, Array], ...] = (
    ("no distortion", _free(*_SQUARE)),
    ("k1", _free(*_SQUARE, ("k1",))),
    ("k1, k2", _free(*_SQUARE, ("k1",), ("k2",))),
    ("k1, k2, p1, p2", _free(*_SQUARE, ("k1",), ("k2",), ("p1",), ("p2",))),
    (
        "k1, k2, p1, p2, oblong pixels",
        _free(*((name,) for name in PARAMETERS if name != "k3")),
    ),
    ("k1, k2, p1, p2, k3, oblong pixels", _free(*((name,) for name in PARAMETERS))),
)
"""Pixels are square (fx = fy) in all but the last two. The board may bulge in every candidate."""

_BENDING = dict(CANDIDATES)["k1, k2, p1, p2"]
"""The distortion that says what a lens bends of the sides of markers, before one is chosen."""


def compare_cameras(
    views: Sequence[SeenBoard], start: Array, tell: Callable[[float, str], None]
) -> tuple[tuple[CandidateRow, Bundle, float], ...]:
    """Fit every model to all photographs, and to all but each fifth part of them in turn.

    Each comes with its row, its fit to all of them, and its rms error (px) on unseen ones.

    Models are compared by :func:`~.calibration.candidates.compare`, photographs being the units.
    The log density of a photograph counts as many corners as err independently: its share is one
    over the squared stretch that :func:`camera_covariance` finds.
    """
    shared, bundles = start, []
    for _, spread in CANDIDATES:
        bundles.append(fit_bundle(views, spread, shared))
        shared = bundles[-1].shared
    densities, errors = [], []
    for index, (name, spread) in enumerate(CANDIDATES):
        tell(0.8 * index / len(CANDIDATES), f"camera: {name}")
        residuals = _unseen_residuals(views, spread, bundles[index])
        densities.append([_log_density(residual, bundles[-1].sd_px) for residual in residuals])
        errors.append(float(np.sqrt(np.mean(np.concatenate(residuals) ** 2) * 2.0)))
    share = camera_covariance(bundles[-1])[1] ** -2
    rows = compare(
        [name for name, _ in CANDIDATES],
        [spread.shape[1] for _, spread in CANDIDATES],
        [Account(share * np.array(densities))],
    )
    return tuple(zip(rows, bundles, errors, strict=True))


def _unseen_residuals(views: Sequence[SeenBoard], spread: Array, whole: Bundle) -> list[Array]:
    """Residuals of each photograph under a camera fitted without it; its pose is its own."""
    folds = min(FOLDS, len(views))
    found: list[Array] = [np.empty((0, 2))] * len(views)
    for fold in range(folds):
        seen = [index for index in range(len(views)) if index % folds != fold]
        trained = fit_bundle(
            [views[index] for index in seen], spread, whole.shared, whole.poses[seen]
        )
        for index in range(fold, len(views), folds):
            found[index] = fit_pose(views[index], trained.shared, whole.poses[index])
    return found


def _log_density(residual: Array, sd: float) -> float:
    """Log density of corner errors under the fit's Student-t, up to a constant."""
    nu = DEGREES_OF_FREEDOM
    return -float(0.5 * (nu + 2.0) * np.sum(np.log1p(np.sum(residual**2, axis=1) / (nu * sd**2))))


UNCERTAINTY = Check(
    "fit.camera uncertainty", "lengths measured in photographs: whether their error is known"
)


def imported_camera(read: CameraFile, file: Path) -> CameraFit:
    """The camera of a file that `read_camera_file` read, without draws, views or covariance."""
    why = f"{file.name} ({read.style}) states no uncertainty of the camera."
    return CameraFit(
        camera=read.camera,
        origin="imported",
        board="",
        candidate=f"as in {file.name}",
        candidates=(),
        draws=np.empty((0, 9)),
        views=(),
        bulge_mm=(0.0, 0.0),
        noise_px=read.rms_px if read.rms_px is not None else float("nan"),
        stretch=float("nan"),
        region=np.empty((0, 2)),
        region_share=0.0,
        pixel_map=None,
        cross=None,
        verdicts=(UNCERTAINTY.not_evaluated(why),),
        inputs_hash=file_digest(file),
        sources=(file.name,),
        notes=(f"Imported from {file.name} ({read.style}).", *read.notes),
    )
