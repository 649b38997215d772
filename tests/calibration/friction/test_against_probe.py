"""The inertia of sweeps beside that of a probe's pushes."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.calibration import FitResult, fit_friction
from scissorcal.calibration.caveats import LONG_WINDOWS, caveats_of
from scissorcal.calibration.friction.probed import inertia_verdict
from scissorcal.recipe import FitFriction
from scissorcal.recording import PROBE_KEY, SAMPLE_DTYPE, Estimate, Joint, ProbeResult, Recording
from tests.calibration.truth import QUICK, Truth, friction_recording

PUSHED, SD = 4e-4, 0.04


def recording(made_at: str, inertia: float = PUSHED) -> Recording:
    found = ProbeResult(
        "a rig",
        "0" * 64,
        made_at,
        inertia_kg_m2=Estimate(inertia, SD * inertia),
    )
    return Recording("friction", np.zeros(10, SAMPLE_DTYPE), device={PROBE_KEY: found.as_dict()})


def swept(inertia: float, lengthening: float, kind: str) -> tuple[SimpleNamespace, np.ndarray]:
    """A law of inertia and one level, and draws of them."""
    logs = np.random.default_rng(0).standard_normal((2000, 2)) * [0.03, 0.1]
    logs += np.array([math.log(inertia), -4.0])
    layout = SimpleNamespace(
        names=("inertia", "coulomb"),
        natural=lambda u: {"inertia": np.exp(u[:, 0])},
    )
    windows = SimpleNamespace(lengthening=lengthening)
    law = SimpleNamespace(layout=layout, windows=windows, joint=Joint(kind))  # type: ignore[arg-type]
    return law, logs


def judged(inertia: float, *recordings: Recording, lengthening: float = 1.0, kind: str = "rotary"):
    law, draws = swept(inertia, lengthening, kind)
    return inertia_verdict(law, draws, recordings)  # type: ignore[arg-type]


NOW = "2026-11-28T00:00:00+00:00"
BEFORE = "2026-11-27T00:00:00+00:00"


@pytest.mark.parametrize(("share", "status"), [(1.0, "pass"), (1.15, "pass"), (1.2, "fail")])
def test_sweeps_may_differ_by_what_both_measurements_are_off(share: float, status: str) -> None:
    """0.05 in the logarithm together: 3.3 of them are a factor of 1.18."""
    assert judged(share * PUSHED, recording(NOW)).status == status


def test_the_verdict_names_both_and_what_to_do() -> None:
    found = judged(2.0 * PUSHED, recording(NOW))
    assert found.status == "fail"
    assert "Probe again" in found.why
    assert "inertia of 800 +- 24 kg mm^2, the probe's pushes 400 +- 16 kg mm^2" in found.why


def test_the_encoder_is_named_where_windows_had_to_be_longer() -> None:
    found = judged(2.0 * PUSHED, recording(NOW), lengthening=1.8)
    assert found.status == "fail"
    assert "the encoder's steps hide how these sweeps swing" in found.why


def test_the_newest_probe_counts() -> None:
    assert judged(PUSHED, recording(BEFORE, 8e-4), recording(NOW)).status == "pass"


def test_without_a_probe_or_turning_blades_nothing_is_compared() -> None:
    bare = Recording("friction", np.zeros(10, SAMPLE_DTYPE))
    assert judged(PUSHED, bare) is None
    assert judged(PUSHED, recording(NOW), kind="linear") is None


COARSE_RAD = 2.0 * math.pi / 8192


def swept_day(step_rad: float | None, probe: bool) -> FitResult:
    """A fit of one recording of sweeps, draft; truth 2e-4 kg m^2, which the probe calls 4e-4."""
    made = friction_recording(Truth(), np.random.default_rng(3), QUICK)
    samples = made.samples.copy()
    if step_rad is not None:
        samples["opening"] = np.round(samples["opening"] / step_rad) * step_rad
    device = recording(NOW).device if probe else {}
    settings = FitFriction(law="coulomb+viscous", critic=False)
    day = (replace(made, samples=samples, device=device),)
    return fit_friction(day, settings, effort="draft", rng=np.random.default_rng(0))


def test_behind_coarse_steps_a_fit_takes_the_pushes_inertia() -> None:
    alone, found = swept_day(COARSE_RAD, probe=False), swept_day(COARSE_RAD, probe=True)
    assert found.diagnostics["window_lengthening"] >= LONG_WINDOWS
    own, stated = alone.parameter("inertia"), found.parameter("inertia")
    assert own.mean == pytest.approx(2e-4, rel=0.1)
    assert stated.mean == pytest.approx(PUSHED, rel=0.01)
    assert stated.sd == pytest.approx(SD * PUSHED, rel=0.1)
    assert stated.measured_prior
    place = [one.name for one in found.parameters].index("inertia")
    assert found.map_point[place] == pytest.approx(PUSHED)
    others = np.arange(len(found.parameters)) != place
    assert found.draws[:, others] == pytest.approx(alone.draws[:, others], abs=0.0)
    assert found.series.predicted == pytest.approx(alone.series.predicted, abs=0.0), "of sweeps"
    assert "the probe's pushes, 400 +- 16 kg mm^2" in found.notes[-1]
    assert "inertia" not in [verdict.check for verdict in found.verdicts]
    assert [one.parameters for one in caveats_of(alone)] == [("inertia",)]
    assert caveats_of(found) == ()


def test_a_fine_encoder_keeps_the_sweeps_inertia_and_compares() -> None:
    found = swept_day(None, probe=True)
    assert found.parameter("inertia").mean == pytest.approx(2e-4, rel=0.05)
    (verdict,) = (one for one in found.verdicts if one.check == "inertia")
    assert verdict.status == "fail"
