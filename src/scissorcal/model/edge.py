"""The cutting edge: its shape on the blade, and its height over the cut when the blade turns."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.errors import ModelError
from scissorcal.model.bspline import FEWEST, spline_slope, spline_value
from scissorcal.model.checks import SMALLEST, check_name, check_numbers

Family = Literal["line", "arc", "cubic", "spline"]
_FAMILIES = get_args(Family)

UPRIGHT = 0.5 * np.pi
"""A taper of a right angle, rad: beyond it a blade has no edge that faces the cut."""

NEWTON_STEPS = 30
HALVINGS = 64
CLOSE = 1e-9
"""Share of the place within which Newton's last step must stay."""


@dataclass(frozen=True)
class Edge:
    """One blade's edge e(s), offset from its centreline against station s from the pivot.

    An edge is offset + s tan(taper) and what its family adds:

    * ``line``: nothing.
    * ``arc``: curvature s^2 / 2, a parabola in the place of a circular arc of that curvature:
      without taper they are 4 um apart at 75 mm for a curvature of 1 /m.
    * ``cubic``: curvature s^2 / 2 + bend s^3 / 6.
    * ``spline``: a cubic B-spline with the weights ``spline_m`` on evenly spaced knots from
      ``spline_start_m`` to ``length_m``, straight on beyond both.

    Parameters may be arrays of one shape that broadcasts with the stations, such as (draws, 1);
    the weights then have one axis more. ModelError for an unknown family, for a number that is not
    finite, a taper beyond a right angle, a length that is not above 0, fewer than 4 weights of
    a spline, and weights of another family.

    >>> float(Edge("line", offset_m=-0.008, taper_rad=0.0, length_m=0.07).offset_at(0.03))
    -0.008
    """

    family: Family
    offset_m: float | Array
    taper_rad: float | Array
    length_m: float
    curvature_per_m: float | Array = 0.0
    bend_per_m2: float | Array = 0.0
    spline_m: tuple[float, ...] | Array = ()
    spline_start_m: float = 0.0

    def __post_init__(self) -> None:
        check_name("family of an edge", self.family, _FAMILIES)
        check_numbers("the offset of an edge (m)", self.offset_m)
        check_numbers("the taper of an edge (rad)", self.taper_rad, -UPRIGHT, UPRIGHT)
        check_numbers("the length of an edge (m)", self.length_m, SMALLEST)
        check_numbers("the curvature of an edge (1/m)", self.curvature_per_m)
        check_numbers("the bend of an edge (1/m^2)", self.bend_per_m2)
        if self.family == "spline":
            check_numbers("the weights of an edge (m)", self.spline_m)
            before_the_tip = np.nextafter(self.length_m, -np.inf)
            check_numbers(
                "the start of an edge's spline (m)", self.spline_start_m, high=before_the_tip
            )
            if np.shape(self.spline_m)[-1] < FEWEST:
                raise ModelError(
                    f"An edge that is a spline needs {FEWEST} weights or more; it has "
                    f"{np.shape(self.spline_m)[-1]}."
                )
        elif np.shape(self.spline_m)[-1]:
            raise ModelError(f'An edge with weights is a "spline", not a "{self.family}".')

    @property
    def straight(self) -> bool:
        """Whether the edge is a straight line, which needs no search along it."""
        return (
            self.family != "spline"
            and not np.any(self.curvature_per_m)
            and not np.any(self.bend_per_m2)
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of its parameters: () for one edge, (draws, 1) for draws of it."""
        scalars = (self.offset_m, self.taper_rad, self.curvature_per_m, self.bend_per_m2)
        shapes = [np.shape(value) for value in scalars]
        return np.broadcast_shapes(*shapes, np.shape(self.spline_m)[:-1])

    @cached_property
    def steepest(self) -> Array:
        """Largest slope e'(s) on the blade, from the pivot to the tip; shape of the parameters."""
        _, *slopes = _slopes_of_pieces(self)
        return _largest_of_parabolas(*slopes)

    def offset_at(self, station: ArrayLike) -> Array:
        """Offset e(s) in metres; ``station`` broadcasts with the parameters."""
        s = np.asarray(station, dtype=np.float64)
        bent = 0.5 * self.curvature_per_m + s * (self.bend_per_m2 / 6.0)
        offset = self.offset_m + s * (np.tan(self.taper_rad) + s * bent)
        if self.family == "spline":
            offset = offset + spline_value(self.spline_m, self.spline_start_m, self.length_m, s)
        return np.asarray(offset)

    def slope_at(self, station: ArrayLike) -> Array:
        """Slope e'(s) = tan(alpha(s)); ``station`` broadcasts with the parameters."""
        s = np.asarray(station, dtype=np.float64)
        slope = np.tan(self.taper_rad) + s * (self.curvature_per_m + 0.5 * s * self.bend_per_m2)
        if self.family == "spline":
            slope = slope + spline_slope(self.spline_m, self.spline_start_m, self.length_m, s)
        return np.asarray(slope)

    def station_at_height(self, height: ArrayLike, blade_angle: ArrayLike) -> Array:
        """Station (m) at which the turned edge comes up through a height over the cut (m).

        The root of s sin(beta) + e(s) cos(beta) = height at which the left side rises with s.
        ``height`` and ``blade_angle`` beta (rad) broadcast; the edge is one, not draws of it. A
        line and an arc are solved exactly and anywhere along their continuation. Other families
        are searched on the blade; NaN where they rise through the height nowhere, or more than
        once.

        >>> edge = Edge("line", offset_m=-0.008, taper_rad=0.0, length_m=0.07)
        >>> round(float(edge.station_at_height(0.0, np.radians(15.0))), 6)
        0.029856
        """
        level, beta = np.broadcast_arrays(
            np.asarray(height, dtype=np.float64), np.asarray(blade_angle, dtype=np.float64)
        )
        if self.family not in ("line", "arc"):
            return _rising_station(self, level.ravel(), beta.ravel()).reshape(beta.shape)
        cosine = np.cos(beta)
        rise = level - self.offset_m * cosine
        grade = np.sin(beta) + np.tan(self.taper_rad) * cosine
        bend = self.curvature_per_m * cosine
        with np.errstate(all="ignore"):
            root = np.sqrt(grade**2 + 2.0 * bend * rise)
            # Two forms of one root: each adds numbers of one sign, so that no digits cancel.
            station = np.where(grade > 0.0, 2.0 * rise / (grade + root), (root - grade) / bend)
            return np.where(np.isfinite(station), station, np.nan)


_PARAMETERS = ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2")


@dataclass(frozen=True)
class EdgeDistribution:
    """An edge with what is known of its parameters: normal, mean ``edge``, with ``covariance``.

    ``names`` (k,) are fields of the edge, or ``spline_m_<i>`` for a weight of its spline, in the
    order of ``covariance`` (k, k), in units of the fields. What is not named is held.

    >>> line = Edge("line", offset_m=-0.008, taper_rad=0.03, length_m=0.07)
    >>> distribution = EdgeDistribution(line, ("offset_m", "taper_rad"), np.diag([1e-10, 1e-8]))
    >>> distribution.mean.tolist()
    [-0.008, 0.03]
    >>> float(distribution.with_values([-0.007, 0.02]).offset_m)
    -0.007
    """

    edge: Edge
    names: tuple[str, ...]
    covariance: Array

    def __post_init__(self) -> None:
        count = len(self.names)
        for name in self.names:
            if not _is_weight(name):
                check_name("parameter of an edge", name, _PARAMETERS)
        check_numbers("the covariance of an edge", self.covariance)
        if self.covariance.shape != (count, count):
            raise ModelError(f"{count} names of edge parameters need a covariance of their size.")
        if count and np.min(np.diagonal(self.covariance)) < 0.0:
            raise ModelError("The variances of an edge's parameters must be 0 or more.")

    @property
    def mean(self) -> Array:
        """The edge's own values of the named parameters, shape (k,)."""
        weights = np.asarray(self.edge.spline_m, dtype=np.float64)
        return np.array(
            [
                weights[_weight(name)] if _is_weight(name) else getattr(self.edge, name)
                for name in self.names
            ],
            dtype=np.float64,
        )

    def with_values(self, values: ArrayLike | Mapping[str, ArrayLike]) -> Edge:
        """The edge with other values of the named parameters.

        ``values`` (k,) gives one edge. (draws, k) gives draws of it, with parameters of shape
        (draws, 1) that broadcast with stations (points,). A mapping gives them by name, each a
        scalar or (draws, 1); others of its keys are left alone.
        """
        if isinstance(values, Mapping):
            named = {n: np.asarray(values[n], dtype=np.float64) for n in self.names if n in values}
        else:
            rows = np.asarray(values, dtype=np.float64)
            if rows.shape[-1:] != (len(self.names),):
                raise ValueError(
                    f"an edge distribution over {self.names} needs {len(self.names)} values"
                )
            columns = rows if rows.ndim == 1 else np.moveaxis(rows, -1, 0)[..., None]
            named = dict(zip(self.names, columns, strict=True))
        fields: dict[str, Any] = {n: _plain(v) for n, v in named.items() if not _is_weight(n)}
        weights = {_weight(n): v for n, v in named.items() if _is_weight(n)}
        if weights:
            shape = np.broadcast_shapes(*(np.shape(value) for value in weights.values()))
            own = np.asarray(self.edge.spline_m, dtype=np.float64)
            spline = np.broadcast_to(own, (*shape, own.shape[-1])).copy()
            for index, value in weights.items():
                spline[..., index] = value
            fields["spline_m"] = spline if shape else tuple(spline.tolist())
        return replace(self.edge, **fields)

    def draws(self, rng: np.random.Generator, count: int) -> Array:
        """Draw values of the named parameters, shape (count, k)."""
        if not self.names:
            return np.zeros((count, 0))
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(self.mean + rng.standard_normal((count, len(self.names))) @ root.T)


def draw_edges(distribution: EdgeDistribution, rng: np.random.Generator, count: int) -> Edge:
    """Draw ``count`` edges of a distribution as one whose parameters have shape (count, 1)."""
    return distribution.with_values(distribution.draws(rng, count))


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
    broadcast. Beyond the blade's ends the edge is continued smoothly; the caller decides what
    a contact beyond the tip means. All fields are NaN where no point of the edge, or not one alone,
    stands over ``contact``: where the edge is upright or leans back anywhere on the blade, or at
    the place itself (dx/ds <= 0).

    >>> float(edge_height(Edge("line", 0.0, 0.0, 0.07), 0.02, 2.0).height)
    nan
    """
    x, beta = np.broadcast_arrays(
        np.asarray(contact, dtype=np.float64), np.asarray(blade_angle, dtype=np.float64)
    )
    sine, cosine = np.sin(beta), np.cos(beta)
    with np.errstate(all="ignore"):
        station = _station_over(edge, x, sine, cosine)
        offset, taper = edge.offset_at(station), edge.slope_at(station)
        run = cosine - taper * sine
        stands = (run > 0.0) & (cosine - edge.steepest * sine > 0.0)
        station = np.where(stands, station, np.nan)
        height = station * sine + offset * cosine
        slope = np.where(stands, (sine + taper * cosine) / run, np.nan)
        return EdgeView(height, slope, station, x + height * slope)


def _slopes_of_pieces(edge: Edge) -> tuple[Array, Array, Array, Array]:
    """Ends (pieces + 1,) of the pieces on the blade, and slopes at first, middle and last of each.

    The slope is one parabola on each piece; slopes are (pieces,) and the parameters' axes.
    """
    ends = np.array([0.0, edge.length_m])
    if edge.family == "spline":
        pieces = np.shape(edge.spline_m)[-1] - FEWEST + 1
        knots = np.linspace(edge.spline_start_m, edge.length_m, pieces + 1)
        ends = np.unique(np.clip(np.append(knots, 0.0), 0.0, edge.length_m))
    with_middles = np.insert(ends, np.arange(1, len(ends)), 0.5 * (ends[:-1] + ends[1:]))
    slopes = np.stack([edge.slope_at(s) for s in with_middles])
    return ends, slopes[:-1:2], slopes[1::2], slopes[2::2]


def _largest_of_parabolas(first: Array, middle: Array, last: Array) -> Array:
    """Largest value of parabolas over pieces, by their values at both ends and in the middle.

    All are (pieces, ...); the result has the other axes. A slope is one parabola on each piece.
    """
    bend = 2.0 * (first + last - 2.0 * middle)
    with np.errstate(all="ignore"):
        top = 0.5 * (1.0 - (last - first) / bend)
        inner = np.where((bend < 0.0) & (top > 0.0) & (top < 1.0), first - bend * top**2, first)
    return np.asarray(np.max(np.maximum(np.maximum(first, last), inner), axis=0))


def _station_over(edge: Edge, x: Array, sine: Array, cosine: Array) -> Array:
    """The station over x; NaN where the search along a bent edge does not end."""
    if edge.straight:
        tangent = np.tan(edge.taper_rad)
        straight: Array = (x + edge.offset_m * sine) / (cosine - tangent * sine)
        return straight
    near = edge.offset_at(0.0)
    chord = (edge.offset_at(edge.length_m) - near) / edge.length_m
    station: Array = (x + near * sine) / (cosine - chord * sine)
    for _ in range(NEWTON_STEPS):
        residual = station * cosine - edge.offset_at(station) * sine - x
        step = residual / (cosine - edge.slope_at(station) * sine)
        station = station - step
        if np.all(np.abs(step) <= 1e-15 + 1e-14 * np.abs(station)):
            return station
    closed = np.abs(step) <= CLOSE * (np.abs(station) + edge.length_m)
    if np.all(closed):
        return station
    return np.where(closed, station, _station_by_halving(edge, x, sine, cosine))


def _station_by_halving(edge: Edge, x: Array, sine: Array, cosine: Array) -> Array:
    """The station over x on the blade and as far beyond both ends, where x rises with it."""
    low, high = -edge.length_m, 2.0 * edge.length_m

    def away(station: Array) -> Array:
        return np.asarray(station * cosine - edge.offset_at(station) * sine - x)

    shape = np.broadcast_shapes(x.shape, edge.shape)
    below, above = np.full(shape, low), np.full(shape, high)
    within = (away(below) <= 0.0) & (away(above) >= 0.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (below + above)
        beyond = away(middle) > 0.0
        below, above = np.where(beyond, below, middle), np.where(beyond, middle, above)
    return np.where(within, 0.5 * (below + above), np.nan)


def _rising_station(edge: Edge, level: Array, beta: Array) -> Array:
    """Where the edge alone rises through each level (n,): between turning points, then Newton.

    A Newton step that leaves what is known to hold the root is replaced by half of that.
    """
    sine, cosine = np.sin(beta), np.cos(beta)
    stations = _turning_stations(edge, sine / cosine)
    heights = stations * sine[:, None] + edge.offset_at(stations) * cosine[:, None]
    rising = (heights[:, :-1] < level[:, None]) & (heights[:, 1:] >= level[:, None])
    each, cell = np.arange(len(level)), np.argmax(rising, axis=1)
    low, high = stations[each, cell], stations[each, cell + 1]
    station = 0.5 * (low + high)
    for _ in range(HALVINGS):
        away = station * sine + edge.offset_at(station) * cosine - level
        low, high = np.where(away < 0.0, station, low), np.where(away < 0.0, high, station)
        with np.errstate(all="ignore"):
            stepped = station - away / (sine + edge.slope_at(station) * cosine)
        within = (stepped >= low) & (stepped <= high)
        before, station = station, np.where(within, stepped, 0.5 * (low + high))
        if np.all(np.abs(station - before) <= 1e-15 * edge.length_m):
            break
    return np.where(np.count_nonzero(rising, axis=1) == 1, station, np.nan)


def _turning_stations(edge: Edge, tilt: Array) -> Array:
    """Stations (n, m), ascending along the blade, between which the turned edge is monotone.

    They are the ends of its pieces and where its slope is -``tilt`` (n,), the tangent of the blade
    angle: at most two places on a piece, the roots of a parabola. Places that a piece lacks stand
    at its first end.
    """
    ends, first, middle, last = _slopes_of_pieces(edge)
    level = first + tilt[:, None]
    bend = 2.0 * (first + last) - 4.0 * middle
    rise = last - first - bend
    with np.errstate(all="ignore"):
        both = -0.5 * (rise + np.copysign(np.sqrt(rise**2 - 4.0 * bend * level), rise))
        shares = np.stack([both / bend, level / both])
        shares = np.where((shares > 0.0) & (shares < 1.0), shares, 0.0)
    turns = ends[:-1] + shares * np.diff(ends)
    borders = np.broadcast_to(ends, (len(tilt), len(ends)))
    return np.sort(np.concatenate([borders, *turns], axis=1), axis=1)


def _plain(value: Array) -> float | Array:
    return float(value) if value.ndim == 0 else value


def _is_weight(name: str) -> bool:
    return name.startswith("spline_m_")


def _weight(name: str) -> int:
    return int(name.removeprefix("spline_m_"))
