"""What the servo is told of a rig: friction as tables, masses, openings, limits."""

import math

import numpy as np
import pytest

from scissorcal.control.mechanics import FASTEST_rad_per_s, axis_friction
from scissorcal.control.settings import Material, Settings, control_settings
from scissorcal.control.surface_path import foot_of, map_contour, time_path
from scissorcal.device import LockstepLink
from scissorcal.errors import InputError
from scissorcal.kernel import fill_struct
from scissorcal.kernel._kernel import ffi, lib
from scissorcal.model import Cylinder, FrictionLaw, Plane, friction_torque
from scissorcal.recipe import Limits
from scissorcal.tracking import PlatePose, level_plate
from tests.control.virtual import mechanics, points, specimen

LIMITS = Limits()
POSE = PlatePose(0.0, *level_plate((20.0, 10.0, 0.0), 4.0), np.zeros((6, 6)))


def test_the_table_of_friction_is_the_law() -> None:
    """Through the C function: within 1.5 % from 1 mrad/s to 5 rad/s, at every opening."""
    law = FrictionLaw(
        {"coulomb_pos": 0.0128, "coulomb_neg": 0.0151, "viscous_pos": 0.0019, "viscous_neg": 0.0022,
         "stribeck": 0.0041, "stribeck_rate": 0.075, "angle_slope": 0.21, "angle_curvature": 0.12},
        0.5,
    )  # fmt: skip
    struct = ffi.new("sc_axis_friction *")
    fill_struct(struct, axis_friction(law, FASTEST_rad_per_s))
    for opening in (0.15, 0.5, 0.9):
        for rate in (*np.geomspace(1e-3, 5.0, 60), *-np.geomspace(1e-3, 5.0, 60)):
            size = lib.sc_axis_friction_at(struct, opening, rate)
            exact = abs(float(friction_torque(law, opening, rate)))
            assert size == pytest.approx(exact, rel=0.015), (opening, rate)


def test_openings_and_advances_bring_the_tip_there() -> None:
    rig = mechanics(specimen())
    for height in (0.0, 5e-3, 0.02):
        opening = rig.opening_at(height)
        assert opening is not None
        advance = rig.advance_at(0.03, opening)
        assert rig.tip.place((opening, advance)).tolist() == pytest.approx([0.03, height, 0.0])
    assert rig.opening_at(0.2) is None


def test_the_mass_along_the_normal_is_that_of_the_kinetic_energy() -> None:
    """Push along the normal: the acceleration there is the force over the mass."""
    rig = mechanics(specimen())
    opening = rig.opening_at(0.012)
    assert opening is not None
    foot = foot_of(Plane(), POSE, *rig.tip.place((opening, 0.0))[:2])
    assert foot is not None
    press = rig.press_at(foot, opening)
    accelerations = press / np.array((rig.opening.inertia, rig.advance.inertia))
    jacobian = rig.tip.jacobian((opening, 0.0))[:2]
    along = np.array(foot.normal) @ jacobian @ accelerations
    assert rig.mass_at(foot, opening) == pytest.approx(1.0 / along)


def settings(limits: Limits = LIMITS, force: float = 2.0, stiffness: float = 1e4) -> Settings:
    rig = mechanics(specimen())
    identity = LockstepLink("office-paper", np.random.default_rng(1)).identity
    path = points(10.0, 40.0, force=force)
    contour = map_contour(path, Plane(), POSE, 0.3)
    timed = time_path(path, contour, 1e-3)
    return control_settings(rig, identity, limits, Material(stiffness, 0.2, 1.0), timed, 400.0)


def test_limits_are_those_of_recipe_and_device() -> None:
    made = settings(Limits(torque_Nm=0.3, force_N=9.0))
    assert made.config.law.effort_limit == (0.3, 9.0)
    assert settings().config.law.effort_limit == (1.0, 30.0)
    assert made.config.law.force_most == pytest.approx(2.1, rel=0.01)
    assert made.config.force_stop > 2.0 * made.config.law.force_most
    assert made.masses_kg[0] <= made.masses_kg[1]


@pytest.mark.parametrize("limits", [Limits(torque_Nm=0.05), Limits(force_N=1.0)])
def test_a_force_beyond_the_recipes_limits_is_refused_with_the_most_there_is(
    limits: Limits,
) -> None:
    with pytest.raises(InputError, match=r"N is the most there") as caught:
        settings(limits)
    assert "recipe's limits" in str(caught.value)


def test_stiff_material_is_refused_with_what_would_do() -> None:
    with pytest.raises(InputError, match=r"What would do: a stiffness of at most [\d.e+]+ N/mm"):
        settings(stiffness=3e5)


def test_a_place_beyond_the_carriage_is_refused() -> None:
    rig = mechanics(specimen())
    identity = LockstepLink("office-paper", np.random.default_rng(1)).identity
    pose = PlatePose(0.0, *level_plate((20.0, 10.0, 0.0)), np.zeros((6, 6)))
    path = points(290.0, 310.0)
    contour = map_contour(path, Plane(), pose, 0.4)
    with pytest.raises(InputError, match=r"x = .* mm the carriage would stand at"):
        control_settings(
            rig, identity, Limits(), Material(1e4, 0.2, 1.0),
            time_path(path, contour, 1e-3), 400.0,
        )  # fmt: skip


def test_a_steep_surface_leaves_the_force_no_lever() -> None:
    rig = mechanics(specimen())
    identity = LockstepLink("office-paper", np.random.default_rng(1)).identity
    pose = PlatePose(0.0, *level_plate((60.0, 20.0, 0.0)), np.zeros((6, 6)))
    surface = Cylinder(0.02, math.pi / 2)
    path = points(0.0, 19.3)
    contour = map_contour(path, surface, pose, 0.3)
    with pytest.raises(InputError, match=r"so steep that a force on it turns the blades"):
        control_settings(
            rig, identity, Limits(), Material(1e4, 0.2, 1.0),
            time_path(path, contour, 1e-3), 400.0,
        )  # fmt: skip
