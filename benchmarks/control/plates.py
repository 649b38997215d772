"""The plates of the benchmark: a true shape and path, and the surface that the filter is given."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from benchmarks.control.world import (
    Path,
    Probe,
    Shape,
    circle,
    cylinder,
    plane,
    probe_cylinder,
    probe_plane,
    rim,
    sphere,
    wavy,
)

from scissorcal.aliases import Array
from scissorcal.model.surface import Cylinder, HeightField, Plane, Sphere, Surface
from scissorcal.model.surface.probed import fit_height_field

PROBE_NOISE_M = 5e-6


@dataclass(frozen=True)
class Plate:
    """A plate's true shape, the path of the tool on it, and the filter's surface.

    ``probe`` gives the true distance of a point, where the tool is controlled on the plate;
    ``axis`` (3,) that of a disc, along which nothing has to be followed.
    """

    shape: Shape
    path: Path
    surface: Surface
    probe: Probe | None = None
    axis: Array | None = None


@cache
def plate_of(name: str) -> Plate:
    """The plate of a name: one of `PLATES`."""
    return PLATES[name]()


def probed_surface() -> HeightField:
    """A spline through points of the wavy face, probed with noise on a grid."""
    ticks = np.linspace(-14e-3, 14e-3, 21)
    points, normals = wavy(*(grid.ravel() for grid in np.meshgrid(ticks, ticks)))
    noise = PROBE_NOISE_M * np.random.default_rng(20).standard_normal((len(points), 1))
    return fit_height_field(points + noise * normals, PROBE_NOISE_M).surface


def _disc() -> Plate:
    radius, axis = 20e-3, np.array([1.0, 0.0, 0.0])
    path, probe = rim(2.0 * math.pi * radius), probe_cylinder(radius)
    return Plate(cylinder(radius), path, Cylinder(radius), probe, axis)


PLATES: dict[str, Callable[[], Plate]] = {
    "plane": lambda: Plate(plane, circle(10e-3), Plane(), probe_plane),
    "cylinder, radius 30 mm": lambda: Plate(cylinder(30e-3), circle(10e-3), Cylinder(30e-3)),
    "sphere, radius 30 mm": lambda: Plate(sphere(30e-3), circle(10e-3), Sphere(30e-3)),
    "sphere, radius 10 mm": lambda: Plate(sphere(10e-3), circle(6e-3), Sphere(10e-3)),
    "probed face": lambda: Plate(wavy, circle(10e-3), probed_surface()),
    "rim of a disc, radius 20 mm": _disc,
}
