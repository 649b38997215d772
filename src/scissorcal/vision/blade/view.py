"""The mapping from pixels to the sheet under a blade, with its covariance.

The sheet is the mat with its markers, or bare, under a camera that is held above it by hand.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recipe.priors import BladePriors
from scissorcal.vision.geometry.board_pose import (
    Corners,
    UndeterminedPoseError,
    locate_board,
    other_size,
    project_pose,
)
from scissorcal.vision.geometry.camera import PARAMETERS, Camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.targets.boards import BLADE_MAT, MAT_FIELD_M
from scissorcal.vision.targets.detect import Detection, find_board

FOCAL_SHARE = 0.85
"""Focal length over the picture's longer side: 0.72 of a telephone's wide lens to 1.0 of a normal
one. It only turns a tilt into a change of scale across the picture."""


LEAST_MARKERS = 6

_CORNER_SD_PX = 0.03
_FIXED_POINT_STEPS = 30
_FAR_OFF = 5.0


@dataclass(frozen=True)
class View(ABC):
    """One photograph's mapping from pixels to a sheet, x to the right and y down.

    ``values`` (p,) with ``covariance`` (p, p) are its parameters; `to_sheet` takes other values, to
    show what each of them moves. The last ``shared`` of them are the same in every photograph of
    one mat and camera; ``own_error`` names the error of the others. ``bounds`` (left, top,
    right, bottom) is the part of the sheet in which a blade may lie, in sheet units: metres, or
    pixels where no scale is known (``metric`` False). ``uncertainty`` is a sentence on its
    accuracy.
    """

    bounds: tuple[float, float, float, float]
    metric: bool
    own_error: str
    shared: int
    values: Array
    covariance: Array
    uncertainty: str

    @abstractmethod
    def to_sheet(self, pixels: Array, values: Array | None = None) -> Array:
        """Places (n, 2) on the sheet of pixels (n, 2)."""

    @abstractmethod
    def to_pixels(self, points: Array) -> Array:
        """Pixels (n, 2) of places (n, 2) on the sheet."""


@dataclass(frozen=True)
class PlainView(View):
    """A photograph of a bare sheet: shapes up to similarity, or to scale with ``scale``.

    ``scale`` is metres per pixel, None where it is unknown. Values are the camera's tilt (rad,
    towards x and y of the picture), the two components by which the tilt foreshortens lengths, and
    the scale's share. The sheet's unit is that of a pixel in the middle.
    """

    scale: float | None

    @classmethod
    def by_hand(
        cls, width: int, height: int, priors: BladePriors, scale: float | None = None
    ) -> "PlainView":
        """A picture of ``width`` by ``height`` pixels by a camera whose tilt has a prior only.

        Foreshortening is of second order: with tilts p and q it is (p^2 - q^2) / 4 and p q / 2.
        """
        unit = scale or 1.0
        tilt = np.radians(priors.tilt_sd_deg) ** 2
        share = (0.01 * priors.scale_sd_percent if scale else 0.0) ** 2
        covariance = np.diag([tilt, tilt, 0.25 * tilt**2, 0.25 * tilt**2, share])
        bounds = (0.0, 0.0, (width - 1) * unit, (height - 1) * unit)
        level = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
        return cls(bounds, scale is not None, "tilt", 1, level, covariance, "", scale).leaning(
            level[:4], covariance[:4, :4]
        )

    def leaning(self, lean: Array, lean_covariance: Array) -> "PlainView":
        """The same view with another estimate (4,) of its tilt and foreshortening."""
        covariance = self.covariance.copy()
        covariance[:4, :4] = lean_covariance
        known = "the shape has no scale" if self.scale is None else "the scale is as stated"
        words = (
            f"No mat: {known}, and the blades' lengths suggest a tilt of "
            f"{np.degrees(np.hypot(*lean[:2])):.1f} deg, which is allowed for."
        )
        return replace(self, values=np.append(lean, 1.0), covariance=covariance, uncertainty=words)

    def to_sheet(self, pixels: Array, values: Array | None = None) -> Array:
        p, q, u, v, share = self.values if values is None else values
        middle, focal, unit = self._frame()
        n = (pixels - middle) / focal
        stretched = n @ np.array([[1.0 + u, v], [v, 1.0 - u]])
        depth = 1.0 - n @ np.array([p, q])
        return np.asarray((middle + focal * stretched / depth[:, None]) * (unit * share))

    def to_pixels(self, points: Array) -> Array:
        p, q, u, v, share = self.values
        middle, focal, unit = self._frame()
        m = (points / (unit * share) - middle) / focal
        # (S + m t') n = m, two by two for each point
        a, b = 1.0 + u + m[:, 0] * p, v + m[:, 0] * q
        c, d = v + m[:, 1] * p, 1.0 - u + m[:, 1] * q
        n = np.column_stack([d * m[:, 0] - b * m[:, 1], a * m[:, 1] - c * m[:, 0]])
        return np.asarray(middle + focal * n / (a * d - b * c)[:, None])

    def _frame(self) -> tuple[Array, float, float]:
        """Middle of the picture and focal length in pixels, and the size of a pixel."""
        unit = self.scale or 1.0
        size = np.array(self.bounds[2:]) / unit
        return 0.5 * size, FOCAL_SHARE * float(size.max() + 1.0), unit


def see_mat(photo: Photo, camera: Camera | None, priors: BladePriors = BladePriors()) -> View:
    """Find the blade mat in a photograph and how it is seen.

    With a camera by the mat's pose; without one by a homography and one radial term of distortion.
    Pixels are those of ``photo.image``; ``priors`` state the error of the print. Raises InputError
    where no mat, another target, or too little of it is seen, or where the camera is not that of
    the photograph.
    """
    detection = find_board(photo, BLADE_MAT)
    if len(detection.ids) < 4 * LEAST_MARKERS:
        raise InputError(
            f"{photo.source} shows {len(detection.ids) // 4} of the {BLADE_MAT.name}'s "
            f"{len(BLADE_MAT.ids)} markers sharply; {LEAST_MARKERS} are needed. Photograph the "
            "whole mat, in focus and without glare."
        )
    height, width = photo.image.shape[:2]
    within = photo.within(detection.pixels)
    detection = replace(detection, pixels=within, width=width, height=height)
    printed = (0.01 * priors.print_scale_sd_percent) ** 2 * np.eye(2)
    if camera is None:
        return _homography_view(detection, (width, height), printed, photo.source)
    if not camera.takes(photo.width, photo.height):
        raise other_size(photo.source, (photo.width, photo.height), camera)
    if photo.reduction > 1:
        camera = camera.scaled(width, height)
    return _camera_view(detection, camera, printed)


@dataclass(frozen=True)
class CameraView(View):
    """The mat at a pose before a known camera.

    Values are its rotation and shift, the camera's intrinsics, and the print's scale by axis.
    """

    camera: Camera

    def to_sheet(self, pixels: Array, values: Array | None = None) -> Array:
        v = self.values if values is None else values
        rays = _with_intrinsics(self.camera, v[6:-2]).rays(pixels)
        rotation = cv2.Rodrigues(v[:3])[0]
        directions = np.column_stack([rays, np.ones(len(rays))]) @ rotation
        origin = -v[3:6] @ rotation
        reach = origin[2] / directions[:, 2]
        return np.asarray((origin[:2] - directions[:, :2] * reach[:, None]) * v[-2:])

    def to_pixels(self, points: Array) -> Array:
        rotation = cv2.Rodrigues(self.values[:3])[0]
        return self.camera.project(points @ rotation[:, :2].T + self.values[3:6])


@dataclass(frozen=True)
class _HomographyView(View):
    """The mat seen by an unknown camera: a homography after one radial term about the middle.

    Values are the homography from pixels to the sheet (8, its last entry 1), the radial term,
    and the print's scale along either axis.
    """

    size: tuple[int, int]

    def to_sheet(self, pixels: Array, values: Array | None = None) -> Array:
        v = self.values if values is None else values
        return np.asarray(_through(_matrix(v[:8]), _straightened(pixels, v[8], self.size)) * v[-2:])

    def to_pixels(self, points: Array) -> Array:
        straight = _through(np.asarray(np.linalg.inv(_matrix(self.values[:8]))), points)
        bent = straight.copy()
        for _ in range(_FIXED_POINT_STEPS):
            r2 = np.sum(bent**2, axis=1, keepdims=True)
            bent = straight / (1.0 + self.values[8] * r2)
        return np.asarray(bent * _half(self.size) + _middle(self.size))


def _camera_view(detection: Detection, camera: Camera, printed: Array) -> CameraView:
    corners = Corners.of(detection).unbent(camera)
    try:
        board = locate_board(corners, camera)
    except UndeterminedPoseError as error:
        raise InputError(str(error)) from None
    whole = np.repeat(board.used.reshape(-1, 4).all(axis=1), 4)
    turn, _ = cv2.Rodrigues(board.pose.matrix[:3, :3])
    pose = np.concatenate([np.ravel(turn), np.asarray(board.pose.translation_m)])
    residual, slope = project_pose(pose, corners.where(whole), camera)
    J, inner = slope[:, :6], slope[:, 6:]
    measured, spread = _covariance(J, residual.ravel())
    follow = -np.linalg.solve(J.T @ J, J.T @ inner)
    known = np.zeros((9, 9)) if camera.covariance is None else camera.covariance
    covariance = np.zeros((17, 17))
    covariance[:6, :6] = measured + follow @ known @ follow.T
    covariance[:6, 6:15] = follow @ known
    covariance[6:15, :6] = covariance[:6, 6:15].T
    covariance[6:15, 6:15] = known
    covariance[15:, 15:] = printed
    words = f"Fitted camera: the mat's corner residuals are {spread:.2f} px rms."
    values = np.concatenate([pose, camera.parameters, np.ones(2)])
    return CameraView(MAT_FIELD_M, True, "mapping", 11, values, covariance, words, camera)


def _homography_view(
    detection: Detection, size: tuple[int, int], printed: Array, source: str
) -> _HomographyView:
    sheet, pixels = detection.points[:, :2], detection.pixels
    start, _ = cv2.findHomography(_straightened(pixels, 0.0, size), sheet, 0)
    if start is None:
        raise InputError(f"{source}: the mat's markers do not fit a flat sheet.")
    start = np.asarray(start) / start[2, 2]
    scale = _pixels_per_unit(start, sheet, size)

    def miss(values: Array) -> Array:
        there = _through(_matrix(values[:8]), _straightened(pixels, values[8], size))
        return np.asarray(((there - sheet) * scale[:, None]).ravel())

    first = np.concatenate([start.ravel()[:8], [0.0]])
    solved = least_squares(miss, first, x_scale="jac", method="lm")
    far = np.linalg.norm(solved.fun.reshape(-1, 8), axis=1)
    kept = np.repeat(far < _FAR_OFF * np.median(far) + _CORNER_SD_PX, 4)
    if not kept.all():
        sheet, pixels, scale = sheet[kept], pixels[kept], scale[kept]
        solved = least_squares(miss, solved.x, x_scale="jac", method="lm")
    # what a lens does beyond one radial term is smooth: no more pieces of it than parameters
    J = np.asarray(solved.jac)
    measured, spread = _covariance(J, np.asarray(solved.fun), len(J) / J.shape[1])
    covariance = np.zeros((11, 11))
    covariance[:9, :9] = measured
    covariance[9:, 9:] = printed
    words = (
        "No camera fit: a homography and one radial term, with corner residuals of "
        f"{spread:.2f} px rms."
    )
    values = np.concatenate([solved.x, np.ones(2)])
    return _HomographyView(MAT_FIELD_M, True, "mapping", 2, values, covariance, words, size)


def _covariance(J: Array, residual: Array, least: float = 1.0) -> tuple[Array, float]:
    """Least squares' covariance, with the four corners of a marker counted as partly one.

    Corners of a marker share its print and its light: the variance is raised by what the sums over
    markers exceed that of independent corners, and ``least`` times at the least.
    """
    count, parameters = J.shape
    variance = float(residual @ residual) / max(count - parameters, 1)
    sums = residual.reshape(-1, 4, 2).sum(axis=1)
    shared = max(float(np.mean(sums**2)) / (4.0 * max(variance, 1e-12)), least)
    sure = max(variance, _CORNER_SD_PX**2) * shared
    scale = np.sqrt(np.sum(J**2, axis=0))
    inverse = np.linalg.pinv((J / scale).T @ (J / scale)) / np.outer(scale, scale)
    return sure * inverse, float(np.sqrt(variance))


def _pixels_per_unit(matrix: Array, sheet: Array, size: tuple[int, int]) -> Array:
    """Pixels per sheet unit near each point, the geometric mean over directions."""
    back = np.asarray(np.linalg.inv(matrix))
    step = 1e-4 * float(np.ptp(sheet))
    here = _through(back, sheet)
    right = _through(back, sheet + np.array([step, 0.0])) - here
    down = _through(back, sheet + np.array([0.0, step])) - here
    area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    return np.asarray(np.sqrt(area) / step * _half(size))


def _with_intrinsics(camera: Camera, values: Array) -> Camera:
    named = dict(zip(PARAMETERS[:4], values[:4].tolist(), strict=True))
    bent = (*values[4:9].tolist(), *camera.distortion[5:])
    return replace(camera, distortion=bent, **named)


def _matrix(values: Array) -> Array:
    return np.append(values, 1.0).reshape(3, 3)


def _middle(size: tuple[int, int]) -> Array:
    return 0.5 * (np.asarray(size, dtype=np.float64) - 1.0)


def _half(size: tuple[int, int]) -> float:
    return 0.5 * float(np.hypot(*size))


def _straightened(pixels: Array, radial: float, size: tuple[int, int]) -> Array:
    centred = (pixels - _middle(size)) / _half(size)
    return np.asarray(centred * (1.0 + radial * np.sum(centred**2, axis=1, keepdims=True)))


def _through(matrix: Array, points: Array) -> Array:
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[:, :2] / mapped[:, 2:])
