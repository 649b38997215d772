"""The inertia of sweeps beside that of a probe's pushes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.calibration.friction.against_probe import inertia_verdict
from scissorcal.recording.header import Joint
from scissorcal.recording.probe import PROBE_KEY, Estimate, ProbeResult
from scissorcal.recording.recording import SAMPLE_DTYPE, Recording

PUSHED, SD = 4e-4, 0.04


def recording(made_at: str, inertia: float = PUSHED) -> Recording:
    found = ProbeResult(
        "a rig",
        "0" * 64,
        made_at,
        inertia_kg_m2=Estimate(inertia, SD * inertia),
    )
    return Recording("friction", np.zeros(10, SAMPLE_DTYPE), device={PROBE_KEY: found.as_dict()})


def judged(swept: float, *recordings: Recording, coarse: bool = True, kind: str = "rotary"):
    logs = math.log(swept) + 0.03 * np.random.default_rng(0).standard_normal((2000, 1))
    layout = SimpleNamespace(natural=lambda u: {"inertia": np.exp(u[:, 0])})
    windows = SimpleNamespace(lengthening=2.0 if coarse else 1.0)
    law = SimpleNamespace(layout=layout, windows=windows, joint=Joint(kind))  # type: ignore[arg-type]
    return inertia_verdict(law, logs, recordings)  # type: ignore[arg-type]


NOW = "2026-11-28T00:00:00+00:00"
BEFORE = "2026-11-27T00:00:00+00:00"


@pytest.mark.parametrize(("share", "status"), [(1.0, "pass"), (1.15, "pass"), (1.2, "fail")])
def test_sweeps_may_differ_by_what_both_measurements_are_off(share: float, status: str) -> None:
    """0.05 in the logarithm together: 3.3 of them are a factor of 1.18."""
    assert judged(share * PUSHED, recording(NOW)).status == status


@pytest.mark.parametrize(("coarse", "cure"), [(True, "Add faster sweeps"), (False, "Probe again")])
def test_the_cause_is_the_encoder_only_where_windows_had_to_be_longer(
    coarse: bool, cure: str
) -> None:
    found = judged(2.0 * PUSHED, recording(NOW), coarse=coarse)
    assert found.status == "fail"
    assert cure in found.why
    assert "inertia of 800 +- 24 kg mm^2, the probe's pushes 400 +- 16 kg mm^2" in found.why


def test_the_newest_probe_counts() -> None:
    assert judged(PUSHED, recording(BEFORE, 8e-4), recording(NOW)).status == "pass"


def test_without_a_probe_or_turning_blades_nothing_is_compared() -> None:
    bare = Recording("friction", np.zeros(10, SAMPLE_DTYPE))
    assert judged(PUSHED, bare) is None
    assert judged(PUSHED, recording(NOW), kind="linear") is None
