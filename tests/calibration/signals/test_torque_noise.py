"""The torque noise's two time scales are told apart, and strokes that lie apart are seen."""

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.friction.noise import stroke_offsets
from scissorcal.calibration.signals.torque_noise import TorqueNoise, torque_noise
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.inference import ArNoise
from scissorcal.recipe import FitFriction
from tests.calibration.truth import QUICK, Truth, friction_recording

TICK_S = 1e-3


def drawn(white: float, slow: float, time_s: float, rng: np.random.Generator) -> tuple:
    memory = float(np.exp(-TICK_S / time_s))
    noise = ArNoise(1, (memory,), slow * float(np.sqrt(1 - memory**2)))
    series = np.repeat(np.arange(25), 2000)
    values = noise.draw(series, rng) + white * rng.standard_normal(len(series))
    return tuple(np.split(values, 25))


@pytest.mark.parametrize(
    ("white", "slow", "time_s"), [(1e-3, 6e-4, 0.012), (2e-4, 1e-3, 0.03), (1e-3, 3e-4, 0.05)]
)
def test_both_scales_are_recovered(white, slow, time_s):
    """Over 12 seeds the mean lies within four of its own standard errors or 5 %."""
    found = [
        torque_noise(drawn(white, slow, time_s, np.random.default_rng(seed)), TICK_S)
        for seed in range(12)
    ]
    for name, value in (("white_Nm", white), ("slow_Nm", slow), ("slow_time_s", time_s)):
        values = np.array([getattr(one, name) for one in found])
        error = values.std(ddof=1) / np.sqrt(len(values))
        assert abs(values.mean() - value) < 4 * error + 0.05 * value, name
    claimed = np.array([one.slow_error_Nm for one in found])
    spread = np.std([one.slow_Nm for one in found], ddof=1)
    assert 0.3 < np.median(claimed) / spread < 3.0


def test_white_noise_has_no_slow_part():
    rng = np.random.default_rng(1)
    found = torque_noise(tuple(1e-3 * rng.standard_normal((25, 2000))), TICK_S)
    assert found.white_Nm == pytest.approx(1e-3, rel=0.03)
    assert found.slow_Nm**2 < 0.02 * found.white_Nm**2


def test_noise_that_sensors_show_at_rest_is_there_in_motion():
    """An error of momenta that is stated too large hides the white noise otherwise."""
    stretches = drawn(1e-3, 6e-4, 0.012, np.random.default_rng(3))
    momenta = tuple(np.zeros(len(one)) for one in stretches)
    too_much = 3e-3 * TICK_S
    assert torque_noise(stretches, TICK_S, momenta, too_much).white_Nm < 0.9e-3
    found = torque_noise(stretches, TICK_S, momenta, too_much, idle_white=1e-3)
    assert 1e-3 <= found.white_Nm < 1.05e-3


def test_momentum_from_the_torque_is_not_noise():
    """Torque that moves the joint is inertia times its change of rate, whatever its spectrum."""
    rng = np.random.default_rng(2)
    torque = 0.01 * np.sin(np.arange(50000) * 0.05)
    momentum = np.concatenate([[0.0], np.cumsum(torque)])[:-1] * TICK_S
    noise = 5e-4 * rng.standard_normal(len(torque))
    found = torque_noise((torque + noise,), TICK_S, (momentum,))
    assert found.white_Nm == pytest.approx(5e-4, rel=0.05)
    assert found.slow_Nm < 1.5e-4


def test_too_little_motion_gives_nothing():
    assert torque_noise((), TICK_S) is None
    assert torque_noise((np.zeros(300),), TICK_S) is None


def test_variance_of_a_mean_follows_the_covariance():
    noise = TorqueNoise(1e-3, 5e-4, 0.02)
    lags = np.abs(np.subtract.outer(np.arange(50), np.arange(50)))
    covariance = 1e-6 * np.eye(50) + 2.5e-7 * np.exp(-lags * TICK_S / 0.02)
    assert noise.variance_of_mean(50, TICK_S) == pytest.approx(covariance.mean())


def test_differing_strokes_are_detected_and_equal_ones_are_not():
    windows = weigh((friction_recording(Truth(), np.random.default_rng(1)),), 75.0)
    windows = windows.where(windows.bins.moving)
    rng = np.random.default_rng(3)
    noise = TorqueNoise(1e-3, 0.0, 0.01)
    strokes = windows.bins.stroke
    residuals = 1e-3 / np.sqrt(5) * rng.standard_normal(len(strokes))
    assert stroke_offsets(residuals, strokes, windows, noise) < 1e-4
    labels, place = np.unique(strokes, return_inverse=True)
    apart = np.where(np.arange(len(labels)) % 2, 1.0, -1.0) * 2.5e-4
    shifted = residuals + apart[place]
    assert stroke_offsets(shifted, strokes, windows, noise) == pytest.approx(2.5e-4, rel=0.1)
    assert np.isnan(stroke_offsets(residuals, strokes, windows, None))


def test_a_friction_fit_stores_its_noise():
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
    recording = friction_recording(Truth(), np.random.default_rng(1), QUICK)
    fit = fit_friction((recording,), settings, effort="draft", rng=np.random.default_rng(2))
    truth = Truth()
    slow_time = -TICK_S / np.log(truth.rho)
    assert fit.diagnostics["noise_slow_Nm"] == pytest.approx(truth.noise, rel=0.2)
    assert fit.diagnostics["noise_slow_time_s"] == pytest.approx(slow_time, rel=0.3)
    assert fit.diagnostics["noise_white_Nm"] < 0.6 * truth.noise
    assert fit.diagnostics["stroke_offset_sd_Nm"] < 2e-4
