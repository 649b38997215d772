"""Response and toughness: integrals, inverses, and a random field whose mean is exact."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.sim.blade import FORCE_CEILING_N, Response, Sheet
from tests.device.sim.build import specimen


def material(**changes: object) -> object:
    return specimen(material=changes).material


@pytest.mark.parametrize(("family", "exponent"), [("power", 1.6), ("exponential", 1.4)])
def test_force_passes_through_its_reference_and_back(family: str, exponent: float) -> None:
    response = Response(material(response=family, response_exponent=exponent, response_force_N=2.5))
    assert response.force(3e-4) == pytest.approx(2.5, rel=1e-12)
    assert response.indentation(response.force(1.7e-4)) == pytest.approx(1.7e-4, rel=1e-12)
    assert response.force(-1e-4) == 0.0
    assert response.energy(0.0) == 0.0


@pytest.mark.parametrize("family", ["power", "exponential"])
def test_energy_is_the_integral_of_the_force_even_beyond_the_ceiling(family: str) -> None:
    response = Response(material(response=family, response_exponent=1.4))
    for end in (1e-9, 1e-4, 1e-3, 2.0 * response.ceiling):
        grid = np.linspace(0.0, end, 200_001)
        force = np.array([response.force(x) for x in grid])
        integral = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(grid)))
        assert response.energy(end) == pytest.approx(integral, rel=1e-5)
    assert response.force(1.0) == FORCE_CEILING_N


@given(
    force=st.floats(1e-3, 1e3),
    exponent=st.floats(0.1, 20),
    indentation=st.floats(0, 1),
    family=st.sampled_from(["power", "exponential"]),
)
def test_extreme_responses_stay_finite_and_rise(
    force: float, exponent: float, indentation: float, family: str
) -> None:
    response = Response(
        material(response=family, response_force_N=force, response_exponent=exponent)
    )
    assert 0.0 <= response.force(indentation) <= FORCE_CEILING_N
    assert response.force(indentation) <= response.force(indentation * 1.01 + 1e-9) * (1 + 1e-9)
    assert math.isfinite(response.energy(indentation))


def test_a_sheets_mean_toughness_is_exactly_the_stated_one() -> None:
    varied = material(toughness_variation=0.1, correlation_length_mm=1.5)
    for seed in range(5):
        sheet = Sheet(varied, np.random.default_rng(seed))
        assert sheet.work_between(0.0, sheet.length) == pytest.approx(0.5 * 0.18, rel=1e-12)


def test_the_toughness_field_has_its_stated_spread_and_length() -> None:
    """Over 40 sheets of 120 correlation lengths the spread is known to about 1 %."""
    varied = material(toughness_variation=0.1, correlation_length_mm=1.5)
    places = np.arange(0.0, 0.18, 1.5e-4)
    fields = []
    for seed in range(40):
        sheet = Sheet(varied, np.random.default_rng(seed))
        fields.append([sheet.fracture_energy_at(x) / 0.5 - 1.0 for x in places])
    field = np.array(fields)
    assert field.std() == pytest.approx(0.1, rel=0.05)
    lag = 10  # one correlation length
    correlation = np.mean(field[:, lag:] * field[:, :-lag]) / np.mean(field**2)
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.05)


def test_work_between_is_the_integral_of_the_local_toughness() -> None:
    sheet = Sheet(material(toughness_variation=0.2), np.random.default_rng(3))
    grid = np.linspace(0.0123, 0.0456, 100_001)
    local = np.array([sheet.fracture_energy_at(x) for x in grid])
    integral = float(np.sum(0.5 * (local[1:] + local[:-1]) * np.diff(grid)))
    assert sheet.work_between(0.0123, 0.0456) == pytest.approx(integral, rel=1e-8)


def test_nothing_cuts_a_sheet_without_toughness() -> None:
    sheet = Sheet(material(toughness_J_per_m2=None), np.random.default_rng(0))
    assert sheet.fracture_energy_at(0.0) == math.inf
