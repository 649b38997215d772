"""The filter's way through time and its corrections against general formulas."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from scissorcal.tracking.filter import (
    BIAS,
    OFFSET,
    POSE,
    RATES,
    SIZE,
    SPIN,
    FilterState,
    predict,
    start_state,
    update,
    update_by_one,
)
from scissorcal.tracking.settings import ForceErrors, PlateMotion, TrackingSettings

SETTINGS = TrackingSettings(force=ForceErrors(zero_sd_N=0.02))


def a_state(seed: int = 0, settings: TrackingSettings = SETTINGS) -> FilterState:
    """A state with every covariance filled."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(random_state=rng).as_matrix()
    state = start_state(settings, 0.0, rotation, rng.standard_normal(3), 1e-6 * np.eye(6))
    scale = np.sqrt(np.diag(state.covariance))
    mixing = np.eye(SIZE) + 0.1 * rng.standard_normal((SIZE, SIZE))
    state.covariance = np.outer(scale, scale) * (mixing @ mixing.T)
    state.mean[3:] += scale[3:] * rng.standard_normal(SIZE - 3)
    return state


def van_loan(settings: TrackingSettings, elapsed: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and noise of pose, rates and offset without a turn, by a matrix exponential.

    Van Loan 1978, doi:10.1109/TAC.1978.1101743; the code under test has closed forms.
    """
    drift, noise = np.zeros((13, 13)), np.zeros((13, 13))
    drift[:6, 6:12] = np.eye(6)
    drift[6:12, 6:12] = -np.eye(6) / settings.plate.time_s
    drift[12, 12] = -1.0 / settings.contact.slow_time_s
    sds = np.repeat([settings.plate.spin_rad_per_s, settings.plate.speed_m_per_s], 3)
    noise[6:12, 6:12] = np.diag(2.0 * sds**2 / settings.plate.time_s)
    noise[12, 12] = 2.0 * settings.contact.slow_m**2 / settings.contact.slow_time_s
    block = np.block([[-drift, noise], [np.zeros((13, 13)), drift.T]]) * elapsed
    exponential = expm(block)
    through = exponential[13:, 13:].T
    return through, through @ exponential[:13, 13:]


@pytest.mark.parametrize("elapsed", [1e-4, 0.004, 0.01, 0.3, 5.0])
def test_prediction_of_a_plate_that_does_not_turn_is_the_exact_one(elapsed: float) -> None:
    state = a_state()
    state.mean[SPIN] = 0.0
    kept = [*range(12), OFFSET]
    before = state.covariance[np.ix_(kept, kept)]
    through, noise = van_loan(SETTINGS, elapsed)
    expected = through @ before @ through.T + noise
    predict(state, SETTINGS, elapsed)
    found = state.covariance[np.ix_(kept, kept)]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-9)


def test_prediction_in_many_steps_is_prediction_in_one() -> None:
    once, often = a_state(), a_state()
    once.mean[SPIN] = often.mean[SPIN] = 0.0
    predict(once, SETTINGS, 0.4)
    for step in range(1, 101):
        predict(often, SETTINGS, 0.004 * step)
    np.testing.assert_allclose(often.mean, once.mean, rtol=1e-12, atol=1e-15)
    scale = np.sqrt(np.outer(np.diag(once.covariance), np.diag(once.covariance)))
    np.testing.assert_allclose(often.covariance / scale, once.covariance / scale, atol=1e-9)


def test_covariance_of_a_turning_plate_follows_the_nonlinear_motion() -> None:
    """Draws of the error, moved by the true motion, have the covariance that is predicted."""
    state = a_state(3)
    state.mean[SPIN] = [0.3, -0.5, 0.4]
    start = state.copy()
    still = replace(SETTINGS, plate=replace(SETTINGS.plate, speed_m_per_s=0.0, spin_rad_per_s=0.0))
    predict(state, still, 0.5)
    rng = np.random.default_rng(4)
    factor = np.linalg.cholesky(start.covariance)
    time = SETTINGS.plate.time_s
    reach = time * (1.0 - math.exp(-0.5 / time))
    errors = []
    for _ in range(4000):
        drawn = 0.01 * factor @ rng.standard_normal(SIZE)
        turned = Rotation.from_rotvec(drawn[:3]).as_matrix() @ start.rotation
        spin = Rotation.from_rotvec(reach * (start.mean[6:9] + drawn[6:9])).as_matrix()
        place = start.mean[3:6] + drawn[3:6] + reach * (start.mean[9:12] + drawn[9:12])
        turn = Rotation.from_matrix(spin @ turned @ state.rotation.T).as_rotvec()
        errors.append(np.concatenate([turn, place - state.mean[3:6]]))
    found = 1e4 * np.cov(np.array(errors).T)
    expected = state.covariance[POSE, POSE]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # 4,000 draws know a correlation to 1/sqrt(4000) = 0.016; the largest of 21 stays below 5 sds.
    np.testing.assert_allclose(found / scale, expected / scale, atol=5 * 0.016 * math.sqrt(2.0))


@given(seed=st.integers(0, 1000), size=st.integers(1, 6), loud=st.floats(-12.0, 12.0))
def test_a_correction_is_the_one_of_linear_regression(seed: int, size: int, loud: float) -> None:
    """The corrected mean and covariance are those of weighted least squares on prior and row."""
    state = a_state(seed % 7)
    rng = np.random.default_rng(seed)
    scale = np.sqrt(np.diag(state.covariance))
    slopes = rng.standard_normal((size, SIZE)) / scale
    noise = np.diag(10.0**loud * (0.5 + rng.random(size)))
    residual = rng.standard_normal(size)
    before = state.copy()
    update(state, residual, slopes, noise, math.inf)
    root = np.linalg.cholesky(before.covariance / np.outer(scale, scale))
    stacked = np.vstack([np.linalg.inv(root), np.linalg.inv(np.sqrt(noise)) @ (slopes * scale)])
    wanted = np.concatenate([np.zeros(SIZE), np.linalg.inv(np.sqrt(noise)) @ residual])
    step = np.linalg.lstsq(stacked, wanted, rcond=None)[0] * scale
    np.testing.assert_allclose(
        (state.mean[3:] - before.mean[3:]) / scale[3:], step[3:] / scale[3:], rtol=1e-5, atol=1e-6
    )
    turn = Rotation.from_matrix(state.rotation @ before.rotation.T).as_rotvec()
    np.testing.assert_allclose(turn / scale[:3], step[:3] / scale[:3], rtol=1e-5, atol=1e-6)


def test_one_number_at_a_time_is_all_at_once() -> None:
    rng = np.random.default_rng(5)
    slopes = rng.standard_normal((3, SIZE)) / np.sqrt(np.diag(a_state().covariance))
    slopes[:, :3] = 0.0  # so that no correction turns what the next one is linear in
    residual, noise = rng.standard_normal(3), np.array([0.5, 1.0, 2.0])
    together, apart = a_state(), a_state()
    update(together, residual, slopes, np.diag(noise), math.inf)
    left = residual.copy()
    for index in range(3):
        before = apart.mean.copy()
        update_by_one(apart, float(left[index]), slopes[index], float(noise[index]), math.inf)
        left = left - slopes @ (apart.mean - before)
    np.testing.assert_allclose(apart.mean, together.mean, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(apart.covariance, together.covariance, rtol=1e-7, atol=1e-12)


def test_a_row_beyond_the_gate_changes_nothing() -> None:
    state = a_state()
    before = state.copy()
    slope = np.zeros(SIZE)
    slope[OFFSET] = 1.0
    nis, used = update_by_one(state, 1.0, slope, 1e-9, 10.8)
    assert (used, nis > 10.8) == (False, True)
    np.testing.assert_array_equal(state.covariance, before.covariance)
    np.testing.assert_array_equal(state.mean, before.mean)


def test_a_residual_that_is_no_number_is_refused() -> None:
    state = a_state()
    assert update_by_one(state, math.nan, np.ones(SIZE), 1.0, 10.8)[1] is False


def test_the_first_pose_holds_pose_and_bias_together() -> None:
    state = start_state(SETTINGS, 0.0, np.eye(3), np.zeros(3), 1e-8 * np.eye(6))
    total = state.covariance[POSE, POSE] + state.covariance[POSE, BIAS]
    total = total + state.covariance[BIAS, POSE] + state.covariance[BIAS, BIAS]
    np.testing.assert_allclose(total, 1e-8 * np.eye(6), atol=1e-18)
    assert state.covariance[RATES, RATES].any()


def test_a_still_plate_has_no_velocity() -> None:
    settings = replace(SETTINGS, plate=PlateMotion(still=True))
    state = start_state(settings, 0.0, np.eye(3), np.zeros(3), 1e-8 * np.eye(6))
    predict(state, settings, 100.0)
    assert not state.covariance[RATES, :].any()
    np.testing.assert_array_equal(state.rotation, np.eye(3))
