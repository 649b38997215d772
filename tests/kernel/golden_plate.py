"""Golden vectors of a plate that moves between the blades, made by `reference_plate`.

``python -m tests.kernel.golden_plate`` writes them anew.
"""

import json
from dataclasses import fields
from typing import Any

import numpy as np

from scissorcal.kernel import ModelTables, Section
from tests.kernel.golden import FOLDER, model_of, single
from tests.kernel.reference_plate import PLATE_COLUMNS, Placed, ReferencePlate
from tests.kernel.zoo import arc_edge, make_tables, power_response

FILE = "plate.json"
NAMES = tuple(field.name for field in fields(Section))
STEPS = 120


def plate_cases() -> dict[str, tuple[ModelTables, dict[str, Any]]]:
    """Title -> tables, and opening, rate, advance and section over the steps."""
    coarse = power_response(knots=40, exponent=1.5)
    upper = {"response": coarse, "moving_blades": 1, "upper_face": 1e-4}
    share = np.linspace(0.0, 1.0, STEPS)
    stroke = {"opening": 0.55 - 0.3 * np.sin(np.pi * share) ** 2, "advance": -0.02}
    rest = {"edge_x": 0.0, "edge_y": 1e-4, "pitch": 0.0, "stretch": 1.0, "thickening": 1.0}
    pitched = rest | {"pitch": 0.09 * share, "edge_y": 1e-4 - 2e-3 * share}
    moved = rest | {"edge_x": 0.006 - 0.009 * share, "edge_y": 3e-3, "pitch": -0.05 + 0.1 * share}
    turned = rest | {"stretch": 1.0 + 0.01 * share, "thickening": 1.02, "pitch": 0.05}
    centred = rest | {"edge_y": 5e-5, "stretch": 1.0 - 0.004 * share, "thickening": 1.01}
    pushed = {"opening": 0.42, "advance": -0.02} | rest | {"edge_x": -0.014 * share}
    damped = {"render_friction": True, "rate_damping": 20.0}
    return {
        "pitched while it is cut": (make_tables(**upper), stroke | pitched),
        "moved and pitched, rippled": (make_tables(**upper, kappa=0.8), stroke | moved),
        "turned, bulging edge": (make_tables(**upper, edge=arc_edge(-2.0)), stroke | turned),
        "pushed into resting blades": (make_tables(**upper), pushed),
        "pressed": (
            make_tables(**upper, fracture_energy=0.0),
            {"opening": 0.35, "advance": -0.02} | moved,
        ),
        "friction and damping": (make_tables(**upper, **damped), stroke | pitched),
        "between two blades": (make_tables(response=coarse), stroke | centred),
        "between two blades, rippled": (make_tables(response=coarse, kappa=0.75), stroke | centred),
    }


def plate_vectors() -> dict[str, Any]:
    """Inputs and outputs of all cases."""
    cases = []
    for title, (tables, motion) in plate_cases().items():
        rows = {name: np.broadcast_to(value, STEPS) for name, value in motion.items()}
        columns = {name: [single(v) for v in rows[name]] for name in rows}
        columns["rate"] = [single(v) for v in np.gradient(rows["opening"]) * 1e3]
        plate = ReferencePlate(tables)
        out = []
        for k in range(STEPS):
            section = Section(*(columns[name][k] for name in NAMES))
            at = Placed.of(section, columns["opening"][k], columns["advance"][k])
            out.append(plate.step(at, columns["rate"][k]))
        cases.append(
            {
                "title": title,
                "model": model_of(tables),
                **columns,
                **{f"out_{name}": [row[name] for row in out] for name in PLATE_COLUMNS},
            }
        )
    return {"format": "scissorcal-golden-plate/1", "tolerance": 5e-4, "cases": cases}


def write() -> None:
    """Write the vectors."""
    text = json.dumps(plate_vectors(), allow_nan=False, separators=(",", ":"))
    text = text.replace('{"title"', '\n{"title"') + "\n"
    (FOLDER / FILE).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
