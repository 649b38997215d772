"""An edge through points: it keeps them, follows the curve between, and refuses what it cannot."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.model.edge_points import LARGEST_MISFIT_M, edge_through
from tests.model.golden_edges import golden


@settings(max_examples=60)
@given(
    st.integers(3, 200),
    st.floats(0.01, 0.5),
    st.floats(-0.5, 0.5),
    st.floats(-4.0, 4.0),
    st.integers(0, 2**32 - 1),
)
def test_parabolas_stay_parabolas_however_their_points_stand(
    count: int, length: float, rise: float, curvature: float, seed: int
) -> None:
    inner = np.random.default_rng(seed).uniform(0.001, 0.999, count - 2)
    station = np.unique(np.concatenate([[0.0], inner, [1.0]])) * length

    def law(s: np.ndarray) -> np.ndarray:
        return -0.008 + rise * s + 0.5 * curvature * s**2

    edge, misfit = edge_through(np.stack([station, law(station)], axis=1))
    dense = np.linspace(0.0, length, 501)
    assert misfit <= LARGEST_MISFIT_M
    assert np.max(np.abs(edge.offset_at(dense) - law(dense))) < 2 * LARGEST_MISFIT_M


def test_a_wavy_edge_is_followed_between_its_points() -> None:
    station = np.linspace(0.0, 0.075, 60)
    wave = -0.008 + 0.0005 * np.sin(2 * np.pi * station / 0.04)
    edge, misfit = edge_through(np.stack([station, wave], axis=1))
    dense = np.linspace(0.0, 0.075, 999)
    true = -0.008 + 0.0005 * np.sin(2 * np.pi * dense / 0.04)
    assert misfit <= LARGEST_MISFIT_M
    assert np.max(np.abs(edge.offset_at(dense) - true)) < 2 * LARGEST_MISFIT_M


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0.0], [0.07, 0.0]], "3 to 200"),
        ([[0.0, 0.0], [0.03, 0.0], [0.03, 0.1]], "rise strictly"),
        ([[0.01, 0.0], [0.03, 0.0], [0.07, 0.0]], "first station"),
        ([[0.0, 0.0], [0.03, np.nan], [0.07, 0.0]], "finite"),
        ([[0.0, 0.0], [0.01, 0.1], [0.02, 0.25]], "steeper than 80"),
        ([[s, 0.01 * (i % 2)] for i, s in enumerate(np.linspace(0, 0.1, 80))], "pieces leaves"),
    ],
)
def test_what_is_no_edge_is_refused(points: list[list[float]], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        edge_through(points)


@pytest.mark.parametrize("case", golden()["cases"], ids=lambda case: case["title"])
def test_the_golden_edges(case: dict[str, Any]) -> None:
    edge, misfit = edge_through(case["points_m"])
    assert len(edge.spline_m) == case["pieces"] + 3
    assert misfit <= LARGEST_MISFIT_M
    assert np.max(np.abs(edge.offset_at(case["at_m"]) - case["offset_m"])) < 1e-9
    assert np.max(np.abs(edge.slope_at(case["at_m"]) - case["slope"])) < 1e-6


@pytest.mark.parametrize("case", golden()["refused"], ids=lambda case: case["words"])
def test_the_golden_refusals(case: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=case["words"]):
        edge_through(case["points_m"])
