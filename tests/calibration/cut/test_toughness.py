"""Toughness from fracture energy and thickness: exact quantiles, and where none is stated."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.cut.unknowns import with_toughness
from scissorcal.calibration.store import load_fit, save
from scissorcal.recipe import Recipe
from tests.package.fits import cut_fit, recipe


def thick(sd_mm: float | None) -> Recipe:
    chosen = recipe()
    material = chosen.material.model_copy(update={"thickness_sd_mm": sd_mm})
    return chosen.model_copy(update={"material": material})


@pytest.mark.parametrize("sd_mm", [0.0, 0.004, 0.02])
def test_toughness_includes_both_uncertainties(sd_mm):
    """Standard deviations of logarithms add in squares; 3 % is three of the estimate's own."""
    fit = cut_fit(thick(sd_mm), energy=0.5, spread=0.03, draws=6000)
    found = with_toughness(fit, thick(sd_mm), np.random.default_rng(5)).derived[0]
    expected = math.hypot(0.03, math.sqrt(math.log1p((sd_mm / 0.1) ** 2)))
    assert (found.name, found.unit) == ("toughness", "J/m^2")
    assert math.log(found.q95 / found.q05) / 3.29 == pytest.approx(expected, rel=0.05)
    assert found.q50 == pytest.approx(5000.0 * math.sqrt(1 + (sd_mm / 0.1) ** 2), rel=0.01)
    assert found.identifiability < 0.2


def test_toughness_needs_a_thickness_and_a_cut():
    rng = np.random.default_rng(6)
    fit = cut_fit(thick(None))
    assert with_toughness(fit, thick(None), rng) is fit
    pressed = cut_fit(recipe("press-only"), energy=None)
    assert with_toughness(pressed, recipe("press-only"), rng) is pressed


def test_toughness_is_derived_and_not_a_parameter_of_the_law(tmp_path):
    fit = cut_fit(thick(0.005))
    found = with_toughness(fit, thick(0.005), np.random.default_rng(7))
    assert found.parameters == fit.parameters
    assert found.draws is fit.draws
    again = with_toughness(fit, thick(0.005), np.random.default_rng(7))
    assert again.derived == found.derived
    save(found, tmp_path / "cut.nc")
    read = load_fit(tmp_path / "cut.nc")
    assert read.derived == found.derived
    assert np.array_equal(read.derived_draws, found.derived_draws)
    assert replace(found, derived=(), derived_draws=None).derived_draws is None
