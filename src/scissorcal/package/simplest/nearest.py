"""Least squares from one law's torque to another's, for all posterior draws at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.package.simplest.difference import Felt, Scene, felt
from scissorcal.package.simplest.law import Law, column, with_columns
from scissorcal.package.simplest.restructure import Free

Rows = NDArray[np.int64]

CENTRAL_STEPS = 20
"""Gauss-Newton steps at the MAP point, each with new derivatives."""
DRAW_STEPS = 4
"""And from there for all draws, with the derivatives at the MAP point: they lie close to it."""
HALVINGS = 4
SETTLED = 1e-6
"""A step that improves the sum of squares by a smaller share is the last."""
DRAWS_SETTLED = 1e-2
"""The same of a draw."""

DERIVATIVE_STEP = 1e-6
SMALLEST = {"edge_offset_m": 1e-3, "edge_curvature_per_m": 1.0, "edge_bend_per_m2": 10.0}
"""Values below which the steps of derivatives no longer shrink; others have 0.01."""

POSITIVE = ("response_force", "response_exponent", "fracture_energy", "stribeck_rate")
NOT_NEGATIVE = ("coulomb", "viscous", "stribeck", "rate_damping")
LEAST_SHARE = 1e-2
"""Of its first value, which no positive parameter falls below."""


def nearest(law: Law, free: Free, target: Felt, scene: Scene) -> Law:
    """The law whose torque at the places of a scene is nearest the target's, row by row.

    Only the ``free`` parameters change. Differences are shares of the target's local torque, where
    either law can be felt at all. Gauss-Newton steps (halved where they do not improve a row) run
    at the MAP point until they settle; then for all rows together. A parameter that would turn
    negative against its meaning, such as friction, is held at 0.
    """
    if not free.names:
        return law
    search = _Search(law, free, target, scene)
    search.centre()
    search.spread()
    return search.law


class _Search:
    def __init__(self, law: Law, free: Free, target: Felt, scene: Scene) -> None:
        self.law, self._free, self._scene = law, free, scene
        self._goal = np.broadcast_to(target.torque, (law.rows, target.torque.shape[1]))
        scale = np.broadcast_to(target.scale, self._goal.shape)[0]
        counted = target.clear[0] & target.reached[0]
        self._weight = np.where(counted, 1.0 / np.where(scale > 0.0, scale, 1.0), 0.0)
        self._start = self._values()
        first = self._start[0]
        self._least = np.array([_least(n, v) for n, v in zip(free.names, first, strict=True)])
        self._centre = law.at(0)
        self._known: dict[int, Felt] = {}

    def centre(self) -> None:
        """Settle the MAP point, and start the draws as far from it as the fitted ones are."""
        values, first = self._start[:1], np.zeros(1, dtype=np.int64)
        held = np.zeros(len(self._free.names), dtype=bool)
        away = self._away(values, first)
        for _ in range(CENTRAL_STEPS):
            solver = _solver(self._derivatives(values, away), held)
            moved, moved_away = self._step(values, away, solver, first)
            bound = (moved[0] <= self._least) & ~held
            if bound.any():
                held |= bound
                values = np.where(held, self._least, values)
                away = self._away(values, first)
                continue
            gained = _gained(away, moved_away)[0]
            values, away = moved, moved_away
            if gained < SETTLED:
                break
        self._solver = _solver(self._derivatives(values, away), held)
        spread = self._start - self._start[:1]
        if self._free.shared:
            spread = np.zeros_like(spread)
        spread[:, held] = 0.0
        self._put(np.maximum(values + spread, self._least))

    def spread(self) -> None:
        """Take all other rows to their own nearest law."""
        if self._free.shared or self.law.rows == 1:
            return
        values, rows = self._values(), np.arange(1, self.law.rows)
        away = self._away(values[rows], rows)
        for _ in range(DRAW_STEPS):
            moved, moved_away = self._step(values[rows], away, self._solver, rows)
            values[rows] = moved
            moving = _gained(away, moved_away) > DRAWS_SETTLED
            rows, away = rows[moving], moved_away[moving]
            if len(rows) == 0:
                break
        self._put(values)

    def _values(self) -> Array:
        part = self.law.part(self._free.what)
        return np.stack([column(part, name) for name in self._free.names], axis=1)

    def _put(self, values: Array) -> None:
        part = self.law.part(self._free.what)
        columns = dict(zip(self._free.names, values.T, strict=True))
        self.law = self.law.with_part(self._free.what, with_columns(part, columns))

    def _away(self, values: Array, rows: Rows) -> Array:
        """Weighted differences of the torque (rows, n) with other values of the free parameters."""
        law = self._centre if len(rows) == 1 and rows[0] == 0 else self.law.of_rows(rows)
        known = None
        if law is self._centre:
            known = self._known.setdefault(0, felt(law, self._scene))
        columns = dict(zip(self._free.names, values.T, strict=True))
        part = with_columns(law.part(self._free.what), columns)
        found = felt(law.with_part(self._free.what, part), self._scene, known)
        return (found.torque - self._goal[rows]) * self._weight

    def _derivatives(self, values: Array, away: Array) -> Array:
        """Of the weighted differences at the MAP point by the free parameters, (n, k)."""
        columns = []
        for index, name in enumerate(self._free.names):
            step = DERIVATIVE_STEP * max(abs(values[0, index]), SMALLEST.get(name, 0.01))
            moved = values[:1].copy()
            moved[0, index] += step
            columns.append((self._away(moved, np.zeros(1, dtype=np.int64))[0] - away[0]) / step)
        return np.stack(columns, axis=1)

    def _step(self, values: Array, away: Array, solver: Array, rows: Rows) -> tuple[Array, Array]:
        """One step of each row, halved until it improves; rows that none improves stay."""
        step = -away @ solver.T
        best, best_away, waiting = values.copy(), away.copy(), np.arange(len(rows))
        for halving in range(HALVINGS):
            tried = np.maximum(values[waiting] + 0.5**halving * step[waiting], self._least)
            found = self._away(tried, rows[waiting])
            better = _cost(found) < _cost(away[waiting])
            best[waiting[better]], best_away[waiting[better]] = tried[better], found[better]
            waiting = waiting[~better]
            if len(waiting) == 0:
                break
        return best, best_away


def _gained(before: Array, after: Array) -> Array:
    """Share of the sum of squares that a step removed, by row."""
    return np.asarray(1.0 - _cost(after) / np.maximum(_cost(before), 1e-300))


def _cost(away: Array) -> Array:
    return np.asarray(np.sum(away**2, axis=-1))


def _solver(grade: Array, held: NDArray[np.bool_]) -> Array:
    """Matrix (k, n) that takes differences to the change that removes them; 0 where held."""
    scale = np.linalg.norm(grade, axis=0)
    scale = np.where((scale > 0.0) & ~held, scale, np.inf)
    return np.asarray(np.linalg.pinv(grade / scale, rcond=1e-10) / scale[:, None])


def _least(name: str, value: float) -> float:
    if name in POSITIVE:
        return LEAST_SHARE * abs(float(value))
    stem = name.removesuffix("_pos").removesuffix("_neg")
    return 0.0 if stem in NOT_NEGATIVE else -np.inf
