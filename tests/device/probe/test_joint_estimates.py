"""What a fitted joint's numbers say: the friction that pushes met, and what the law leaves out."""

import math

import numpy as np
import pytest

from scissorcal.device.probe.joint_values import LEFT_OUT, NAMES, JointFit

VALUES = {"log_inertia": math.log(3e-4), "log_coulomb": math.log(0.02), "log_slow": math.log(0.01),
          "slow_logit": 0.5, "log_rise_share": -1.0, "log_rise_rate": -2.0}  # fmt: skip
SDS = {"log_inertia": 0.03, "log_coulomb": 0.1, "log_slow": 0.4, "slow_logit": 0.3}


def fit(way: float, misfit: float = 0.1) -> JointFit:
    values = np.array([VALUES.get(name, -1.0) for name in NAMES])
    covariance = np.diag([SDS.get(name, 0.01) ** 2 for name in NAMES])
    return JointFit(values, covariance, misfit, (), way=way)


@pytest.mark.parametrize("way", [2e-3, 1e-2, math.inf])
def test_dry_friction_is_what_the_longest_push_met(way: float) -> None:
    """By the law at draws of its posterior; an endless push meets all of it."""
    found = fit(way)
    share = 1.0 / (1.0 + math.exp(-VALUES["slow_logit"]))
    met = 0.02 * (1.0 - share * math.exp(-way / 0.01))
    assert found.coulomb.mean == pytest.approx(met, rel=0.02)
    rng = np.random.default_rng(1)
    drawn = {name: VALUES[name] + sd * rng.standard_normal(100_000) for name, sd in SDS.items()}
    shares = 1.0 / (1.0 + np.exp(-drawn["slow_logit"]))
    left = shares * np.exp(-way / np.exp(drawn["log_slow"]))
    spread = float(np.std(drawn["log_coulomb"] + np.log(1.0 - left)))
    sd = found.coulomb.sd / found.coulomb.mean
    assert sd == pytest.approx(math.hypot(spread, LEFT_OUT), rel=0.1)


def test_what_the_law_leaves_out_grows_with_its_misfit() -> None:
    small, large = fit(math.inf, misfit=0.5).inertia, fit(math.inf, misfit=4.0).inertia
    assert small.sd / small.mean == pytest.approx(math.hypot(0.03, LEFT_OUT), rel=0.01)
    assert large.sd / large.mean == pytest.approx(math.hypot(0.03, 2.0 * LEFT_OUT), rel=0.02)
