"""The rendered camera: where a point of the world falls on the picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array


@dataclass(frozen=True)
class SimPose:
    """Takes points of a plane's frame into the camera's: ``rotation`` (3, 3), ``shift_m`` (3,)."""

    rotation: Array
    shift_m: Array

    @classmethod
    def looking_at(
        cls,
        target_m: tuple[float, float],
        distance_m: float,
        *,
        tilt: float = 0.0,
        azimuth: float = 0.0,
        turn: float = 0.0,
    ) -> "SimPose":
        """Look at a place of the plane from a distance.

        Square-on where ``tilt`` is 0; else leaned by it towards ``azimuth``, and turned by ``turn``
        about the line of sight; all in radians.
        """
        to_azimuth = about(2, azimuth)
        rotation = about(2, turn) @ to_azimuth @ about(1, tilt) @ to_azimuth.T
        target = np.array([target_m[0], target_m[1], 0.0])
        return cls(rotation, np.array([0.0, 0.0, distance_m]) - rotation @ target)


@dataclass(frozen=True)
class Lens:
    """Focal length and centre in pixels, and Brown's distortion (k1, k2, p1, p2, k3)."""

    focal_px: float
    centre_px: tuple[float, float]
    width: int
    height: int
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def sees(self, points: ArrayLike, pose: SimPose) -> Array:
        """Pixels (n, 2) of points (n, 2) in the plane of ``pose``; NaN behind the camera.

        Pixels have their first centre at (0, 0).
        """
        flat = np.asarray(points, dtype=np.float64)
        x, y, z = (flat @ pose.rotation[:, :2].T + pose.shift_m).T
        ahead = z > 1e-6
        depth = np.where(ahead, z, np.nan)
        return self.bend(np.column_stack([x / depth, y / depth]))

    def bend(self, directions: Array) -> Array:
        """Pixels of undistorted directions (n, 2), x/z and y/z."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = directions[:, 0], directions[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bent_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.column_stack(
            [
                self.focal_px * bent_x + self.centre_px[0],
                self.focal_px * bent_y + self.centre_px[1],
            ]
        )


def about(axis: int, angle: float) -> Array:
    """Rotation (3, 3) by an angle (rad) about the axis x, y or z (0, 1 or 2)."""
    turned = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned[first, first] = turned[second, second] = np.cos(angle)
    turned[second, first] = np.sin(angle)
    turned[first, second] = -np.sin(angle)
    return turned
