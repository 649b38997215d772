"""What the probe estimates against the truth of rigs of two constructions."""

import math

import numpy as np
import pytest

from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.probe.idle import correlation_time, mean_of, observed_step
from scissorcal.device.probe.probe import probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.device.sim.truth import varied
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import Estimate, ProbeResult, probe_from_dict
from tests.strange_device import FAULTS, Faults, Person, StrangeDevice, VirtualPort

RECIPE = builtin_recipe("paper-80gsm")
SYMPLECTIC_S = 2.5e-4
"""The strange device steps explicitly: motor and place are each half a substep of 0.25 ms early."""


def found(faults: Faults, seed: int) -> ProbeResult:
    device = StrangeDevice(faults, seed)
    return probe(RigSession(VirtualPort(device), RECIPE, Operator(Person(device))))


def holds(estimate: Estimate | None, truth: float, widths: float = 2.0) -> bool:
    assert estimate is not None
    return abs(estimate.mean - truth) <= widths * 1.645 * estimate.sd


@pytest.mark.slow
def test_zeros_lie_in_their_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(41)
    inside = []
    for stage in ("_push", "_push_carriage"):  # the idle second is over then
        monkeypatch.setattr(f"scissorcal.device.probe.probe.{stage}", lambda *_, **__: None)
    for seed in range(8):
        torque, force = rng.normal(0.0, 0.01), rng.normal(0.0, 0.3)
        result = found(Faults(measured_zero_Nm=torque, force_zero_N=force), 900 + seed)
        for estimate, truth in ((result.torque_zero_Nm, torque), (result.force_zero_N, force)):
            assert estimate is not None
            inside.append(holds(estimate, truth, widths=1.0))
            assert estimate.sd < 2e-4 if estimate is result.torque_zero_Nm else 2e-3
    assert sum(inside) >= 11  # of 16 at 90 %: fewer in 1 of 4000 runs


@pytest.mark.parametrize(
    ("inertia", "dry", "lag", "late"),
    [
        pytest.param(1.5e-4, 0.006, 0.0005, 0.0, marks=pytest.mark.slow),
        pytest.param(6e-4, 0.012, 0.002, 0.0005, marks=pytest.mark.slow),
        (2.5e-3, 0.02, 0.001, 0.0025),
        pytest.param(6e-4, 0.005, 0.0005, 0.0015, marks=pytest.mark.slow),
    ],
)
def test_inertia_friction_and_delay_are_recovered(
    inertia: float, dry: float, lag: float, late: float
) -> None:
    faults = Faults(
        inertia=inertia, dry_Nm=dry, motor_lag_s=lag, delay_to_host_s=late, delay_to_device_s=late
    )
    result = found(faults, seed=77)
    ticks = 2.0 * math.ceil(late / 1e-3 - 1e-9) * 1e-3  # the device takes and sends on its ticks
    assert holds(result.inertia_kg_m2, inertia)
    assert holds(result.coulomb_Nm, dry)
    assert holds(result.viscous_Nm_s_per_rad, 4e-3)
    assert holds(result.delay_s, ticks + lag - SYMPLECTIC_S)
    assert result.facts["largest_rate_rad_per_s"] < RECIPE.rig.probe.largest_rate_rad_per_s


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "rigs"), [(8, 1), pytest.param(5, 3, marks=pytest.mark.slow)], ids=["one", "three"]
)
def test_the_virtual_rig_is_recovered_although_its_friction_follows_another_law(
    seed: int, rigs: int
) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(rigs):
        specimen = varied(load_specimen("office-paper"), rng)
        result = probe(RigSession(LockstepLink(specimen, rng), RECIPE))
        mechanism = specimen.mechanism
        law = mechanism.friction
        assert holds(result.inertia_kg_m2, mechanism.inertia_kg_m2)
        assert holds(
            result.coulomb_Nm, 0.5 * (law.coulomb_opening_Nm + law.coulomb_closing_Nm), widths=3.0
        )
        assert holds(result.delay_s, specimen.motor.lag_ms * 1e-3)
        assert holds(result.torque_gain, 1.0)


@pytest.mark.parametrize("fault", ["500 Hz", pytest.param("2 kHz", marks=pytest.mark.slow)])
def test_other_rates_are_probed_alike(fault: str) -> None:
    result = found(FAULTS[fault], seed=3)
    assert holds(result.inertia_kg_m2, 6e-4)
    assert holds(result.coulomb_Nm, 0.012)


def test_the_error_of_a_mean_holds_for_slow_noise() -> None:
    """White noise with a slow part, as of a current sensor: 90 % intervals hold 83 % and more."""
    rng = np.random.default_rng(9)
    inside = 0
    keep = math.exp(-1.0 / 12.0)
    for _ in range(300):
        slow = np.empty(1000)
        slow[0] = rng.standard_normal()
        for at, step in enumerate(rng.standard_normal(999), start=1):
            slow[at] = keep * slow[at - 1] + math.sqrt(1.0 - keep**2) * step
        estimate = mean_of(0.5 * slow + 0.8 * rng.standard_normal(1000))
        inside += abs(estimate.mean) <= 1.645 * estimate.sd
    assert inside >= 0.83 * 300 - 3 * math.sqrt(300 * 0.83 * 0.17)


def test_white_noise_has_a_correlation_time_of_a_half() -> None:
    values = np.random.default_rng(3).standard_normal(4000)
    assert correlation_time(values) == pytest.approx(0.5, abs=0.15)


def test_the_encoder_step_is_seen_through_float32() -> None:
    step = 2.0 * math.pi / 131072
    counts = np.array([9000, 9001, 9003, 9004, 9008, 9013, 9020])
    assert observed_step((counts * step).astype(np.float32).astype(np.float64)) == pytest.approx(
        step, rel=0.01
    )
    assert math.isnan(observed_step(np.full(5, 0.3)))


def test_a_result_survives_its_file() -> None:
    result = found(FAULTS["none"], seed=2)
    assert probe_from_dict(result.as_dict()) == result
    assert result.posterior is not None
    assert len(result.swings) == 6
    plain = result.as_dict()
    with pytest.raises(ValueError, match="not as many rows as names"):
        probe_from_dict({**plain, "posterior": {**plain["posterior"], "mean": [0.0]}})
    with pytest.raises(ValueError, match="not as many places as times"):
        probe_from_dict({**plain, "swings": [{**plain["swings"][0], "times_s": [0.0]}]})
    with pytest.raises(ValueError, match="its format is"):
        probe_from_dict({})
    with pytest.raises(ValueError, match="not a whole probe"):
        probe_from_dict({"format": "scissorcal-probe/1", "facts": None, "verdicts": []})
