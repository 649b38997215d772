"""The cutting edge: its shape on the blade, and its height over the cut when the blade turns."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

NEWTON_STEPS = 30


@dataclass(frozen=True)
class Edge:
    """One blade's edge e(s), offset from its centreline against station s from the pivot.

    ``line``: e = offset + s tan(taper). ``arc``: e = offset + s tan(taper) + curvature s^2 / 2,
    a parabola in the place of a circular arc of that curvature: without taper they are 4 um apart
    at 75 mm for a curvature of 1 /m.

    >>> float(Edge("line", offset_m=-0.008, taper_rad=0.0, length_m=0.07).offset_at(0.03))
    -0.008
    """

    family: Literal["line", "arc"]
    offset_m: float
    taper_rad: float
    length_m: float
    curvature_per_m: float = 0.0

    def offset_at(self, station: ArrayLike) -> Array:
        """Offset e(s) in metres, same shape as ``station``."""
        s = np.asarray(station, dtype=np.float64)
        return np.asarray(
            self.offset_m + s * (np.tan(self.taper_rad) + 0.5 * self.curvature_per_m * s)
        )

    def slope_at(self, station: ArrayLike) -> Array:
        """Slope e'(s) = tan(alpha(s)), same shape as ``station``."""
        s = np.asarray(station, dtype=np.float64)
        return np.asarray(np.tan(self.taper_rad) + self.curvature_per_m * s)


@dataclass(frozen=True)
class EdgeView:
    """The edge as the plate sees it at one place: all fields share one shape.

    ``height`` is phi(x, theta) in metres, ``slope`` is tan(psi) = d(phi)/dx, ``station`` the place
    on the blade that stands over x, and ``lever`` = x + phi tan(psi) = d(phi)/d(beta) at fixed x.
    """

    height: Array
    slope: Array
    station: Array
    lever: Array


def edge_height(edge: Edge, contact: ArrayLike, blade_angle: ArrayLike) -> EdgeView:
    """Height and slope of the turned edge over ``contact``.

    Solves x = s cos(beta) - e(s) sin(beta) for s by Newton steps, which are exact at once for a
    straight edge; phi = s sin(beta) + e(s) cos(beta). ``contact`` (m) and ``blade_angle`` (rad)
    broadcast. Beyond the blade's ends the edge is continued smoothly; whoever asks decides what a
    contact beyond the tip means.
    """
    x, beta = np.broadcast_arrays(
        np.asarray(contact, dtype=np.float64), np.asarray(blade_angle, dtype=np.float64)
    )
    sine, cosine = np.sin(beta), np.cos(beta)
    station = _station_over(edge, x, sine, cosine)
    offset, taper = edge.offset_at(station), edge.slope_at(station)
    height = station * sine + offset * cosine
    slope = (sine + taper * cosine) / (cosine - taper * sine)
    return EdgeView(height, slope, station, x + height * slope)


def _station_over(edge: Edge, x: Array, sine: Array, cosine: Array) -> Array:
    tangent = np.tan(edge.taper_rad)
    station: Array = (x + edge.offset_m * sine) / (cosine - tangent * sine)
    if edge.curvature_per_m == 0.0:
        return station
    for _ in range(NEWTON_STEPS):
        residual = station * cosine - edge.offset_at(station) * sine - x
        step = residual / (cosine - edge.slope_at(station) * sine)
        station = station - step
        if np.all(np.abs(step) <= 1e-15 + 1e-14 * np.abs(station)):
            break
    return station
