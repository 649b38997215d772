"""Jitter of an encoder is told from vibration, and from a place between two steps."""

import numpy as np
import pytest

from scissorcal.device.probe.idle import largest_correlation
from scissorcal.device.probe.probe import ProbeRefusedError, probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.recipe import builtin_recipe
from tests.strange_device import Faults, Person, StrangeDevice, VirtualPort

TIME_S = np.arange(1000) * 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_white_noise_is_uncorrelated(seed: int) -> None:
    assert largest_correlation(np.random.default_rng(seed).normal(size=1000)) < 0.2


@pytest.mark.parametrize("rate_Hz", [20.0, 50.0, 180.0, 250.0, 410.0])
def test_a_vibration_is_correlated_at_any_rate(rate_Hz: float) -> None:
    noise = np.random.default_rng(1).normal(size=1000)
    shaken = 2.0 * np.sin(2 * np.pi * rate_Hz * TIME_S) + noise
    assert largest_correlation(shaken) > 0.5


@pytest.mark.parametrize("sd_mrad", [3.0, 5.0, 20.0])
def test_an_encoder_that_jitters_is_named_before_blades_that_move(sd_mrad: float) -> None:
    """Noise of one reading moves a mean over some of them, and no blades."""
    noise = Faults(encoder_noise_rad=1e-3 * sd_mrad)
    device = StrangeDevice(noise, seed=2)
    with pytest.raises(ProbeRefusedError, match="The opening jitters by"):
        probe(
            RigSession(VirtualPort(device), builtin_recipe("paper-80gsm"), Operator(Person(device)))
        )
    assert device.largest_torque == 0.0


def test_a_constant_and_a_short_series_are_no_noise() -> None:
    assert largest_correlation(np.zeros(1000)) == 1.0
    assert largest_correlation(np.random.default_rng(1).normal(size=20)) == 1.0
