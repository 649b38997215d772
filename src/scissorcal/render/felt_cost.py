"""What a softer response costs: by how much the torque of a scene's closing strokes changes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel

Array = NDArray[np.float64]
Stroke = tuple[Array, Array, NDArray[np.bool_]]

BINS = 25
STROKE_TICKS = 4000
APPROACH_TICKS = 400
"""With open blades, from one stroke's place to the next one's."""
MOST_STROKES = 64
"""Of a drawn plate; what lies beyond their reach is not compared."""
LEAST_SHARE = 0.05
"""Of the strokes' largest torque; the cost of derating is compared where torque is above."""
PROGRESS_M = 1e-6


def felt_change(
    tables: ModelTables, other: ModelTables, torque_limit: float, pieces: Sequence[Piece] = ()
) -> float:
    """Relative rms difference of torque, averaged over its ripple, in the scene's closing strokes.

    Both are stepped in the compiled core along one motion, at rest (rate 0, without friction), held
    to the torque limit, and averaged in 25 bins of opening in each stroke. Without ``pieces`` one
    stroke over the scene's openings closes on a sheet whose near edge is at the scene's nearest
    contact, or, where nothing is cut, at the middle of its contacts. Of a drawn plate of
    ``pieces``: see `plate_strokes`; there a bin counts where either of both laws is felt. Zero
    where no torque is felt.
    """
    quiet, soft = (replace(each, render_friction=False) for each in (tables, other))
    if pieces:
        motion = plate_strokes(quiet, pieces)
        one, two = (_binned(_cut(each, pieces, motion), torque_limit) for each in (quiet, soft))
        size = np.maximum(one, two)
    else:
        one, two = (_binned(_stroke(each), torque_limit) for each in (quiet, soft))
        size = one
    felt = size > LEAST_SHARE * one.max()
    if not felt.any() or one.max() <= 0.0:
        return 0.0
    return float(np.sqrt(np.mean((two - one)[felt] ** 2) / np.mean(one[felt] ** 2)))


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


def _cut(
    tables: ModelTables,
    pieces: Sequence[Piece],
    strokes: Sequence[Stroke],
) -> Array:
    """Torque (ticks that count,) of a fresh plate along the strokes."""
    model = PiecesModel(tables, pieces)
    found = [
        model.step_many(opening, 0.0, advance)["torque"][counts]
        for opening, advance, counts in strokes
    ]
    return np.concatenate(found).astype(np.float64)


def _stroke(tables: ModelTables) -> Array:
    kernel = Kernel(tables)
    pressed = 0.5 * (tables.contact_min + tables.contact_max)
    kernel.reset(tables.contact_min if tables.fracture_energy > 0.0 else pressed)
    opening = np.linspace(tables.opening_max, tables.opening_min, STROKE_TICKS)
    return np.asarray(kernel.step_many(opening, 0.0, 0.0)["torque"], dtype=np.float64)


def _binned(torque: Array, torque_limit: float) -> Array:
    held = np.minimum(torque, torque_limit)
    return np.asarray(held.reshape(-1, STROKE_TICKS // BINS).mean(axis=1))
