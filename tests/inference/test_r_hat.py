"""R-hat of the thorough effort is the rank-normalised one of ArviZ."""

import numpy as np
import pytest

from scissorcal.inference.thorough import rank_r_hat
from tests.with_arviz import arviz


@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize("spread", [1.0, 3.0])
@pytest.mark.parametrize("count", [50, 101])
def test_r_hat_is_that_of_arviz(shift: float, spread: float, count: int) -> None:
    draws = np.random.default_rng(1).standard_normal((4, count))
    draws[0] = shift + spread * draws[0]
    assert rank_r_hat(draws) == pytest.approx(float(arviz.rhat(draws, method="rank")), rel=1e-12)
