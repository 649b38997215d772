"""The largest drop of a drawn plate's torque, against drops that the compiled core shows."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.kernel import ModelTables, Piece, PiecesModel, StepFlag, Strip
from scissorcal.render.derating import needs_on
from scissorcal.render.drops import largest_drop
from tests.kernel.zoo import make_tables

FACE, LIMIT = 5e-5, 100.0


def sheet(*strips: tuple[float, float], begin: float = 0.0, scale: float = 1.0) -> Piece:
    return Piece(begin, FACE, scale, tuple(Strip(end, energy) for end, energy in strips))


def seen(tables: ModelTables, pieces: list[Piece], ticks: int = 6000) -> float:
    """The largest fall from one tick to the next while cracks run, in strokes 30 mm apart."""
    found = 0.0
    first = min(piece.begin_m for piece in pieces) - tables.contact_max
    last = max(piece.end_m for piece in pieces) - tables.contact_min
    for begun in np.linspace(first, first + 0.03, 20):
        model = PiecesModel(tables, pieces)
        for place in np.arange(begun, last, 0.03):
            model.step(1.4, 0.0, place)
            closing = np.linspace(tables.opening_max, tables.opening_min, ticks)
            step = model.step_many(closing, 0.0, place)
            fall = -np.diff(step["torque"].astype(np.float64))
            inside = step["flags"][:-1] & int(StepFlag.OUT_OF_RANGE | StepFlag.BEYOND_TIP) == 0
            found = max(found, float(np.max(fall[inside], initial=0.0)))
    return found


@pytest.mark.parametrize(
    ("kappa", "pieces"),
    [
        (1.0, [sheet((0.1, 0.6))]),
        (1.0, [sheet((0.03, 1.2), (0.05, 0.4), (0.2, 0.0))]),
        (1.0, [sheet((0.03, 1.2), (0.0305, 0.2), (0.2, 0.0))]),
        (1.0, [sheet((0.03, 1.2), (0.0302, 0.2), (0.0304, 0.1))]),
        (1.0, [sheet((0.05, 0.6)), sheet((0.05, 1.2), begin=0.02, scale=2.0)]),
        (0.8, [sheet((0.2, 0.6), (0.3, 0.0))]),
        (0.7, [sheet((0.03, 0.6), (0.05, 0.7), (0.2, 0.0))]),
    ],
)
def test_no_stroke_drops_by_more_and_some_by_nearly_as_much(
    kappa: float, pieces: list[Piece]
) -> None:
    tables = make_tables(kappa=kappa)
    stated, found = largest_drop(tables, LIMIT, pieces), seen(tables, pieces)
    assert found <= 1.02 * stated + 1e-3
    assert found >= 0.75 * stated


def test_a_smooth_strip_that_meets_only_tougher_ones_never_drops() -> None:
    tables = make_tables()
    assert largest_drop(tables, LIMIT, [sheet((0.03, 0.6), (0.05, 1.2), (0.1, 0.0))]) == 0.0


def test_a_long_weak_strip_keeps_a_piece_together() -> None:
    """A crack that leaves the tough band stops in what follows, unless that is too short."""
    tables = make_tables()
    whole = largest_drop(tables, LIMIT, [sheet((0.03, 1.2))])
    long = largest_drop(tables, LIMIT, [sheet((0.03, 1.2), (0.5, 0.6))])
    short = largest_drop(tables, LIMIT, [sheet((0.03, 1.2), (0.0301, 0.6))])
    assert short == pytest.approx(whole)
    assert long < 0.6 * whole


def test_what_is_above_the_limit_is_not_felt() -> None:
    tables = make_tables()
    assert 0.0 < largest_drop(tables, 0.1, [sheet((0.1, 0.6))]) <= 0.1
    assert needs_on(tables, LIMIT, [sheet((0.1, 0.6))]).drop_Nm == largest_drop(
        replace(tables, render_friction=True), LIMIT, [sheet((0.1, 0.6))]
    )
