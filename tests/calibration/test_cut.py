"""Cuts: recovery of known materials, refusals, and the pieces of the likelihood."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.calibration import fit_cut, fit_friction
from scissorcal.calibration.cut_likelihood import (
    contrasts,
    make_blocks,
    variance_of_contrasts,
)
from scissorcal.errors import InputError
from scissorcal.recipe.schema import Recipe
from tests.calibration.truth import Truth, cut_recording, friction_recording

RECIPES = Path(__file__).resolve().parents[2] / "recipes"
STEEL = Truth(kappa=1.0)


def recipe(**cut) -> Recipe:
    facts = tomllib.loads((RECIPES / "paper-80gsm.toml").read_text(encoding="utf-8"))
    facts["fit"]["friction"] = {"rung": "coulomb+viscous", "symmetry": "asymmetric"}
    facts["fit"]["cut"].update(cut)
    return Recipe.model_validate(facts)


def friction_of(truth: Truth, rng: np.random.Generator):
    settings = recipe().fit.friction
    return fit_friction((friction_recording(truth, rng),), settings, effort="draft", rng=rng)


@pytest.fixture(scope="module")
def friction():
    return friction_of(STEEL, np.random.default_rng(10))


@pytest.mark.slow
def test_a_smooth_cut_is_recovered(friction):
    """Four standard deviations: false alarm 2e-4 for three parameters."""
    rng = np.random.default_rng(11)
    cuts = cut_recording(STEEL, rng, sheets=2)
    found = fit_cut((cuts,), recipe(fracture="smooth"), friction, effort="standard", rng=rng)
    for name, value in (
        ("response_force", STEEL.force),
        ("response_exponent", STEEL.exponent),
        ("fracture_energy", STEEL.fracture_energy),
    ):
        parameter = found.parameter(name)
        assert abs(parameter.mean - value) < 4 * parameter.sd, name
    assert found.parameter("fracture_energy").sd < 0.01
    assert {v.check: v.status for v in found.verdicts}["k-hat"] == "pass"


@pytest.mark.slow
def test_a_ripple_is_seen_for_what_it_is(friction):
    rng = np.random.default_rng(12)
    cuts = cut_recording(Truth(kappa=0.7), rng, sheets=2)
    found = fit_cut((cuts,), recipe(fracture="rippled"), friction, effort="draft", rng=rng)
    kappa = found.parameter("kappa")
    assert abs(kappa.mean - 0.7) < 4 * kappa.sd
    assert kappa.q95 < 0.95


def test_cutting_air_is_refused(friction):
    rng = np.random.default_rng(13)
    air = cut_recording(Truth(kappa=1.0, force=1e-9), rng, sheets=1)
    with pytest.raises(InputError, match="hardly touched the material"):
        fit_cut((air,), recipe(fracture="smooth"), friction, effort="draft", rng=rng)


def test_a_recording_without_sheets_is_refused(friction):
    rng = np.random.default_rng(14)
    empty = friction_recording(STEEL, rng)
    with pytest.raises(InputError, match="no stroke through material"):
        fit_cut((empty,), recipe(), friction, effort="draft", rng=rng)


@given(lengths=st.lists(st.integers(1, 30), min_size=1, max_size=6), seed=st.integers(0, 2**32 - 1))
def test_blocks_keep_the_sum_of_squares(lengths, seed):
    """Helmert's transform is orthonormal: nothing is lost or counted twice."""
    run = np.repeat(np.arange(len(lengths)), lengths)
    residuals = np.random.default_rng(seed).standard_normal(len(run))
    blocks = make_blocks(run)
    ones, zeros = np.ones(len(run)), np.zeros(len(run))
    assert np.sum(contrasts(residuals, blocks) ** 2) == pytest.approx(np.sum(residuals**2))
    assert np.allclose(variance_of_contrasts(zeros, ones, blocks), 1.0)
    assert blocks.length.max() <= 8
    assert np.all(run[blocks.first] == run)


def test_slow_variance_belongs_to_means_and_fast_variance_to_contrasts():
    rng = np.random.default_rng(15)
    run = np.repeat(np.arange(4000), 8)
    slow = np.repeat(rng.standard_normal(4000) * 3.0, 8)
    residuals = slow + rng.standard_normal(len(run))
    ones = np.ones(len(run))
    blocks = make_blocks(run)
    z = contrasts(residuals, blocks) / np.sqrt(variance_of_contrasts(9.0 * ones, ones, blocks))
    place = np.arange(len(run)) % 8
    assert z[place == 0].std() == pytest.approx(1.0, abs=0.05)
    assert z[place > 0].std() == pytest.approx(1.0, abs=0.02)
