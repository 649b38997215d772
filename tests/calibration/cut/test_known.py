"""What a cut takes over from the fit of friction: a law in the middle of its posterior."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.model import friction_torque
from scissorcal.recipe import CutPriors
from tests.calibration.cut.path.made import record
from tests.calibration.truth import sweep
from tests.package.fits import friction_fit

RATE, LEVEL = 0.1, 0.05
NOISE = {"noise_white_Nm": 1e-3, "noise_slow_Nm": 5e-4, "noise_slow_time_s": 0.01}


def bent(spread: float):
    """A fit that knows friction at 0.1 rad/s, with Stribeck friction open by ``spread`` in logs."""
    fit = friction_fit(law="stribeck", draws=2000)
    names = [p.name for p in fit.parameters]
    rng = np.random.default_rng(4)
    stribeck = 0.003 * np.exp(spread * rng.standard_normal(2000))
    scale = 0.1 * np.sqrt(stribeck / 0.003)
    most = (LEVEL - 1e-4) / np.exp(-((RATE / scale) ** 2))  # Coulomb friction stays above 0
    stribeck = np.minimum(stribeck, most)
    coulomb = LEVEL - stribeck * np.exp(-((RATE / scale) ** 2))
    draws = fit.draws.copy()
    point = fit.map_point.copy()
    open_ones = {"stribeck": stribeck, "stribeck_rate": scale, "coulomb": coulomb}
    highest = {"stribeck": 0.003, "stribeck_rate": 0.1, "coulomb": LEVEL - 0.003 * np.exp(-1.0)}
    parameters = list(fit.parameters)
    for name, column in open_ones.items():
        index = names.index(name)
        draws[:, index], point[index] = column, highest[name]
        parameters[index] = replace(parameters[index], mean=float(column.mean()))
    viscous = names.index("viscous")
    draws[:, viscous] = point[viscous] = parameters[viscous].mean
    draws[:, names.index("offset")] = point[names.index("offset")] = 0.0
    parameters[names.index("offset")] = replace(parameters[names.index("offset")], mean=0.0)
    return replace(
        fit, draws=draws, map_point=point, parameters=tuple(parameters), diagnostics=NOISE
    )


def test_on_a_curved_ridge_the_mode_replaces_the_mean():
    """With Stribeck friction open by a factor of 4.5 they give 2 mN m less than every draw."""
    fit = bent(1.5)
    known = KnownFriction.of(fit)
    viscous = fit.parameter("viscous").mean * RATE
    level = float(friction_torque(known.law, known.law.angle_center, RATE))
    assert level == pytest.approx(LEVEL + viscous, abs=1e-6)
    means = {p.name: p.mean for p in fit.parameters}
    bell = means["stribeck"] * np.exp(-((RATE / means["stribeck_rate"]) ** 2))
    assert means["coulomb"] + bell < LEVEL - 1e-3


def test_segments_at_rates_that_friction_is_not_known_at_hardly_count():
    """Friction open at rest and known at 0.3 rad/s: sds of 0.02 rad/s and of 0.3 rad/s."""
    known = KnownFriction.of(bent(1.0))
    doubts = []
    for rate in (0.02, 0.3):
        made = record(sweep(0.8, 0.3, rate), lambda opening: 0.0 * opening, step_rad=1e-5)
        (motion,) = path_motion((made.recording,), known.inertia)
        ends = np.linspace(0, len(motion.opening) - 1, 5).astype(int)
        covariance = known.material(motion).torque_doubt(motion, ends)
        assert np.all(np.linalg.eigvalsh(covariance) >= -1e-15)
        doubts.append(float(np.sqrt(np.diag(covariance).mean())))
    assert doubts[0] > 1.5e-3
    assert doubts[1] < 0.1 * doubts[0]


def test_the_standard_deviation_is_of_the_posteriors_core():
    """Friction at 0.3 rad/s: a few draws far out do not count."""
    fit = bent(0.3)
    draws = fit.draws.copy()
    draws[:20, [p.name for p in fit.parameters].index("coulomb")] += 0.05
    wide, narrow = KnownFriction.of(replace(fit, draws=draws)), KnownFriction.of(fit)
    assert wide.closing_sd == pytest.approx(narrow.closing_sd, rel=0.1)
    assert narrow.closing_sd > CutPriors().friction_sd_floor_Nm
