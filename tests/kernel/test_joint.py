"""The joint that a probe fits, against closed forms and at the extremes."""

import math
from dataclasses import astuple, fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.joint import Joint, follow_joint, follow_joints

FREE = Joint(
    inertia=3e-4, opening=0.0, closing=0.0, rise=0.0, rise_rate=0.1, viscous=0.0, fine=1e-3,
    slow=1e-2, slow_share=0.0, bristle=0.0, carrying=0.0, carrying_slope=0.0, turn=0.0,
    motor_lag=0.0,
)  # fmt: skip
TIMES = np.linspace(0.0, 0.2, 201)
STEP_S = 5e-5


def places(
    joint: Joint, torque: float, times: np.ndarray = TIMES, step_s: float = STEP_S
) -> np.ndarray:
    rests = np.full(len(times), np.nan)
    rests[0] = 0.0
    return follow_joint(joint, times, rests, np.array([0.0]), np.array([torque]), step_s)


def test_a_free_joint_speeds_up_evenly() -> None:
    exact = 0.01 * TIMES**2 / (2.0 * 3e-4)
    assert places(FREE, 0.01) == pytest.approx(exact, rel=1e-9, abs=1e-12)


def test_viscous_friction_ends_at_torque_over_friction() -> None:
    joint = replace(FREE, viscous=0.01)
    time = joint.inertia / joint.viscous
    exact = 0.01 / joint.viscous * (TIMES - time * (1.0 - np.exp(-TIMES / time)))
    assert places(joint, 0.01) == pytest.approx(exact, rel=2e-3, abs=1e-8)


def test_a_motor_with_a_lag_acts_by_its_time_constant_later() -> None:
    lag = 2e-3
    late = np.maximum(TIMES - lag, 0.0)
    found = places(replace(FREE, motor_lag=lag), 0.01)[100:]
    exact = (0.01 / 3e-4) * (late**2 / 2.0 + lag**2 / 2.0)[100:]
    assert found == pytest.approx(exact, rel=1e-3)


def test_what_yields_takes_dahls_way_under_a_torque_below_friction() -> None:
    """F (1 - exp(-x / l)) = u, reached without swinging where the bristles are damped."""
    joint = replace(FREE, opening=0.02, closing=0.02, bristle=0.2)
    times = np.linspace(0.0, 3.0, 301)
    found = places(joint, 0.01, times, 1e-4)[-1]
    assert found == pytest.approx(-1e-3 * math.log(1.0 - 0.01 / 0.02), rel=5e-3)


def test_a_joint_that_is_carried_begins_at_rest() -> None:
    joint = replace(FREE, opening=0.02, closing=0.02, carrying=0.005)
    assert np.abs(places(joint, 0.0)).max() < 1e-5


CARRIED = replace(FREE, carrying=-0.01, stop=1.0, stop_stiffness=50.0)


def test_a_stop_bears_what_carries_the_blades() -> None:
    """A torque below the load lifts them in the stop, by torque over stiffness, not off it."""
    assert np.abs(places(CARRIED, 0.0)).max() < 1e-9
    assert places(CARRIED, 0.005, np.linspace(0.0, 2.0, 201))[-1] == pytest.approx(1e-4, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_blades_are_thrown_off_their_stop_and_fall_back(side: float) -> None:
    """A stiff stop: up for 20 ms, down by what carries them, as far again, and back."""
    joint = replace(CARRIED, carrying=-0.01 * side, stop=side, stop_stiffness=5e3)
    rests = np.full(len(TIMES), np.nan)
    rests[0] = 0.0
    torques = np.array([0.02 * side, 0.0])
    found = side * follow_joint(joint, TIMES, rests, np.array([0.0, 0.02]), torques, STEP_S)
    assert found.max() == pytest.approx(0.01 * 0.02**2 / 3e-4, rel=0.03)
    assert np.abs(found[-20:]).max() < 0.1 * found.max()


def test_joints_together_go_as_each_alone() -> None:
    """Those that need no shorter steps than the first: the same operations, to the last bits."""
    first = replace(FREE, opening=0.02, closing=0.018, rise=2e-3, bristle=0.05, viscous=2e-3)
    first = replace(first, slow_share=0.3, carrying=1e-3, carrying_slope=-5e-3, motor_lag=1e-3)
    others = [
        replace(first, **{name: 1.1 * getattr(first, name)})
        for name in ("inertia", "fine", "slow", "viscous", "bristle", "carrying", "motor_lag")
    ]
    joints = [first, *others]
    rests = np.full(len(TIMES), np.nan)
    rests[[0, 120]] = 0.3, 0.35
    rest = (TIMES, rests, np.array([0.01, 0.05]), np.array([0.03, 0.0]), 2e-5)
    together = follow_joints(np.array([astuple(one) for one in joints]), *rest)
    for one, found in zip(joints, together, strict=True):
        assert found == pytest.approx(follow_joint(one, *rest), abs=1e-12)


def test_a_switch_just_before_a_time_takes_no_step_of_no_length() -> None:
    rests = np.full(len(TIMES), np.nan)
    rests[0] = 0.0
    for at in (np.nextafter(TIMES[72], 0.0), np.nextafter(TIMES[72], 1.0)):
        found = follow_joint(FREE, TIMES, rests, np.array([0.0, at]), np.array([0.01, 0.0]), 1e-3)
        assert found[72] == pytest.approx(0.01 * TIMES[72] ** 2 / (2.0 * 3e-4), rel=1e-6)


def test_what_is_no_set_of_joints_is_refused() -> None:
    ends = (TIMES, TIMES, np.zeros(1), np.zeros(1), 1e-3)
    row = np.array([astuple(FREE)])
    with pytest.raises(ValueError, match="at most 16 joints"):
        follow_joints(np.repeat(row, 17, axis=0), *ends)
    with pytest.raises(ValueError, match="has 16 values"):
        follow_joints(row[:, 1:], *ends)
    with pytest.raises(ValueError, match="each time a rest"):
        follow_joints(row, TIMES, TIMES[1:], np.zeros(1), np.zeros(1), 1e-3)
    with pytest.raises(ValueError, match="each switch has a torque"):
        follow_joints(row, TIMES, TIMES, np.zeros(2), np.zeros(1), 1e-3)


def test_joints_of_both_languages_have_the_same_values_in_the_same_order() -> None:
    assert [name for name, _ in ffi.typeof("sc_joint").fields] == [
        one.name for one in fields(Joint)
    ]
    assert lib.SC_JOINTS == 16


def test_it_is_put_to_rest_where_it_stands() -> None:
    rests = np.full(len(TIMES), np.nan)
    rests[[0, 100]] = 0.0, 0.5
    found = follow_joint(FREE, TIMES, rests, np.array([0.0]), np.array([0.01]), 1e-4)
    assert found[100] == 0.5
    assert found[150] - 0.5 == pytest.approx(0.01 * 0.05**2 / (2.0 * 3e-4), rel=5e-3)


@given(
    st.floats(1e-6, 0.1),
    st.floats(1e-5, 1.0),
    st.floats(2e-5, 0.2),
    st.floats(1e-7, 1.0),
    st.floats(-1.0, 1.0),
)
def test_it_stays_finite_and_bounded_by_the_free_joint(
    inertia: float, dry: float, length: float, bristle: float, torque: float
) -> None:
    joint = replace(
        FREE, inertia=inertia, opening=dry, closing=dry, rise=0.3 * dry, fine=length,
        slow=3.0 * length, slow_share=0.3, bristle=bristle,
    )  # fmt: skip
    found = places(joint, torque, TIMES[:51], 2.5e-4)
    assert np.isfinite(found).all()
    free = abs(torque) / inertia * TIMES[:51] ** 2
    assert (np.abs(found) <= free + 3.0 * length + 1e-3).all()
