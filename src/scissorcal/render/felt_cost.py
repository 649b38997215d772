"""What admission costs: by how much the felt torque of a scene's closing strokes changes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel

Stroke = tuple[Array, Array, NDArray[np.bool_]]

BINS = 25
STROKE_TICKS = 4000
APPROACH_TICKS = 400
"""With open blades, from one stroke's place to the next one's."""
MOST_STROKES = 64
"""Of a drawn plate; what lies beyond their reach is not compared."""
LEAST_SHARE = 0.05
"""Of the strokes' largest torque; the cost of derating is compared where torque is above."""
PRESSES = 3
"""Contacts at which a sheet that is not cut is pressed: the scene's ends and its middle."""
PROGRESS_M = 1e-6


class FeltTorque:
    """The torque that a package's closing strokes feel like, and what others change of it.

    Strokes over the scene's openings at the ``rates`` (rad/s), stepped in the compiled core; held
    to the torque limit, and averaged in 25 bins of opening in each stroke, which takes the ripple
    out. Rendered friction is part of what is felt. Without ``pieces`` a stroke closes on a sheet
    whose near edge is at the scene's nearest contact, or, where nothing is cut, on one at each of
    three contacts. Of a drawn plate of ``pieces``: see `plate_strokes`.
    """

    def __init__(
        self,
        tables: ModelTables,
        torque_limit: float,
        rates: Sequence[float] = (0.0,),
        pieces: Sequence[Piece] = (),
    ) -> None:
        self._limit, self._rates, self._pieces = torque_limit, tuple(rates), tuple(pieces)
        quiet = replace(tables, render_friction=False)
        self._strokes = plate_strokes(quiet, pieces) if pieces else _sheet_strokes(tables)
        self._whole = self._binned(tables, 0.0)

    def change(self, other: ModelTables, friction_width: float = 0.0) -> float:
        """Relative rms difference of the felt torque where ``other`` is rendered instead.

        With a ``friction_width`` (rad) friction builds up over it after the blades turn round, as
        in the loop (`sc_near_rest`). A bin counts where either opens the blades; zero where
        none does.
        """
        one, two = self._whole, self._binned(other, friction_width)
        felt = np.maximum(one, two) > LEAST_SHARE * one.max()
        if not felt.any() or not one.max() > 0.0:
            return 0.0
        return float(np.sqrt(np.mean((two - one)[felt] ** 2) / np.mean(one[felt] ** 2)))

    def _binned(self, tables: ModelTables, friction_width: float) -> Array:
        found = [self._torque(tables, friction_width, rate) for rate in self._rates]
        held = np.clip(np.concatenate(found), -self._limit, self._limit)
        return np.asarray(held.reshape(-1, STROKE_TICKS // BINS).mean(axis=1))

    def _torque(self, tables: ModelTables, friction_width: float, rate: float) -> Array:
        """Torque (ticks that count,) along the strokes, a fresh sheet or plate before them."""
        model = PiecesModel(tables, self._pieces) if self._pieces else Kernel(tables)
        found = []
        for opening, advance, counts in self._strokes:
            if isinstance(model, Kernel):
                model.reset(0.0)
            steps = model.step_many(opening, -rate, advance)
            torque = steps["torque"].astype(np.float64)
            if tables.render_friction and friction_width > 0.0:
                built = _built_up(tables, opening, rate, friction_width)
                torque += built - steps["friction_torque"]
            found.append(torque[counts])
        return np.concatenate(found)


def felt_rates(tables: ModelTables, slowest: float, fastest: float) -> tuple[float, ...]:
    """Rates (rad/s) at which a scene's strokes are felt: its ends and their geometric mean.

    None below the rate up to which the package's own friction only passes through rest.
    """
    low = max(slowest, tables.friction_rate_eps)
    high = max(fastest, low)
    return tuple(float(rate) for rate in np.geomspace(low, high, 3))


def _built_up(tables: ModelTables, opening: Array, rate: float, width: float) -> Array:
    """Friction (N m) of blades that opened before: it turns round over twice the width."""
    stretch = np.maximum(width - (opening[0] - opening), -width) / width
    speed = max(rate, tables.friction_rate_eps)
    up, down = (
        table.evaluate([speed], held=True)[0]
        for table in (tables.friction_opening, tables.friction_closing)
    )
    factor = tables.friction_angle.evaluate(opening, held=True).astype(np.float64)
    return np.asarray(-np.where(stretch > 0.0, up, down) * factor * stretch)


def _sheet_strokes(tables: ModelTables) -> tuple[Stroke, ...]:
    """A stroke that cuts a uniform sheet, or those that press it; the sheet's edge is at 0."""
    contacts = np.array([tables.contact_min])
    if not tables.fracture_energy > 0.0:
        contacts = np.linspace(tables.contact_min, tables.contact_max, PRESSES)
    opening = np.linspace(tables.opening_max, tables.opening_min, STROKE_TICKS)
    counts = np.ones(STROKE_TICKS, dtype=np.bool_)
    return tuple((opening, np.full(STROKE_TICKS, -contact), counts) for contact in contacts)


def plate_strokes(tables: ModelTables, pieces: Sequence[Piece]) -> tuple[Stroke, ...]:
    """The closing strokes that cut a drawn plate: of each (opening, advance, whether it counts).

    Each closes over the scene's openings, after the plate was moved into the open blades until the
    nearest crack stands at the scene's nearest contact, or at the middle of its contacts where it
    stands in a strip that is not cut. A stroke that cuts nothing of the nearest piece is followed
    by one on the next. At most ``MOST_STROKES``.
    """
    model = PiecesModel(tables, pieces)
    closing = np.linspace(tables.opening_max, tables.opening_min, STROKE_TICKS)
    opening = np.concatenate([np.full(APPROACH_TICKS, tables.opening_max), closing])
    counts = np.arange(len(opening)) >= APPROACH_TICKS
    middle = 0.5 * (tables.contact_min + tables.contact_max)
    done, before = -np.inf, None
    strokes: list[Stroke] = []
    while len(strokes) < MOST_STROKES:
        front = _next_front(model, done)
        if front is None:
            break
        done, is_cut = front[0] + PROGRESS_M, front[1]
        place = front[0] - (tables.contact_min if is_cut else middle)
        start = place - tables.contact_max if before is None else before
        way = np.linspace(start, place, APPROACH_TICKS)
        advance = np.concatenate([way, np.full(STROKE_TICKS, place)])
        model.step_many(opening, 0.0, advance)
        strokes.append((opening, advance, counts))
        before = place
    return tuple(strokes)


def _next_front(model: PiecesModel, done: float) -> tuple[float, bool] | None:
    """The nearest crack beyond ``done``, and whether the strip it stands in is cut."""
    fronts = []
    for piece, crack, through in zip(model.pieces, model.cracks, model.cut_through, strict=True):
        if not through and crack > done:
            ahead = [strip for strip in piece.strips if crack < np.float32(strip.end_m)]
            energy = ahead[0].fracture_energy_J_per_m if ahead else 0.0
            fronts.append((crack, energy > 0.0))
    return min(fronts, default=None)
