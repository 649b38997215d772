"""How uncertain a fitted camera is, and whether two halves of the photographs agree with that."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.camera.bundle import Bundle, SeenBoard, fit_bundle, projected
from scissorcal.calibration.camera.result import CrossValidation, PixelMap
from scissorcal.vision.geometry.camera import PARAMETERS, Camera

GRID = (21, 15)
FEWEST_TO_HALVE = 6
"""Fewer photographs than these cannot be halved."""

_DRAWS = 2000
_TURN_STEPS = 8
_LEAST_LEFT = 0.05


def camera_covariance(bundle: Bundle, stretch: float | None = None) -> tuple[Array, float]:
    """Covariance (9, 9) of the camera, widened for errors that a photograph's corners share.

    Corners taken as independent give the sandwich covariance C of a robust fit. But a board that is
    not flat, or a detector's bias, moves all corners of a photograph together, and C is then too
    small. The pulls of whole photographs show by how much, corrected for each photograph's share
    in the fit so that independent corners would give C on average (CR2: Bell and McCaffrey 2002).
    A dozen photographs cannot give a whole matrix: only one number is taken from them, the mean of
    the variances over C's, and C is multiplied by it. Its root, the stretch of standard errors,
    comes second; ``stretch`` gives it where it is known from elsewhere.
    """
    back = np.linalg.inv(np.linalg.cholesky(bundle.information.sum(axis=0) + bundle.prior))
    noise = back @ (bundle.noise + bundle.sd_px**2 * bundle.prior) @ back.T
    if stretch is None:
        pulls = np.array(
            [
                _inverse_root(np.eye(len(back)) - back @ own @ back.T) @ back @ score
                for own, score in zip(bundle.information, bundle.scores, strict=True)
            ]
        )
        ratio = float(np.trace(np.linalg.solve(noise, pulls.T @ pulls))) / len(back)
        stretch = float(np.sqrt(max(ratio, 1.0)))
    single = back.T @ noise @ back
    own = bundle.spread[: len(PARAMETERS)]
    return stretch**2 * own @ single @ own.T, stretch


def _inverse_root(symmetric: Array) -> Array:
    values, vectors = np.linalg.eigh(symmetric)
    return np.asarray((vectors / np.sqrt(np.maximum(values, _LEAST_LEFT))) @ vectors.T)


def halves(views: Sequence[SeenBoard], bundle: Bundle) -> tuple[Bundle, Bundle] | None:
    """Fit two halves of the photographs apart, every other one; None where there are too few."""
    if len(views) < FEWEST_TO_HALVE:
        return None
    first, second = (
        fit_bundle(views[at::2], bundle.spread, bundle.shared, bundle.poses[at::2]) for at in (0, 1)
    )
    return first, second


def pixel_map(
    camera: Camera,
    stretch: float,
    parts: tuple[Bundle, Bundle] | None,
    region: Array,
    rivals: Sequence[Array] = (),
) -> tuple[PixelMap, CrossValidation | None]:
    """Lay the projection's uncertainty and the two halves' difference over the picture.

    ``camera`` has its covariance, in which standard errors were widened by ``stretch``. ``rivals``
    are the parameters (9,) of models that predict unseen photographs as well as the chosen one: how
    far they differ from it is what the choice of a model leaves open.

    Two cameras are compared as a user would notice: a direction seen by one is turned by the
    rotation that makes both agree best over the valid region, and projected by the other.
    """
    import cv2

    x = np.linspace(0.0, camera.width - 1.0, GRID[0])
    y = np.linspace(0.0, camera.height - 1.0, GRID[1])
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    outline = region.astype(np.float32)
    inside = np.array(
        [cv2.pointPolygonTest(outline, (float(u), float(v)), False) >= 0 for u, v in pixels]
    )
    rays = camera.rays(pixels)
    known = np.isfinite(rays).all(axis=1)
    within = inside & known
    slope = _without_turn(rays, camera, within)
    assert camera.covariance is not None
    variance = np.einsum("npi,ij,npj->n", slope, camera.covariance, slope) / 2.0
    shape = (GRID[1], GRID[0])
    sd = np.where(known, np.sqrt(np.maximum(variance, 0.0)), np.nan).reshape(shape)
    model = _apart(pixels, camera.parameters, rivals, within, shape)
    if parts is None:
        return PixelMap(x, y, sd, inside.reshape(shape), None, model), None
    difference = _difference(pixels, parts[0].camera, parts[1].camera, within)
    covariance = sum(camera_covariance(part, stretch)[0] for part in parts)
    cross = _judged(difference, slope, np.asarray(covariance), within)
    length = np.linalg.norm(difference, axis=1).reshape(shape)
    return PixelMap(x, y, sd, inside.reshape(shape), length, model), cross


def _without_turn(rays: Array, camera: Camera, within: NDArray[np.bool_]) -> Array:
    """Slopes (n, 2, 9) of pixels by the camera's parameters, the best rotation taken out."""
    points = np.column_stack([np.nan_to_num(rays), np.ones(len(rays))])
    _, by_pose, by_camera = projected(points, np.zeros(6), camera.parameters)
    turn, by_parameter = by_pose[:, :3], by_camera
    rows = np.repeat(within, 2)
    absorbed, *_ = np.linalg.lstsq(turn[rows], by_parameter[rows], rcond=None)
    return np.asarray((by_parameter - turn @ absorbed).reshape(-1, 2, 9))


def _apart(
    pixels: Array,
    chosen: Array,
    rivals: Sequence[Array],
    within: NDArray[np.bool_],
    shape: tuple[int, int],
) -> Array | None:
    """Largest distance between what a rival sees at ``pixels`` and what the chosen camera does."""
    if not rivals:
        return None
    lengths = [
        np.linalg.norm(_difference(pixels, chosen, rival, within), axis=1) for rival in rivals
    ]
    return np.asarray(np.max(lengths, axis=0).reshape(shape))


def _difference(pixels: Array, first: Array, second: Array, within: NDArray[np.bool_]) -> Array:
    """Where the second camera (9,) sees what the first one sees at ``pixels``, less those."""
    rays = Camera.of(first, 0, 0).rays(pixels)
    points = np.column_stack([rays, np.ones(len(rays))])
    used = within & np.isfinite(rays).all(axis=1)
    safe = np.nan_to_num(points)
    pose = np.zeros(6)
    for _ in range(_TURN_STEPS):
        image, by_pose, _ = projected(safe, pose, second)
        rows = np.repeat(used, 2)
        step, *_ = np.linalg.lstsq(by_pose[rows][:, :3], (pixels - image)[used].ravel(), rcond=None)
        pose[:3] += step
    image, _, _ = projected(safe, pose, second)
    return np.asarray(np.where(np.isfinite(rays), image - pixels, np.nan))


def _judged(
    difference: Array, slope: Array, covariance: Array, within: NDArray[np.bool_]
) -> CrossValidation:
    rng = np.random.default_rng(0)
    drawn = rng.multivariate_normal(np.zeros(9), covariance, _DRAWS, method="eigh")
    used = within & np.isfinite(difference).all(axis=1)
    moved = np.einsum("npi,di->dnp", slope[used], drawn)
    expected = np.mean(np.sum(moved**2, axis=2), axis=1)
    squared = float(np.mean(np.sum(difference[used] ** 2, axis=1)))
    return CrossValidation(
        float(np.sqrt(squared)),
        float(np.sqrt(expected.mean())),
        float(np.mean(expected >= squared)),
    )
