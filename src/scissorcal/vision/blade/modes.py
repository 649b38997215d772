"""Common errors of all points of a measured edge: the linear response to each error source."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.priors import BladePriors
from scissorcal.vision.blade.borders import BorderPoints
from scissorcal.vision.blade.silhouette import BladeParts
from scissorcal.vision.blade.view import View

SHARP = 1.4
"""Largest blur, relative to the median, of points that determine the centreline."""

_ROUNDS = 20


class SeenBorders(NamedTuple):
    """A blade's borders in the picture; ``hole`` is None where no hole shows the pivot."""

    edge: BorderPoints
    back: BorderPoints
    hole: BorderPoints | None


class BladeFrame(NamedTuple):
    """A blade's frame on the sheet: ``pivot``, unit vectors ``axis`` and ``up``, hole radius."""

    pivot: Array
    axis: Array
    up: Array
    radius: float

    def of(self, points: Array) -> tuple[Array, Array]:
        """Stations and offsets of sheet points (n, 2)."""
        away = points - self.pivot
        return away @ self.axis, away @ self.up


def halving_stations(parts: BladeParts) -> Array:
    """Stations (201,) over which the centreline halves the blade."""
    return np.linspace(*parts.halved, 201) * parts.length


def edge_modes(
    view: View, borders: SeenBorders, frame: BladeFrame, parts: BladeParts, priors: BladePriors
) -> tuple[Array, tuple[str, ...]]:
    """Effect on the edge of one standard deviation of each common error source.

    Columns (n, k) are changes of the offset at a fixed station, at the edge's points in the order
    of ``borders.edge``; names say which source each belongs to. They come from one linear response:
    a source moves border points and pivot on the sheet; the centreline, which halves the blade,
    turns after them; and a point that moves along the edge changes the offset by the edge's slope.
    That slope is a cubic's, so that no column carries the noise of the points.
    """
    edge, back = view.to_sheet(borders.edge.pixels), view.to_sheet(borders.back.pixels)
    sides = ((edge, borders.edge), (back, borders.back))
    response = _Response(frame, *(_Side.of(frame, parts, *side) for side in sides))
    edge_out, back_out = _outward(view, borders.edge), _outward(view, borders.back)
    still = np.zeros(2)
    pivot_out = still
    if borders.hole is not None:
        place = view.to_sheet(borders.hole.pixels)
        pivot_out = _circle_follows(place, _outward(view, borders.hole), frame)
    rows: list[Array] = []
    names: list[str] = []
    for name, moved in _mapping_moves(view, borders, frame, parts):
        rows.append(response.to(*moved))
        names.append(name)
    tone = 0.01 * priors.tone_sd_percent * borders.edge.blur_px
    rows.append(response.to(tone * edge_out, tone * back_out, tone * pivot_out))
    names.append("tone")
    grain = 0.01 * priors.grain_percent
    rough = grain * float(np.median(borders.edge.sd_px))
    along = np.linspace(-1.0, 1.0, len(edge))
    rows += [
        response.to((rough * drift)[:, None] * edge_out, 0.0 * back, still)
        for drift in (np.ones_like(along), along, (3.0 * along**2 - 1.0) / 2.0)
    ]
    behind = grain * float(np.median(borders.back.sd_px))
    rows.append(response.to(0.0 * edge, behind * back_out, still))
    names += ["grain"] * 4
    for shift in _pivot_shifts(view, frame, borders, parts, grain):
        rows.append(response.to(0.0 * edge, 0.0 * back, shift))
        names.append("pivot")
    rows.append(-_turn_sd(*frame.of(back)) * response.edge.swing)
    names.append("centreline")
    return np.stack(rows, axis=1), tuple(names)


@dataclass(frozen=True)
class _Side:
    """One side of the blade: its smooth ``slope`` (n,) and ``swing`` (n,), by which its offset
    falls per radian that the axis turns, and ``weight`` (n,), its points' pull on the axis."""

    slope: Array
    swing: Array
    weight: Array

    @classmethod
    def of(
        cls, frame: BladeFrame, parts: BladeParts, points: Array, border: BorderPoints
    ) -> "_Side":
        station, offset = frame.of(points)
        slope = smooth_slope(station, offset)
        sharp = np.flatnonzero(border.softness < SHARP)
        weight = np.zeros(len(points))
        weight[sharp] = _pull(station[sharp], halving_stations(parts))
        return cls(slope, station + slope * offset, weight)

    def shifted(self, moves: Array, frame: BladeFrame) -> Array:
        """Change of the offset at a fixed station under moves (n, 2) of the points."""
        return np.asarray(moves @ frame.up - self.slope * (moves @ frame.axis))


@dataclass(frozen=True)
class _Response:
    """Linear response of the measured edge to moves of both sides' points and of the pivot."""

    frame: BladeFrame
    edge: _Side
    back: _Side

    def to(self, edge_moves: Array, back_moves: Array, pivot_move: Array) -> Array:
        """Change (n,) of the edge's offset at a fixed station, the centreline following."""
        here = self.edge.shifted(edge_moves - pivot_move, self.frame)
        there = self.back.shifted(back_moves - pivot_move, self.frame)
        # the axis turns until both sides' weighted offsets balance again
        lever = self.edge.weight @ self.edge.swing + self.back.weight @ self.back.swing
        turn = (self.edge.weight @ here + self.back.weight @ there) / lever
        return np.asarray(here - turn * self.edge.swing)


def _outward(view: View, border: BorderPoints) -> Array:
    """Moves (n, 2) on the sheet when a border moves out of the metal by a pixel."""
    return view.to_sheet(border.pixels + border.normals) - view.to_sheet(border.pixels)


def _circle_follows(hole: Array, moves: Array, frame: BladeFrame) -> Array:
    """Shift (2,) of a least-squares circle's centre by moves (n, 2) of its points."""
    radial = (hole - frame.pivot) / np.linalg.norm(hole - frame.pivot, axis=1, keepdims=True)
    design = np.column_stack([radial, np.ones(len(radial))])
    away = np.sum(radial * moves, axis=1)
    return np.asarray(np.linalg.solve(design.T @ design, design.T @ away)[:2])


def _mapping_moves(
    view: View, borders: SeenBorders, frame: BladeFrame, parts: BladeParts
) -> Iterator[tuple[str, tuple[Array, Array, Array]]]:
    """Moves of edge, back and pivot for each independent error of the mapping."""
    pivot = borders.hole.pixels if borders.hole is not None else view.to_pixels(parts.pivot[None])
    pixels = np.concatenate([borders.edge.pixels, borders.back.pixels, pivot])
    ends = np.cumsum([len(borders.edge.pixels), len(borders.back.pixels)])
    before = view.to_sheet(pixels)
    for name, values in _mapping_errors(view):
        edge, back, rest = np.split(view.to_sheet(pixels, values) - before, ends)
        if borders.hole is None:
            yield name, (edge, back, rest[0])
        else:
            yield name, (edge, back, _circle_follows(before[ends[1] :], rest, frame))


def _mapping_errors(view: View) -> list[tuple[str, Array]]:
    """Values of the mapping moved by one standard deviation of each of its independent errors.

    Those shared by all photographs come first, with what is correlated with them.
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
        moved.append(("shared mapping" if place < view.shared else view.own_error, values))
    return moved


def _pivot_shifts(
    view: View, frame: BladeFrame, borders: SeenBorders, parts: BladeParts, grain: float
) -> Array:
    """Two shifts of the pivot, one standard deviation each.

    ``grain`` is the share of a point's noise that its neighbours have too.
    """
    if borders.hole is None:
        return np.eye(2) * parts.pivot_sd
    away = view.to_sheet(borders.hole.pixels) - frame.pivot
    radial = away / np.linalg.norm(away, axis=1, keepdims=True)
    off = np.linalg.norm(away, axis=1) - frame.radius
    # neighbours along a small circle share pixels: about one in four is independent
    spread = float(np.sqrt(np.mean(off**2)))
    information = radial.T @ radial / 4.0
    pixel = float(np.median(np.linalg.norm(_outward(view, borders.hole), axis=1)))
    common = grain * float(np.median(borders.hole.sd_px)) * pixel
    covariance = np.linalg.inv(information) * spread**2 + common**2 * np.eye(2)
    return np.asarray(np.linalg.cholesky(covariance)).T


def _turn_sd(s: Array, e: Array) -> float:
    """Standard deviation (rad) of the axis by the middle between edge and back.

    ``s`` and ``e`` (n,) are the back's stations and offsets.
    """
    design = np.stack([np.ones_like(s), s, s**2, s**3], axis=1)
    off = e - design @ np.linalg.lstsq(design, e, rcond=None)[0]
    spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    stretch = 20.0 * float(np.median(np.abs(np.diff(s))) + 1e-12)
    independent = max(float(np.ptp(s)) / max(stretch, 1e-12), 2.0)
    return float(0.5 * spread / np.sqrt(independent * np.mean(s**2)))


def smooth_slope(station: Array, offset: Array) -> Array:
    """Slope (n,) of a side of the blade: that of a cubic, robust against nicks and glare.

    Any slope that follows single stretches of the points carries their noise into the modes, and
    where a mode moves points along the edge by much, as a tilt does, least squares would then take
    that noise for a measurement of the mode.
    """
    middle, reach = float(station.mean()), max(0.5 * float(np.ptp(station)), 1e-30)
    design = np.vander((station - middle) / reach, 4)
    weight = np.ones_like(offset)
    curve: Array = np.zeros(4)
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        curve = np.asarray(np.linalg.lstsq(design * root[:, None], offset * root, rcond=None)[0])
        rest = offset - design @ curve
        spread = 1.4826 * float(np.median(np.abs(rest))) + 1e-30
        weight = np.maximum(1.0 - np.minimum(np.abs(rest) / (4.7 * spread), 1.0) ** 2, 0.0) ** 2
    return np.asarray(np.polyval(np.polyder(curve), (station - middle) / reach) / reach)


def _pull(station: Array, along: Array) -> Array:
    """Weights (n,) of points in the sum over ``along`` of station times offset there."""
    order = np.argsort(station)
    s = station[order]
    above = np.clip(np.searchsorted(s, along), 1, len(s) - 1)
    gap = np.maximum(s[above] - s[above - 1], 1e-30)
    share = np.clip((along - s[above - 1]) / gap, 0.0, 1.0)
    weight = np.zeros(len(s))
    np.add.at(weight, order[above - 1], (1.0 - share) * along)
    np.add.at(weight, order[above], share * along)
    return weight
