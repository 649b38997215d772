"""The design of a friction fit: picklable, and the same algorithm that the fit itself uses."""

import pickle

import numpy as np
import pytest

from scissorcal.calibration import fit_friction, friction_experiment
from scissorcal.inference import find_optimum, fit_ar
from scissorcal.recipe import FitFriction
from tests.calibration.truth import QUICK, Truth, friction_recording

SETTINGS = FitFriction(law="stribeck", symmetry="asymmetric")


@pytest.fixture(scope="module")
def fitted():
    recording = friction_recording(Truth(), np.random.default_rng(1), QUICK)
    fit = fit_friction((recording,), SETTINGS, effort="draft", rng=np.random.default_rng(2))
    return fit, friction_experiment((recording,), SETTINGS, fit)


def test_the_fit_again_from_its_design_is_the_fit(fitted):
    fit, experiment = fitted
    candidate = pickle.loads(pickle.dumps(experiment)).candidate(experiment.observed)
    assert candidate.name == fit.candidate
    optimum = candidate.optimum(experiment.series)
    wanted = [i for i, n in enumerate(candidate.layout.names) if n not in experiment.nuisance]
    natural = candidate.layout.columns(optimum.point)[wanted]
    assert natural == pytest.approx(fit.map_point, rel=1e-6)


def test_the_search_over_products_ends_where_a_search_over_bins_does(fitted):
    _, experiment = fitted
    candidate = experiment.candidate(experiment.observed)
    slow = find_optimum(candidate.problem(experiment.series))
    assert candidate.optimum(experiment.series).value > slow.value - 1e-3


def test_at_the_optimum_the_prior_balances_what_the_windows_are_worth(fitted):
    """Windows overlap, and count by the share of them that is independent."""
    _, experiment = fitted
    candidate = experiment.candidate(experiment.observed)
    point = candidate.optimum(experiment.series).point
    assert 0.0 < candidate.share < 0.5
    pull = candidate.share * candidate.reduced.slope(point)
    held = candidate.prior_precision @ (point - candidate.prior_mean)
    size = np.sqrt(np.diag(candidate.share * candidate.reduced.information(point)))
    assert pull / size == pytest.approx(held / size, abs=1e-3)


def test_simulated_data_have_the_priors_of_the_original(fitted):
    _, experiment = fitted
    u = experiment.candidate(experiment.observed).starts[0]
    residuals = experiment.observed - experiment.mean(u)
    noise = fit_ar(residuals, experiment.series)
    rng = np.random.default_rng(3)
    simulated = 2 * experiment.mean(u) + noise.draw(experiment.series, rng)
    assert np.array_equal(experiment.candidate(simulated).prior_mean, experiment.layout.mean)
    assert simulated.shape == experiment.strokes.shape == experiment.observed.shape
