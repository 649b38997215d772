"""Blades with exactly known edges, for rendering."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.vision.sim.lens import SimPose
from scissorcal.vision.sim.photograph import PaintLayer

STEEL = 0.28
_SCREW = 0.12
_STEP_M = 1e-4
_ROUND = np.linspace(0.0, 2.0 * np.pi, 241)[:-1]


@dataclass(frozen=True)
class Nick:
    """A notch in the edge: where from the pivot, how wide and how deep."""

    station_m: float
    width_m: float
    depth_m: float


@dataclass(frozen=True)
class BladeShape:
    """One blade in its own frame: x from the pivot to the tip, the edge below, the back above.

    The edge is ``offset + s tan(taper) + curvature s^2/2 + bend s^3/6 + wave sin(2 pi s / wave
    length + phase)``, in metres; the back is a straight line that rounds down to the tip over the
    last ``tip_share`` of the blade. Behind the pivot the body ends round at ``-tang_m``.
    """

    length_m: float = 0.075
    offset_m: float = -0.008
    taper_rad: float = 0.035
    curvature_per_m: float = 0.0
    bend_per_m2: float = 0.0
    wave_m: float = 0.0
    wave_length_m: float = 0.03
    wave_phase: float = 0.0
    back_m: float = 0.008
    back_slope: float = -0.035
    tip_share: float = 0.15
    tang_m: float = 0.016
    hole_m: float = 0.003
    nicks: tuple[Nick, ...] = ()

    def edge_at(self, station: ArrayLike, *, nicked: bool = False) -> Array:
        """Offset of the edge at stations."""
        s = np.asarray(station, dtype=np.float64)
        e = self.offset_m + s * np.tan(self.taper_rad)
        e = e + self.curvature_per_m * s**2 / 2.0 + self.bend_per_m2 * s**3 / 6.0
        e = e + self.wave_m * np.sin(2.0 * np.pi * s / self.wave_length_m + self.wave_phase)
        if nicked:
            for nick in self.nicks:
                across = (s - nick.station_m) / (0.5 * nick.width_m)
                e = e + nick.depth_m * np.maximum(1.0 - across**2, 0.0)
        return np.asarray(e)

    def back_at(self, station: ArrayLike) -> Array:
        """Offset of the back at stations."""
        s = np.asarray(station, dtype=np.float64)
        straight = self.back_m + self.back_slope * s
        near = np.clip((s / self.length_m - 1.0 + self.tip_share) / self.tip_share, 0.0, 1.0)
        edge = self.edge_at(s)
        return np.asarray(edge + (straight - edge) * np.sqrt(1.0 - near**2))

    def centreline_turn(self) -> float:
        """How far this frame must be turned for its x axis to halve the blade, in radians.

        Halving means: least squares through the pivot over 30 to 80 % of the blade's length.
        """
        turn = 0.0
        s = np.linspace(0.0, self.length_m, 4001)
        for _ in range(6):
            c, n = np.cos(turn), np.sin(turn)
            along = np.linspace(0.3, 0.8, 501) * self.length_m
            lower, upper = (
                np.interp(along, c * s + n * y, c * y - n * s)
                for y in (self.edge_at(s), self.back_at(s))
            )
            middle = 0.5 * (lower + upper)
            turn += float(np.arctan(np.sum(middle * along) / np.sum(along**2)))
        return turn

    def outlines(self, *, tail: Array | None = None) -> list[Array]:
        """The body's outline and the pivot's hole, polygons in the blade's frame.

        ``tail`` (n, 2) replaces the round end behind the pivot, from the back to the edge.
        """
        stop = self.length_m * (1.0 - 1e-9)
        start = -self.tang_m
        s = np.linspace(start, stop, int((stop - start) / _STEP_M))
        fine = stop - (stop - 0.8 * stop) * np.linspace(1.0, 0.0, 600) ** 2
        s = np.union1d(s, fine)
        lower = np.column_stack([s, self.edge_at(s, nicked=True)])
        upper = np.column_stack([s, self.back_at(s)])[::-1]
        if tail is None:
            middle = 0.5 * (lower[0] + upper[-1])
            half = 0.5 * (upper[-1, 1] - lower[0, 1])
            turn = np.linspace(0.5, 1.5, 121)[1:-1] * np.pi
            tail = middle + half * np.column_stack([np.cos(turn), np.sin(turn)])
        outline = np.vstack([lower, upper, tail])
        if self.hole_m <= 0.0:
            return [outline]
        return [outline, self.hole_m * np.column_stack([np.cos(_ROUND), -np.sin(_ROUND)])]


def blade_layer(
    shape: BladeShape,
    pose: SimPose,
    pivot_m: tuple[float, float],
    turn: float = 0.0,
    **look: Any,
) -> PaintLayer:
    """One blade on a sheet: its pivot at ``pivot_m`` of the sheet's frame, turned by ``turn``.

    Unturned, it points along the sheet's x axis with its edge towards +y, which is downward in
    print. ``look`` are fields of `PaintLayer`.
    """
    look = {"reflectance": STEEL, "brushed": 0.04, "grain": turn, **look}
    outlines = [on_sheet(outline, pivot_m, turn) for outline in shape.outlines()]
    return PaintLayer(outlines, pose, **look)


def scissors_layers(
    upper: BladeShape,
    lower: BladeShape,
    opening: float,
    pose: SimPose,
    pivot_m: tuple[float, float],
    turn: float = 0.0,
    *,
    rings: bool = True,
    **look: Any,
) -> list[PaintLayer]:
    """Both blades, open by ``opening`` about one pivot, with ring handles behind it.

    Each blade is turned away from the common axis by half the opening; its handle lies beyond the
    pivot on the other side. A dark screw fills the upper blade's hole.
    """
    look = {"reflectance": STEEL, "brushed": 0.04, **look}
    layers = []
    for shape, side in ((replace(lower, hole_m=0.0), -1.0), (upper, 1.0)):
        tail = _handle(shape) if rings else None
        outlines = shape.outlines(tail=tail)
        if rings:
            outlines.append(_ring_hole())
        placed = []
        for outline in outlines:
            mirrored = outline * (1.0, side)
            mirrored = mirrored if side > 0 else mirrored[::-1]
            placed.append(on_sheet(mirrored, pivot_m, turn - 0.5 * side * opening))
        layers.append(PaintLayer(placed, pose, **{"grain": turn - 0.5 * side * opening, **look}))
    screw = 0.9 * upper.hole_m * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
    layers.append(PaintLayer([screw + np.asarray(pivot_m)], pose, _SCREW))
    return layers


def on_sheet(points: ArrayLike, pivot_m: tuple[float, float], turn: float) -> Array:
    """Take points of a blade's frame, y upward, to the sheet's, whose y points down."""
    c, s = np.cos(turn), np.sin(turn)
    flipped = np.asarray(points, dtype=np.float64) * (1.0, -1.0)
    return np.asarray(flipped @ np.array([[c, s], [-s, c]]) + np.asarray(pivot_m))


_RING = (-0.075, -0.022, 0.022, 0.015)
"""Centre x, y and half axes of a handle's ring in the blade's frame."""


def _handle(shape: BladeShape) -> Array:
    """From the back behind the pivot around the ring to the edge's side."""
    x, y, along, across = _RING
    start = -shape.tang_m
    turn = np.linspace(0.35, 2.0 * np.pi - 0.35, 121)
    ring = np.column_stack([x + along * np.cos(turn), y + across * np.sin(turn)])
    back = np.array([[start - 0.004, float(shape.back_at(start)) - 0.003]])
    edge = np.array([[start - 0.004, float(shape.edge_at(start)) - 0.001]])
    return np.vstack([back, ring, edge])


def _ring_hole() -> Array:
    x, y, along, across = _RING
    turn = -_ROUND
    inner = 0.68
    return np.column_stack([x + inner * along * np.cos(turn), y + inner * across * np.sin(turn)])
