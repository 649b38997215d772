"""Intervals of what a model's step computes, over boxes of the blade's angle and station.

A box holds every angle beta and station s between its ends; each interval contains every value that
the tables, as cubics in exact arithmetic, have in it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import ModelTables, Table
from scissorcal.model.curvature import Span
from scissorcal.package.proved_tables import Profile

Indices = NDArray[np.int64]

STEEPEST = 0.05
"""Least run of the edge per length, as in the kernel: below, an edge stands upright."""
COARSER = 1.05
"""Ratio of neighbouring stations beyond 1.2 times the farthest contact: boxes may be longer."""
LEAST_M = 1e-3
"""The nearest station from which that ratio counts."""
PARTS = 16
"""Cells of the response's slope between two knots."""


@dataclass(frozen=True)
class Boxes:
    """Boxes (n,): of each its bin of openings, its stretch of the edge, angles and stations.

    Within ``stretch`` the edge is one cubic; -1 lies before the table, its last knot beyond it.
    """

    bin: Indices
    stretch: Indices
    beta: Span
    station: Span

    def where(self, chosen: NDArray[np.bool_]) -> "Boxes":
        """Some of them."""
        return Boxes(
            self.bin[chosen],
            self.stretch[chosen],
            part(self.beta, chosen),
            part(self.station, chosen),
        )

    def quartered(self) -> "Boxes":
        """Each as four, halved in both directions."""
        angles, stations = _halves(self.beta), _halves(self.station)
        pairs = [(angle, station) for angle in angles for station in stations]
        return Boxes(
            np.tile(self.bin, 4),
            np.tile(self.stretch, 4),
            _joined([angle for angle, _ in pairs]),
            _joined([station for _, station in pairs]),
        )


@dataclass(frozen=True)
class Stand:
    """How the edge stands in each box: arrays of intervals, and whether it stands at all.

    ``x``, ``y`` where it is, ``slope`` tan(psi), ``lever`` x + y tan(psi), ``turn``
    1 + tan(psi)^2 + y d(tan(psi))/dx, ``bend`` d(tan(psi))/dx, ``taper`` e', ``twist`` e'' / run.
    """

    stands: NDArray[np.bool_]
    x: Span
    y: Span
    slope: Span
    lever: Span
    turn: Span
    bend: Span
    taper: Span
    twist: Span


class EdgeOver:
    """A table of the edge over boxes."""

    def __init__(self, table: Table) -> None:
        self.knots, self.values, self.slopes = _float64(table)
        self.width, self.first, self.second, self.third = _cubics(table)

    def stretches(self, stations: Array) -> Indices:
        """In which cubic each station lies."""
        last = len(self.width)
        return np.clip(np.searchsorted(self.knots, stations, side="right") - 1, -1, last)

    def stand(self, boxes: Boxes) -> Stand:
        """How the edge stands in each box."""
        sine = Span.between(np.sin(boxes.beta.low), np.sin(boxes.beta.high))
        cosine = Span.between(np.cos(boxes.beta.low), np.cos(boxes.beta.high))
        station = boxes.station
        offset, taper, bend = self._over(boxes)
        run = cosine - taper * sine
        stands = run.high > STEEPEST
        per_run = Span(np.maximum(run.low, STEEPEST), np.maximum(run.high, STEEPEST)).inverse()
        slope = (sine + taper * cosine) * per_run
        y = station * sine + offset * cosine
        twist = bend * per_run
        bent = twist * square(per_run)
        return Stand(
            stands,
            station * cosine - offset * sine,
            y,
            slope,
            (station + offset * taper) * per_run,
            square(slope) + 1.0 + y * bent,
            bent,
            taper,
            twist,
        )

    def _over(self, boxes: Boxes) -> tuple[Span, Span, Span]:
        """Intervals of e, e' and e'': chords between the ends, and what a curve strays off them."""
        last = len(self.width)
        inside = np.clip(boxes.stretch, 0, last - 1)
        straight = (boxes.stretch < 0) | (boxes.stretch >= last)
        end = np.where(boxes.stretch < 0, 0, last)
        ends: list[tuple[Array, Array, Array]] = []
        for place in (boxes.station.low, boxes.station.high):
            w = self.width[inside]
            t = (place - self.knots[inside]) / w
            first, second, third = self.first[inside], self.second[inside], self.third[inside]
            value = self.values[inside] + t * (first + t * (second + t * third))
            slope = (first + t * (2.0 * second + 3.0 * t * third)) / w
            bend = (2.0 * second + 6.0 * t * third) / w**2
            on = self.values[end] + self.slopes[end] * (place - self.knots[end])
            ends.append(
                (
                    np.where(straight, on, value),
                    np.where(straight, self.slopes[end], slope),
                    np.where(straight, 0.0, bend),
                )
            )
        offset, taper, curve = (Span.between(one, two) for one, two in zip(*ends, strict=True))
        stray = (boxes.station.high - boxes.station.low) ** 2 / 8.0
        jerk = np.where(straight, 0.0, np.abs(6.0 * self.third / self.width**3)[inside])
        return _widened(offset, curve.largest * stray), _widened(taper, jerk * stray), curve


class ResponseOver:
    """A table of the response, which never falls, over intervals of indentation."""

    def __init__(self, table: Table) -> None:
        self.knots, self.values, self.slopes = _float64(table)
        self.width, self.first, self.second, self.third = _cubics(table)
        shares = np.arange(PARTS) / PARTS
        inner = (self.knots[:-1, None] + self.width[:, None] * shares).ravel()
        self.ends = np.append(inner, self.knots[-1])
        self.profile = self._profile(shares)
        self.forces = np.maximum.accumulate(self.at(self.ends))

    def at(self, depth: Array) -> Array:
        """The force at indentations; 0 outside of the material, straight on beyond the table."""
        last = len(self.width) - 1
        i = np.clip(np.searchsorted(self.knots, depth, side="right") - 1, 0, last)
        t = (depth - self.knots[i]) / self.width[i]
        inside = self.values[i] + t * (self.first[i] + t * (self.second[i] + t * self.third[i]))
        beyond = self.values[-1] + self.slopes[-1] * (depth - self.knots[-1])
        force = np.where(depth > self.knots[-1], beyond, np.maximum(inside, 0.0))
        return np.where(depth > 0.0, force, 0.0)

    def steepness(self, depth: Array) -> Array:
        """Its derivative at indentations; 0 outside of the material, the end's beyond the table."""
        last = len(self.width) - 1
        i = np.clip(np.searchsorted(self.knots, depth, side="right") - 1, 0, last)
        t = (depth - self.knots[i]) / self.width[i]
        first, second, third = self.first[i], self.second[i], self.third[i]
        inside = (first + t * (2.0 * second + 3.0 * t * third)) / self.width[i]
        return np.where(depth > 0.0, np.where(depth > self.knots[-1], self.slopes[-1], inside), 0.0)

    def slope(self, depth: Span) -> Span:
        """Its derivative over intervals, as bounds by parts of the table."""
        return self.profile.over(Span(np.maximum(depth.low, 0.0), np.maximum(depth.high, 0.0)))

    def deepest(self, force: Array) -> Array:
        """An indentation from which on more than ``force`` is borne; infinite where none is."""
        i = np.searchsorted(self.forces, force, side="right")
        steep = self.slopes[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = (force - self.forces[-1]) / steep if steep > 0.0 else np.inf
        inside = self.ends[np.minimum(i, len(self.ends) - 1)]
        return np.where(i < len(self.ends), inside, self.ends[-1] + np.maximum(away, 0.0))

    def _profile(self, shares: Array) -> Profile:
        count = len(self.width)
        first, second, third = (
            np.repeat(one / self.width, PARTS) for one in (self.first, self.second, self.third)
        )
        begin, end = np.tile(shares, count), np.tile(shares + 1.0 / PARTS, count)
        turn = np.divide(-second, 3.0 * third, out=np.zeros_like(second), where=third != 0.0)
        found = [
            first + t * (2.0 * second + 3.0 * t * third)
            for t in (begin, end, np.clip(turn, begin, end))
        ]
        lows = np.maximum(np.minimum.reduce(found), 0.0)
        return Profile(self.ends, lows, np.maximum.reduce(found))


def slope_of_opening(tables: ModelTables, stand: Stand, stiff: Span, force: Span) -> Span:
    """By how much torque falls per opening (N m/rad) while the crack stands, of a sheet of scale 1.

    ``stiff`` and ``force`` are the response's slope and value where the edge stands.
    """
    if tables.closure == "work":
        loss = stand.lever * stand.slope + stand.y * stand.turn
        slope = stiff * square(stand.lever) - force * loss
    else:
        level = cosine_of(stand.taper)
        tilt = stand.x * stand.taper * stand.twist * level * square(level)
        slope = stiff * stand.lever * stand.x * level + force * tilt * stand.y
    return slope * (1.0 / tables.moving_blades)


def part(span: Span, chosen: NDArray[np.bool_]) -> Span:
    """Some of the intervals."""
    return Span(span.low[chosen], span.high[chosen])


def square(span: Span) -> Span:
    """Squares of what lies in an interval, 0 where it holds 0."""
    size = Span.between(np.abs(span.low), np.abs(span.high))
    crosses = (span.low <= 0.0) & (span.high >= 0.0)
    return Span(np.where(crosses, 0.0, size.low**2), size.high**2)


def cosine_of(taper: Span) -> Span:
    """cos(alpha) of an edge's slope tan(alpha)."""
    steep = square(taper)
    return Span(1.0 / np.sqrt(1.0 + steep.high), 1.0 / np.sqrt(1.0 + steep.low))


def first_boxes(tables: ModelTables, edge: EdgeOver, ends: Array, stations: int) -> Boxes:
    """Boxes over bins of the blade's angle with these ends, and all stations that may count.

    From before the scene's nearest contact to the blade's tip; a blade without one is taken to
    end a metre beyond its table and the scene.
    """
    knots = edge.knots
    near = np.abs(knots[0]) + np.abs(edge.values[0]) + np.abs(tables.contact_min)
    low = knots[0] - near / STEEPEST
    high = tables.tip_station
    if not np.isfinite(high):
        high = max(float(knots[-1]), tables.contact_max) + 1.0
    fine = np.linspace(tables.contact_min, 1.2 * tables.contact_max, stations)
    away = max(1.2 * tables.contact_max, LEAST_M)
    coarse = away * COARSER ** np.arange(max(np.log(high / away) / np.log(COARSER), 0.0))
    places = np.concatenate([knots, fine, coarse])
    places = places[(places > low) & (places < high)]
    places = np.unique(np.concatenate([[min(low, high)], places, [high]]))
    count, bins = len(places) - 1, len(ends) - 1
    index = np.repeat(np.arange(bins), count)
    middle = 0.5 * (places[1:] + places[:-1])
    return Boxes(
        index,
        np.tile(edge.stretches(middle), bins),
        Span(ends[index], ends[index + 1]),
        Span(np.tile(places[:-1], bins), np.tile(places[1:], bins)),
    )


def _float64(table: Table) -> tuple[Array, Array, Array]:
    first, second, third = (np.asarray(one, np.float64) for one in (table.x, table.y, table.slope))
    return first, second, third


def _cubics(table: Table) -> tuple[Array, Array, Array, Array]:
    """Width, and the coefficients of t, t^2 and t^3 between knots."""
    x, y, slope = _float64(table)
    width, rise = np.diff(x), np.diff(y)
    first, last = slope[:-1] * width, slope[1:] * width
    third = first + last - 2.0 * rise
    return width, first, rise - first - third, third


def _widened(span: Span, by: Array) -> Span:
    return Span(span.low - by, span.high + by)


def _halves(span: Span) -> tuple[Span, Span]:
    middle = 0.5 * (span.low + span.high)
    return Span(span.low, middle), Span(middle, span.high)


def _joined(spans: list[Span]) -> Span:
    return Span(np.concatenate([s.low for s in spans]), np.concatenate([s.high for s in spans]))
