"""A prior by name in the place of a law's own: joint where it is stated, untouched elsewhere."""

import numpy as np
import pytest

from scissorcal.calibration.parameters import Layout, Parameter, StatedPrior
from scissorcal.model import LOG

NAMES = ("response_force", "response_exponent", "noise_scale", "kappa")
LAYOUT = Layout(tuple(Parameter(n, "1", LOG, 0.0, 2.0, "") for n in NAMES))
COVARIANCE = np.array([[0.04, 0.01], [0.01, 0.09]])
STATED = StatedPrior(
    ("response_exponent", "response_force"), np.array([1.0, 3.0]), COVARIANCE, "power"
)


def test_what_is_stated_takes_the_own_priors_place():
    layout = STATED.layout(LAYOUT)
    assert layout.names == NAMES
    assert layout.mean == pytest.approx([3.0, 1.0, 0.0, 0.0])
    assert layout.sd == pytest.approx([0.3, 0.2, 2.0, 2.0])
    covariance = np.linalg.inv(STATED.precision(LAYOUT, np.diag(1 / LAYOUT.sd**2)))
    assert covariance[:2, :2] == pytest.approx(COVARIANCE[::-1, ::-1])
    assert np.diag(covariance)[2:] == pytest.approx([4.0, 4.0])
    assert covariance[:2, 2:] == pytest.approx(np.zeros((2, 2)))


def test_another_response_keeps_its_own_exponent():
    assert STATED.of_response("power") is STATED
    other = STATED.of_response("exponential")
    assert other.names == ("response_force",)
    assert other.layout(LAYOUT).mean == pytest.approx([3.0, 0.0, 0.0, 0.0])
