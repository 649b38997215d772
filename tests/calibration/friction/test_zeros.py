"""Zeros of the second rig's sensors leave its friction as it is."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.zeros import DriveZero
from scissorcal.recording import Recording
from tests.second_rig import capture_friction, draw_truth, fine, recipe_for, true_parameters

SETTINGS = recipe_for(fine()).fit.friction.model_copy(
    update={"critic": False, "law": "stribeck+angle", "symmetry": "asymmetric"}
)
LEVELS = ("coulomb_pos", "coulomb_neg")


def recorded(
    torque_Nm: float, force_N: float, seed: int = 31
) -> tuple[Recording, dict[str, float]]:
    """A capture of one day's rig with these zeros, and its true parameters."""
    rng = np.random.default_rng(seed)
    day = draw_truth(fine(), rng)
    zeros = replace(day.sensors, torque_zero_Nm=torque_Nm, force_zero_N=force_N)
    rig = replace(day, sensors=zeros)
    recording, _ = capture_friction(rig, recipe_for(rig), rng)
    return recording, true_parameters(rig, angle_center=0.5)


def fitted(recording: Recording) -> FitResult:
    rng = np.random.default_rng(0)
    return fit_friction((recording,), SETTINGS, effort="draft", rng=rng)


@pytest.fixture(scope="module")
def plain() -> FitResult:
    """The fit of the rig whose sensors have no zero."""
    return fitted(recorded(0.0, 0.0)[0])


@pytest.mark.parametrize(
    ("torque_Nm", "force_N"),
    [
        (-4e-3, -0.1),
        *(
            pytest.param(*zeros, marks=pytest.mark.slow)
            for zeros in ((0.0, 0.05), (0.0, 0.2), (5e-3, 0.0))
        ),
    ],
)
def test_zeros_do_not_change_the_levels(plain: FitResult, torque_Nm: float, force_N: float) -> None:
    shifted = fitted(recorded(torque_Nm, force_N)[0])
    for name in ("inertia", "viscous_pos", "viscous_neg", *LEVELS):
        one, other = plain.parameter(name), shifted.parameter(name)
        assert other.mean == pytest.approx(one.mean, abs=0.02 * one.sd)
        assert other.sd == pytest.approx(one.sd, rel=0.02)
    verdicts = {verdict.check: verdict for verdict in shifted.verdicts}
    assert verdicts["sensor zeros"].status == "pass"
    assert verdicts["zero drift"].status == "pass"


def test_without_idle_seconds_the_intervals_are_wider_and_a_verdict_names_the_remedy() -> None:
    """Only how friction varies over the opening then tells levels from a zero of -3 mN m."""
    recording, _ = recorded(0.0, 0.05)
    moved = recording.samples["stroke"] >= 0
    first, last = np.flatnonzero(moved)[[0, -1]]
    bare = replace(recording, samples=recording.samples[first - 200 : last + 200])
    fit, whole = fitted(bare), fitted(recording)
    for name in LEVELS:
        found, true = fit.parameter(name), whole.parameter(name)
        assert found.sd > 3.0 * true.sd
        assert abs(found.mean - true.mean) < 3.0 * found.sd
    assert fit.parameter("offset").mean == pytest.approx(-3e-3, abs=1e-3)
    verdict = next(one for one in fit.verdicts if one.check == "sensor zeros")
    assert verdict.status == "not_evaluated"
    assert "one second at idle" in verdict.why


def test_a_cut_knows_friction_no_better_than_both_zeros(plain: FitResult) -> None:
    before = DriveZero.from_dict(plain.diagnostics)
    assert before is not None
    known = KnownFriction.of(plain)
    own = replace(before, sd=1e-3)
    again = known.with_zero(own, before)
    assert again.closing_sd == pytest.approx(np.hypot(known.closing_sd, np.hypot(1e-3, before.sd)))
    assert known.with_zero(None, before) == known
    assert known.with_zero(own, None) == known
