"""ArviZ on a stored fit: summaries, predictive checks, leave-one-stroke-out, comparison."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import (
    FitResult,
    fit_friction,
    friction_experiment,
    load_fit,
    save,
)
from scissorcal.calibration.assemble import REPLICATES, _rounded
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording, Stroke
from tests.calibration.truth import (
    QUICK,
    RATE_HZ,
    Truth,
    friction_recording,
    make_recording,
    sweep,
)
from tests.with_arviz import arviz

matplotlib: Any = pytest.importorskip("matplotlib")
matplotlib.use("Agg")

OF_LIBRARIES = pytest.mark.filterwarnings(
    "ignore::matplotlib.MatplotlibDeprecationWarning",
    "ignore:The inplace keyword:DeprecationWarning",
)
"""ArviZ calls functions that newer versions of its own dependencies deprecate."""


def repeated(rng: np.random.Generator) -> Recording:
    """Sweeps and excitation, each several times: no parameter depends on one stroke alone."""
    t = np.arange(2500) / RATE_HZ
    opening, strokes = [], []
    for turn in range(8):
        wave = 0.85 - 0.1 * (1 - np.cos(2 * np.pi * (1.5 + 0.2 * turn + t) * t))
        opening += [sweep(0.85, 0.2, 0.4), sweep(0.2, 0.85, 0.8), wave]
    for kind in ("closing", "opening", "excitation") * 8:
        strokes.append(Stroke(len(strokes), kind))
    return make_recording("friction", opening, [0.0] * 24, strokes, Truth(), rng, False)


@pytest.fixture(scope="module")
def fitted() -> FitResult:
    rng = np.random.default_rng(1)
    wanted = FitFriction(law="coulomb+viscous", critic=False)
    return fit_friction((repeated(rng),), wanted, effort="standard", rng=rng)


@pytest.fixture(scope="module")
def stored(fitted: FitResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("fits") / "friction.nc"
    save(fitted, path)
    return path


@pytest.fixture
def data(stored: Path) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return arviz.from_netcdf(stored)


def test_values_beyond_32_bits_stay_finite() -> None:
    rounded = _rounded(np.array([1e300, -1e39, 1.2345, 0.0, np.nan]))
    assert np.all(np.isfinite(rounded[:4]))
    assert rounded[2] == pytest.approx(1.2345, rel=5e-4)
    assert np.isnan(rounded[4])


def test_arviz_finds_its_groups_with_the_same_variable_and_dimensions(
    data: Any, fitted: FitResult
) -> None:
    names = [parameter.name for parameter in fitted.parameters]
    assert list(data.posterior.data_vars) == list(data.prior.data_vars) == names
    assert data.posterior_predictive.torque.dims == ("chain", "draw", "point")
    assert data.observed_data.torque.dims == ("point",)
    assert data.log_likelihood.torque.dims == ("chain", "draw", "stroke")
    summary = arviz.summary(data)
    assert list(summary.index) == names


@OF_LIBRARIES
def test_arviz_plots_draws_and_predictive_checks(data: Any) -> None:
    from matplotlib import pyplot

    arviz.plot_trace(data)
    arviz.plot_posterior(data)
    arviz.plot_ppc(data, num_pp_samples=20)
    pyplot.close("all")


def test_replicates_have_the_spread_and_autocorrelation_of_the_residuals(
    fitted: FitResult,
) -> None:
    assert fitted.predictive is not None
    observed = fitted.series.measured - fitted.series.predicted
    noise = fitted.predictive.torque - fitted.series.predicted
    assert noise.shape[0] == REPLICATES
    assert noise.std(axis=1).mean() == pytest.approx(observed.std(), rel=0.1)
    neighbours = [float(np.corrcoef(e[1:], e[:-1])[0, 1]) for e in (observed, *noise)]
    assert np.mean(neighbours[1:]) == pytest.approx(neighbours[0], abs=0.1)


def test_log_likelihoods_are_those_of_the_draws_beside_them(data: Any, fitted: FitResult) -> None:
    """Evaluated again at every tenth stored draw, stroke by stroke, with the law of the fit."""
    recording = repeated(np.random.default_rng(1))
    settings = FitFriction(law="coulomb+viscous", critic=False)
    design = friction_experiment((recording,), settings, fitted)
    problem = design.candidate(design.observed).problem(design.series)
    found, likelihood = fitted.predictive, data.log_likelihood.torque.values[0]
    assert found is not None
    group = data.log_likelihood_posterior
    assert list(group.data_vars) == list(found.parameters) == list(design.layout.names)
    for row in range(0, len(likelihood), 10):
        values = {name: float(group[name].values[0, row]) for name in found.parameters}
        terms = problem.log_likelihood_terms(design.layout.unconstrained(values))
        by_stroke = np.array([terms[design.strokes == label].sum() for label in found.stroke])
        expected = found.independent_share * by_stroke - found.log_likelihood_reference
        np.testing.assert_allclose(likelihood[row], expected, rtol=1e-6, atol=1e-3)


def test_loo_by_arviz_agrees_with_the_fit_s_own(data: Any, fitted: FitResult) -> None:
    found = arviz.loo(data, pointwise=True)
    own = next(candidate for candidate in fitted.candidates if candidate["chosen"])
    level = float(data.reference.log_likelihood.sum())
    assert found.n_data_points == len(fitted.held_out)
    assert float(found.elpd_loo) + level == pytest.approx(own["loo"], abs=0.5)
    assert float(found.pareto_k.max()) < found.good_k


@OF_LIBRARIES
def test_compare_by_arviz_orders_the_candidates_as_the_fit_does(
    data: Any, fitted: FitResult
) -> None:
    candidates = {
        name: arviz.InferenceData(posterior=data.posterior, log_likelihood=data.candidates[[name]])
        for name in data.candidates
    }
    assert len(candidates) > 1
    found = arviz.compare(candidates, ic="loo")
    ordered = sorted(fitted.candidates, key=lambda candidate: -candidate["loo"])
    assert list(found.index) == [candidate["name"] for candidate in ordered]
    gaps = [ordered[0]["loo"] - candidate["loo"] for candidate in ordered]
    np.testing.assert_allclose(found["elpd_diff"], gaps, atol=1.0)


def test_draft_effort_has_replicates_and_no_log_likelihood(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    wanted = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
    recording = friction_recording(Truth(), rng, QUICK)
    save(fit_friction((recording,), wanted, effort="draft", rng=rng), tmp_path / "friction.nc")
    found = load_fit(tmp_path / "friction.nc").predictive
    assert found is not None
    assert found.torque.shape[0] == REPLICATES
    assert found.log_likelihood is None
