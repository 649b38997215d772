"""Tables against the laws they stand for, up to the extremes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.aliases import Array
from scissorcal.model import Response
from scissorcal.package.tables import FLOOR, LARGEST_TABLE, TableLaw, fit_table, hermite

FLOAT32_ROUNDING = 2e-6
"""A few float32 roundings while a cubic is evaluated, as a share of its value."""


def independent_points(low: float, high: float) -> Array:
    """Even and geometric places that no knot was chosen by."""
    even = np.linspace(low, high, 7919)
    return np.sort(np.concatenate([even, low + (high - low) * np.geomspace(1e-12, 1.0, 4001)]))


@settings(max_examples=60)
@given(
    family=st.sampled_from(["power", "exponential"]),
    exponent=st.floats(0.5, 8.0),
    force=st.floats(1e-3, 1e3),
    reach=st.floats(1e-5, 1e-2),
    tolerance=st.sampled_from([1e-3, 1e-4]),
)
def test_response_tables_keep_their_tolerance(
    family: str, exponent: float, force: float, reach: float, tolerance: float
) -> None:
    law = Response("power", force, exponent, 3e-4)
    if family == "exponential":
        law = Response("exponential", force, exponent, max(3e-4, reach / 5))
    fitted = fit_table(
        TableLaw(law.force_at, law.stiffness_at, 0.0, reach, monotone=True), tolerance=tolerance
    )
    assert fitted.met
    assert len(fitted.table.x) <= LARGEST_TABLE
    x = independent_points(0.0, float(fitted.table.x[-1])).astype(np.float32)
    exact = law.force_at(x.astype(np.float64))
    allowed = tolerance * np.maximum(exact, FLOOR * exact.max()) + FLOAT32_ROUNDING * exact
    assert np.all(np.abs(fitted.table.evaluate(x) - exact) <= allowed)


@settings(max_examples=40)
@given(exponent=st.floats(0.5, 8.0), tolerance=st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_monotone_tables_never_fall(exponent: float, tolerance: float) -> None:
    law = Response("power", 2.0, exponent, 3e-4)
    table = fit_table(
        TableLaw(law.force_at, law.stiffness_at, 0.0, 1e-3, monotone=True), tolerance=tolerance
    ).table
    knots, values, slopes = (a.astype(np.float64) for a in (table.x, table.y, table.slope))
    x = independent_points(float(knots[0]), float(knots[-1]))
    steps = np.diff(hermite(knots, values, slopes, x))
    assert np.all(steps >= -1e-12 * values.max())


def test_hermite_passes_through_values_and_slopes() -> None:
    knots = np.array([0.0, 0.3, 1.0])
    x = np.linspace(0.0, 1.0, 101)
    assert np.allclose(hermite(knots, knots**3, 3 * knots**2, x), x**3, rtol=0, atol=1e-15)


def test_a_cubic_needs_two_knots_only() -> None:
    fitted = fit_table(
        TableLaw(lambda x: 1 - x + 4 * x**3, lambda x: -1 + 12 * x**2, -1.0, 2.0), tolerance=1e-5
    )
    assert len(fitted.table.x) == 2
    assert fitted.met


def test_knots_gather_where_the_law_bends() -> None:
    """A friction level falls steeply at low rates and is nearly straight beyond."""
    fitted = fit_table(
        TableLaw(
            lambda w: 0.01 + 0.006 * np.exp(-((w / 0.02) ** 2)),
            lambda w: -0.012 * w / 4e-4 * np.exp(-((w / 0.02) ** 2)),
            0.0,
            2.0,
        ),
        tolerance=1e-4,
    )
    assert fitted.met
    assert np.mean(fitted.table.x < 0.1) > 0.7


def test_a_table_with_too_few_knots_reports_its_error() -> None:
    fitted = fit_table(
        TableLaw(np.sqrt, lambda x: 0.5 / np.sqrt(x), 0.0, 1.0, monotone=True),
        tolerance=1e-6,
        largest=12,
    )
    assert len(fitted.table.x) == 12
    assert not fitted.met


def test_scale_sets_where_precision_may_end() -> None:
    law = Response("power", 2.0, 4.0, 3e-4)
    coarse, fine = (
        fit_table(
            TableLaw(law.force_at, law.stiffness_at, 0, 3e-3, monotone=True, scale=scale),
            tolerance=1e-4,
        ).table
        for scale in (None, 1.0)
    )
    x = np.array([2e-4], dtype=np.float32)
    exact = law.force_at(x.astype(np.float64))
    assert abs(fine.evaluate(x) - exact) <= 1.1e-4 * 0.5
    assert abs(fine.evaluate(x) - exact) < abs(coarse.evaluate(x) - exact)


@pytest.mark.parametrize(
    ("law", "low", "high", "words"),
    [
        (lambda x: -x, 0.0, 1.0, "falls"),
        (lambda x: np.where(x > 0.5, np.inf, x), 0.0, 1.0, "not finite"),
        (lambda x: x * 1e39, 0.0, 1.0, "single precision"),
        (lambda x: x, 1.0, 1.0, "low < high"),
        (lambda x: x, 0.0, float("nan"), "low < high"),
    ],
)
def test_a_law_that_no_table_can_represent_is_refused(
    law: object, low: float, high: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        fit_table(TableLaw(law, np.ones_like, low, high, monotone=True), tolerance=1e-3)  # type: ignore[arg-type]
