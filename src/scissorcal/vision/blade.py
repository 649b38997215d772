"""A blade in one photograph: its edge to a fraction of a pixel, and what makes it uncertain."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.blade_borders import BorderPoints, find_border, find_hole, fit_circle
from scissorcal.vision.blade_parts import BACK_FIRST, BACK_LAST, FIRST, LAST, BladeParts
from scissorcal.vision.blade_view import View
from scissorcal.vision.profile import Light

Array = NDArray[np.float64]

TONE_SHARE = 0.12
"""By how much of its blur a border may seem shifted, since a camera's curve is not quite sRGB's."""

GRAIN_SHARE = 0.5
"""Which part of a crossing's noise neighbours share: brushed metal's streaks run along the edge."""

_ANCHORS, _STRETCHES = 14, 30
_SHARP = 1.4
_WAVY = 0.008
"""How far, in shares of its length, a side may leave a parabola and still be the side."""


@dataclass(frozen=True)
class BladeMeasurement:
    """One blade of one photograph.

    ``station``, ``offset`` and ``sd`` (n,) are points of the edge in the blade's frame (sheet
    units: metres, or pixels without a scale), each with the noise of its own; ``modes`` (n, k) are
    what moves them together, each column by one standard deviation: the mapping, the print's
    scale, the pivot, the centreline, the tone of blurred borders, the metal's grain; ``mode_names``
    say which. ``softness`` (n,) is the blur of each point against the usual one. ``pivot_px`` and
    ``axis_px`` are for pictures.
    """

    source: str
    station: Array
    offset: Array
    sd: Array
    softness: Array
    modes: Array
    mode_names: tuple[str, ...]
    length: float
    hole_radius: float
    parts: BladeParts
    edge: BorderPoints
    metric: bool
    uncertainty: str
    pivot_px: Array
    axis_px: Array


def measure_blade(
    light: Light, view: View, parts: BladeParts, source: str, *, search: float = 0.035
) -> BladeMeasurement:
    """Measure a blade whose parts are roughly known, in the photograph's own pixels.

    Nothing is resampled: borders are crossed in the picture and their places taken to the sheet.
    What each source of error does to the edge is found by moving that source and measuring again.
    ``search`` is how far from the rough outline a border may lie, in blade lengths.
    Raises InputError where the picture is too blurred or too much of the edge is hidden.
    """
    edge = find_border(light, view, parts, parts.edge, FIRST, LAST, source, "edge", search)
    back = find_border(
        light, view, parts, parts.back, BACK_FIRST, BACK_LAST, source, "back", search
    )
    hole = find_hole(light, view, parts)
    scene = _Scene(view, parts, edge, back, hole)
    place = scene.place()
    columns, names = _modes(scene, place)
    slope = np.gradient(place.offset, place.station)
    length = float(place.length)
    keep = (place.station > 0.0) & np.isfinite(slope)
    centre = view.to_pixels((place.pivot)[None])[0]
    ahead = view.to_pixels((place.pivot + 0.5 * length * place.axis)[None])[0]
    return BladeMeasurement(
        source,
        place.station[keep],
        place.offset[keep],
        place.sd[keep],
        edge.softness[place.order][keep],
        columns[keep],
        names,
        length,
        place.radius,
        replace(parts, pivot=place.pivot, axis=place.axis, up=place.up, length=length),
        edge,
        view.metric,
        view.uncertainty,
        centre,
        ahead,
    )


@dataclass(frozen=True)
class _Scene:
    """All that was seen of a blade; `place` turns it into a blade frame and an edge in it."""

    view: View
    parts: BladeParts
    edge: BorderPoints
    back: BorderPoints
    hole: BorderPoints | None
    pivot_shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    grown_px: float = 0.0
    grain: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    values: Array | None = None

    def place(self) -> "_Place":
        along = np.linspace(-1.0, 1.0, len(self.edge.pixels))
        level, ramp, bow, behind = self.grain
        edge = self._on_sheet(self.edge, level + ramp * along + bow * (3.0 * along**2 - 1.0) / 2.0)
        back = self._on_sheet(self.back, behind)
        if self.hole is None:
            pivot, radius = self._moved_pivot(), 0.0
        else:
            pivot, radius = fit_circle(self._on_sheet(self.hole))
        pivot = pivot + np.asarray(self.pivot_shift)
        axis, up = self.parts.axis, self.parts.up
        sides = [
            points[border.softness < _SHARP]
            for points, border in ((edge, self.edge), (back, self.back))
        ]
        for _ in range(3):
            axis, up = _halved(sides, pivot, axis, up, self.parts.length)
        axis, up = _turned(axis, up, self.turn)
        away = edge - pivot
        station, offset = away @ axis, away @ up
        order = np.argsort(station)
        sd = self._sd(edge, up)
        tip = float(self.parts.length + (self.parts.pivot - pivot) @ axis)
        return _Place(station[order], offset[order], sd[order], pivot, axis, up, radius, tip, order)

    def _on_sheet(self, border: BorderPoints, drift: Array | float = 0.0) -> Array:
        out = np.broadcast_to(self.grown_px + np.asarray(drift), len(border.pixels))
        return self.view.to_sheet(border.pixels + out[:, None] * border.normals, self.values)

    def _moved_pivot(self) -> Array:
        if self.values is None:
            return self.parts.pivot
        seen = self.view.to_pixels(self.parts.pivot[None])
        return np.asarray(self.view.to_sheet(seen, self.values)[0])

    def _sd(self, edge: Array, up: Array) -> Array:
        """Noise along ``up`` in sheet units, from that along the normals in pixels."""
        moved = self.view.to_sheet(self.edge.pixels + self.edge.normals, self.values)
        return np.asarray(np.abs((moved - edge) @ up) * self.edge.sd_px)


@dataclass(frozen=True)
class _Place:
    station: Array
    offset: Array
    sd: Array
    pivot: Array
    axis: Array
    up: Array
    radius: float
    length: float
    order: NDArray[np.int64]


def _modes(scene: _Scene, place: _Place) -> tuple[Array, tuple[str, ...]]:
    """What one standard deviation of each shared source of error does to the edge, (n, k)."""
    rows: list[Array] = []
    names: list[str] = []

    def add(name: str, changed: _Scene, factor: float = 1.0) -> None:
        there = changed.place()
        moved = np.interp(place.station, there.station, there.offset)
        rows.append((moved - place.offset) * factor)
        names.append(name)

    for name, values in _mapping_modes(scene.view):
        add(name, replace(scene, values=values))
    shared = TONE_SHARE * scene.edge.blur_px
    add("tone", replace(scene, grown_px=shared))
    rough = GRAIN_SHARE * float(np.median(scene.edge.sd_px))
    behind = GRAIN_SHARE * float(np.median(scene.back.sd_px))
    for index, size in enumerate((rough, rough, rough, behind)):
        drift = [0.0, 0.0, 0.0, 0.0]
        drift[index] = size
        add("grain", replace(scene, grain=(drift[0], drift[1], drift[2], drift[3])))
    for row in _pivot_modes(scene, place):
        add("pivot", replace(scene, pivot_shift=(float(row[0]), float(row[1]))))
    add("centreline", replace(scene, turn=_turn_sd(scene, place)))
    return np.stack(rows, axis=1), tuple(names)


def _mapping_modes(view: View) -> list[tuple[str, Array]]:
    """Values of the mapping moved by one standard deviation of each of its independent errors.

    Those shared by all photographs come first, and take with them what follows from them.
    """
    count = len(view.values)
    order = np.r_[count - view.shared : count, 0 : count - view.shared]
    covariance = view.covariance[np.ix_(order, order)]
    scale = np.sqrt(np.diag(covariance))
    used = np.flatnonzero(scale > 0.0)
    if not len(used):
        return []
    size = scale[used]
    correlation = covariance[np.ix_(used, used)] / np.outer(size, size)
    root = size[:, None] * np.linalg.cholesky(correlation + 1e-9 * np.eye(len(used)))
    moved = []
    for column, place in enumerate(used):
        values = view.values.copy()
        values[order[used]] += root[:, column]
        moved.append(("shared mapping" if place < view.shared else "mapping", values))
    return moved


def _pivot_modes(scene: _Scene, place: _Place) -> Array:
    """Two shifts of the pivot, one standard deviation each."""
    if scene.hole is None:
        return np.eye(2) * scene.parts.pivot_sd
    there = scene._on_sheet(scene.hole)
    away = there - place.pivot
    radial = away / np.linalg.norm(away, axis=1, keepdims=True)
    off = np.linalg.norm(away, axis=1) - place.radius
    # neighbours along a small circle share their pixels: about one in four says something new
    spread = float(np.sqrt(np.mean(off**2)))
    information = radial.T @ radial / 4.0
    moved = scene.view.to_sheet(scene.hole.pixels + scene.hole.normals, scene.values) - there
    pixel = float(np.median(np.linalg.norm(moved, axis=1)))
    grain = GRAIN_SHARE * float(np.median(scene.hole.sd_px)) * pixel
    covariance = np.linalg.inv(information) * spread**2 + grain**2 * np.eye(2)
    return np.asarray(np.linalg.cholesky(covariance)).T


def _turn_sd(scene: _Scene, place: _Place) -> float:
    """How well the middle between edge and back fixes the axis, in radians."""
    view = scene.view
    back = view.to_sheet(scene.back.pixels)
    s, e = (back - place.pivot) @ place.axis, (back - place.pivot) @ place.up
    design = np.stack([np.ones_like(s), s, s**2, s**3], axis=1)
    off = e - design @ np.linalg.lstsq(design, e, rcond=None)[0]
    spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    stretch = 20.0 * float(np.median(np.abs(np.diff(s))) + 1e-12)
    independent = max(float(np.ptp(s)) / max(stretch, 1e-12), 2.0)
    return float(0.5 * spread / np.sqrt(independent * np.mean(s**2)))


def _halved(
    sides: list[Array], pivot: Array, axis: Array, up: Array, length: float
) -> tuple[Array, Array]:
    """The axis turned so that it halves the way between both sides of the blade."""
    along = np.linspace(BACK_FIRST, BACK_LAST, 201) * length
    middle = np.zeros_like(along)
    for side in sides:
        away = side - pivot
        middle += 0.5 * _smooth(away @ axis, away @ up, along)
    return _turned(axis, up, float(np.sum(middle * along) / np.sum(along**2)))


def _smooth(station: Array, offset: Array, along: Array) -> Array:
    """A side of the blade at places along it, whatever nicks and glare take out of it.

    Of all parabolas through three of the side's stretches the one that most stretches lie nearest
    to tells what belongs to it; medians of that are the side, and the parabola where there are
    none.
    """
    here = (station > along[0]) & (station < along[-1])
    s, e = station[here], offset[here]
    middle = 0.5 * (along[0] + along[-1])
    anchors = np.array(
        [
            (np.median(x), np.median(y))
            for x, y in zip(np.array_split(s, _ANCHORS), np.array_split(e, _ANCHORS), strict=True)
            if len(x)
        ]
    )
    triples = np.array(list(combinations(range(len(anchors)), 3)))
    powers = np.vander(anchors[:, 0] - middle, 3)
    curves = np.linalg.solve(powers[triples], anchors[triples, 1][..., None])[..., 0]
    off = np.abs(anchors[:, 1] - curves @ powers.T)
    curve = curves[np.argmin(np.quantile(off, 0.6, axis=1))]
    for _ in range(4):
        rest = np.abs(e - np.polyval(curve, s - middle))
        usual = 4.0 * 1.4826 * float(np.quantile(rest, 0.4))
        kept = rest < max(usual, _WAVY * float(along[-1]))
        curve = np.polyfit(s[kept] - middle, e[kept], 2)
    cells = np.linspace(along[0], along[-1], _STRETCHES + 1)
    index = np.digitize(s, cells) - 1
    places = 0.5 * (cells[1:] + cells[:-1])
    values = np.polyval(curve, places - middle)
    for cell in range(_STRETCHES):
        own = kept & (index == cell)
        if own.sum() >= 2:
            shift = e[own] - np.polyval(curve, s[own] - middle)
            values[cell] += float(np.median(shift))
    return np.asarray(np.interp(along, places, values))


def _turned(axis: Array, up: Array, angle: float) -> tuple[Array, Array]:
    c, s = np.cos(angle), np.sin(angle)
    return c * axis + s * up, c * up - s * axis
