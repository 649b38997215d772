"""Windows are as long as the cutoff asks, and longer where the encoder's steps would matter."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration.signals.filtering import (
    ENCODER_SHARE,
    LONGEST_S,
    knot_samples,
    second_derivative,
    spline,
)
from scissorcal.calibration.signals.weak_form import next_cutoff, weigh
from scissorcal.recording import SAMPLE_DTYPE, Recording

INERTIA, RATE_HZ = 2e-4, 1000.0


def swinging(step: float, seed: int = 0) -> Recording:
    """A swing of three sines over 20 s, its place in steps, its torque exact."""
    rng = np.random.default_rng(seed)
    time = np.arange(20_000) / RATE_HZ
    opening, acceleration = np.full(len(time), 0.5), np.zeros(len(time))
    for frequency_Hz, size in ((1.3, 0.08), (3.1, 0.03), (5.7, 0.01)):
        omega = 2 * np.pi * frequency_Hz
        wave = size * np.sin(omega * time + rng.uniform(0, 2 * np.pi))
        opening, acceleration = opening + wave, acceleration - omega**2 * wave
    samples = np.zeros(len(time), SAMPLE_DTYPE)
    samples["device_time_us"] = np.round(time * 1e6)
    samples["opening"] = np.round(opening / step) * step if step else opening
    samples["motor_torque"] = INERTIA * acceleration
    samples["stroke"] = -1
    return Recording("friction", samples, source="swing.mcap")


def regressed(recording: Recording, window_Hz: float | None = None) -> float:
    """Inertia by least squares over the windows without a turn, relative to the true one."""
    bins = weigh((recording,), 75.0, window_Hz=window_Hz).bins
    acceleration, drive = bins.acceleration[bins.moving], bins.drive[bins.moving]
    return float(acceleration @ drive / (acceleration @ acceleration) / INERTIA)


@pytest.mark.parametrize("step", [0.0, 1e-6])
def test_a_fine_encoder_gets_the_windows_of_the_cutoff(step):
    windows = weigh((swinging(step),), 75.0)
    assert len(windows.weights) == 15
    assert windows.lengthening == 1.0


@pytest.mark.parametrize("step", [1e-4, 3e-4])
def test_a_coarse_encoder_gets_longer_windows_and_a_true_inertia(step):
    """Windows of the cutoff give an inertia that is too low by the errors' share, longer ones do
    not: within twice the share that is allowed."""
    recording = swinging(step)
    windows = weigh((recording,), 75.0)
    assert windows.lengthening > 1.0
    assert windows.half_at < 60.0
    assert len(windows.weights) <= LONGEST_S * RATE_HZ + 1
    assert regressed(recording) == pytest.approx(1.0, abs=2 * ENCODER_SHARE)
    assert regressed(recording, 75.0) < 1.0 - 4 * ENCODER_SHARE


def test_the_variance_of_the_encoders_steps_is_the_one_of_the_formula():
    """6 q^2 / (12 k^5 tick^4), against the motion's true second derivative."""
    step = 1e-4
    coarse, exact = (weigh((swinging(q),), 75.0, window_Hz=30.0) for q in (step, 0.0))
    quick = np.abs(exact.bins.rate) > 0.5
    seen = np.var((coarse.bins.acceleration - exact.bins.acceleration)[quick])
    knot = knot_samples(30.0, RATE_HZ)
    assert seen == pytest.approx(6 * step**2 / 12 / knot**5 * RATE_HZ**4, rel=0.25)


def test_the_second_derivative_is_that_of_the_spline():
    """Exact for a parabola, whose second derivative is two, wherever it stands."""
    for knot in (1, 4, 13):
        weights = second_derivative(knot, RATE_HZ)
        time = np.arange(len(weights)) / RATE_HZ
        assert weights @ (time - 0.3) ** 2 == pytest.approx(2.0, rel=1e-6)
        assert spline(knot).sum() == pytest.approx(1.0)


def test_slow_motion_ends_at_the_longest_windows():
    """Nothing accelerates, so no window makes the encoder's share small; none exceeds the limit."""
    recording = swinging(0.0)
    samples = recording.samples.copy()
    samples["opening"] = np.round(np.arange(len(samples)) * 2e-5 / 3e-4) * 3e-4
    slow = dataclasses.replace(recording, samples=samples)
    assert len(weigh((slow,), 75.0).weights) <= LONGEST_S * RATE_HZ + 1


def test_prescribed_windows_are_taken_as_they_are():
    windows = weigh((swinging(3e-4),), 75.0, window_Hz=60.0)
    assert len(windows.weights) == 18
    shorter = next_cutoff(windows)
    assert shorter is not None
    assert len(weigh((swinging(3e-4),), 75.0, window_Hz=shorter).weights) == 15
