"""Points spread evenly over the opening, rate and contact of a scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.package.manifest import Ranges

NOTHING_TOUCHED = (
    "Nowhere in the scene do the blades touch the material, so nothing can be rendered: "
    "check scene.opening_deg and scene.contact_mm against rig.edge in the recipe."
)
FELT_SHARE = 0.05
"""Torques below this share of the scene's largest are not held to the tolerance."""

_GOLDEN = 1.2207440846057596
"""Root of x^4 = x + 1: its inverse powers spread points evenly in three dimensions (the R3
sequence of Roberts 2018, a generalised golden ratio)."""


@dataclass(frozen=True)
class Points:
    """Places in a scene: three arrays of shape (n,), the rate with its sign."""

    opening: Array
    opening_rate: Array
    contact: Array

    def at(self, rows: NDArray[np.int64]) -> "Points":
        """Some of the points."""
        return Points(self.opening[rows], self.opening_rate[rows], self.contact[rows])

    def joined(self, other: "Points") -> "Points":
        """These points and others."""
        return Points(
            np.concatenate([self.opening, other.opening]),
            np.concatenate([self.opening_rate, other.opening_rate]),
            np.concatenate([self.contact, other.contact]),
        )


def spread_points(scene: Ranges, count: int, slowest: float = 0.0) -> Points:
    """Spread ``count`` points over a scene, and a quarter as many over its faces and corners.

    Half of the rates close (negative), half open. No rate is slower than ``slowest``. The points
    follow from ``count`` alone, and share no coordinate with any table's knots but by accident.
    """
    inner = _sequence(count)
    outer = _sequence(count // 4, start=count)
    face = np.arange(len(outer)) % 3
    rows = np.arange(len(outer))
    outer[rows, face] = np.round(outer[rows, face])
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    unit = np.concatenate([inner, outer, corners])
    low, high = (
        max(scene.opening_rate_rad_per_s[0], slowest),
        max(scene.opening_rate_rad_per_s[1], slowest),
    )
    speed = low + unit[:, 1] * (high - low)
    sign = np.where(np.arange(len(unit)) % 2 == 0, -1.0, 1.0)
    return Points(
        _scaled(scene.opening_rad, unit[:, 0]), sign * speed, _scaled(scene.contact_m, unit[:, 2])
    )


def nearby_points(
    scene: Ranges, centres: Points, count: int, reach: float, slowest: float
) -> Points:
    """Spread ``count`` points around each centre, up to ``reach`` of each range away from it.

    All stay within the scene and no slower than ``slowest``; directions of motion are kept.
    """
    steps = np.tile(reach * (2.0 * _sequence(count) - 1.0), (len(centres.opening), 1))
    wide = Points(
        *(
            np.repeat(values, count)
            for values in (centres.opening, centres.opening_rate, centres.contact)
        )
    )
    low, high = (
        max(scene.opening_rate_rad_per_s[0], slowest),
        max(scene.opening_rate_rad_per_s[1], slowest),
    )
    speed = np.abs(wide.opening_rate) + steps[:, 1] * (high - low)
    return Points(
        np.clip(
            wide.opening + steps[:, 0] * (scene.opening_rad[1] - scene.opening_rad[0]),
            *scene.opening_rad,
        ),
        np.sign(wide.opening_rate) * np.clip(speed, low, high),
        np.clip(
            wide.contact + steps[:, 2] * (scene.contact_m[1] - scene.contact_m[0]), *scene.contact_m
        ),
    )


def _sequence(count: int, start: int = 0) -> Array:
    steps = 1.0 / _GOLDEN ** np.arange(1, 4)
    return np.asarray((0.5 + np.arange(start, start + count)[:, None] * steps) % 1.0)


def _scaled(span: tuple[float, float], share: Array) -> Array:
    return np.asarray(span[0] + share * (span[1] - span[0]))
