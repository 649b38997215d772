"""Proved bounds: never below what a dense search finds, and not far above it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.model import (
    Edge,
    FrictionLaw,
    Response,
    edge_breaks,
    edge_curvature,
    friction_level,
    level_curvature,
    response_breaks,
    response_curvature,
)
from scissorcal.package.average import AverageTorque
from scissorcal.package.bound import ExactTorque
from scissorcal.package.compile import compile_model, scene_ranges, table_file, table_laws, table_of
from scissorcal.package.exact import FitDraws, central_model
from scissorcal.package.grid import Points
from scissorcal.package.proved_tables import proved_table, seen_deviation
from scissorcal.package.proved_torque import proved_torque
from scissorcal.package.tables import NumberFormat, TableLaw, fit_table
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.package.test_bound import CASES

FORMATS = st.sampled_from(["float32", "int16"])


def judge(law: TableLaw, tolerance: float, number_format: NumberFormat) -> None:
    """Compare the proved bound of a table with 20,000 places, and with its own search."""
    fitted = fit_table(replace(law, scale=None), tolerance=tolerance, number_format=number_format)
    array = fitted.array.astype(np.float32)
    proof = proved_table(law, array)
    assert proof is not None
    rng = np.random.default_rng(8)
    x = np.concatenate([np.linspace(0, 1, 12_000), rng.random(8_000), np.geomspace(1e-9, 1, 2_000)])
    x = (array[0, 0] + x * (array[0, -1] - array[0, 0])).astype(np.float32)
    x = np.clip(x, array[0, 0], array[0, -1])
    table = table_of(array)
    away = np.abs(table.evaluate(x).astype(np.float64) - law.law(x.astype(np.float64)))
    assert np.max(away) <= proof.proved
    # what float32 rounds is bounded for the worst case and hardly seen: beside it, near the truth,
    # or, where a cubic holds the law exactly, a thousandth of the largest value: what the cells in
    # which curvatures are bounded leave
    little = 1e-3 * float(np.max(np.abs(array[1])))
    assert proof.proved <= 1.6 * seen_deviation(law, array) + np.max(proof.rounding) + little
    place = np.searchsorted(proof.high, x.astype(np.float64)).clip(0, len(proof.high) - 1)
    assert np.all(away <= proof.value[place] + proof.rounding[place])


@settings(max_examples=30)
@given(
    family=st.sampled_from(["power", "exponential", "spline"]),
    exponent=st.floats(0.5, 6.0),
    force=st.floats(1e-2, 1e2),
    step=st.floats(-1.0, 1.0),
    tolerance=st.sampled_from([0.05, 1e-2, 1e-3, 1e-4]),
    number_format=FORMATS,
)
def test_responses(
    family: Any,
    exponent: float,
    force: float,
    step: float,
    tolerance: float,
    number_format: NumberFormat,
) -> None:
    shape, knots = ((step,), (1.5e-4, 3e-4, 6e-4)) if family == "spline" else ((), ())
    response = Response(family, force, exponent, 3e-4, shape, knots)
    law = TableLaw(
        response.force_at,
        response.stiffness_at,
        0.0,
        1e-3,
        monotone=True,
        curvature=lambda low, high: response_curvature(response, low, high),
        breaks=response_breaks(response),
    )
    judge(law, tolerance, number_format)


@settings(max_examples=10)
@given(seed=st.integers(0, 1000), tolerance=st.sampled_from([1e-2, 1e-4]), number_format=FORMATS)
def test_spline_edges(seed: int, tolerance: float, number_format: NumberFormat) -> None:
    weights = np.random.default_rng(seed).normal(0.0, 2e-4, 8)
    edge = Edge("spline", -0.008, 0.03, 0.07, spline_m=tuple(weights), spline_start_m=0.01)
    law = TableLaw(
        edge.offset_at,
        edge.slope_at,
        -0.003,
        0.074,
        curvature=lambda low, high: edge_curvature(edge, low, high),
        breaks=edge_breaks(edge),
    )
    judge(law, tolerance, number_format)


@settings(max_examples=10)
@given(
    scale=st.floats(0.01, 1.0),
    tolerance=st.sampled_from([5e-2, 1e-3, 1e-4]),
    number_format=FORMATS,
)
def test_friction_levels(scale: float, tolerance: float, number_format: NumberFormat) -> None:
    friction = FrictionLaw(
        {"coulomb": 0.01, "stribeck": 0.006, "stribeck_rate": scale, "viscous": 0.003}
    )
    law = TableLaw(
        lambda speed: friction_level(friction, 1.0, speed)[0],
        lambda speed: friction_level(friction, 1.0, speed)[1],
        0.0,
        2.0,
        curvature=lambda low, high: level_curvature(friction, 1.0, low, high),
    )
    judge(law, tolerance, number_format)


def proof_and_deviation(
    name: str, cut: dict[str, Any], tolerance: float, **scene: Any
) -> tuple[Any, float]:
    """The proof of a whole scene's torque, and the largest deviation at 30,000 random places."""
    chosen = recipe(name, **scene)
    centre = [FitDraws.centre(fit) for fit in (cut_fit(chosen, **cut), friction_fit())]
    model = central_model(*centre)
    laws, compiled = table_laws(model, chosen), compile_model(model, chosen, tolerance=tolerance)
    proofs = {
        name: proved_table(law, compiled.arrays[table_file(name)]) for name, law in laws.items()
    }
    ranges, limit = scene_ranges(chosen), chosen.limits.torque_Nm
    proof = proved_torque(model, laws, proofs, compiled, ranges, limit)
    rng = np.random.default_rng(23)
    slow, fast = max(0.02, ranges.opening_rate_rad_per_s[0]), ranges.opening_rate_rad_per_s[1]
    points = Points(
        rng.uniform(*ranges.opening_rad, 30_000),
        rng.uniform(slow, fast, 30_000) * rng.choice([-1.0, 1.0], 30_000),
        rng.uniform(*ranges.contact_m, 30_000),
    )
    exact = ExactTorque.at(model, points, limit)
    average = AverageTorque(compiled.mechanics, ranges, compiled.arrays)
    return proof, float(np.max(exact.deviation(average)))


PROVED = ("paper", "rippled", "tough", "pressed", "damped", "pressed, spline", "eighth power")


@pytest.mark.parametrize("title", PROVED)
def test_torque_stays_within_its_proved_bound(title: str) -> None:
    name, cut = CASES[title]
    proof, found = proof_and_deviation(name, cut, 1e-2)
    assert proof.bound_Nm is not None
    assert found <= proof.bound_Nm <= 12.0 * found
    assert "float32 rounding" in proof.not_proved[0]


@pytest.mark.parametrize("closure", ["work", "eq4"])
def test_both_closures_are_proved(closure: str) -> None:
    proof, found = proof_and_deviation("paper-80gsm", {}, 1e-2, closure=closure)
    assert found <= proof.bound_Nm <= 12.0 * found


@pytest.mark.parametrize(
    ("title", "words"),
    [
        ("rippled exponential", "none is of the table of mean energy"),
        ("square root", "exceed the torque limit"),
    ],
)
def test_where_nothing_is_proved_it_says_why(title: str, words: str) -> None:
    name, cut = CASES[title]
    proof, _ = proof_and_deviation(name, cut, 1e-2)
    assert proof.bound_Nm is None
    assert words in proof.not_proved[0]
