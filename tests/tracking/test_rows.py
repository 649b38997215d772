"""Slopes of every row against finite differences of what it predicts."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scissorcal.model import Cylinder, Plane, Sphere, Surface
from scissorcal.tracking.filter import RIG_BIAS, SIZE, FilterState, start_state
from scissorcal.tracking.rows import (
    CameraPose,
    Contact,
    ForceDirection,
    camera_row,
    contact_row,
    force_row,
)
from scissorcal.tracking.settings import ContactErrors, ForceErrors, TrackingSettings

SURFACES = [Plane(), Cylinder(0.03, 0.4), Sphere(0.02), Sphere(-0.05)]
STEP = 1e-6


def a_state() -> FilterState:
    rotation = Rotation.from_rotvec([0.3, -1.2, 0.7]).as_matrix()
    settings = TrackingSettings(force=ForceErrors(zero_sd_N=0.01))
    place = np.array([0.1, 0.02, -0.03])
    state = start_state(settings, 0.0, rotation, place, 1e-12 * np.eye(6))
    state.mean[6:] = 0.01 * np.random.default_rng(0).standard_normal(SIZE - 6)
    state.mean[19], state.mean[20] = 1e-4, 0.25
    state.mean[RIG_BIAS] = 0.0
    return state


def moved(state: FilterState, index: int, by: float) -> FilterState:
    """The state with one error added, by SciPy's rotation."""
    there = state.copy()
    if index < 3:
        turn = np.zeros(3)
        turn[index] = by
        there.rotation = Rotation.from_rotvec(turn).as_matrix() @ state.rotation
    else:
        there.mean[index] += by
    return there


def slopes_by_differences(
    state: FilterState, residual: Callable[[FilterState], np.ndarray]
) -> np.ndarray:
    columns = []
    for index in range(SIZE):
        up, down = (residual(moved(state, index, by)) for by in (STEP, -STEP))
        columns.append(-(up - down) / (2.0 * STEP))
    return np.stack(columns, axis=-1)


def on_surface(state: FilterState, surface: Surface) -> np.ndarray:
    """A point of the surface, some way from the origin."""
    local = surface.nearest_points(np.array([[0.008, -0.005, 0.001]])).points[0]
    return np.asarray(state.mean[3:6] + state.rotation @ local)


@pytest.mark.parametrize("surface", SURFACES)
def test_slopes_of_a_contact(surface: Surface) -> None:
    state = a_state()
    # On the surface the slopes are exact; the smoothed force stands for the raw one here.
    contact = Contact(0.0, on_surface(state, surface), 2.5, 2.5, 0.01)
    _, slope, _ = contact_row(state, contact, surface, ContactErrors())
    wanted = slopes_by_differences(
        state, lambda s: np.array(contact_row(s, contact, surface, ContactErrors())[0])
    )
    np.testing.assert_allclose(slope, wanted, rtol=1e-6, atol=1e-7)


def test_a_known_bias_of_the_rigs_places_is_taken_off() -> None:
    state, surface = a_state(), Sphere(0.02)
    point = on_surface(state, surface)
    bias = np.array([2e-3, -1e-3, 3e-3, 1e-4, -5e-5, 2e-4])
    off = point + bias[3:] + np.cross(bias[:3], point - state.mean[3:6])
    errors = ContactErrors()
    exact, _, _ = contact_row(state, Contact(0.0, point, 2.5, 2.5, 0.01), surface, errors)
    blind, _, _ = contact_row(state, Contact(0.0, off, 2.5, 2.5, 0.01), surface, errors)
    state.mean[RIG_BIAS] = bias
    told, _, _ = contact_row(state, Contact(0.0, off, 2.5, 2.5, 0.01), surface, errors)
    assert abs(blind - exact) > 5e-5
    # What is left is the bias's square: 4e-3 rad of 0.3 mm.
    assert abs(told - exact) < 1.5e-6


@pytest.mark.parametrize("surface", SURFACES)
def test_slopes_of_a_force_direction(surface: Surface) -> None:
    state, errors = a_state(), ForceErrors(zero_sd_N=0.01)
    state.covariance[6:12, 6:12] = 0.0  # the plate's velocity is known, so sliding is as well
    point = on_surface(state, surface)
    normal = state.rotation @ surface.gradient(state.rotation.T @ (point - state.mean[3:6]))
    tip = np.cross(normal, [0.3, 0.5, -0.2])
    felt = ForceDirection(
        0.0, point, 2.5 * normal - 0.4 * tip, 0.05 * tip / np.linalg.norm(tip), 10
    )
    row = force_row(state, felt, surface, errors)
    assert row is not None
    residual, slopes, noise = row

    def whole(s: FilterState) -> np.ndarray:
        """Across the first prediction, so that the axes stay where they are."""
        return across.T @ direction(s)

    def direction(s: FilterState) -> np.ndarray:
        local = surface.at(s.rotation.T @ (point - s.mean[3:6]))
        n = s.rotation @ local.gradient
        n = n / np.linalg.norm(n)
        arm = point - s.mean[3:6]
        v = felt.velocity_m_per_s - s.mean[9:12] - np.cross(s.mean[6:9], arm)
        v = v - n * (n @ v)
        lean = n - s.mean[20] * v / np.linalg.norm(v)
        f = felt.force_N - s.mean[21:24]
        return f / np.linalg.norm(f) - lean / np.linalg.norm(lean)

    n = state.rotation @ surface.at(state.rotation.T @ (point - state.mean[3:6])).gradient
    n = n / np.linalg.norm(n)
    v = felt.velocity_m_per_s - state.mean[9:12]
    v = v - np.cross(state.mean[6:9], point - state.mean[3:6])
    t = v - n * (n @ v)
    t = t / np.linalg.norm(t)
    mu = state.mean[20]
    across = np.stack([np.cross(t, n), (t + mu * n) / np.sqrt(1.0 + mu * mu)], axis=1)
    np.testing.assert_allclose(residual, whole(state), atol=1e-12)
    # The row omits how the tip's velocity leaves the tangent plane as that turns (n . v = 0 here).
    scale = np.abs(slopes).max()
    np.testing.assert_allclose(slopes, slopes_by_differences(state, whole), atol=0.02 * scale)
    assert np.all(np.linalg.eigvalsh(noise) > 0.0)


def test_slopes_of_a_picture() -> None:
    state = a_state()
    seen = CameraPose(0.0, state.rotation, state.mean[3:6].copy(), np.eye(6))
    _, slopes, _ = camera_row(state, seen)
    wanted = slopes_by_differences(state, lambda s: camera_row(s, seen)[0])
    np.testing.assert_allclose(slopes, wanted, atol=1e-7)


def test_a_tip_that_hardly_slides_tells_no_direction() -> None:
    state = a_state()
    point = on_surface(state, Plane())
    rest = ForceDirection(0.0, point, np.array([0.0, 0.0, 2.5]), np.zeros(3), 10)
    state.mean[6:12] = 0.0
    assert force_row(state, rest, Plane(), ForceErrors(zero_sd_N=0.01)) is None
