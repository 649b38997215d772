"""Normals, curvatures and nearest points of a surface, from its level."""

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.surface.protocol import Surface


def nearest(surface: Surface, points: ArrayLike) -> Array:
    """Nearest points (..., 3) of the surface; NaN where the search did not converge.

    ``surface.nearest_points`` also gives signed distances, and where the point is not unique.

    >>> from scissorcal.model.surface import Sphere
    >>> nearest(Sphere(radius_m=0.02), [0.0, 0.0, 0.005]).tolist()
    [0.0, 0.0, 0.0]
    """
    return surface.nearest_points(points).points


def normal(surface: Surface, points: ArrayLike) -> Array:
    """Unit normal (..., 3) out of the material at points (..., 3).

    Away from the surface it is that of the level set through the point; NaN where the gradient
    vanishes (the axis of a cylinder, the centre of a sphere).
    """
    gradient = surface.gradient(points)
    length = np.linalg.norm(gradient, axis=-1, keepdims=True)
    return np.asarray(gradient / np.where(length > 0.0, length, np.nan))


def shape_operator(surface: Surface, points: ArrayLike) -> Array:
    """Derivative of the normal along the surface, (..., 3, 3) [1/m]: P H P / abs(grad phi0).

    H is the level's Hessian, P projects onto the tangent plane. Positive along a direction in which
    the surface bulges out of the material: a sphere of radius R > 0 has P / R. Away from the
    surface it is that of the level set through the point.
    """
    unit = normal(surface, points)
    length = np.linalg.norm(surface.gradient(points), axis=-1)[..., None, None]
    across = np.eye(3) - unit[..., :, None] * unit[..., None, :]
    return np.asarray(across @ surface.hessian(points) @ across / length)


def curvatures(surface: Surface, points: ArrayLike) -> Array:
    """Principal curvatures (..., 2) [1/m] in ascending order, positive where convex.

    >>> from scissorcal.model.surface import Cylinder
    >>> curvatures(Cylinder(radius_m=0.05), [0.01, 0.0, 0.0]).tolist()
    [0.0, 20.0]
    """
    unit = normal(surface, points)
    length = np.linalg.norm(surface.gradient(points), axis=-1)
    one, other = tangents(unit)
    bend = surface.hessian(points)
    a, b, c = (
        np.einsum("...i,...ij,...j->...", left, bend, right) / length
        for left, right in ((one, one), (one, other), (other, other))
    )
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return np.stack((mean - half, mean + half), axis=-1)


def tangents(unit: Array) -> tuple[Array, Array]:
    """Two unit vectors that make a right-handed frame with ``unit`` (..., 3).

    Without a branch that loses digits: Duff et al. 2017 (http://jcgt.org/published/0006/01/01/).
    """
    x, y, z = unit[..., 0], unit[..., 1], unit[..., 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    one = np.stack((1.0 + sign * x * x * a, sign * b, -sign * x), axis=-1)
    other = np.stack((b, sign + y * y * a, -y), axis=-1)
    return one, other
