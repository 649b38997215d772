"""Random models and plates, and the steepest slopes that the compiled core shows on them.

``python -m tests.package.random_plates SEED COUNT`` compares with the proved bounds and says how
tight they are.
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import ModelTables, Piece, PiecesModel, StepFlag, Strip, Table
from scissorcal.package.layer_slopes import LayerSlopes
from tests.kernel.zoo import BLADE_LENGTH, arc_edge, line_edge, make_tables, power_response

STROKES, PLACES = 24, 160
TURN_RAD, MOVE_M = 4e-4, 2e-5
BAD = int(StepFlag.ADVANCED | StepFlag.INVALID | StepFlag.BEYOND_TIP)
SAME = 1e-3
"""Share of the torque by which it may differ when the blades are back at a place."""
OUTSIDE = int(StepFlag.INVALID | StepFlag.BEYOND_TIP)


@dataclass(frozen=True)
class Case:
    """A model on a plate, within a torque limit (N m)."""

    tables: ModelTables
    limit: float
    pieces: tuple[Piece, ...]


@dataclass(frozen=True)
class Steepest:
    """The largest slopes found, by quantity, and while closing along a smooth crack (N m/rad)."""

    opening: float
    cross: float
    advance: float
    closing: float


def random_case(rng: np.random.Generator) -> Case:
    """Any blades, material, plate: up to 16 pieces, 64 strips, toughness ratios 0.01 to 100."""
    low = rng.uniform(0.08, 0.4)
    tables = make_tables(
        edge=_edge(rng),
        response=_response(rng),
        moving_blades=int(rng.integers(1, 3)),
        closure="work" if rng.random() < 0.8 else "eq4",
        kappa=1.0 if rng.random() < 0.5 else rng.uniform(0.5, 0.98),
        opening_min=low,
        opening_max=rng.uniform(low + 0.1, 1.1),
        contact_min=rng.uniform(0.008, 0.03),
        contact_max=rng.uniform(0.04, 0.06),
        tip_station=BLADE_LENGTH,
    )
    limit = float(10.0 ** rng.uniform(-0.5, 2.0))
    return Case(tables, limit, random_plate(rng))


def random_plate(rng: np.random.Generator) -> tuple[Piece, ...]:
    """Pieces anywhere along 80 mm, over, under and beside each other, some of them not cut."""
    count = int(rng.choice([1, 1, 1, 2, 2, 3, 6, 16]))
    most = 64 // count if rng.random() < 0.3 else 3
    toughness = 10.0 ** rng.uniform(-1.0, 0.5)
    pieces = []
    for _ in range(count):
        begin, length = rng.uniform(0.0, 0.04), 10.0 ** rng.uniform(-2.5, -1.0)
        strips = int(rng.integers(1, most + 1))
        ends = begin + length * np.sort(rng.uniform(0.05, 1.0, strips))
        ends += 1e-5 * np.arange(1, strips + 1)
        scale = float(10.0 ** rng.uniform(-1.0, 1.5))
        energies = scale * toughness * 10.0 ** rng.uniform(-2.0, 2.0, strips)
        if rng.random() < 0.1:
            energies[-1] = 0.0
        face = float(10.0 ** rng.uniform(-5.0, -2.7))
        parts = tuple(Strip(float(e), float(j)) for e, j in zip(ends, energies, strict=True))
        pieces.append(Piece(begin, face, scale, parts))
    return tuple(pieces)


def steepest(case: Case, rng: np.random.Generator) -> Steepest:
    """Close on the plate in strokes at many places, and try each place to and fro by a little."""
    tables = case.tables
    ends = [end for piece in case.pieces for end in (piece.begin_m, piece.end_m)]
    places = rng.uniform(min(ends) - tables.contact_max, max(ends) - tables.contact_min, STROKES)
    found = np.zeros(4)
    for place in np.sort(places):
        found = np.maximum(found, _stroke(case, float(place)))
    return Steepest(*(float(one) for one in found))


def _stroke(case: Case, place: float) -> Array:
    """One stroke through a fresh plate: opening, cross, advance and closing slope."""
    tables = case.tables
    low, high = tables.opening_min, tables.opening_max
    model = PiecesModel(tables, case.pieces)
    model.step_many(np.full(200, 1.4), 0.0, np.linspace(place - 0.1, place, 200))
    closing = np.linspace(high - TURN_RAD, low, PLACES)
    opening = np.repeat(closing, 5)
    opening[1::5] += TURN_RAD
    advance = np.full(len(opening), place)
    advance[3::5] -= MOVE_M
    behind = _presses_behind(case, place, opening, advance).reshape(-1, 5)
    step = model.step_many(opening, 0.0, advance)
    opening, advance = (one.astype(np.float32).astype(np.float64) for one in (opening, advance))
    torque, force = (step[name].astype(np.float64).reshape(-1, 5) for name in ("torque", "force"))
    flags = step["flags"].reshape(-1, 5)
    turn = np.diff(opening.reshape(-1, 5), axis=1)[:, 0]
    move = -np.diff(advance.reshape(-1, 5), axis=1)[:, 2]
    counts = (flags[:, 0] & OUTSIDE == 0) & np.all(flags[:, 1:] & BAD == 0, axis=1)
    counts &= (torque.max(axis=1) <= case.limit) & ~behind.any(axis=1)
    # a piece that let go on the way to and fro, at the tip or its far edge, is a drop and no slope
    kept = np.abs(torque[:, 2::2] - torque[:, :1]).max(axis=1)
    counts &= kept <= SAME * np.abs(torque[:, 0])
    rows = (
        np.abs(torque[:, 0] - torque[:, 1]) / turn,
        np.maximum(
            np.abs(force[:, 0] - force[:, 1]) / turn, np.abs(torque[:, 2] - torque[:, 3]) / move
        ),
        np.abs(force[:, 2] - force[:, 3]) / move,
    )
    best = [float(np.max(row[counts], initial=0.0)) for row in rows]
    smooth = tables.kappa == 1.0 and tables.closure == "work" and tables.release_falls
    both = counts[1:] & counts[:-1]
    rise = np.diff(torque[:, 0]) / -np.diff(closing)
    best.append(float(np.max(rise[both], initial=0.0)) if smooth else 0.0)
    return np.array(best)


def _presses_behind(case: Case, place: float, opening: Array, advance: Array) -> NDArray[np.bool_]:
    """Where a piece is pressed before the scene's nearest contact; beyond its farthest counts."""
    behind = np.zeros(len(opening), dtype=np.bool_)
    for piece in case.pieces:
        model = PiecesModel(case.tables, (piece,))
        model.step_many(np.full(200, 1.4), 0.0, np.linspace(place - 0.1, place, 200))
        step = model.step_many(opening, 0.0, advance)
        touches = step["flags"] & int(StepFlag.TOUCHING) != 0
        behind |= touches & (step["contact"] < case.tables.contact_min)
    return behind


def _edge(rng: np.random.Generator) -> Table:
    offset, taper = rng.uniform(-0.012, 0.001), rng.uniform(-0.03, 0.08)
    kind = rng.integers(3)
    if kind == 0:
        return line_edge(offset, taper)
    if kind == 1:
        return arc_edge(rng.uniform(-2.0, 3.0), offset, taper)
    s = np.linspace(0.0, BLADE_LENGTH, 12)
    depth, period = rng.uniform(0.0, 3e-4), rng.uniform(0.02, 0.05)
    wave = depth * np.sin(s / period * 2.0 * np.pi)
    slope = depth * 2.0 * np.pi / period * np.cos(s / period * 2.0 * np.pi)
    return Table(s, offset + taper * s + wave, taper + slope)


def _response(rng: np.random.Generator) -> Table:
    last = float(10.0 ** rng.uniform(-3.5, -2.0))
    knots = int(rng.choice([3, 8, 30, 200]))
    return power_response(10.0 ** rng.uniform(-1.0, 1.5), rng.uniform(1.0, 3.0), last, knots)


def main(seed: int, count: int) -> None:
    """Print how tight the bounds are over random cases, and each violation."""
    ratios: dict[str, list[float]] = {"opening": [], "cross": [], "advance": [], "closing": []}
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        case = random_case(rng)
        slopes, found = LayerSlopes(case.tables, case.limit, case.pieces), steepest(case, rng)
        for name in ratios:
            bound = slopes.bound("opening" if name == "closing" else name).value  # type: ignore[arg-type]
            measured = getattr(found, name)
            if measured > 0.0:
                ratios[name].append(bound / measured)
                if bound < measured:
                    print(f"case {index}: {name} {measured:.6g} above the bound {bound:.6g}")
    for name, row in ratios.items():
        least, median, high, most = np.quantile(row, [0.0, 0.5, 0.9, 1.0])
        figures = f"{least:.4f} {median:.3f} {high:.3f} {most:.3g}"
        print(f"{name}: {len(row)} cases, bound / found (least, median, 90 %, most) {figures}")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
