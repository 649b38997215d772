"""A pinhole camera with radial and tangential distortion, and its covariance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array

PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Rows and columns of ``Camera.covariance``, in this order."""

_ROUND_TRIP_PX = 1e-3
_UNDISTORT_STEPS = 200


def usual_camera(width: int, height: int) -> "Camera":
    """A camera of middling field of view: its focal length is within a third of most cameras'."""
    focal = 1.1 * max(width, height)
    middle = 0.5 * (width - 1), 0.5 * (height - 1)
    return Camera(focal, focal, *middle, (0.0,) * 5, width, height)


@dataclass(frozen=True)
class Camera:
    """Intrinsics of one camera at one focus and picture size.

    ``x' = x/z, y' = y/z, r^2 = x'^2 + y'^2`` of a point in the camera's frame (x right, y down,
    z forward) are bent to ``x'(1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x'y' + p2 (r^2 + 2x'^2)`` (y'
    alike; divided by ``1 + k4 r^2 + k5 r^4 + k6 r^6`` where ``distortion`` has eight numbers) and
    project to pixel ``(fx x'' + cx, fy y'' + cy)`` (Brown 1971, as OpenCV writes it). The centre of
    the first pixel is (0, 0). ``distortion`` is (k1, k2, p1, p2, k3[, k4, k5, k6]).

    ``covariance`` is (9, 9) over `PARAMETERS` (zero rows for fixed parameters); None means
    that the camera is taken as exact.

    >>> Camera(500.0, 500.0, 320.0, 240.0, (0.0,) * 5, 640, 480).project([[0.1, 0.0, 1.0]])
    array([[370., 240.]])
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...]
    width: int
    height: int
    covariance: Array | None = None

    @classmethod
    def of(
        cls, parameters: Array, width: int, height: int, covariance: Array | None = None
    ) -> "Camera":
        """The camera of nine `PARAMETERS`."""
        fx, fy, cx, cy, *bend = (float(value) for value in parameters)
        return cls(fx, fy, cx, cy, tuple(bend), width, height, covariance)

    @property
    def parameters(self) -> Array:
        """The nine `PARAMETERS`; k4 to k6 are not among them."""
        return np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion[:5]])

    @property
    def matrix(self) -> Array:
        """The 3x3 camera matrix K."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def coefficients(self) -> Array:
        """``distortion`` as the array that OpenCV takes."""
        return np.array(self.distortion, dtype=np.float64)

    def takes(self, width: int, height: int) -> bool:
        """Whether its pictures have this size in pixels."""
        return (self.width, self.height) == (width, height)

    def project(self, points: ArrayLike) -> Array:
        """Pixels (n, 2) of points (n, 3) in the camera's frame, metres; NaN behind the camera."""
        import cv2

        given = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        pixels = np.full((len(given), 2), np.nan)
        ahead = given[:, 2] > 0.0
        if ahead.any():
            still = np.zeros(3)
            there, _ = cv2.projectPoints(given[ahead], still, still, self.matrix, self.coefficients)
            pixels[ahead] = there.reshape(-1, 2)
        return pixels

    def rays(self, pixels: ArrayLike) -> Array:
        """Undistorted directions (n, 2), x/z and y/z, of pixels (n, 2).

        NaN where no direction leads to the pixel, as beyond where the distortion folds back.
        """
        import cv2

        given = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        if not len(given):
            return np.empty((0, 2))
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, _UNDISTORT_STEPS, 1e-12)
        directions = cv2.undistortPoints(
            given[:, None, :], self.matrix, self.coefficients, criteria=criteria
        ).reshape(-1, 2)
        back = self.project(np.column_stack([directions, np.ones(len(directions))]))
        missed = ~(np.abs(back - given).max(axis=1) < _ROUND_TRIP_PX)
        directions[missed] = np.nan
        return np.asarray(directions, dtype=np.float64)

    def scaled(self, width: int, height: int) -> "Camera":
        """Give the camera of the same photographs read at another size (same shape of picture)."""
        across, down = width / self.width, height / self.height
        covariance = self.covariance
        if covariance is not None:
            factors = np.array([across, down, across, down, 1.0, 1.0, 1.0, 1.0, 1.0])
            covariance = covariance * np.outer(factors, factors)
        return Camera(
            self.fx * across,
            self.fy * down,
            (self.cx + 0.5) * across - 0.5,
            (self.cy + 0.5) * down - 0.5,
            self.distortion,
            width,
            height,
            covariance,
        )
