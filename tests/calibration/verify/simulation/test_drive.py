"""Drives and recordings of a known truth: what the path's own sums make of them again."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.path_work import material_of
from scissorcal.calibration.signals.torque_noise import TorqueNoise, torque_noise
from scissorcal.calibration.verify.simulated_motion import (
    DriveTruth,
    drawn_noise,
    measured_drive,
    motion_of,
)
from scissorcal.calibration.verify.simulated_recordings import simulate_friction
from scissorcal.model import FrictionLaw
from tests.calibration.truth import QUICK, Truth, friction_recording

SILENT = TorqueNoise(0.0, 0.0, 0.01)
LAW = FrictionLaw({"coulomb_pos": 0.013, "coulomb_neg": 0.016, "viscous": 0.002})
INERTIA = 2e-4


@pytest.fixture(scope="module")
def recording():
    return friction_recording(Truth(), np.random.default_rng(1), QUICK)


@pytest.fixture(scope="module")
def motion(recording):
    return motion_of((recording,), INERTIA, 1e-3)[0]


def test_labels_times_and_resolutions_are_kept(recording, motion):
    truth = DriveTruth(INERTIA, LAW, TorqueNoise(1e-3, 5e-4, 0.02))
    (made,) = simulate_friction((motion,), truth, np.random.default_rng(2))
    (again,) = simulate_friction((motion,), truth, np.random.default_rng(2))
    assert np.array_equal(made.samples, again.samples)
    for name in ("device_time_us", "stroke", "flags", "handle_force", "sequence"):
        assert np.array_equal(made.samples[name], recording.samples[name])
    away = np.abs(made.samples["opening"] - recording.samples["opening"])
    assert away.max() < 12 * motion.opening_step
    counts = (made.samples["opening"] - made.samples["opening"][0]) / motion.opening_step
    assert np.abs(counts - np.round(counts)).max() < 1e-4
    assert not np.array_equal(made.samples["motor_torque"], recording.samples["motor_torque"])


@pytest.mark.parametrize("cogging", [(0.0, 0.0, 0.0), (4e-4, -3e-4, 90.0)])
def test_the_materials_work_is_recovered(recording, motion, cogging):
    """A torque of 5 to 25 mN m by place, without noise: over 20 mrad right to 0.05 mN m."""

    def material(opening):
        return 0.015 + 0.01 * np.sin(9.0 * opening)

    truth = DriveTruth(INERTIA, LAW, SILENT, offset=1e-3, cogging=cogging)
    drives = []
    for piece in motion.pieces:
        middle = 0.5 * (piece.opening[1:] + piece.opening[:-1])
        drives.append(measured_drive(piece, truth, material(middle), np.random.default_rng(3)))
    made = motion.with_drive(drives, np.random.default_rng(4))
    for path in path_motion((made,), INERTIA):
        given = (-cogging[0], -cogging[1], cogging[2])
        work = material_of(path, LAW, 1e-3, given).work
        steady = np.flatnonzero(np.abs(path.rate) > 0.05)
        ends = steady[::200]
        whole = np.array([np.all(np.abs(path.rate[a:b]) > 0.05) for a, b in pairwise(ends)])
        turn = np.diff(path.opening[ends])
        kept = whole & (np.abs(turn) > 0.02)
        assert kept.sum() > 20
        found = np.diff(work[ends])[kept] / turn[kept]
        low, high = path.opening[ends[:-1]][kept], path.opening[ends[1:]][kept]
        wanted = 0.015 - 0.01 * (np.cos(9.0 * high) - np.cos(9.0 * low)) / (9.0 * (high - low))
        assert np.abs(found - wanted).max() < 5e-5


def test_load_and_offsets_act_by_direction(motion):
    """Friction by load adds to what closing takes, and takes from what opening gives back."""
    piece = motion.pieces[0]
    pressed = np.full(len(piece.opening) - 1, 0.03)
    plain = DriveTruth(INERTIA, LAW, SILENT)
    rng = np.random.default_rng(0)
    base = measured_drive(piece, plain, pressed, rng)
    loaded = measured_drive(piece, replace(plain, load_share=0.1), pressed, rng)
    shifted = measured_drive(
        piece, replace(plain, closing_offset=1e-3, opening_offset=-2e-3), pressed, rng
    )
    rate = np.gradient(piece.opening) / piece.tick_s
    for sign, offset in ((-1.0, 1e-3), (1.0, -2e-3)):
        inner = np.convolve(sign * rate > 0.02, np.ones(31), "same") > 30.5
        assert loaded[inner] - base[inner] == pytest.approx(sign * 0.003, abs=1e-9)
        assert shifted[inner] - base[inner] == pytest.approx(-offset, abs=1e-9)


def test_a_delay_shifts_the_simulated_torque(motion):
    piece = motion.pieces[0]
    plain = DriveTruth(INERTIA, LAW, SILENT)
    none = np.zeros(len(piece.opening) - 1)
    rng = np.random.default_rng(0)
    base = measured_drive(piece, plain, none, rng)
    late = measured_drive(piece, replace(plain, delay_s=0.3 * piece.tick_s), none, rng)
    assert late[1:] == pytest.approx(0.7 * base[1:] + 0.3 * base[:-1], abs=1e-12)


def test_strokes_differ_by_their_stated_offset(motion):
    piece = motion.pieces[0]
    plain = DriveTruth(INERTIA, LAW, SILENT)
    none = np.zeros(len(piece.opening) - 1)
    base = measured_drive(piece, plain, none, np.random.default_rng(0))
    apart = [
        measured_drive(piece, replace(plain, stroke_sd=1e-3), none, np.random.default_rng(seed))
        - base
        for seed in range(60)
    ]
    inside = [np.flatnonzero(piece.stroke == label) for label in np.unique(piece.stroke)[1:]]
    means = np.array([[one[here].mean() for here in inside] for one in apart])
    assert np.std(means) == pytest.approx(1e-3, rel=0.15)
    assert np.std(apart[0][inside[0][20:-20]]) < 1e-6


def test_noise_has_its_two_time_scales():
    wanted = TorqueNoise(1e-3, 6e-4, 0.02)
    drawn = drawn_noise(wanted, 400_000, 1e-3, np.random.default_rng(5))
    found = torque_noise(tuple(np.split(drawn, 100)), 1e-3)
    assert found is not None
    assert found.white_Nm == pytest.approx(1e-3, rel=0.05)
    assert found.slow_Nm == pytest.approx(6e-4, rel=0.1)
    assert found.slow_time_s == pytest.approx(0.02, rel=0.35)
