"""What every surface gives: its level, the level's derivatives, and its nearest points."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array


class SurfacePoint(NamedTuple):
    """Level phi0 [m] at one point, its gradient (3,) and its Hessian (3, 3) [1/m].

    The arrays may be shared between calls: do not write into them.
    """

    level: float
    gradient: Array
    hessian: Array


class NearestPoints(NamedTuple):
    """Nearest points of a surface.

    ``points`` (..., 3); NaN where the search did not converge. ``distance`` (...) [m] is signed as
    the level, positive outside the material. ``unique`` (...) is false where another point of the
    surface is as near, as at the centre of a sphere; ``points`` then holds one of them.
    ``converged`` (...).
    """

    points: Array
    distance: Array
    unique: NDArray[np.bool_]
    converged: NDArray[np.bool_]


class Surface(Protocol):
    """A surface as the zero of a twice differentiable level phi0(p), in the plate's frame.

    The level is positive outside the material. At the origin it is 0 with the gradient (0, 0, 1),
    of a probed surface nearly so. It is no distance: phi0 / abs(grad phi0) is one to first order.
    ``level``, ``gradient`` and ``hessian`` take points (..., 3) in metres, real or complex; ``at``
    gives all three at one point (3,) in microseconds.
    """

    def at(self, point: Array) -> SurfacePoint: ...

    def level(self, points: ArrayLike) -> Array: ...

    def gradient(self, points: ArrayLike) -> Array: ...

    def hessian(self, points: ArrayLike) -> Array: ...

    def nearest_points(self, points: ArrayLike) -> NearestPoints: ...


def as_points(points: ArrayLike) -> Array:
    """Points (..., 3) as an array; complex ones stay complex, for derivatives by complex steps."""
    array = np.asarray(points)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points need the shape (..., 3), not {array.shape}")
    return array if np.iscomplexobj(array) else array.astype(np.float64, copy=False)
