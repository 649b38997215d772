"""The recipe's table of tracking, in SI, and what of it the camera's fit replaces."""

import math

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.recipe import Recipe, parse_recipe, read_text, recipe_path
from scissorcal.tracking.filter import BIAS, POSE, start_state
from scissorcal.tracking.settings import TrackingSettings, settings_of

TEXT = read_text(recipe_path("paper-80gsm"))


def a_recipe(*lines: str) -> Recipe:
    return parse_recipe("\n".join([TEXT, "[plate.tracking]", *lines]))


def test_units_become_si() -> None:
    table = """
        [plate.tracking]
        speed_mm_per_s = 20
        turn_deg_per_s = 5
        contact_white_mm = 0.03
        force_zero_sd_N = 0.02
        [plate.touch]
        stiffness_N_per_mm = 5.0
    """
    recipe = parse_recipe(TEXT + table)
    found = settings_of(recipe)
    assert found.plate.speed_m_per_s == pytest.approx(0.02)
    assert found.plate.spin_rad_per_s == pytest.approx(math.radians(5.0))
    assert found.contact.white_m == pytest.approx(3e-5)
    assert found.contact.compliance_m_per_N == pytest.approx(2e-4)
    assert found.contact.compliance_sd_m_per_N == pytest.approx(4e-5)
    assert found.force.zero_sd_N == 0.02


def test_defaults_of_contact_and_force_are_those_of_the_filter() -> None:
    found, filters = settings_of(a_recipe()), TrackingSettings()
    for mine, its in ((found.contact, filters.contact), (found.force, filters.force)):
        assert vars(mine) == pytest.approx(vars(its))
    assert found.camera == filters.camera


def test_what_all_pictures_share_is_taken_from_the_fits() -> None:
    rng = np.random.default_rng(0)
    root = 1e-3 * rng.standard_normal((6, 6))
    shared = root @ root.T
    auto = settings_of(a_recipe(), shared).camera
    np.testing.assert_array_equal(auto.bias_covariance, shared)

    half = settings_of(a_recipe("camera_bias_mm = 0.5"), shared).camera.bias_covariance
    np.testing.assert_array_equal(half[:3, :3], shared[:3, :3])
    np.testing.assert_allclose(half[3:, 3:], 0.25e-6 * np.eye(3))
    assert not half[:3, 3:].any()

    both = settings_of(a_recipe("camera_bias_mm = 0.5", "camera_bias_deg = 0.0"), shared).camera
    assert both.shared is None
    np.testing.assert_allclose(np.diag(both.bias_covariance), [0, 0, 0, *[0.25e-6] * 3])


def test_a_filter_starts_with_the_shared_error_as_its_bias() -> None:
    root = 1e-3 * np.random.default_rng(1).standard_normal((6, 6))
    shared, noise = root @ root.T, 1e-8 * np.eye(6)
    settings = settings_of(a_recipe(), shared)
    state = start_state(settings, 0.0, np.eye(3), np.zeros(3), noise)
    np.testing.assert_allclose(state.covariance[POSE, POSE], shared + noise)
    np.testing.assert_allclose(state.covariance[BIAS, BIAS], shared)
    np.testing.assert_allclose(state.covariance[POSE, BIAS], -shared)
    # a second picture of the same pose leaves of the pose what all pictures share
    kept = state.covariance[POSE, POSE] + state.covariance[POSE, BIAS]
    np.testing.assert_allclose(kept, noise, atol=1e-18)


@pytest.mark.parametrize(
    "line",
    ["speed_mm_per_s = 0", "camera_bias_mm = 'none'", "speed_m_per_s = 0.02", "friction_sd = nan"],
)
def test_what_is_no_setting_is_refused(line: str) -> None:
    with pytest.raises(InputError, match=r"plate\.tracking"):
        parse_recipe(f"{TEXT}\n[plate.tracking]\n{line}\n")
