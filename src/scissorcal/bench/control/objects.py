"""The plates of the benchmark: a true shape and path, and the surface that the filter is given."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from scissorcal.aliases import Array
from scissorcal.bench.control.world import (
    Path,
    Probe,
    Shape,
    circle,
    cylinder,
    hilly,
    plane,
    probe_cylinder,
    probe_plane,
    rim,
    sphere,
)
from scissorcal.model.surface import Cylinder, HeightField, Plane, Sphere, Surface
from scissorcal.model.surface.probed import fit_height_field

PROBE_NOISE_M = 5e-6
PROBED = 21
PROBED_TO_M = 14e-3


@dataclass(frozen=True)
class Plate:
    """A plate's true shape, the path of the tool on it, and the filter's surface.

    ``probe`` gives the true distance of a point, where the tool is controlled on the plate;
    ``axis`` (3,) that of a disc, along which nothing has to be followed.
    """

    name: str
    shape: Shape
    path: Path
    surface: Surface
    probe: Probe | None = None
    axis: Array | None = None


def plate_of(name: str) -> Plate:
    """The plate of a name: one of `PLATES`."""
    return _PLATES[name](name)


def _cap(shape: Shape, surface: Surface) -> Callable[[str], Plate]:
    return lambda name: Plate(name, shape, circle(10e-3), surface)


def _probed(name: str) -> Plate:
    return Plate(name, hilly(), circle(10e-3), _probed_surface())


@cache
def _probed_surface() -> HeightField:
    """A spline through points of the true face, probed with noise on a grid."""
    rng = np.random.default_rng(20)
    ticks = np.linspace(-PROBED_TO_M, PROBED_TO_M, PROBED)
    a, b = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    points, normals = hilly()(a, b)
    found = fit_height_field(
        points + PROBE_NOISE_M * rng.standard_normal((len(points), 1)) * normals, PROBE_NOISE_M
    )
    return found.surface


_PLATES: dict[str, Callable[[str], Plate]] = {
    "plane": lambda name: Plate(name, plane, circle(10e-3), Plane(), probe_plane),
    "cylinder 30 mm": _cap(cylinder(30e-3), Cylinder(30e-3)),
    "sphere 30 mm": _cap(sphere(30e-3), Sphere(30e-3)),
    "sphere 10 mm": lambda name: Plate(name, sphere(10e-3), circle(6e-3), Sphere(10e-3)),
    "spline": _probed,
    "disc 20 mm": lambda name: Plate(
        name,
        cylinder(20e-3),
        rim(2.0 * math.pi * 20e-3),
        Cylinder(20e-3),
        probe_cylinder(20e-3),
        np.array([1.0, 0.0, 0.0]),
    ),
}
PLATES = tuple(_PLATES)
