"""Proved bounds of how steeply torque and force change as blades move, on a plate of pieces.

While a crack stands, a piece of scale 1 has, with g' = dg/d(delta), t = tan(psi), L the lever,
t' = dt/dx at a fixed angle and q = 1 + t^2 + phi t',

    - d(tau)/d(theta) = (g' L^2 - g (L t + phi q)) / m
      d(tau)/d(x_n)   = d(f)/d(theta) = g' L t - g q
    - d(f)/d(x_n)     = m (g' t^2 - g t')

(closure ``work``). Each is bounded over boxes of angle and station that cover the scene, by
intervals. A place counts only where the crack can stand, m g t <= J, and where the torque is
within its limit; both bound g, and so the indentation. Boxes near the largest bound are divided. A
piece of scale s in a strip of energy J is the sheet of energy J / s, times s. At each opening
those that an advance can press at once add up.

A smooth crack that runs along changes d(tau)/d(theta) by - (g' L t - g q)^2 / (m (g' t^2 - g t')):
with ``work`` its slope is below the bound wherever the release falls outwards. The proof is of the
tables as cubics in exact arithmetic.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import ModelTables, Piece, StepFlag
from scissorcal.model.curvature import Span
from scissorcal.package.law_boxes import (
    Boxes,
    EdgeOver,
    ResponseOver,
    Stand,
    cosine_of,
    first_boxes,
    part,
    slope_of_opening,
    square,
)

Quantity = Literal["opening", "cross", "advance", "rate"]

BINS, STATIONS = 64, 97
ROUNDS, SURE_ROUNDS = 6, 3
NEAR = 0.9
"""Boxes whose bound is above this share of their bin's are divided, three to five times."""
HALVINGS = 8
"""Of boxes in which it is not certain that torque opens the blades."""
LEAST_GAIN = 0.005
"""A bin is divided again where that lowered its bound by more than this."""
PARALLEL = 1e-6
"""As in the kernel: along flatter edges nothing is released."""
APART_M = 1e-7
"""Rounding of a place in float32."""


@dataclass(frozen=True)
class SlopeBound:
    """A bound, and about where it is reached: an opening (rad) and a contact (m).

    Of ``opening`` in N m/rad, ``cross`` in N/rad (and N m/m), ``advance`` in N/m, ``rate`` (torque
    by the rate of the opening, of a material with rate damping) in N m s/rad.
    """

    value: float
    opening: float
    contact: float


@dataclass(frozen=True)
class _Sheet:
    """A uniform sheet's bounds by bin of openings: ``value`` where it lies at ``contact``, and
    between which contacts it may be pressed (an empty interval where it is not)."""

    value: Array
    contact: Array
    near: Array
    far: Array


class LayerSlopes:
    """Bounds of the slopes of a model on a plate of pieces.

    Over the openings of the tables, for cracks at any contact from ``contact_min`` to the blade's
    tip: strokes that begin within the scene press beyond ``contact_max``, too, at any release up to
    J. A crack that ran through a weak strip is held at the border of a tougher one, a ripple stops
    at kappa J, the release falls again as blades open, and a layer may begin there.
    ``torque_limit`` (N m): places where the torque is above it do not count, as it is held there.
    """

    def __init__(self, tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> None:
        self.tables, self.limit, self.pieces = tables, torque_limit, tuple(pieces)
        self.blades = float(tables.moving_blades)
        self.edge, self.response = EdgeOver(tables.edge), ResponseOver(tables.response)
        low, high = tables.opening_min / self.blades, tables.opening_max / self.blades
        turns = [turn for turn in (-0.5 * np.pi, 0.0, 0.5 * np.pi) if low < turn < high]
        self.ends = np.unique(np.concatenate([np.linspace(low, high, BINS + 1), turns]))
        self._sheets: dict[tuple[Quantity, float, float, float], _Sheet] = {}

    def bound(self, quantity: Quantity) -> SlopeBound:
        """The largest magnitude of one slope, over all that an advance can press at once."""
        whole, first, last, starts = [], [], [], []
        sheets: list[_Sheet] = []
        for piece in self.pieces:
            starts.append(len(sheets))
            begin = piece.begin_m
            for strip in piece.strips:
                energy = strip.fracture_energy_J_per_m / piece.scale
                sheet = self._sheet(quantity, piece.upper_face_m, energy, piece.scale)
                sheets.append(sheet)
                whole.append(piece.scale * sheet.value)
                first.append(begin - sheet.far - APART_M)
                last.append(strip.end_m - sheet.near + APART_M)
                begin = strip.end_m
        value, low, high = (np.stack(one, axis=1) for one in (whole, first, last))
        pressed = (low[:, :, None] <= low[:, None, :]) & (low[:, None, :] <= high[:, :, None])
        each = np.maximum.reduceat(np.where(pressed, value[:, :, None], 0.0), starts, axis=1)
        total = each.sum(axis=1).max(axis=1)
        worst = int(np.argmax(total))
        strongest = sheets[int(np.argmax(value[worst]))]
        middle = 0.5 * (self.ends[worst] + self.ends[worst + 1])
        place = float(strongest.contact[worst])
        return SlopeBound(float(total[worst]), float(self.blades * middle), place)

    @cached_property
    def _first(self) -> tuple[Boxes, Stand]:
        """The boxes that are looked at first, without those in which nothing can be pressed."""
        return self._reached(first_boxes(self.tables, self.edge, self.ends, STATIONS))

    def _reached(self, boxes: Boxes) -> tuple[Boxes, Stand]:
        stand = self.edge.stand(boxes)
        top = max(piece.upper_face_m for piece in self.pieces)
        felt = stand.stands & (stand.y.low < top) & (stand.x.high >= self.tables.contact_min)
        return boxes.where(felt), _some(stand, felt)

    @cached_property
    def _all_oppose(self) -> bool:
        """Whether no piece's torque closes the blades, so that each is within the limit of all."""
        boxes, stand = self._first
        for _ in range(HALVINGS if len(self.pieces) > 1 else 0):
            unsure = self._arm(stand).low < 0.0
            if not unsure.any():
                break
            boxes, stand = self._reached(boxes.where(unsure).quartered())
        return len(self.pieces) == 1 or not np.any(self._arm(stand).low < 0.0)

    def _sheet(self, quantity: Quantity, face: float, energy: float, scale: float) -> _Sheet:
        boxes, stand = self._first
        limit = self.limit / scale if self._all_oppose else np.inf
        key = (quantity, face, energy, limit)
        if key not in self._sheets:
            self._sheets[key] = self._divided(quantity, boxes, stand, (face, energy, limit))
        return self._sheets[key]

    def _divided(
        self, quantity: Quantity, boxes: Boxes, stand: Stand, sheet: tuple[float, float, float]
    ) -> _Sheet:
        bins = len(self.ends) - 1
        value, contact = np.zeros(bins), np.zeros(bins)
        near, far, top = np.full(bins, np.inf), np.full(bins, -np.inf), np.full(bins, np.inf)
        for turn in range(ROUNDS):
            kept, depth, force = self._bearing(stand, *sheet)
            boxes, stand = boxes.where(kept), _some(stand, kept)
            found = self._steepness(quantity, stand, part(depth, kept), part(force, kept))
            if turn == 0:
                np.minimum.at(near, boxes.bin, stand.x.low)
                np.maximum.at(far, boxes.bin, stand.x.high)
            before, top = top, value.copy()
            np.maximum.at(top, boxes.bin, found)
            at_top = found == top[boxes.bin]
            contact[boxes.bin[at_top]] = 0.5 * (stand.x.low + stand.x.high)[at_top]
            gains = (top < (1.0 - LEAST_GAIN) * before) | (turn < SURE_ROUNDS)
            again = (found > NEAR * top[boxes.bin]) & (found > 0.0) & gains[boxes.bin]
            if turn == ROUNDS - 1 or not again.any():
                return _Sheet(top, contact, near, far)
            np.maximum.at(value, boxes.bin[~again], found[~again])
            boxes = boxes.where(again).quartered()
            stand = self.edge.stand(boxes)
        raise AssertionError("the last round returns")

    def _bearing(
        self, stand: Stand, face: float, energy: float, limit: float
    ) -> tuple[NDArray[np.bool_], Span, Span]:
        """Which boxes hold a place that counts, and what indentation and force are there."""
        tables = self.tables
        depth = Span(face - stand.y.high, face - stand.y.low)
        force = Span(self.response.at(depth.low), self.response.at(depth.high))
        kept = stand.stands & (depth.high > 0.0) & (stand.x.high >= tables.contact_min)
        most = force.high
        if energy > 0.0:
            releases = stand.slope.low > PARALLEL
            cap = np.where(
                releases, energy / (self.blades * np.maximum(stand.slope.low, PARALLEL)), np.inf
            )
            kept &= force.low <= cap
            most = np.minimum(most, cap)
        arm = self._arm(stand).low
        cap = np.where(arm > 0.0, limit / np.where(arm > 0.0, arm, 1.0), np.inf)
        kept &= force.low <= cap
        most = np.maximum(np.minimum(most, cap), force.low)
        deepest = np.maximum(np.minimum(depth.high, self.response.deepest(most)), 0.0)
        return kept, Span(np.clip(depth.low, 0.0, deepest), deepest), Span(force.low, most)

    def _arm(self, stand: Stand) -> Span:
        """Torque over response."""
        return stand.lever if self.tables.closure == "work" else stand.x * cosine_of(stand.taper)

    def _steepness(self, quantity: Quantity, stand: Stand, depth: Span, force: Span) -> Array:
        """The largest magnitude of a slope of a sheet of scale 1 in each box."""
        if quantity == "rate":
            damping = self._arm(stand) * stand.lever * force
            return damping.largest * self.tables.rate_damping / self.blades
        stiff = self.response.slope(depth)
        if quantity == "advance":
            slope = stiff * square(stand.slope) - force * stand.bend
            return np.asarray(self.blades * slope.largest)
        if quantity == "opening":
            return slope_of_opening(self.tables, stand, stiff, force).largest
        shared = stiff * stand.lever * stand.slope - force * stand.turn
        if self.tables.closure == "work":
            return shared.largest
        level = cosine_of(stand.taper)
        tilt = stand.x * stand.taper * stand.twist * level * square(level)
        own = stiff * stand.slope * stand.x * level - force * (level - tilt)
        return np.maximum(shared.largest, own.largest)


def _some(stand: Stand, chosen: NDArray[np.bool_]) -> Stand:
    parts = (getattr(stand, name) for name in Stand.__dataclass_fields__ if name != "stands")
    return Stand(stand.stands[chosen], *(part(one, chosen) for one in parts))


class Tangent:
    """The elastic slope of torque over the opening, where steps of a model have come to."""

    def __init__(self, tables: ModelTables) -> None:
        self.tables = tables
        self._edge, self._response = EdgeOver(tables.edge), ResponseOver(tables.response)

    def at(self, opening: Array, steps: NDArray[np.void]) -> Array:
        """By how much torque falls per opening (n,), N m/rad, with the crack held.

        ``opening`` (n,) in rad, ``steps`` (n,) what `Kernel.step_many` gave there; of a response of
        scale 1, without friction and at rest. 0 where the blades do not touch.
        """
        touching = (steps["flags"] & int(StepFlag.TOUCHING)) != 0
        slope = np.zeros(len(opening))
        if touching.any():
            slope[touching] = self._touching(opening[touching], steps[touching])
        return slope

    def _touching(self, opening: Array, steps: Any) -> Array:
        beta = np.asarray(opening, dtype=np.float64) / self.tables.moving_blades
        x, y, depth = (
            steps[name].astype(np.float64) for name in ("contact", "height", "indentation")
        )
        station = x * np.cos(beta) + y * np.sin(beta)  # the rotation by beta, turned back
        places = Boxes(
            np.zeros(len(beta), dtype=np.int64),
            self._edge.stretches(station),
            Span(beta, beta),
            Span(station, station),
        )
        stiff, force = self._response.steepness(depth), self._response.at(depth)
        stand = self._edge.stand(places)
        slope = slope_of_opening(self.tables, stand, Span(stiff, stiff), Span(force, force))
        return np.asarray(slope.low)
