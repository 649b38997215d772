"""True faces of plates, by rotations: no level is solved and no polynomial is shared."""

from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array


@dataclass(frozen=True)
class Shape:
    """A face with its apex at the origin and its normal along +z there.

    ``radius_m`` bends it along y, and along x as well where ``ball``; the face is walked by arcs
    (a, b) in metres from the apex. ``reach_m`` is how far the tip goes.
    """

    radius_m: float = inf
    ball: bool = False
    reach_m: float = 10e-3

    def walk(self, arcs_m: Array) -> tuple[Array, Array, Array]:
        """Points (n, 3), normals (n, 3) and frames (n, 3, 3: tangents, normal) at arcs (n, 2)."""
        a, b = np.asarray(arcs_m, dtype=float).T
        zero = np.zeros_like(a)
        lean = a / self.radius_m if self.ball else zero
        turn = Rotation.from_rotvec(np.stack([-b / self.radius_m, lean, zero], axis=1))
        axes = turn.as_matrix()
        if self.radius_m == inf:
            points = np.stack([a, b, zero], axis=1)
        else:
            points = self.radius_m * (axes[:, :, 2] - np.array([0.0, 0.0, 1.0]))
            if not self.ball:
                points[:, 0] = a
        return points, axes[:, :, 2], axes


SHAPES = {
    "plane": Shape(),
    "cylinder 30 mm": Shape(30e-3),
    "sphere 30 mm": Shape(30e-3, ball=True),
}
