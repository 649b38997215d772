"""A response law of one's own is fitted, stored as a spline, and refused where it is none."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import scissorcal
from scissorcal.calibration import FitResult
from scissorcal.calibration.cut.own_law import as_law_fit, as_spline_fit, refuse_unusable
from scissorcal.calibration.store import load_fit, save
from scissorcal.calibration.verify.of_fit import known_cut
from scissorcal.errors import InputError, ModelError
from scissorcal.recording import Recording
from tests.calibration.cut.recipes import friction_of, paper
from tests.calibration.truth import Truth, cut_recording
from tests.package.fits import cut_fit, recipe

SMOOTH = Truth(kappa=1.0)


@dataclass(frozen=True)
class Stiffening:
    """A linear spring and a power beside it: no family of the recipe's."""

    def parameters(self):
        return {"total_N": (2.0, 2.0), "exponent": (1.8, 0.4), "linear_share": 1e-3}

    def force_N(self, indentation_m, total_N, exponent, linear_share):
        u = indentation_m / SMOOTH.reference
        return total_N * (linear_share * u + (1.0 - linear_share) * u**exponent)


@dataclass(frozen=True)
class Softening:
    def parameters(self):
        return {"peak_N": (1.0, 0.1)}

    def force_N(self, indentation_m, peak_N):
        u = indentation_m / SMOOTH.reference
        return peak_N * u * np.exp(-u)


@dataclass(frozen=True)
class Broken:
    def parameters(self):
        return {"scale_N": (1.0, 0.1)}

    def force_N(self, indentation_m, scale_N):
        return scale_N * np.sqrt(indentation_m - 1e-5)


@dataclass(frozen=True)
class Settled:
    def parameters(self):
        return {"scale_N": 1.0}

    def force_N(self, indentation_m, scale_N):
        return scale_N * indentation_m


RECIPE = paper(fracture="smooth")


@pytest.fixture(scope="module")
def cuts() -> Recording:
    return cut_recording(SMOOTH, np.random.default_rng(11), sheets=2)


@pytest.fixture(scope="module")
def friction() -> FitResult:
    return friction_of(SMOOTH, np.random.default_rng(10))


@pytest.fixture(scope="module")
def fit(cuts: Recording, friction: FitResult) -> FitResult:
    return scissorcal.fit_cut(cuts, RECIPE, friction, law=Stiffening(), effort="draft")


@pytest.mark.slow
def test_its_parameters_come_back_within_four_standard_deviations(fit: FitResult) -> None:
    """The linear share is held at a thousandth, where the truth, a power law, has none."""
    for parameter in fit.derived:
        truth = {"total_N": SMOOTH.force, "exponent": SMOOTH.exponent}[parameter.name]
        print(parameter.name, parameter.mean, parameter.sd, truth)
        assert abs(parameter.mean - truth) < 4.0 * parameter.sd + 2e-3 * truth


@pytest.mark.slow
def test_the_stored_fit_is_a_spline_that_needs_no_law(fit: FitResult, tmp_path: Path) -> None:
    path = tmp_path / "cut.nc"
    save(fit, path)
    again = load_fit(path)
    assert again.structure["response"] == "spline"
    assert "Stiffening" in again.candidate
    assert np.array_equal(again.draws, fit.draws)


@pytest.mark.parametrize(
    ("law", "error", "words"),
    [
        (Softening(), ModelError, "does not rise"),
        (Broken(), ModelError, "nan N at"),
        (Settled(), InputError, "leaves nothing to fit"),
        (object(), InputError, "needs two methods"),
    ],
)
def test_a_law_that_is_none_is_refused_before_the_fit(law, error, words) -> None:
    with pytest.raises(error, match=words):
        refuse_unusable(law, SMOOTH.reference)


# ------------------------------------------------------------------ simulation-based calibration

FITS = 20


@pytest.mark.slow
def test_it_is_calibrated_on_simulated_cuts_through_its_own_material(
    fit: FitResult, cuts: Recording, friction: FitResult
) -> None:
    """20 fits, of which the verdicts may fail falsely with 1 %; the ranks are of the law's numbers.

    Intervals half as wide as they should be hold the truth in 59 % at 90 %, and are found.
    """
    check = scissorcal.verify_fit(fit, cuts, RECIPE, friction, law=Stiffening(), fits=FITS, seed=4)
    assert check.candidate.startswith("Stiffening response")
    assert check.calibration is not None
    assert not check.calibration.broken
    quantities = {quantity.name: quantity for quantity in check.calibration.quantities}
    assert list(quantities)[:3] == ["total_N", "exponent", "fracture_energy"]
    for name in ("total_N", "exponent", "fracture_energy"):
        assert len(quantities[name].ranks) == FITS
        assert all(one.low <= one.share for one in quantities[name].coverage), name
    assert {v.check: v.status for v in check.verdicts}["calibration"] == "pass"


@pytest.fixture
def stored() -> FitResult:
    """A fit with two of Stiffening's numbers, as `as_spline_fit` leaves it, without a search."""
    made = cut_fit(recipe())
    names = ("total_N", "exponent")
    own = tuple(replace(p, name=n) for p, n in zip(made.parameters, names, strict=False))
    structure = {**made.structure, "response": "own", "response_law": Stiffening()}
    name = "Stiffening response, smooth fracture"
    made = replace(
        made, parameters=(*own, *made.parameters[2:]), candidate=name, structure=structure
    )
    return as_spline_fit(made, Stiffening())


def test_a_check_without_the_law_names_it(stored: FitResult) -> None:
    with pytest.raises(InputError, match=r"of your own, Stiffening, .*\(law=\.\.\.\)"):
        known_cut((), RECIPE, stored, stored)
    with pytest.raises(InputError, match=r"of another law .* than Softening"):
        known_cut((), RECIPE, stored, stored, law=Softening())
    without = replace(stored, derived=stored.derived[:1])
    with pytest.raises(InputError, match="no draws of exponent, so Stiffening was changed"):
        known_cut((), RECIPE, stored, without, law=Stiffening())


def test_the_laws_own_numbers_come_back_from_the_spline(stored: FitResult) -> None:
    again = as_law_fit(stored, Stiffening())
    assert [p.name for p in again.parameters] == ["total_N", "exponent", "fracture_energy"]
    assert np.array_equal(again.draws[:, :2], stored.derived_draws)
    splined = as_spline_fit(again, Stiffening())
    assert np.array_equal(splined.draws, stored.draws)
    assert splined.structure == stored.structure
