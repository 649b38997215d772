"""Surfaces of a plate: plane, cylinder, sphere, and a height field that was probed.

All in the plate's frame: x along the cut from the near edge, y to the left of the cut, z out of
the upper face. A surface passes through the origin with its normal along +z, a probed one nearly.
"""

from scissorcal.model.surface.height_field import HeightField
from scissorcal.model.surface.probed import ProbedSurface, fit_height_field
from scissorcal.model.surface.protocol import (
    Cylinder,
    NearestPoints,
    Plane,
    Sphere,
    Surface,
    SurfacePoint,
    curvatures,
    nearest,
    normal,
)

__all__ = [
    "Cylinder",
    "HeightField",
    "NearestPoints",
    "Plane",
    "ProbedSurface",
    "Sphere",
    "Surface",
    "SurfacePoint",
    "curvatures",
    "fit_height_field",
    "nearest",
    "normal",
]
