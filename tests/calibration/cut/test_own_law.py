"""A response law of one's own is fitted, stored as a spline, and refused where it is none."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import FitResult, fit_cut
from scissorcal.calibration.cut.own_law import refuse_unusable
from scissorcal.calibration.fit_model import CutRun
from scissorcal.calibration.store import load_fit, save
from scissorcal.errors import InputError, ModelError
from tests.calibration.cut.recipes import friction_of, paper
from tests.calibration.truth import Truth, cut_recording

SMOOTH = Truth(kappa=1.0)


@dataclass(frozen=True)
class Stiffening:
    """A linear spring and a power beside it: no family of the recipe's."""

    def parameters(self):
        return {"total_N": (2.0, 2.0), "exponent": (1.8, 0.4), "linear_share": 1e-3}

    def force_N(self, indentation_m, total_N, exponent, linear_share):  # noqa: N802
        u = indentation_m / SMOOTH.reference
        return total_N * (linear_share * u + (1.0 - linear_share) * u**exponent)


@dataclass(frozen=True)
class Softening:
    def parameters(self):
        return {"peak_N": (1.0, 0.1)}

    def force_N(self, indentation_m, peak_N):  # noqa: N802
        u = indentation_m / SMOOTH.reference
        return peak_N * u * np.exp(-u)


@dataclass(frozen=True)
class Broken:
    def parameters(self):
        return {"scale_N": (1.0, 0.1)}

    def force_N(self, indentation_m, scale_N):  # noqa: N802
        return scale_N * np.sqrt(indentation_m - 1e-5)


@dataclass(frozen=True)
class Settled:
    def parameters(self):
        return {"scale_N": 1.0}

    def force_N(self, indentation_m, scale_N):  # noqa: N802
        return scale_N * indentation_m


@pytest.fixture(scope="module")
def fit() -> FitResult:
    rng = np.random.default_rng(11)
    cuts = cut_recording(SMOOTH, rng, sheets=2)
    friction = friction_of(SMOOTH, np.random.default_rng(10))
    run = CutRun(own_law=Stiffening())
    return fit_cut((cuts,), paper(fracture="smooth"), friction, effort="draft", rng=rng, run=run)


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
