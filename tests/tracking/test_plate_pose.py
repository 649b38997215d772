"""A pose with play: it rests on noise, follows motion, and says how far it may be off."""

import numpy as np
import pytest

from scissorcal.tracking.plate_pose import (
    PLAY_SDS,
    PlatePose,
    SteadyPose,
    rotation_of,
    rotation_vector,
)

NOISE = np.diag([1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5]) ** 2


def pose(turn: np.ndarray, place: np.ndarray) -> PlatePose:
    return PlatePose(0.0, rotation_of(turn), place, 1e-8 * np.eye(6))


def test_noise_of_pictures_moves_nothing_and_a_constant_error_stays_small() -> None:
    rng, steady = np.random.default_rng(1), SteadyPose()
    first = steady.held(pose(np.zeros(3), np.zeros(3)), NOISE)
    for _ in range(200):
        error = np.sqrt(np.diag(NOISE)) * rng.standard_normal(6)
        held = steady.held(pose(error[:3], error[3:]), NOISE)
        assert np.array_equal(held.translation, first.translation)
        assert np.array_equal(held.rotation, first.rotation)


def test_motion_is_followed_behind_by_the_play() -> None:
    steady, axis = SteadyPose(), np.array([0.0, 0.0, 1.0])
    for way in np.linspace(0.0, 1.0, 101):
        held = steady.held(pose(0.08 * way * axis, 0.01 * way * axis), NOISE)
    behind = np.concatenate(
        [
            rotation_vector(rotation_of(0.08 * axis) @ held.rotation.T),
            0.01 * axis - held.translation,
        ]
    )
    away = np.sqrt(behind @ np.linalg.solve(NOISE, behind))
    assert away == pytest.approx(PLAY_SDS, rel=1e-6)


def test_the_play_counts_in_the_covariance() -> None:
    """Offsets that are uniform in the six-dimensional ball have this variance in each number."""
    rng = np.random.default_rng(2)
    way = rng.standard_normal((200_000, 6))
    way *= (rng.random(len(way)) ** (1 / 6) / np.linalg.norm(way, axis=1))[:, None]
    held = SteadyPose().held(pose(np.zeros(3), np.zeros(3)), NOISE)
    grown = np.diag(held.covariance - 1e-8 * np.eye(6)) / np.diag(NOISE)
    assert grown == pytest.approx(PLAY_SDS**2 * np.mean(way[:, 0] ** 2), rel=0.01)
