"""Zeros of the sensors: subtracted along a line, known to within an sd, judged by name."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration.signals.zeros import (
    FELT,
    DriveZero,
    idle_periods,
    without_zeros,
    zero_verdicts,
)
from scissorcal.recording import PROBE_KEY, SAMPLE_DTYPE, Estimate, ProbeResult, Recording

UNMEASURED, NOISE, RADIUS = 3e-3, 1e-3, 0.06
IDLE, MOVING = 1500, 4000


def recording(
    torque: tuple[float, float] = (0.0, 0.0),
    force: tuple[float, float] = (0.0, 0.0),
    ends: tuple[bool, bool] = (True, True),
    seed: int = 5,
) -> Recording:
    """Motion between idle periods; zeros drift from the first to the second of a pair."""
    rng = np.random.default_rng(seed)
    count = MOVING + 2 * IDLE
    samples = np.zeros(count, SAMPLE_DTYPE)
    samples["device_time_us"] = 1000 * np.arange(count)
    moves = np.zeros(count, dtype=bool)
    moves[IDLE:-IDLE] = True
    if not ends[0]:
        moves[:IDLE] = True
    if not ends[1]:
        moves[-IDLE:] = True
    place = np.where(moves, 0.3 * np.sin(np.arange(count) / 200.0), 0.0)
    samples["opening"] = np.round(place / 5e-5) * 5e-5
    samples["torque_command"][moves] = 0.02
    share = np.arange(count) / count
    samples["motor_torque"] = samples["torque_command"] + torque[0] * (1 - share)
    samples["motor_torque"] += torque[1] * share + NOISE * rng.standard_normal(count)
    samples["handle_force"] = force[0] * (1 - share) + force[1] * share
    samples["stroke"] = np.where(moves, 0, -1)
    return Recording("friction", samples, handle_radius_m=RADIUS, source="a.mcap")


def test_a_steady_zero_is_taken_off() -> None:
    raw = recording(torque=(5e-3, 5e-3), force=(0.2, 0.2))
    (cleaned,), zero = without_zeros((raw,), UNMEASURED)
    assert zero is not None
    assert zero.drive == pytest.approx(5e-3 - RADIUS * 0.2, abs=1e-4)
    assert zero.sd < 1e-4
    left = cleaned.drive_effort - raw.samples["torque_command"]
    assert abs(float(left.mean())) < 4 * zero.sd
    assert np.array_equal(raw.samples["motor_torque"] > 1.0, cleaned.samples["motor_torque"] > 1.0)


def test_a_zero_that_drifts_is_followed_and_widens() -> None:
    raw = recording(torque=(0.0, 6e-3))
    (cleaned,), zero = without_zeros((raw,), UNMEASURED)
    assert zero is not None
    inside = slice(IDLE, -IDLE)
    left = (cleaned.drive_effort - raw.samples["torque_command"])[inside]
    assert abs(float(left.mean())) < 2e-4
    steady = without_zeros((recording(),), UNMEASURED)[1]
    assert steady is not None
    assert zero.sd > 10 * steady.sd
    assert zero.drift == pytest.approx(6e-3 * (1 - IDLE / (MOVING + 2 * IDLE)), rel=0.05)


@pytest.mark.parametrize("ends", [(True, False), (False, True)])
def test_one_end_leaves_the_drift_open(ends: tuple[bool, bool]) -> None:
    zero = without_zeros((recording(torque=(4e-3, 4e-3), ends=ends),), UNMEASURED)[1]
    assert zero is not None
    assert np.isnan(zero.drift)
    assert zero.sd == pytest.approx(4e-3 / np.sqrt(12), rel=0.05)
    verdict = zero_verdicts(zero, (recording(),), 0.02)[1]
    assert verdict.check == "zero drift"
    assert verdict.status == "fail"
    assert "warm up" in verdict.why


def test_without_idle_time_the_zero_has_the_priors_width() -> None:
    raw = recording(ends=(False, False))
    (cleaned,), zero = without_zeros((raw,), UNMEASURED)
    assert np.array_equal(cleaned.samples, raw.samples)
    assert zero is not None
    assert zero.sd == UNMEASURED
    (verdict,) = zero_verdicts(zero, (raw,), 0.02)
    assert verdict.status == "not_evaluated"
    assert "one second at idle" in verdict.why


def test_a_zero_that_is_known_from_before_is_used_where_nothing_shows_it() -> None:
    known = DriveZero(5e-3, 0.0, 5e-3, 1e-4, 0.0, 3.0)
    raw = recording(torque=(5e-3, 5e-3), ends=(False, False))
    (cleaned,), zero = without_zeros((raw,), UNMEASURED, known)
    left = cleaned.drive_effort - raw.samples["torque_command"]
    assert abs(float(left.mean())) < 1e-4
    assert zero is not None
    assert zero.sd == pytest.approx(5e-3 / np.sqrt(12))
    assert not zero.measured


def test_what_a_probe_found_counts_as_the_beginning() -> None:
    probe = ProbeResult(
        device="rig",
        identity="0" * 64,
        made_at="2026-01-01T00:00:00+00:00",
        torque_zero_Nm=Estimate(0.0, 1e-4),
        force_zero_N=Estimate(0.05, 1e-3),
    )
    late = recording(torque=(6e-3, 6e-3), ends=(False, True))
    raw = replace(late, device={PROBE_KEY: probe.as_dict()})
    zero = without_zeros((raw,), UNMEASURED)[1]
    assert zero is not None
    assert zero.drift == pytest.approx(6e-3 + RADIUS * 0.05, rel=0.05)
    assert zero.sd == pytest.approx(zero.drift / np.sqrt(12), rel=0.05)
    whole = replace(recording(), device={PROBE_KEY: probe.as_dict()})
    own = without_zeros((recording(),), UNMEASURED)[1]
    assert without_zeros((whole,), UNMEASURED)[1] == own
    only = replace(recording(ends=(False, False)), device={PROBE_KEY: probe.as_dict()})
    alone = without_zeros((only,), UNMEASURED)[1]
    assert alone is not None
    assert alone.measured
    assert alone.force_N == 0.05


def test_imports_without_commands_stay_as_they_are() -> None:
    raw = recording()
    raw.samples["torque_command"] = 0.0
    cleaned, zero = without_zeros((raw,), UNMEASURED)
    assert zero is None
    assert cleaned == (raw,)
    assert zero_verdicts(zero, (raw,), 0.02)[0].status == "not_evaluated"


def test_a_hand_that_holds_the_handles_at_rest_is_no_zero() -> None:
    raw = recording(force=(1.0, 1.0))
    raw.samples["torque_command"][raw.samples["stroke"] >= 0] = 0.0
    raw.samples["torque_command"][:100] = 0.02
    assert without_zeros((raw,), UNMEASURED)[1] is None
    known = DriveZero(0.0, 0.05, -3e-3, 1e-4, 0.0, 3.0)
    (cleaned,), zero = without_zeros((raw,), UNMEASURED, known)
    assert zero is not None
    assert zero.drive == known.drive
    assert float(np.median(cleaned.samples["handle_force"])) == pytest.approx(0.95)


def test_a_zero_beyond_the_drive_fails_and_names_its_sensor() -> None:
    raw = recording(force=(2.0, 2.0))
    zero = without_zeros((raw,), UNMEASURED)[1]
    large, drift = zero_verdicts(zero, (raw,), 0.02)
    assert large.status == "fail"
    assert "unload the force sensor" in large.why
    assert drift.status == "pass"
    assert drift.value is not None
    assert drift.value < FELT


def test_several_recordings_have_the_worst_of_their_zeros() -> None:
    both = (recording(torque=(2e-3, 2e-3)), recording(torque=(4e-3, 7e-3), seed=6))
    alone = without_zeros(both[1:], UNMEASURED)[1]
    zero = without_zeros(both, UNMEASURED)[1]
    assert alone is not None
    assert zero is not None
    assert zero.sd == alone.sd
    assert zero.drive == pytest.approx(0.5 * (2e-3 + 5.5e-3), abs=1e-4)


def test_a_zero_is_read_as_it_was_written() -> None:
    zero = without_zeros((recording(torque=(1e-3, 2e-3)),), UNMEASURED)[1]
    assert zero is not None
    assert DriveZero.from_dict(zero.as_dict()) == zero
    open_end = replace(zero, drift=float("nan"))
    again = DriveZero.from_dict(open_end.as_dict())
    assert again is not None
    assert np.isnan(again.drift)
    assert DriveZero.from_dict({}) is None


def test_the_spread_of_the_mean_is_that_of_the_line() -> None:
    """Random walks known at both ends: the sd is their mean's distance from the line, 3 sds."""
    rng = np.random.default_rng(2)
    walks = np.cumsum(rng.standard_normal((4000, 200)), axis=1)
    line = np.linspace(0, 1, 200) * walks[:, -1:]
    away = (walks - line).mean(axis=1)
    expected = np.sqrt(np.mean(walks[:, -1] ** 2) / 12.0)
    assert float(away.std()) == pytest.approx(expected, rel=0.08)


def test_idle_periods_are_told_in_order() -> None:
    first, second = idle_periods(recording(torque=(0.0, 1e-2)))
    assert first.time_s < second.time_s
    assert first.torque < second.torque
