"""Rotations of single vectors against SciPy's, at every angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from scissorcal.tracking.plate_pose import (
    cross,
    cross_matrix,
    nearest_rotation,
    rotation_of,
    rotation_vector,
)

NUMBER = st.floats(-1.0, 1.0, allow_nan=False)
ANGLES = st.one_of(
    st.floats(0.0, np.pi),
    st.sampled_from([0.0, 1e-300, 1e-12, 1e-7, 1e-6, 1.1e-6, np.pi - 1e-9, np.pi]),
)


def vector_of(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    direction = np.array(axis) + np.array([0.0, 0.0, 2.0])
    return angle * direction / np.linalg.norm(direction)


@given(axis=st.tuples(NUMBER, NUMBER, NUMBER), angle=ANGLES)
def test_matrix_and_vector_agree_with_scipy(axis: tuple[float, float, float], angle: float) -> None:
    vector = vector_of(axis, angle)
    matrix = rotation_of(vector)
    np.testing.assert_allclose(matrix, Rotation.from_rotvec(vector).as_matrix(), atol=4e-16)
    found = rotation_vector(matrix)
    assert np.linalg.norm(found) <= np.pi * (1.0 + 1e-15)
    # Near half a turn a rotation vector and its opposite are the same rotation.
    np.testing.assert_allclose(rotation_of(found), matrix, atol=1e-15)
    if angle < np.pi - 1e-6:
        np.testing.assert_allclose(found, vector, rtol=1e-9, atol=1e-15)


def test_half_turns_about_each_axis_are_found() -> None:
    for axis in np.eye(3):
        matrix = np.diag(2.0 * axis - 1.0)
        np.testing.assert_allclose(np.abs(rotation_vector(matrix)), np.pi * axis, atol=1e-15)


@given(a=st.tuples(NUMBER, NUMBER, NUMBER), b=st.tuples(NUMBER, NUMBER, NUMBER))
def test_cross_products_agree_with_numpy(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    first, second = np.array(a), np.array(b)
    np.testing.assert_allclose(cross(first, second), np.cross(first, second), atol=1e-16)
    np.testing.assert_allclose(cross_matrix(first) @ second, np.cross(first, second), atol=1e-15)


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9])
def test_a_newton_step_squares_the_deviation_from_a_rotation(off: float) -> None:
    rng = np.random.default_rng(1)
    matrix = Rotation.random(random_state=rng).as_matrix() + off * rng.standard_normal((3, 3))
    nearer = nearest_rotation(matrix)
    left = np.abs(nearer @ nearer.T - np.eye(3)).max()
    assert left < 40.0 * off * off + 1e-15
