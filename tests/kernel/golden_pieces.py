"""Golden vectors of plates made of pieces, made by `reference_pieces`.

``python -m tests.kernel.golden_pieces`` writes them anew. The core takes a step where it ends, the
reference goes the way to there: of ripples, whose phase follows, only the energies are compared.
"""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from scissorcal.kernel import ModelTables
from scissorcal.kernel.plate import Piece, Strip
from tests.kernel.golden import FOLDER, model_of, single
from tests.kernel.reference_pieces import PIECES_COLUMNS, ReferencePieces
from tests.kernel.zoo import arc_edge, make_tables, power_response

FILE = "pieces.json"
STEPS = 240
FACE = 5e-5
SMOOTH, BOOKS = {"tolerance": 2e-5, "arrest_tolerance": 0.03}, {"tolerance": 0.03}

HOLE = (Piece(0.0, FACE, 1.0, (Strip(0.01, 0.6),)), Piece(0.014, FACE, 1.0, (Strip(0.05, 0.6),)))
LAYER = (
    Piece(0.0, FACE, 1.0, (Strip(0.06, 0.6),)),
    Piece(0.008, 2e-4, 2.0, (Strip(0.02, 0.8),)),
)
STRIPS = (
    Piece(
        *(0.0, FACE, 1.0),
        (
            *(Strip(0.006, 0.6), Strip(0.01, 0.3), Strip(0.0101, 0.05), Strip(0.0102, 0.7)),
            *(Strip(0.018, 0.9), Strip(0.0181, 0.0)),
        ),
    ),
)


def hand(steps: int = STEPS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Closing, half open again, closing further, while the pivot creeps on, in float32."""
    opening = np.concatenate(
        [
            np.linspace(0.8, 0.45, steps // 3),
            np.linspace(0.45, 0.7, steps // 6),
            np.linspace(0.7, 0.22, steps // 2),
        ]
    )
    columns = (opening, np.gradient(opening) * 100.0, np.linspace(-0.03, -0.022, len(opening)))
    first, second, third = (column.astype(np.float32) for column in columns)
    return first, second, third


def pieces_cases() -> dict[str, tuple[ModelTables, tuple[Piece, ...]]]:
    """Title -> tables and pieces."""
    coarse = power_response(knots=25)
    plain, one = {"response": coarse}, {"response": coarse, "moving_blades": 1}
    damped = {"render_friction": True, "rate_damping": 20.0, "closure": "eq4"}
    return {
        "a hole": (make_tables(**plain), HOLE),
        "a layer": (make_tables(**plain), LAYER),
        "strips": (make_tables(**plain), STRIPS),
        "a hole, one blade, hollow edge": (make_tables(**one, edge=arc_edge(2.0)), HOLE),
        "strips, one blade, friction and damping": (make_tables(**one, **damped), STRIPS),
        "a hole, rippled": (make_tables(**plain, kappa=0.7), HOLE),
        "a layer, rippled": (make_tables(**plain, kappa=0.7), LAYER),
        "strips, rippled": (make_tables(**plain, kappa=0.85), STRIPS),
    }


def pieces_vectors() -> dict[str, Any]:
    """Inputs and outputs of all cases; fracture and arrest are sums since the start."""
    cases = []
    opening, rate, advance = (column.tolist() for column in hand())
    for title, (tables, pieces) in pieces_cases().items():
        plate = ReferencePieces(tables, pieces)
        rows = [plate.step(*row) for row in zip(opening, rate, advance, strict=True)]
        is_smooth = tables.kappa == 1.0
        columns = PIECES_COLUMNS if is_smooth else PIECES_COLUMNS[3:]
        cases.append(
            {
                "title": title,
                **(SMOOTH if is_smooth else BOOKS),
                "model": model_of(tables),
                "pieces": [asdict(piece) for piece in pieces],
                "opening": opening,
                "rate": [single(value) for value in rate],
                "advance": advance,
                **{f"out_{name}": [row[name] for row in rows] for name in columns},
                "cracks": plate.cracks,
            }
        )
    return {"format": "scissorcal-golden-pieces/1", "cases": cases}


def write() -> None:
    """Write the vectors."""
    text = json.dumps(pieces_vectors(), allow_nan=False, separators=(",", ":"))
    text = text.replace('{"title"', '\n{"title"') + "\n"
    (FOLDER / FILE).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
