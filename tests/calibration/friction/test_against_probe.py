"""The inertia of sweeps beside that of a probe's pushes."""

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from scissorcal.calibration.friction.against_probe import inertia_verdict, with_pushed_inertia
from scissorcal.inference.posterior import Posterior
from scissorcal.model.transforms import LOG
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


def swept(inertia: float, lengthening: float, kind: str) -> tuple[SimpleNamespace, np.ndarray]:
    """A law of inertia and one level, and draws of them."""
    logs = np.random.default_rng(0).standard_normal((2000, 2)) * [0.03, 0.1]
    logs += np.array([math.log(inertia), -4.0])
    layout = SimpleNamespace(
        names=("inertia", "coulomb"),
        parameters=(SimpleNamespace(transform=LOG), SimpleNamespace(transform=LOG)),
        natural=lambda u: {"inertia": np.exp(u[:, 0])},
    )
    windows = SimpleNamespace(lengthening=lengthening)
    law = SimpleNamespace(layout=layout, windows=windows, joint=Joint(kind))  # type: ignore[arg-type]
    return law, logs


def judged(inertia: float, *recordings: Recording, lengthening: float = 1.0, kind: str = "rotary"):
    law, draws = swept(inertia, lengthening, kind)
    return inertia_verdict(law, draws, recordings)  # type: ignore[arg-type]


def pushed(inertia: float, *recordings: Recording, lengthening: float = 2.0, kind: str = "rotary"):
    law, draws = swept(inertia, lengthening, kind)
    posterior = cast(Posterior, Drawn(draws))
    rng = np.random.default_rng(1)
    found, note = with_pushed_inertia(posterior, law, recordings, rng)  # type: ignore[arg-type]
    assert found.draws[:, 1] == pytest.approx(draws[:, 1], abs=0.0), "nothing else changes"
    return np.exp(found.draws[:, 0]), note


@dataclass(frozen=True)
class Drawn:
    """The part of a posterior that is asked here."""

    draws: np.ndarray


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


def test_where_steps_hide_how_sweeps_swing_the_pushes_inertia_stands() -> None:
    draws, note = pushed(2.0 * PUSHED, recording(NOW))
    assert draws.mean() == pytest.approx(PUSHED, rel=0.01)
    assert draws.std() == pytest.approx(SD * PUSHED, rel=0.1)
    assert "pushes, 400 +- 16 kg mm^2" in note
    assert "800 +- 24 kg mm^2" in note
    assert judged(2.0 * PUSHED, recording(NOW), lengthening=2.0) is None


def test_windows_that_are_long_enough_keep_the_sweeps_inertia() -> None:
    draws, note = pushed(2.0 * PUSHED, recording(NOW), lengthening=1.8)
    assert (draws.mean() == pytest.approx(2.0 * PUSHED, rel=0.01), note) == (True, "")


def test_the_newest_probe_counts() -> None:
    assert judged(PUSHED, recording(BEFORE, 8e-4), recording(NOW)).status == "pass"
    assert pushed(PUSHED, recording(BEFORE, 8e-4), recording(NOW))[0].mean() == pytest.approx(
        PUSHED, rel=0.01
    )


def test_without_a_probe_or_turning_blades_nothing_is_compared_or_replaced() -> None:
    bare = Recording("friction", np.zeros(10, SAMPLE_DTYPE))
    assert judged(PUSHED, bare) is None
    assert judged(PUSHED, recording(NOW), kind="linear") is None
    assert pushed(2.0 * PUSHED, bare)[1] == ""
    assert pushed(2.0 * PUSHED, recording(NOW), kind="linear")[1] == ""
