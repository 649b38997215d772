"""Results of every kind, made up, and their comparison."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from scissorcal.calibration.edge.result import SeenPair
from scissorcal.calibration.result import (
    Predictive,
    Proposal,
    ReplayComparison,
    ReplayRow,
    Result,
)
from tests.report.fits import cut_fit, friction_fit
from tests.report.geometry_fits import blade_result, camera_fit, imported_camera, plate_fit


def results() -> dict[str, Result]:
    """One result of each kind, with every optional member somewhere."""
    cut = cut_fit()
    friction = friction_fit()
    rng = np.random.default_rng(0)
    replay = ReplayComparison(
        stroke=1,
        recording="a.mcap",
        kind="closing",
        speed=0.5,
        opening=np.linspace(0.2, 0.8, 5),
        torque=np.linspace(0.0, 0.1, 5),
        rows=(ReplayRow(2, "a.mcap", "speed", 1.0, 0.9, 0.02, 0.004, 0.001, float("nan")),),
        sentence="Replaying stroke 1 misses the others.",
    )
    proposal = Proposal(
        "rate^2", "rate squared", 1e-3, 1e-4, "N m", 2e-3, 0.9, 0.1, 12.0, "", "It."
    )
    density = rng.normal(-5.0, 0.1, (8, 3))
    predictive = Predictive(
        torque=rng.normal(0.0, 0.1, (4, len(cut.series.measured))).astype(np.float32),
        stroke=np.array([0, 1, 4]),
        log_likelihood=density,
        log_likelihood_reference=np.array([100.0, 90.0, 80.0]),
        independent_share=0.5,
        candidates=("power", "spline, rippled"),
        candidate_log_likelihoods=np.stack([density, density - 1.0], axis=-1),
    )
    return {
        "friction": replace(
            friction,
            prior_draws=friction.draws[:7],
            nuisance=friction.parameters[:1],
            nuisance_draws=friction.draws[:, :1],
            replay=replay,
            critic=(proposal,),
            proposed=1e-3 * friction.series.measured,
            selection="The cheapest.",
        ),
        "cut": replace(cut, predictive=predictive),
        "blade": replace(blade_result(), openings=(SeenPair("a.jpg", 0.7),)),
        "camera": camera_fit(),
        "imported camera": imported_camera(),
        "plate": replace(plate_fit(), ambiguity=float("inf")),
    }


def difference(a: Any, b: Any, at: str = "result") -> str:
    """The first place where two values differ in type or content; empty where they are equal."""
    if type(a) is not type(b):
        return f"{at}: {type(a)} and {type(b)}"
    if isinstance(a, np.ndarray):
        equal = a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        return "" if equal else at
    if is_dataclass(a):
        pairs = [(f.name, getattr(a, f.name), getattr(b, f.name)) for f in fields(a)]
    elif isinstance(a, dict):
        if a.keys() != b.keys():
            return at
        pairs = [(key, value, b[key]) for key, value in a.items()]
    elif isinstance(a, tuple | list):
        if len(a) != len(b):
            return at
        pairs = [(str(i), x, y) for i, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return "" if a == b or (a != a and b != b) else f"{at}: {a} and {b}"
    return next((found for name, x, y in pairs if (found := difference(x, y, f"{at}.{name}"))), "")
