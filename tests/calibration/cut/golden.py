"""Golden vectors of the cut's likelihood: the twin's answers, for C and for Python.

Written anew by ``python -m tests.calibration.cut.golden``.
"""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from tests.calibration.cut.made_segments import made_data, made_parameters, responses
from tests.calibration.cut.twin import log_likelihood

PATH = Path(__file__).resolve().parents[2] / "golden" / "cut_fit.json"
TOLERANCE = 1e-9
CASES = (
    ("power", "rippled", 2, 0.0),
    ("power", "smooth", 0, 2e-5),
    ("exponential", "rippled", 0, 0.0),
    ("spline", "rippled", 2, 0.0),
    ("power", "none", 2, 0.0),
)


def golden() -> dict[str, Any]:
    """Data, parameters and answers of every case, numbers to 17 digits."""
    cases = []
    for seed, (family, fracture, edge_count, known_sd) in enumerate(CASES):
        data = made_data(seed, edge_count, known_sd)
        given = made_parameters(responses()[family], fracture, edge_count=edge_count)
        twin = log_likelihood(data, given)
        codes = ("none", "smooth", "rippled")
        cases.append(
            {
                "title": f"{family}, {fracture}",
                "data": _plain(data),
                "parameters": {**_plain(given), "fracture": codes.index(fracture)},
                "total": twin.total,
                "terms": twin.terms.tolist(),
                "residuals": twin.residuals.tolist(),
                "standardised": twin.standardised.tolist(),
                "places": twin.places.tolist(),
                "log_period": twin.log_period,
            }
        )
    return {"tolerance": TOLERANCE, "cases": cases}


def _plain(record: Any) -> dict[str, Any]:
    values = {f.name: getattr(record, f.name) for f in fields(record) if not f.name.startswith("_")}
    return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in values.items()}


if __name__ == "__main__":
    PATH.write_text(json.dumps(golden(), separators=(",", ":")) + "\n", encoding="utf-8")
