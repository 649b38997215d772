"""Fit a camera to photographs of a flat board."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.camera.bundle import Bundle, SeenBoard, fit_bundle
from scissorcal.calibration.camera.candidates import CANDIDATES, compare_cameras
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
from scissorcal.errors import MissingError
from scissorcal.recipe.priors import CameraPriors
from scissorcal.vision.geometry.camera import Camera, usual_camera
from scissorcal.vision.targets.detect import Detection

_DRAWS = 500


@dataclass(frozen=True)
class CameraPhoto:
    """A board as one photograph of ``width`` by ``height`` pixels shows it."""

    name: str
    width: int
    height: int
    detection: Detection


def fit_camera(
    photos: Sequence[CameraPhoto],
    *,
    rng: np.random.Generator,
    priors: CameraPriors = CameraPriors(),
    inputs_hash: str = "",
    progress: Progress | None = None,
) -> CameraFit:
    """Fit focal length, centre and distortion, and say how well they are known.

    Corner errors follow a Student-t, so that a bad corner does little harm. The distortion model is
    the simplest that photographs left out do not distinguish from the best. The covariance counts
    that the corners of one photograph err together. Photographs that fit far worse than the others
    are named, none is dropped. ``priors`` are the recipe's.

    Raises MissingError with fewer than three photographs, InputError where a corner lies outside
    of its photograph, VerdictError where they do not determine
    the focal length: all taken with the board at one slant.
    """
    tell = progress or (lambda _share, _sentence: None)
    if len(photos) < FEWEST_VIEWS:
        raise MissingError(_too_few(len(photos)))
    width, height = photos[0].width, photos[0].height
    views = [seen_board(photo.name, photo.detection, priors) for photo in photos]
    start = usual_camera(width, height).parameters
    refuse_outside(views, width, height)
    refuse_parallel(views, start)
    tell(0.0, "camera: first fit")
    first = fit_bundle(views, CANDIDATES[0][1], np.append(start, [0.0, 0.0]))
    refuse_undetermined(first, width, height)
    compared = compare_cameras(views, first.shared, tell)
    (chosen,) = (one for one in compared if one.row.chosen)
    bundle = chosen.bundle
    refuse_undetermined(bundle, width, height)
    spread = camera_covariance(bundle)
    camera = Camera.of(bundle.camera, width, height, spread.covariance)
    region, share = seen_region([view.pixels for view in views], width, height)
    tell(0.85, "camera: two halves apart")
    rivals = [one.bundle.camera for one in compared if one.row.equivalent and not one.row.chosen]
    places, cross = pixel_map(camera, spread, halves(views, bundle), region, rivals)
    rows = _views(photos, bundle)
    return CameraFit(
        camera=camera,
        origin="fitted",
        board=photos[0].detection.board.name,
        rung=chosen.row.name,
        rungs=tuple(one.as_row() for one in compared),
        draws=rng.multivariate_normal(bundle.camera, spread.covariance, _DRAWS, method="eigh"),
        views=rows,
        bulge_mm=(float(1e3 * bundle.shared[-2]), float(1e3 * bundle.shared[-1])),
        noise_px=bundle.sd_px,
        stretch=spread.stretch,
        region=region,
        region_share=share,
        pixel_map=places,
        cross=cross,
        verdicts=camera_verdicts(camera, rows, places, cross),
        inputs_hash=inputs_hash,
        sources=tuple(photo.name for photo in photos),
        notes=uncovered_notes(places, share),
    )


def seen_board(name: str, detection: Detection, priors: CameraPriors) -> SeenBoard:
    """Give a detection as the bundle's arrays."""
    size = detection.board.width_m, detection.board.height_m
    return SeenBoard(name, detection.points, detection.pixels, size, 1e-3 * priors.bulge_sd_mm)


def seen_region(pixels: Sequence[Array], width: int, height: int) -> tuple[Array, float]:
    """Convex outline (k, 2) of all corners, and its share of the picture."""
    import cv2

    points = np.concatenate(list(pixels)).astype(np.float32)
    outline = np.asarray(cv2.convexHull(points), dtype=np.float64).reshape(-1, 2)
    area = float(cv2.contourArea(outline.astype(np.float32)))
    return outline, area / (width * height)


def tilt_of(pose: Array) -> float:
    """Angle (rad) between a board and the picture's plane, from its pose (6,)."""
    import cv2

    turn, _ = cv2.Rodrigues(pose[:3])
    return float(np.arccos(np.clip(abs(turn[2, 2]), 0.0, 1.0)))


def _views(photos: Sequence[CameraPhoto], bundle: Bundle) -> tuple[ViewError, ...]:
    rms = bundle.rms_px
    middle = float(np.median(rms))
    rows = []
    for photo, pose, residual, error in zip(
        photos, bundle.poses, bundle.residuals, rms, strict=True
    ):
        rows.append(
            ViewError(
                name=photo.name,
                corners=len(residual),
                rms_px=float(error),
                worst_px=float(np.linalg.norm(residual, axis=1).max()),
                square_px=photo.detection.square_px,
                distance_m=float(np.linalg.norm(pose[3:])),
                tilt_deg=float(np.degrees(tilt_of(pose))),
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
