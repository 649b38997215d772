"""Golden vectors of a crack's walk: the plain twin's answers, for C.

Written anew by ``python -m tests.kernel.golden_crack``.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.calibration import Sheet, crack_law
from scissorcal.model import Cutting, Edge, Response
from tests.kernel.reference_crack import stored, walk

PATH = Path(__file__).resolve().parents[1] / "golden" / "crack.json"
TOLERANCE = 1e-9
SAMPLES = 60
POWER = Response("power", 1.5, 1.4, 3e-4)
LINE = Edge("line", -0.008, 0.03, 0.075)
BENT = Edge("cubic", -0.008, 0.02, 0.075, curvature_per_m=1.2, bend_per_m2=8.0)
CASES = {
    "line, rippled": Cutting(LINE, POWER, 1, 1e-4, 0.55, 0.7),
    "bent, both blades, rippled": Cutting(BENT, POWER, 2, 5e-5, 0.55, 0.85),
    "bent, eq4, pressed": Cutting(BENT, POWER, 1, 1e-4, None, 1.0, "eq4"),
}


def golden() -> dict[str, Any]:
    """Curves, motion and answers of every case, numbers to 17 digits."""
    phase = np.linspace(0.0, 3 * np.pi, SAMPLES)
    opening = 0.5 + 0.3 * np.cos(phase) - 0.03 * phase / np.pi
    advance = -0.03 + 0.002 * np.linspace(0.0, 1.0, SAMPLES)
    sheet = Sheet(1.0 + 0.1 * np.sin(np.arange(30.0)), 1e-3)
    knots = sheet.step_m * np.arange(30.0)
    cases = []
    for title, one in CASES.items():
        law = crack_law(one, 1e-3, sheet)
        tough = (one.fracture_energy or 0.0) * sheet.relative
        found = walk(one, lambda x, t=tough: float(np.interp(x, knots, t)), opening, advance)
        curves = {
            name: {
                "first": curve.first,
                "step": curve.step,
                "value": curve.value.tolist(),
                "slope": curve.slope.tolist(),
            }
            for name, curve in (
                ("edge", law.edge),
                ("response", law.response),
                ("energy", law.energy),
            )
        }
        cases.append(
            {
                "title": title,
                **curves,
                "moving_blades": one.moving_blades,
                "upper_face": one.upper_face_m,
                "eq4": int(one.closure == "eq4"),
                "fracture": {"none": 0, "smooth": 1, "rippled": 2}[law.fracture],
                "kappa": float(one.kappa),
                "tick_s": law.tick_s,
                "tough_step": sheet.step_m,
                "tough": tough.tolist(),
                "opening": opening.tolist(),
                "advance": advance.tolist(),
                "torque": found.torque,
                "push": found.push,
                "place": found.places,
                "lost": found.lost,
                "jumps": found.jumps,
                "stored": stored(one, opening[-1], advance[-1], found.place),
            }
        )
    return {"tolerance": TOLERANCE, "cases": cases}


if __name__ == "__main__":
    PATH.write_text(json.dumps(golden(), separators=(",", ":")) + "\n", encoding="utf-8")
