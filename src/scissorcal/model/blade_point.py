"""Kinematics of a point of the moving blade: where it is, and how the two axes move it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.checks import check_moving_blades, check_numbers
from scissorcal.model.edge import Edge


@dataclass(frozen=True)
class BladePoint:
    """A point of the upper blade, moved by the rig's axes q = (opening theta, advance x_n).

    p(q) = (x_n + s cos(beta) - e sin(beta), s sin(beta) + e cos(beta), 0) m, beta = theta / m,

    in the rig's plane: x along the cut, y up, the pivot at (x_n, 0, 0). ``station_m`` s and
    ``offset_m`` e are the point's place on the blade, along its centreline from the pivot and
    across it; ``moving_blades`` m is 1 or 2. The blade's tip is the station of the blade's length
    (:meth:`on_edge`).

    ``q`` is (..., 2), in rad and m. Complex values pass through, for derivatives by a complex step
    (doi:10.1137/S003614459631241X). ModelError for a number of moving blades other than 1 or 2, and
    for a place that is not finite.

    >>> tip = BladePoint(station_m=0.07, offset_m=-0.008, moving_blades=1)
    >>> tip.place([0.0, -0.06])
    array([ 0.01 , -0.008,  0.   ])
    >>> tip.jacobian([0.0, -0.06])
    array([[0.008, 1.   ],
           [0.07 , 0.   ],
           [0.   , 0.   ]])
    """

    station_m: float
    offset_m: float
    moving_blades: int

    def __post_init__(self) -> None:
        check_moving_blades(self.moving_blades)
        check_numbers("the station of a point on the blade (m)", self.station_m)
        check_numbers("the offset of a point on the blade (m)", self.offset_m)

    @classmethod
    def on_edge(cls, edge: Edge, station_m: float, moving_blades: int) -> "BladePoint":
        """The edge's point at a station; at ``edge.length_m`` it is the blade's tip.

        The edge is one edge, not draws of it.
        """
        return cls(station_m, float(edge.offset_at(station_m)), moving_blades)

    def place(self, q: ArrayLike) -> Array:
        """Where the point is, p(q) in metres, shape (..., 3)."""
        advance = np.asarray(q)[..., 1]
        along, up = self._from_pivot(q)
        return np.stack([advance + along, up, np.zeros_like(up)], axis=-1)

    def jacobian(self, q: ArrayLike) -> Array:
        """J = dp/dq, shape (..., 3, 2): m/rad in the first column, 1 in the second."""
        along, up = self._from_pivot(q)
        zero, one = np.zeros_like(up), np.ones_like(up)
        rows = [[-up / self.moving_blades, one], [along / self.moving_blades, zero], [zero, zero]]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    def _from_pivot(self, q: ArrayLike) -> tuple[Array, Array]:
        """The point seen from the pivot: along the cut and up, in metres."""
        angle = np.asarray(q)[..., 0] / self.moving_blades
        sine, cosine = np.sin(angle), np.cos(angle)
        along = self.station_m * cosine - self.offset_m * sine
        return along, self.station_m * sine + self.offset_m * cosine
