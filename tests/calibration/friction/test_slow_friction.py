"""What a probe found of slow friction is the prior of a fit, unless a recipe states one."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.friction.slow_friction import LEFT_OUT, SlowFriction, with_probed
from scissorcal.calibration.friction.typical import at_typical, typical_values
from scissorcal.recipe.priors import JointPriors, LogNormalPrior
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.header import Joint
from scissorcal.recording.probe import PROBE_KEY, Posterior, ProbeResult
from scissorcal.recording.recording import SAMPLE_DTYPE, Recording
from tests.calibration.cut.test_known import bent
from tests.calibration.truth import Truth, friction_recording

SETTINGS = FitFriction()


def probed(*recordings: Recording, slowest: float = 0.05) -> FitFriction:
    bins = SimpleNamespace(rate=np.full(100, slowest))
    return with_probed(SETTINGS, SlowFriction.of(recordings, bins))  # type: ignore[arg-type]


SHARE, RATE = 0.4, 0.08


def recording(
    sd: float = 0.1, *, probed: bool = True, kind: str = "rotary", rate: float = 0.08
) -> Recording:
    found = ProbeResult(
        "a rig",
        "0" * 64,
        "2026-11-28T00:00:00+00:00",
        posterior=Posterior(
            ("log_inertia", "log_rise_share", "log_rise_rate"),
            (-8.0, math.log(SHARE), math.log(rate)),
            ((0.01, 0.0, 0.0), (0.0, sd**2, 0.0), (0.0, 0.0, sd**2)),
        ),
    )
    device = {PROBE_KEY: found.as_dict()} if probed else {}
    samples = np.zeros(10, SAMPLE_DTYPE)
    return Recording("friction", samples, joint=Joint(kind), device=device)  # type: ignore[arg-type]


def test_level_and_speed_are_the_probes() -> None:
    before = SETTINGS.priors.rotary
    after = probed(recording(probed=False), recording()).priors.rotary
    assert after.stribeck_Nm.median == pytest.approx(SHARE * before.coulomb_Nm.median)
    assert after.stribeck_rate_rad_per_s.median == pytest.approx(RATE)
    sd = after.stribeck_rate_rad_per_s.normal()[1]
    assert sd == pytest.approx(math.hypot(0.1, LEFT_OUT), rel=0.01)
    assert after.coulomb_Nm == before.coulomb_Nm
    assert SETTINGS.priors.rotary == before, "a recipe's settings are not changed"


def test_what_a_recipe_states_stays() -> None:
    own = LogNormalPrior(median=0.002, factor_90=2.0)
    rotary = type(SETTINGS.priors.rotary)(stribeck_Nm=own)
    stated = SETTINGS.model_copy(update={"priors": JointPriors(rotary=rotary)})
    bins = SimpleNamespace(rate=np.full(100, 0.05))
    slow = SlowFriction.of((recording(),), bins)  # type: ignore[arg-type]
    after = with_probed(stated, slow).priors.rotary
    assert after.stribeck_Nm == own
    assert after.stribeck_rate_rad_per_s.median == pytest.approx(RATE)


@pytest.mark.parametrize(
    "one",
    [recording(probed=False), recording(sd=3.0), recording(kind="linear")],
    ids=["no probe", "a probe that did not see it", "a linear joint"],
)
def test_without_such_a_probe_the_recipes_priors_hold(one: Recording) -> None:
    assert probed(one) == SETTINGS


@pytest.mark.parametrize("speed", [0.06, 1.0], ids=["held", "seen by sweeps"])
def test_what_no_sweep_shows_is_as_wide_as_the_probe_knows_it(speed: float) -> None:
    """Sweeps from 0.3 rad/s on of friction whose rise ends at 0.06; the probe has 0.4 +- 0.2."""
    rng = np.random.default_rng(3)
    made = friction_recording(Truth(), rng, speeds=(0.3, 0.6, 1.0))
    device = recording(0.2, rate=speed).device
    wanted = FitFriction(rung="stribeck", symmetry="symmetric", critic=False)
    fit = fit_friction((replace(made, device=device),), wanted, effort="draft", rng=rng)
    level = fit.column("stribeck") / fit.column("coulomb")
    spread = float(np.log(level).std())
    known = math.hypot(0.2, LEFT_OUT)
    if speed < 0.3:
        assert spread == pytest.approx(known, rel=0.15)
        assert abs(math.log(float(np.median(level)) / SHARE)) < known
    else:
        assert spread < 1.2 * known


def test_a_mode_far_out_on_a_ridge_is_not_what_is_rendered() -> None:
    """The mean is taken where the mode has ten times the median of the static friction."""
    fit = bent(0.3)
    point = fit.map_point.copy()
    point[[p.name for p in fit.parameters].index("stribeck")] = 0.03
    ridge = replace(fit, map_point=point)
    values = typical_values(ridge)
    assert float(values["stribeck"]) == fit.parameter("stribeck").mean
    shown = at_typical(ridge).map_point
    assert shown == pytest.approx([p.mean for p in fit.parameters])
