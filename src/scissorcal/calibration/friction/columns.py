"""A friction law weighed over windows: columns that its parameters multiply."""

import itertools
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.kernel import presliding_path
from scissorcal.model.friction_terms import PARAMETERS, side_of
from scissorcal.model.terms import Motion, Role, Term

Product = tuple[float, tuple[str, ...]]
Cell = tuple[tuple[int, ...], tuple[int, ...]]
"""Nodes of Stribeck's speed and of Dahl's length that parameters lie between, four or one each."""

_SCALED = next(term for term in PARAMETERS.values() if term.role is Role.DRY and term.scale)
_SHARE = next(term for term in PARAMETERS.values() if term.role is Role.BUILD_UP)
SCALES = (_SCALED.scale, "presliding_length")

RATE_SPACING, LENGTH_SPACING = 0.15, 0.2
"""Distance of nodes in the logarithm of Stribeck's speed and of Dahl's length; interpolation then
errs by 2e-4 of a level at most."""

MOST_BYTES = 6e7
"""Memory for columns of one kind, and for what is late at each sample: what does not fit is made
again when it is wanted again."""

FEWEST_KEPT = 4
"""Columns of one kind that are in memory at least: those of one cell."""

COARSER = 2
"""Nodes of the coupled columns lie so many times as far apart. Linear interpolation then errs by
2.5 % of what Stribeck friction lacks at worst, by 0.1 % of its level (rms) over empty sweeps."""

EVERY = slice(None)

DRIVE = ("inertia", "offset", "delay", "cogging_cos", "cogging_sin")
"""The first columns: what is added to the drive and is no friction."""


class FrictionBasis:
    """Drive at every window, weighed as it was measured, for any parameters of one law.

    Its friction equals ``windows.average(friction_torque(law, samples))`` and costs a fraction of
    it: what is linear in its parameters is weighed once, and what depends on a scale (Stribeck's
    speed, Dahl's length) is weighed at nodes of that scale and interpolated. So a drive is
    ``fixed`` (n, q) times coefficients, plus the columns of the scales' nodes times theirs. What
    Stribeck friction lacks after a reversal depends on both scales (``coupled``).
    """

    def __init__(
        self,
        windows: Windows,
        angle_center: float,
        terms: tuple[Term, ...],
        *,
        cogging: float = 0.0,
    ) -> None:
        """``terms`` are rows of the table; those of the load are left where none was measured.

        ``cogging`` is the number of periods a turn of a torque that repeats, 0 where there is none.
        """
        self.windows, self.cogging, self._center = windows, cogging, angle_center
        rows = [term for term in terms if windows.load is not None or not term.needs_load]
        place = sorted((row for row in rows if row.role is Role.PLACE), key=lambda one: one.power)
        self._place = tuple(one.name for one in place)
        self._plain = tuple(row for row in rows if row.role is Role.PLAIN)
        self._dry = tuple(row for row in rows if row.role is Role.DRY and not row.scale)
        self._sliding = tuple(row for row in rows if row.role is Role.SLIDING)
        none = np.broadcast_to(0.0, windows.rate.shape)
        load = none if windows.load is None else windows.load
        self.motion = Motion(windows.opening, windows.rate, none, load)
        self.fixed = np.vstack([*self._rigid(), *self._free(), *self._levels().T]).T
        self._places: dict[tuple[str, ...], list[tuple[Array, Integers, Integers, Integers]]] = {}
        self.stribeck = ScaledColumns(self._stribeck_at, RATE_SPACING)
        self.lag = ScaledColumns(self._lag_at, LENGTH_SPACING)
        self._coupled: dict[tuple[int, int], Array] = {}
        self._lateness: dict[int, Array] = {}

    def __call__(self, values: Mapping[str, Array]) -> Array:
        """Friction (n,) from a law's parameters by name; those it lacks are zero."""
        fixed, *scaled = self.coefficients(values)
        friction = np.concatenate([np.zeros(len(DRIVE)), fixed[len(DRIVE) :]])
        return self._total([friction, *scaled], values)

    def drive(self, values: Mapping[str, Array]) -> Array:
        """Friction, inertia, offset, lateness and cogging together (n,)."""
        return self._total(self.coefficients(values), values)

    def lacking(self, values: Mapping[str, Array], length: float) -> Array:
        """Dry friction that is missing after reversals (n,) if all of it builds up over ``length``.

        Exact at that length, and far cheaper than the columns of its nodes.
        """
        known = {name: float(value) for name, value in values.items()}

        def level(name: str) -> float:
            side = side_of(name, known)
            return 0.0 if side is None else known[side]

        dry = np.zeros(len(self.windows.rate))
        for term in self._dry:
            names = term.names(symmetric=False)
            for name, column in zip(names, self._levels_of((term,)), strict=True):
                dry += level(name) * column
        if _SCALED.name in known:
            dry += known[_SCALED.name] * _SCALED.column(self.motion, known[SCALES[0]])
        away = self.windows.opening - self._center
        place = 1.0 + sum(
            level(name) * away**power for power, name in enumerate(self._place, start=1)
        )
        return self.windows.average(self._late(length) * dry * place)

    def coupled(self, rate: int, length: int) -> Array:
        """What Stribeck friction still lacks after a reversal, at every other node of a scale."""
        if (rate, length) not in self._coupled:
            bell = _SCALED.column(self.motion, self.stribeck.scale_of(COARSER * rate))
            late = self._late_at(COARSER * length)
            lacks = late * bell
            made = self._weigh(lambda here: [lacks[here]])
            _keep(self._coupled, (rate, length), made)
        return self._coupled[rate, length]

    def coupled_weights(self, rates: Array, lengths: Array, cell: Cell) -> Array:
        """Weights (..., pairs) of :func:`coupled_nodes` at two scales (...): linear in either."""
        by_rate = self.stribeck.linear_over(rates, _around(cell[0]))
        by_length = self.lag.linear_over(lengths, _around(cell[1]))
        pairs = by_rate[..., :, None] * by_length[..., None, :]
        return np.asarray(pairs.reshape((*np.shape(rates), -1)))

    def coefficients(self, values: Mapping[str, Array]) -> list[Array]:
        """Factors of ``fixed`` (q,), of Stribeck's, the late and the coupled columns.

        The latter three are zero where the law has no such part.
        """

        known = np.array([*(float(value) for value in values.values()), 1.0, 0.0])
        return [
            signs * known[first] * known[second] * known[third]
            for signs, first, second, third in self.places(tuple(values))
        ]

    def places(self, names: tuple[str, ...]) -> list[tuple[Array, Integers, Integers, Integers]]:
        """Signs, and the places among ``names`` of three parameters, whose product a factor is.

        One past the last name stands for one, and the place after that for zero.
        """
        if names not in self._places:
            one, zero = len(names), len(names) + 1
            tables = []
            for part in self.factors:
                rows = []
                for _, wanted in part:
                    sides = [side_of(name, names) for name in wanted]
                    row = [zero if name is None else names.index(name) for name in sides]
                    rows.append([*row, one, one][:3])
                places = np.array(rows, dtype=np.int64)
                signs = np.array([sign for sign, _ in part])
                tables.append((signs, places[:, 0], places[:, 1], places[:, 2]))
            self._places[names] = tables
        return self._places[names]

    @cached_property
    def factors(self) -> tuple[tuple[Product, ...], ...]:
        """What multiplies ``fixed``, Stribeck's, the late and the coupled columns.

        A sign and the names of parameters for each.

        A parameter of both directions stands for either side where a law has no sides; one that a
        law lacks is zero.
        """
        share, level = _SHARE.name, _SCALED.name
        place = [(), *((name,) for name in self._place)]
        dry = [name for term in self._dry for name in term.names(symmetric=False)]
        sliding = [name for term in self._sliding for name in term.names(symmetric=False)]

        def placed(sign: float, *names: str) -> list[Product]:
            return [(sign, (*names, *product)) for product in place]

        fixed: list[Product] = [(-1.0 if name == "delay" else 1.0, (name,)) for name in DRIVE]
        fixed += [(1.0, (term.name,)) for term in self._plain]
        fixed += [product for name in (*dry, *sliding) for product in placed(1.0, name)]
        late = [product for name in dry for product in placed(-1.0, share, name)]
        coupled = placed(-1.0, share, level)
        return tuple(fixed), tuple(placed(1.0, level)), tuple(late), tuple(coupled)

    def _total(self, factors: list[Array], values: Mapping[str, Array]) -> Array:
        fixed, stribeck, late, coupled = factors
        total = self.fixed @ fixed
        if np.any(stribeck):
            total += self.stribeck(float(values["stribeck_rate"])) @ stribeck
        if np.any(late):
            total += self.lag(float(values["presliding_length"])) @ late
        if np.any(coupled):
            rate, length = np.log([float(values[name]) for name in SCALES])
            cell = self.stribeck.cell_of(rate), self.lag.cell_of(length)
            weights = self.coupled_weights(np.exp(rate), np.exp(length), cell)
            for (i, j), weight in zip(coupled_nodes(cell), weights, strict=True):
                total += weight * (self.coupled(i, j) @ coupled)
        return np.asarray(total)

    def _rigid(self) -> list[Array]:
        windows, bins = self.windows, self.windows.bins
        waves = [np.zeros(len(windows.first))] * 2
        if self.cogging:
            phase = self.cogging * windows.opening
            waves = [windows.average(np.cos(phase)), windows.average(np.sin(phase))]
        return [bins.acceleration, np.ones(len(windows.first)), windows.slope, *waves]

    def _free(self) -> Array:
        return self.windows.averages(lambda here: self._columns_of(self._plain, here))

    def _levels(self) -> Array:
        def levels(here: slice) -> list[Array]:
            sign = np.sign(self.windows.rate[here])
            dry = [sign * level for level in self._levels_of(self._dry, here)]
            return [*dry, *self._levels_of(self._sliding, here)]

        return self._weigh(levels)

    def _columns_of(self, terms: tuple[Term, ...], here: slice) -> list[Array]:
        motion = self._motion_at(here)
        return [term.column(motion) for term in terms]

    def _motion_at(self, here: slice) -> Motion:
        """The motion at a stretch of samples."""
        whole = self.motion
        parts = (whole.opening, whole.rate, whole.acceleration, whole.load)
        return Motion(*(part[here] for part in parts))

    def _levels_of(self, terms: tuple[Term, ...], here: slice = EVERY) -> list[Array]:
        """What each parameter of some terms multiplies: one column for each direction."""
        rate, columns = self.windows.rate[here], []
        for term, value in zip(terms, self._columns_of(terms, here), strict=True):
            columns += [value * (rate > 0), value * (rate < 0)] if term.sided else [value]
        return columns

    def _stribeck_at(self, rate: float) -> Array:
        def bell(here: slice) -> list[Array]:
            motion = self._motion_at(here)
            return [motion.direction * _SCALED.column(motion, rate)]

        return self._weigh(bell)

    def _lag_at(self, length: float) -> Array:
        late = self._late(length)
        return self._weigh(lambda here: [late[here] * c for c in self._levels_of(self._dry, here)])

    def _late_at(self, node: int) -> Array:
        if node not in self._lateness:
            made = self._late(self.lag.scale_of(node))
            if (len(self._lateness) + 1) * made.nbytes > MOST_BYTES:
                self._lateness.clear()
            self._lateness[node] = made
        return self._lateness[node]

    def _late(self, length: float) -> Array:
        """What dry friction still lacks after a reversal (m,), relative to its level."""
        windows = self.windows
        ends = [*windows.starts[1:].tolist(), len(windows.opening)]
        state = np.concatenate(
            [
                presliding_path(windows.opening[low:high], length)
                for low, high in zip(windows.starts.tolist(), ends, strict=True)
            ]
        )
        return np.asarray(np.sign(windows.rate) - state)

    def _weigh(self, columns: Callable[[slice], list[Array]]) -> Array:
        """Columns times the powers of the place, weighed (n, columns * powers).

        ``columns`` (samples) gives them at a stretch of samples. In memory each column of the
        result lies in one piece, as products by stroke take it.
        """

        def placed(here: slice) -> list[Array]:
            away, powers = self.windows.opening[here] - self._center, []
            for column in columns(here):
                powers.append(column)
                for _ in self._place:
                    powers.append(powers[-1] * away)
            return powers

        return self.windows.averages(placed).T


class ScaledColumns:
    """Columns that depend smoothly on a positive scale, worked out at nodes when first needed."""

    def __init__(self, at: Callable[[float], Array], spacing: float) -> None:
        """``at`` gives the columns at a scale, ``spacing`` is the nodes' in its logarithm."""
        self.at, self.spacing = at, spacing
        self.known: dict[int, Array] = {}
        self.last: tuple[float, Array] | None = None

    def __call__(self, scale: float) -> Array:
        """Cubic interpolation (Lagrange) in the logarithm of ``scale``."""
        if self.last is None or self.last[0] != scale:
            nodes = self.cell_of(float(np.log(scale)))
            weights = self.weights_over(np.asarray(scale), nodes).tolist()
            total = weights[0] * self.node(nodes[0])
            for index, weight in zip(nodes[1:], weights[1:], strict=True):
                total += weight * self.node(index)
            self.last = (scale, total)
        return self.last[1]

    def linear_over(self, scales: Array, nodes: tuple[int, ...]) -> Array:
        """Weights (..., nodes) of two coarser nodes or none, linear in the scales' logarithm."""
        if not nodes:
            return np.ones((*np.shape(scales), 0))
        beyond = np.log(scales) / (COARSER * self.spacing) - nodes[0]
        return np.stack((1.0 - beyond, beyond), axis=-1)

    def scale_of(self, index: int) -> float:
        """The scale of a node."""
        return float(np.exp(index * self.spacing))

    def cell_of(self, log_scale: float) -> tuple[int, ...]:
        """The four nodes around a scale's logarithm.

        >>> ScaledColumns(lambda scale: np.array([scale]), 0.1).cell_of(0.05)
        (-1, 0, 1, 2)
        """
        low = math.floor(log_scale / self.spacing)
        return (low - 1, low, low + 1, low + 2)

    def weights_over(self, scales: Array, nodes: tuple[int, ...]) -> Array:
        """Weights (..., nodes) by which columns at ``nodes`` make up those at ``scales`` (...).

        Cubic interpolation (Lagrange) in the logarithm of the scale between the four of a cell. A
        single node counts alone, wherever the scale is.
        """
        if len(nodes) == 1:
            return np.ones((*np.shape(scales), 1))
        return np.stack(_cubic(np.log(scales) / self.spacing - nodes[1]), axis=-1)

    def node(self, index: int) -> Array:
        """Columns at one node."""
        made = self.known.pop(index, None)
        _keep(self.known, index, self.at(self.scale_of(index)) if made is None else made)
        return self.known[index]


def _keep(known: dict[Any, Array], key: Any, made: Array) -> None:
    """Put columns last, and forget the first as far as ``MOST_BYTES`` do not hold all."""
    known[key] = made
    while len(known) > max(FEWEST_KEPT, MOST_BYTES / max(made.nbytes, 1)):
        del known[next(iter(known))]


def coupled_nodes(cell: Cell) -> list[tuple[int, int]]:
    """Pairs of coarser nodes by which a cell's coupled columns are interpolated.

    A scan for starts, whose cells have one node of each scale, goes without.

    >>> coupled_nodes(((3, 4, 5, 6), (7, 8, 9, 10)))
    [(2, 4), (2, 5), (3, 4), (3, 5)]
    >>> coupled_nodes(((3,), (7,)))
    []
    """
    return list(itertools.product(_around(cell[0]), _around(cell[1])))


def _around(nodes: tuple[int, ...]) -> tuple[int, ...]:
    """The coarser nodes around the inner ones of a cell, none of a single node."""
    return (nodes[1] // COARSER, nodes[1] // COARSER + 1) if len(nodes) == 4 else ()


def _cubic(t: Array) -> tuple[Array, Array, Array, Array]:
    """Weights of four even nodes for a place ``t`` nodes beyond the second one."""
    return (
        -t * (t - 1) * (t - 2) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        -(t + 1) * t * (t - 2) / 2,
        (t + 1) * t * (t - 1) / 6,
    )
