"""What a probe found of slow friction is the prior of a fit, unless a recipe states one."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.calibration.friction.layout import at_typical, typical_values
from scissorcal.calibration.friction.probed import (
    LEFT_OUT,
    SlowFriction,
    opened,
    with_probed,
)
from scissorcal.recipe import FitFriction, JointPriors, LogNormalPrior
from scissorcal.recording import PROBE_KEY, SAMPLE_DTYPE, Joint, Posterior, ProbeResult, Recording
from tests.calibration.cut.test_known import bent

SETTINGS = FitFriction()


def slow_of(
    *recordings: Recording, slowest: float = 0.05, settings: FitFriction = SETTINGS
) -> SlowFriction | None:
    bins = SimpleNamespace(slowest_rate=slowest)
    return SlowFriction.of(recordings, bins, settings)  # type: ignore[arg-type]


def probed(*recordings: Recording) -> FitFriction:
    return with_probed(SETTINGS, slow_of(*recordings))


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
    assert slow_of(recording(), settings=stated) is None
    assert with_probed(stated, None) == stated


@pytest.mark.parametrize(
    "one",
    [recording(probed=False), recording(sd=0.7), recording(kind="linear")],
    ids=["no probe", "a probe that did not see it", "a linear joint"],
)
def test_without_such_a_probe_the_recipes_priors_hold(one: Recording) -> None:
    assert probed(one) == SETTINGS


@dataclass(frozen=True)
class Drawn:
    """As much of a posterior as is opened."""

    draws: NDArray[np.float64]


def opened_from(slowest: float, lacking: float) -> tuple[Drawn, Drawn]:
    """Draws with a tenth of the probe's level at its speed, before and after."""
    rng = np.random.default_rng(3)
    names = ("coulomb", "stribeck", "stribeck_rate")
    centre = np.log([0.015, 0.1 * SHARE * 0.015, RATE])
    before = Drawn(centre + 0.05 * rng.standard_normal((400, 3)))
    law = SimpleNamespace(layout=SimpleNamespace(names=names))
    after = opened(before, law, slow_of(recording(), slowest=slowest), lacking, rng)  # type: ignore[arg-type, type-var]
    return before, after  # type: ignore[return-value]


def test_what_no_sweep_shows_is_what_the_probe_found_and_as_wide() -> None:
    before, after = opened_from(slowest=0.5, lacking=1e-4)
    share, rate = after.draws[:, 1] - after.draws[:, 0], after.draws[:, 2]
    known = math.hypot(0.1, LEFT_OUT)
    assert share.mean() == pytest.approx(math.log(SHARE), abs=0.1)
    assert share.std() == pytest.approx(known, rel=0.15)
    assert rate.std() == pytest.approx(known, rel=0.15)
    assert np.all(after.draws[:, 0] == before.draws[:, 0])


def test_friction_at_the_slowest_sweep_changes_by_what_the_law_lacks() -> None:
    lacking, slowest = 5e-5, 0.12
    before, after = opened_from(slowest, lacking)

    def seen(drawn: Drawn) -> NDArray[np.float64]:
        level, rate = np.exp(drawn.draws[:, 1:]).T
        return np.asarray(level * np.exp(-((slowest / rate) ** 2)))

    change = seen(after) - seen(before)
    assert np.sqrt(np.mean(change**2)) < 2.0 * lacking
    assert (after.draws[:, 1] - after.draws[:, 0]).std() > 0.4


def test_sweeps_that_show_the_rise_decide() -> None:
    before, after = opened_from(slowest=RATE, lacking=1e-4)
    assert after is before


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
