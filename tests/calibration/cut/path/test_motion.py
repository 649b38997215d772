"""Motion over the path: smoothed as the encoder needs, work of a known force, its noise."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from scissorcal.calibration.cut.path_motion import path_motion, turning_points
from scissorcal.calibration.cut.path_work import (
    advance_line,
    material_of,
    mean_advance,
    mean_torque,
    torque_covariance,
    torque_noise_of,
    without_tremor,
)
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.model import FrictionLaw
from tests.calibration.cut.path.made import COULOMB, INERTIA, RATE_HZ, record, swing
from tests.calibration.truth import sweep

COARSE = 2 * np.pi / 20_000
FRICTION = FrictionLaw({"coulomb": COULOMB})


def spring(opening):
    """A torque that resists closing below 0.6 rad: its potential is known."""
    return 2.0 * np.maximum(0.6 - opening, 0.0)


def potential(opening):
    """Integral of the spring's torque over the opening."""
    return -(np.maximum(0.6 - opening, 0.0) ** 2)


def motion_of(made):
    (motion,) = path_motion((made.recording,), INERTIA)
    return motion


def off(values, truth):
    """Rms difference away from the ends, where a smoother has one side only."""
    inside = slice(50, -50)
    return float(np.sqrt(np.mean((values - truth)[inside] ** 2)))


def test_a_fine_encoder_is_hardly_smoothed():
    made = record(swing(), spring, step_rad=1e-6)
    motion = motion_of(made)
    assert motion.resolution == pytest.approx(1e-6, rel=0.01)
    assert off(motion.opening, made.recording.samples["opening"]) < 0.4e-6
    assert off(motion.opening, made.opening) < 0.35e-6


def test_a_coarse_encoder_is_smoothed_by_the_drive():
    """Better than its steps by 2.5 in place, and than differences of them by 5 in rate."""
    made = record(swing(), spring, step_rad=COARSE)
    motion = motion_of(made)
    assert motion.resolution == pytest.approx(COARSE, rel=0.01)
    steps = off(made.recording.samples["opening"], made.opening)
    rough = np.gradient(made.recording.samples["opening"]) * RATE_HZ
    assert off(motion.opening, made.opening) < steps / 2.5
    assert off(motion.rate, made.rate) < off(rough, made.rate) / 5.0


@pytest.mark.parametrize("step_rad", [1e-5, COARSE])
def test_the_error_of_the_rate_matches_its_standard_deviation(step_rad):
    made = record(swing(), spring, step_rad=step_rad)
    motion = motion_of(made)
    assert 0.4 < off(motion.rate, made.rate) / motion.rate_sd.mean() < 2.0


def test_blades_that_swing_on_the_material_are_smoothed_less():
    """0.2 s at 80 Hz in 6 s, on 30 N m/rad: one walk for all gets their size wrong by 30 %.

    The rate's error is as large as it says there too, and smaller elsewhere.
    """
    swings = np.arange(200) / RATE_HZ
    held = 0.5 + 1e-3 * np.sin(2 * np.pi * 80.0 * swings) * np.sin(np.pi * swings / 0.2) ** 2
    way = np.concatenate([sweep(0.9, 0.5, 0.15), held, sweep(0.5, 0.9, 0.15)])
    made = record(way, lambda q: 30.0 * np.minimum(q - 0.5, 0.01), step_rad=COARSE)
    motion = motion_of(made)
    here = slice(len(sweep(0.9, 0.5, 0.15)) + 40, len(sweep(0.9, 0.5, 0.15)) + 160)
    swing_sd = np.std(made.opening[here])
    assert np.std(motion.opening[here]) == pytest.approx(swing_sd, rel=0.05)
    error = np.sqrt(np.mean((motion.rate - made.rate)[here] ** 2))
    assert 0.4 < error / motion.rate_sd[here].mean() < 2.0
    assert motion.rate_sd[here].mean() > 1.5 * motion.rate_sd.min()


@pytest.mark.parametrize(("step_rad", "share"), [(1e-6, 1e-3), (COARSE, 5e-3)])
def test_the_work_of_a_known_force_is_its_potential(step_rad, share):
    """Away from the turns, where the sign of friction is not known to a tick."""
    made = record(swing(), spring, step_rad=step_rad)
    motion = motion_of(made)
    material = material_of(motion, FRICTION, 0.0)
    turns = turning_points(motion.opening, 3e-3)
    largest = float(np.ptp(potential(made.opening)))
    assert len(turns) == 7
    for low, high in pairwise(turns):
        a, b = low + 5, high - 5
        done = material.work[b] - material.work[a]
        expected = potential(made.opening[b]) - potential(made.opening[a])
        assert done == pytest.approx(expected, abs=share * largest)


def test_friction_does_no_work_where_the_blades_stand():
    """A smoothed position trembles by 5 urad: 300 samples of it would add 20 mN m over 2 mrad."""
    way = np.concatenate([sweep(0.6, 0.5, 0.2), np.full(300, 0.5), sweep(0.5, 0.4, 0.2)])
    motion = motion_of(record(way, lambda q: 0.0 * q, step_rad=5e-5))
    held = slice(len(sweep(0.6, 0.5, 0.2)) + 20, len(sweep(0.6, 0.5, 0.2)) + 280)
    assert motion.standing[held].all()
    assert not motion.standing[100:300].any()
    trembling = 5e-6 * np.random.default_rng(5).standard_normal(len(way))
    motion = replace(motion, opening=motion.opening + trembling)
    work = material_of(motion, FRICTION, 0.0).work[held]
    assert np.ptp(work) < 1e-4 * COULOMB
    never = replace(motion, standing=np.zeros(len(way), dtype=bool), opening_sd=np.zeros(len(way)))
    assert np.ptp(material_of(never, FRICTION, 0.0).work[held]) > 1e-3 * COULOMB


def test_turns_within_the_error_of_a_position_take_no_work():
    """Independent errors go back by three sds of a difference once in 37 samples; 0.7 of 5 mrad."""
    way = np.linspace(0.5, 0.4, 2000)
    trembling = way[999] + 5e-6 * np.random.default_rng(5).standard_normal(1000)
    path = np.concatenate([way[:1000], trembling, way[1000:]])
    certain = without_tremor(path, 3 * np.sqrt(2) * 5e-6)
    assert np.abs(np.diff(path)).sum() - 0.1 > 4e-3
    assert np.abs(np.diff(certain)).sum() - 0.1 < 8e-4
    assert np.abs(certain - path).max() < 5e-5
    swing = 0.45 + 1e-3 * np.sin(np.arange(2000) / 30.0)
    assert without_tremor(swing, 2e-5) == pytest.approx(swing, abs=1e-12)


def test_blades_that_creep_do_work_against_friction():
    """At 4 mrad/s they count as standing, and friction acts on what they turn by on the whole."""
    motion = motion_of(record(sweep(0.6, 0.5, 0.004), lambda q: 0.0 * q, step_rad=1e-6))
    assert motion.standing.all()
    work = material_of(motion, FRICTION, 0.0).work
    assert work[-1] - work[0] == pytest.approx(0.0, abs=0.01 * COULOMB * 0.1)


def test_the_mean_advance_is_that_over_the_path():
    """A carriage that moves on while the blades stand has no share in it."""
    way = np.concatenate([sweep(0.6, 0.5, 0.2), np.full(300, 0.5)])
    motion = motion_of(record(way, spring))
    moved = np.where(np.arange(len(way)) < len(way) - 300, 0.01, 0.02)
    mean = mean_advance(replace(motion, advance=moved), np.array([100, len(way) - 1]))
    assert mean == pytest.approx([0.01], abs=1e-4)


def test_the_advance_at_the_ends_is_on_the_line_along_the_path():
    """By steps of 10 um, a carriage at 0.05 m a rad: within a tenth of a step at the ends."""
    motion = motion_of(record(sweep(0.6, 0.5, 0.2), spring))
    advance = 0.03 + np.round(0.05 * (0.6 - motion.opening) / 1e-5) * 1e-5
    ends = np.array([100, 220, 340])
    stepped = replace(motion, advance=advance, advance_sd=1e-5 / np.sqrt(12.0))
    line = advance_line(stepped, ends)
    true = 0.03 + 0.05 * (0.6 - motion.opening[ends])
    assert line == pytest.approx(np.stack([true[:-1], true[1:]], axis=1), abs=1e-6)


def test_segments_of_one_step_have_the_advance_of_its_ends():
    motion = motion_of(record(sweep(0.6, 0.5, 0.2), spring))
    advance = 0.03 + 0.05 * (0.6 - motion.opening)
    ends = np.arange(200, 206)
    line = advance_line(replace(motion, advance=advance), ends)
    assert line == pytest.approx(np.stack([advance[ends[:-1]], advance[ends[1:]]], axis=1))


@pytest.mark.parametrize("hertz", [25.0, 60.0])
def test_the_line_stays_within_what_the_carriage_did(hertz):
    """Swings on a slow drift, in and out of what counts as standing, while the carriage goes on."""
    time = np.arange(600) / RATE_HZ
    way = 0.6 - 0.02 * time - 1e-3 * np.sin(2 * np.pi * hertz * time) * np.exp(-time / 0.15)
    motion = motion_of(record(way, spring, step_rad=COARSE))
    advance = 0.02 * time
    for low in range(20, 400, 20):
        ends = np.array([low, low + 60, low + 130])
        line = advance_line(replace(motion, advance=advance), ends)
        for pair, first, last in zip(line, ends[:-1], ends[1:], strict=True):
            assert advance[first] - 2e-6 < pair.min() <= pair.max() < advance[last] + 2e-6


def test_a_carriage_that_moves_back_at_rest_does_not_count():
    """30 mm in 0.3 s before the blades turn, and then 0.05 m a rad: the line is that of the way."""
    motion = motion_of(record(np.concatenate([np.full(300, 0.6), sweep(0.6, 0.5, 0.2)]), spring))
    back = np.linspace(0.03, 0.0, 300)
    away = 0.6 - motion.opening
    advance = np.where(np.arange(len(away)) < 300, np.resize(back, len(away)), 0.0) + 0.05 * away
    ends = np.array([0, 320, 420])
    line = advance_line(replace(motion, advance=advance), ends)
    true = 0.05 * away[ends]
    assert line == pytest.approx(np.stack([true[:-1], true[1:]], axis=1), abs=5e-6)


def test_cogging_and_offset_are_taken_off():
    """A motor that adds a periodic torque that its measured drive does not show."""
    made = record(swing(), lambda q: spring(q) + 0.004 * np.cos(40.0 * q) - 0.002)
    motion = motion_of(made)
    clean = material_of(motion, FRICTION, 0.0)
    taken = material_of(motion, FRICTION, 0.002, (0.004, 0.0, 40.0))
    turns = turning_points(motion.opening, 3e-3)
    ends = np.arange(turns[0] + 20, turns[1] - 20, 15)
    expected = np.diff(potential(motion.opening[ends])) / np.diff(motion.opening[ends])
    torque, _ = mean_torque(motion, taken.work, ends)
    rough, _ = mean_torque(motion, clean.work, ends)
    assert np.abs(torque - expected).max() < 3e-4
    assert np.abs(rough - expected).max() > 4e-3


@pytest.mark.parametrize("late_ticks", [0.3, 1.0])
def test_a_late_torque_is_corrected_by_its_delay(late_ticks):
    made = record(swing(), spring, late_ticks=late_ticks)
    motion = motion_of(made)
    turns = turning_points(motion.opening, 3e-3)
    ends = np.arange(turns[0] + 20, turns[1] - 20, 25)
    seen, late = mean_torque(motion, material_of(motion, FRICTION, 0.0).work, ends)
    expected = np.diff(potential(motion.opening[ends])) / np.diff(motion.opening[ends])
    left, mended = seen - expected, seen - late_ticks * late - expected
    assert np.abs(mended).max() < 0.15 * np.abs(left).max()


def test_the_covariance_is_that_of_simulated_noise():
    """White and slow noise on the drive, 1000 times: 8 % is 3.6 standard errors."""
    rng = np.random.default_rng(3)
    noise = TorqueNoise(1e-3, 8e-4, 0.02)

    def drawn(count):
        keep = np.exp(-1.0 / RATE_HZ / noise.slow_time_s)
        shocks = np.sqrt(1 - keep**2) * rng.standard_normal(count)
        shocks[0] = rng.standard_normal()
        slow = lfilter([1.0], [1.0, -keep], shocks)
        return noise.white_Nm * rng.standard_normal(count) + noise.slow_Nm * slow

    motion = motion_of(record(swing(2.0), spring, step_rad=1e-7))
    ends = np.array([300, 320, 350, 380, 400, 460])
    covariance = torque_covariance(motion, ends, noise, 2e-4)
    path = np.diff(motion.opening)
    low, high = ends[:-1], ends[1:]
    means = []
    for _ in range(1000):
        done = np.concatenate([[0.0], np.cumsum(drawn(len(path)) * path)])
        means.append((done[high] - done[low]) / (motion.opening[high] - motion.opening[low]))
    seen = np.cov(np.array(means).T)
    shared = covariance - 4e-8
    assert np.sqrt(np.diag(seen) / np.diag(shared)) == pytest.approx(np.ones(5), abs=0.08)
    scale = np.sqrt(np.outer(np.diag(shared), np.diag(shared)))
    assert np.abs(seen - shared).max() < 0.15 * scale.max()


def test_noise_is_taken_from_friction_and_white_where_it_is_not_known():
    known = {"noise_white_Nm": 1e-3, "noise_slow_Nm": 5e-4, "noise_slow_time_s": 0.03}
    assert torque_noise_of(known) == TorqueNoise(1e-3, 5e-4, 0.03)
    assert torque_noise_of({"residual_rms": 2e-3}).white_Nm == 2e-3


def test_reversed_turns_are_tremor():
    """The first sample counts as one where the opening falls or rises from there."""
    way = np.concatenate(
        [
            np.linspace(0.8, 0.5, 100),
            np.linspace(0.5, 0.502, 10),
            np.linspace(0.502, 0.3, 80),
            np.full(30, 0.3),
            np.linspace(0.3, 0.6, 90),
        ]
    )
    assert way[turning_points(way, 3e-3)] == pytest.approx([0.8, 0.3])
    assert way[turning_points(way, 1e-3)] == pytest.approx([0.8, 0.5, 0.502, 0.3])
    assert turning_points(np.full(20, 0.4), 1e-3) == []


def test_invalid_samples_stay_marked_and_a_gap_splits_a_motion():
    made = record(swing(4.0), spring)
    usable = np.ones(4000, dtype=bool)
    usable[1000:1010] = False
    (motion,) = path_motion((made.recording,), INERTIA, (usable,))
    assert np.flatnonzero(~motion.usable).tolist() == list(range(1000, 1010))
    motions = path_motion((without(made, 2000, 2300),), INERTIA)
    assert [m.source[0] for m in motions] == [0, 2000]
    assert sum(len(m.opening) for m in motions) == 3700


def without(made, low, high):
    samples = np.delete(made.recording.samples, np.s_[low:high])
    return replace(made.recording, samples=samples)


@pytest.mark.parametrize(("missing", "kept"), [(1, True), (2, True), (3, False), (50, False)])
def test_a_short_gap_is_bridged_and_a_longer_one_than_3_ms_is_not_used(missing, kept):
    """The swing turns at 25 rad/s^2: a gap of 2 ms leaves its opening to a microradian."""
    made = record(swing(4.0), spring)
    (motion,) = path_motion((without(made, 1500, 1500 + missing),), INERTIA)
    whole = motion_of(made)
    inside = slice(1500, 1500 + missing)
    assert len(motion.opening) == 4000
    assert np.all(motion.usable[inside] == kept)
    lost = np.flatnonzero(~motion.usable).tolist()
    assert lost == ([] if kept else list(range(1498, 1502 + missing))), "with rates that reach in"
    assert np.all(motion.source[inside] == 1499)
    assert motion.source[1500 + missing] == 1500
    assert motion.resolution == pytest.approx(whole.resolution, rel=0.01)
    beside = np.r_[1400:1500, 1500 + missing : 1600 + missing]
    np.testing.assert_allclose(motion.opening[beside], whole.opening[beside], atol=2e-6)
    if kept:
        np.testing.assert_allclose(motion.opening[inside], whole.opening[inside], atol=2e-6)
