"""The low-pass against SciPy's Butterworth filter, forwards and backwards."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from scissorcal.calibration.signals.filtering import low_pass


@pytest.mark.parametrize(
    ("rate_Hz", "cutoff_Hz"), [(1000.0, 60.0), (10000.0, 200.0), (200.0, 60.0)]
)
def test_it_is_a_butterworth_filter_forwards_and_backwards(rate_Hz, cutoff_Hz):
    """Within 1e-9 of what varies by 1, twenty periods of the cutoff from the ends and beyond."""
    values = np.cumsum(np.random.default_rng(4).standard_normal(8000)) / 90.0
    sections = butter(4, min(cutoff_Hz / rate_Hz, 0.4) * 2.0, output="sos")
    away = int(20 * rate_Hz / cutoff_Hz)
    found, expected = low_pass(values, cutoff_Hz, rate_Hz), sosfiltfilt(sections, values)
    assert found[away:-away] == pytest.approx(expected[away:-away], abs=1e-9)


def test_lines_pass_and_ends_stay():
    line = np.linspace(-3.0, 5.0, 501)
    assert low_pass(line, 40.0, 1000.0) == pytest.approx(line, abs=1e-12)
    wave = line + np.sin(np.arange(501.0))
    assert low_pass(wave, 40.0, 1000.0)[[0, -1]] == pytest.approx(wave[[0, -1]])


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_values_are_allowed(count):
    assert low_pass(np.arange(float(count)), 40.0, 1000.0) == pytest.approx(np.arange(float(count)))
