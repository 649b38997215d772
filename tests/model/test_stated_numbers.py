"""Draws of stated numbers have the stated mean and deviation, and a share stays a share."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.model import as_share, draw_columns, draw_share, log_normal

COUNT = 200_000


def widest(mean: float) -> float:
    """The deviation at which the density of a beta distribution stops falling to its nearer end.

    There its one parameter is 1 and the other k = (1 - n) / n with n the distance to that end, of
    variance k / ((k + 1)^2 (k + 2)).
    """
    near = min(mean, 1.0 - mean)
    k = (1.0 - near) / near
    return math.sqrt(k / ((k + 1.0) ** 2 * (k + 2.0)))


means = st.one_of(
    st.floats(1e-12, 1.0 - 1e-12),
    st.floats(-12.0, -0.31).map(lambda power: 10.0**power),
    st.floats(-12.0, -0.31).map(lambda power: 1.0 - 10.0**power),
)
parts = st.one_of(st.just(1.0), st.just(0.0), st.floats(0.0, 1.0), st.floats(0.0, 1e-250))


@given(means, parts, st.integers(0, 2**32 - 1))
def test_a_share_is_drawn_within_0_and_1(mean: float, part: float, seed: int) -> None:
    # the test's formula and the model's round differently
    stated = as_share("kappa", (mean, part * (1.0 - 1e-12) * widest(mean)))
    draws = draw_share(*stated, np.random.default_rng(seed), 50)
    assert draws[0] == mean
    assert np.all((draws > 0.0) & (draws <= 1.0))


@given(means, st.floats(1.001, 1e3))
def test_a_wider_share_is_refused_with_the_widest(mean: float, times: float) -> None:
    with pytest.raises(InputError, match="standard deviation of at most"):
        as_share("kappa", (mean, times * widest(mean)))


@pytest.mark.parametrize("mean", [0.05, 0.5, 0.8, 0.97])
@pytest.mark.parametrize("part", [0.1, 0.5, 0.999])
def test_a_share_has_the_stated_mean_and_deviation(mean: float, part: float) -> None:
    sd = part * widest(mean)
    draws = draw_share(*as_share("kappa", (mean, sd)), np.random.default_rng(5), COUNT)[1:]
    # 5 standard errors; a beta distribution with one peak has a kurtosis of at most 9
    assert draws.mean() == pytest.approx(mean, abs=5.0 * sd / math.sqrt(COUNT))
    assert draws.std() == pytest.approx(sd, rel=5.0 * math.sqrt((9.0 - 1.0) / 4.0 / COUNT))


@pytest.mark.parametrize("share", [1.0, 1.5, (1.0, 0.1)])
def test_what_is_no_share_is_refused(share: float | tuple[float, float]) -> None:
    with pytest.raises(InputError, match="must lie below 1"):
        as_share("kappa", share)


def test_columns_are_log_normal_with_the_stated_mean_and_deviation() -> None:
    stated = {"force_N": (2.0, 0.5), "exponent": (1.4, 0.0)}
    columns = draw_columns(stated, np.random.default_rng(6), COUNT)
    assert np.all(columns["exponent"] == 1.4)
    assert columns["force_N"][0] == 2.0
    force = columns["force_N"][1:]
    # 5 standard errors, a log-normal with this ratio has a kurtosis of at most 4.2
    assert force.mean() == pytest.approx(2.0, abs=5.0 * 0.5 / math.sqrt(COUNT))
    assert force.std() == pytest.approx(0.5, rel=5.0 * math.sqrt((4.2 - 1.0) / 4.0 / COUNT))
    centre, spread = log_normal(2.0, 0.5)
    error = spread / math.sqrt(COUNT)
    assert np.log(force).mean() == pytest.approx(centre, abs=5.0 * error)
    assert np.log(force).std() == pytest.approx(spread, abs=5.0 * error)
