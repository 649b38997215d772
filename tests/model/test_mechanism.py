"""Dynamics against closed forms: energy, pendulum, incline, two links, limit of stiffness."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from scissorcal.model.friction import FrictionLaw
from scissorcal.model.mechanism import (
    AxisLaw,
    Constraint,
    ContactLaw,
    Mechanism,
    compliant_motion,
    constrained_motion,
    free_acceleration,
    rig_mechanism,
)

G = 9.81
RIG = rig_mechanism(
    AxisLaw(
        2.1e-4,
        FrictionLaw({"coulomb_pos": 0.013, "coulomb_neg": 0.016, "viscous": 2e-3}, 0.5),
        offset=4e-4,
        rest_rate=0.02,
    ),
    AxisLaw(0.8, FrictionLaw({"coulomb": 0.8, "viscous": 4.0}), offset=0.1, rest_rate=1e-3),
)


def run(accelerate, q, rates, times, extra=()):
    """Integrate q'' = accelerate(t, q, rates), and the rates of ``extra`` sums, to 1e-11."""
    k = len(q)

    def slope(t, y):
        q, v = y[:k], y[k : 2 * k]
        return np.concatenate([v, accelerate(t, q, v), *(np.atleast_1d(f(t, q, v)) for f in extra)])

    start = np.concatenate([q, rates, np.zeros(len(extra))])
    found = solve_ivp(slope, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-13)
    assert found.success
    return found.y[:k].T, found.y[k : 2 * k].T, found.y[2 * k :].T


def weight(mass):
    """A point of this mass in the plane (x, y), y up."""
    return Mechanism(mass * np.eye(2), lambda q, rates: np.array([0.0, mass * G]))


def on_circle(length):
    return Constraint(
        lambda q: np.array([0.5 * (q @ q - length**2) / length]),
        lambda q: q[None, :] / length,
        lambda q, rates: np.array([rates @ rates / length]),
    )


def on_line(angle):
    """Above a line through 0 that rises at this angle; its normal is the gap's gradient."""
    normal = np.array([-math.sin(angle), math.cos(angle)])
    return Constraint(
        lambda q: np.array([normal @ q]), lambda q: normal[None, :], lambda q, v: np.zeros(1)
    )


def two_links(masses, lengths):
    """A double pendulum of point masses, angles from the horizontal; and its energy."""
    (m1, m2), (a, b) = masses, lengths

    def inertia(q):
        c = math.cos(q[1])
        cross = m2 * (b * b + a * b * c)
        return np.array(
            [[(m1 + m2) * a * a + m2 * b * b + 2.0 * m2 * a * b * c, cross], [cross, m2 * b * b]]
        )

    def effort(q, v):
        s = m2 * a * b * math.sin(q[1])
        whole, first = math.cos(q[0] + q[1]), math.cos(q[0])
        return np.array(
            [
                -s * (2.0 * v[0] * v[1] + v[1] ** 2) + G * ((m1 + m2) * a * first + m2 * b * whole),
                s * v[0] ** 2 + G * m2 * b * whole,
            ]
        )

    def energy(q, v):
        height = m1 * a * math.sin(q[0]) + m2 * (a * math.sin(q[0]) + b * math.sin(q[0] + q[1]))
        return 0.5 * v @ inertia(q) @ v + G * height

    return Mechanism(inertia, effort), energy


def tip_on_wall(lengths, wall):
    """The second link's tip stays at x = wall: a Jacobian that the user of a chain gives."""
    a, b = lengths

    def gradient(q):
        first, whole = math.sin(q[0]), math.sin(q[0] + q[1])
        return np.array([[-a * first - b * whole, -b * whole]])

    def bias(q, v):
        first, whole = math.cos(q[0]), math.cos(q[0] + q[1])
        return np.array([-a * first * v[0] ** 2 - b * whole * (v[0] + v[1]) ** 2])

    return Constraint(
        lambda q: np.array([a * math.cos(q[0]) + b * math.cos(q[0] + q[1]) - wall]), gradient, bias
    )


def test_work_of_a_free_motion_is_kinetic_energy_and_losses():
    def drive(t):
        return np.array([0.05 * math.sin(9.0 * t), 3.0 * math.cos(5.0 * t)])

    def power(t, q, v):
        return v @ (drive(t) - RIG.effort(q, v))

    _, v, work = run(
        lambda t, q, v: free_acceleration(RIG, q, v, drive(t)),
        np.array([0.5, 0.0]),
        np.array([1.0, -0.05]),
        np.linspace(0.0, 0.6, 13),
        extra=(power,),
    )
    kinetic = 0.5 * (v**2 @ np.array([2.1e-4, 0.8]))
    assert np.ptp(kinetic) > 1e-3
    np.testing.assert_allclose(kinetic - kinetic[0], work[:, 0], atol=1e-10)


def test_a_chain_of_given_inertia_keeps_its_energy_free_and_constrained():
    chain, energy = two_links((1.3, 0.4), (0.35, 0.25))
    still = np.zeros(2)
    q, v, _ = run(
        lambda t, q, v: free_acceleration(chain, q, v, still),
        np.array([0.3, 0.9]),
        np.array([0.4, -1.0]),
        np.linspace(0.0, 1.5, 16),
    )
    every = [energy(*at) for at in zip(q, v, strict=True)]
    np.testing.assert_allclose(every, every[0], atol=1e-8)
    start = np.array([0.3, 0.9])
    wall = tip_on_wall((0.35, 0.25), 0.35 * math.cos(0.3) + 0.25 * math.cos(1.2))
    row = wall.jacobian(start)[0]
    q, v, _ = run(
        lambda t, q, v: constrained_motion(chain, wall, q, v, still).acceleration,
        start,
        np.array([row[1], -row[0]]) / row[1],
        np.linspace(0.0, 0.5, 16),
    )
    every = [energy(*at) for at in zip(q, v, strict=True)]
    np.testing.assert_allclose(every, every[0], atol=1e-8)
    assert np.ptp(q, axis=0).min() > 0.1
    assert max(abs(float(wall.value(one)[0])) for one in q) < 1e-9


def test_a_point_on_a_circle_is_a_pendulum():
    length, mass, top = 0.4, 0.7, 1.9
    held = on_circle(length)
    point = weight(mass)
    quarter = math.sqrt(length / G) * float(ellipk(math.sin(0.5 * top) ** 2))
    start = length * np.array([math.sin(top), -math.cos(top)])
    q, v, _ = run(
        lambda t, q, v: constrained_motion(point, held, q, v, np.zeros(2)).acceleration,
        start,
        np.zeros(2),
        np.linspace(0.0, 4.0 * quarter, 9),
    )
    np.testing.assert_allclose(q[2], [0.0, -length], atol=1e-8)
    np.testing.assert_allclose(q[4], [-start[0], start[1]], atol=1e-8)
    np.testing.assert_allclose(q[8], start, atol=1e-7)
    for at, speed in zip(q, v, strict=True):
        force = constrained_motion(point, held, at, speed, np.zeros(2)).force[0]
        cosine = -at[1] / length
        tension = mass * (speed @ speed / length + G * cosine)
        assert force == pytest.approx(-tension, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.3, -1.2])
def test_a_mass_slides_down_an_incline(angle):
    motion = constrained_motion(weight(2.0), on_line(angle), [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    down = -G * math.sin(angle) * np.array([math.cos(angle), math.sin(angle)])
    np.testing.assert_allclose(motion.acceleration, down, atol=1e-13)
    assert motion.force[0] == pytest.approx(2.0 * G * math.cos(angle), abs=1e-13)


def test_a_drive_that_lifts_off_is_held_by_a_force_that_pulls():
    motion = constrained_motion(weight(2.0), on_line(0.0), [0.0, 0.0], [0.0, 0.0], [0.0, 50.0])
    assert motion.force[0] == pytest.approx(2.0 * G - 50.0)
    law = ContactLaw(1e6)
    free = compliant_motion(weight(2.0), on_line(0.0), law, [0.0, 1e-9], [0, 0], [0.0, 50.0])
    assert free.force[0] == 0.0
    assert free.acceleration[1] == pytest.approx(25.0 - G)


def test_stabilisation_takes_a_violation_back_critically_damped():
    rate, line = 40.0, on_line(0.4)
    normal = line.jacobian(np.zeros(2))[0]
    times = np.linspace(0.0, 0.2, 11)

    def accelerate(t, q, v):
        motion = constrained_motion(weight(1.0), line, q, v, [0, 0], stabilisation_per_s=rate)
        return motion.acceleration

    q, _, _ = run(accelerate, 1e-3 * normal, np.zeros(2), times)
    gaps = [float(line.value(at)[0]) for at in q]
    exact = 1e-3 * (1.0 + rate * times) * np.exp(-rate * times)
    np.testing.assert_allclose(gaps, exact, atol=1e-12)


def test_without_stabilisation_a_violation_stays():
    line = on_line(0.4)
    motion = constrained_motion(weight(1.0), line, [0.0, 1e-3], [0.0, 0.0], [0.0, 0.0])
    assert line.jacobian(np.zeros(2))[0] @ motion.acceleration == pytest.approx(0.0, abs=1e-14)


def test_a_mass_on_soft_ground_swings_as_a_damped_spring():
    mass, stiffness, damping = 0.8, 4000.0, 10.0
    law = ContactLaw(stiffness, damping)
    rest = -mass * G / stiffness
    start = 1.5 * rest
    omega = math.sqrt(stiffness / mass - (0.5 * damping / mass) ** 2)
    decay = 0.5 * damping / mass
    times = np.linspace(0.0, 0.05, 21)
    q, _, _ = run(
        lambda t, q, v: (
            compliant_motion(weight(mass), on_line(0.0), law, q, v, np.zeros(2)).acceleration
        ),
        np.array([0.0, start]),
        np.zeros(2),
        times,
    )
    swing = np.cos(omega * times) + decay / omega * np.sin(omega * times)
    exact = rest + (start - rest) * np.exp(-decay * times) * swing
    np.testing.assert_allclose(q[:, 1], exact, atol=1e-10)


def test_compliant_contact_goes_to_the_constraint_as_stiffness_grows():
    """The pendulum again, as a bead below a stiff ring that is driven against it."""
    length, mass = 0.4, 0.7
    ring = on_circle(length)
    bowl = Constraint(
        lambda q: -ring.value(q), lambda q: -ring.jacobian(q), lambda q, v: -ring.bias(q, v)
    )
    point, none = weight(mass), np.zeros(2)
    start, times = length * np.array([math.sin(0.5), -math.cos(0.5)]), np.linspace(0.0, 0.2, 5)
    exact, _, _ = run(
        lambda t, q, v: constrained_motion(point, bowl, q, v, none).acceleration,
        start,
        none,
        times,
    )
    away, pressed = [], []
    for stiffness in (1e3, 1e4, 1e5):
        law = ContactLaw(stiffness, 2.0 * math.sqrt(stiffness * mass))
        force = float(constrained_motion(point, bowl, start, none, none).force[0])
        sunk = start * (1.0 + force / stiffness / length)
        q, v, _ = run(
            lambda t, q, v, law=law: compliant_motion(point, bowl, law, q, v, none).acceleration,
            sunk,
            none,
            times,
        )
        away.append(np.abs(q - exact).max())
        soft = compliant_motion(point, bowl, law, q[-1], v[-1], none).force[0]
        hard = constrained_motion(point, bowl, q[-1], v[-1], none).force[0]
        pressed.append(abs(soft / hard - 1.0))
    assert away[1] / away[0] == pytest.approx(0.1, rel=0.1)
    assert away[2] / away[1] == pytest.approx(0.1, rel=0.1)
    assert pressed[2] < pressed[1] < pressed[0] < 0.1


SIZES = st.floats(-6.0, 6.0).map(lambda power: 10.0**power)
SIGNED = st.floats(-1e3, 1e3)


@given(
    st.tuples(SIZES, SIZES),
    st.tuples(SIZES, SIZES),
    st.tuples(SIGNED, SIGNED),
    st.tuples(SIGNED, SIGNED),
    st.floats(0.0, 2.0 * math.pi),
)
def test_the_kkt_system_holds_for_any_masses_and_directions(inertia, scale, drive, rates, angle):
    row = np.array([[scale[0] * math.cos(angle), scale[1] * math.sin(angle)]])
    held = Constraint(lambda q: np.zeros(1), lambda q: row, lambda q, v: np.array([7.0]))
    effort = np.array([0.3, -0.2])
    mechanism = Mechanism(np.diag(inertia), lambda q, v: effort)
    motion = constrained_motion(mechanism, held, np.zeros(2), rates, drive)
    terms = np.abs([np.array(inertia) * motion.acceleration, drive - effort, motion.force @ row])
    left = np.array(inertia) * motion.acceleration - (drive - effort) - motion.force @ row
    assert np.all(np.abs(left) <= 1e-12 * terms.max())
    # the system is solved by rotations, whose rounding is a share of whole vectors' lengths
    half = 1.0 / np.sqrt(inertia)
    size = 7.0 + np.linalg.norm(half * (drive - effort)) * np.linalg.norm(half * row[0])
    assert abs(row[0] @ motion.acceleration + 7.0) <= 1e-12 * size


@given(
    st.floats(-1.0, 1.0),
    st.floats(-1e3, 1e3),
    st.floats(0.0, 1e9),
    st.floats(0.0, 1e6),
)
def test_a_contact_never_pulls_and_never_reaches_out(gap, rate, stiffness, damping):
    force = float(ContactLaw(stiffness, damping).force(gap, rate))
    assert force >= 0.0
    if gap >= 0.0:
        assert force == 0.0
    else:
        assert force == pytest.approx(max(0.0, -stiffness * gap - damping * rate))


@given(st.floats(-50.0, 50.0), st.floats(0.0, 1.0), st.floats(0.0, 0.5))
def test_friction_of_an_axis_opposes_every_motion(rate, place, rest_rate):
    law = FrictionLaw(
        {"coulomb_pos": 0.4, "coulomb_neg": 0.9, "viscous": 0.1, "angle_slope": 0.5}, 0.4
    )
    axis = AxisLaw(1.0, law, rest_rate=rest_rate)
    assert float(axis.effort(place, rate)) * rate >= 0.0


def test_friction_near_rest_is_a_damper_that_joins_the_law():
    axis = AxisLaw(1.0, FrictionLaw({"coulomb_pos": 2.0, "coulomb_neg": 3.0}), 0.25, 0.01)
    rates = np.array([-0.01, -0.005, 0.0, 0.0025, 0.01, 0.02])
    np.testing.assert_allclose(axis.effort(0.0, rates) - 0.25, [-3.0, -1.5, 0.0, 0.5, 2.0, 2.0])


def test_an_axis_is_read_from_a_fits_parameters():
    values = {"inertia": 0.8, "offset": -0.1, "coulomb": 0.7, "viscous": 4.0, "delay": 1e-3}
    axis = AxisLaw.of_fit(values, 0.03, 1e-3)
    assert (axis.inertia, axis.offset, axis.friction.angle_center) == (0.8, -0.1, 0.03)
    assert float(axis.effort(0.0, 0.1)) == pytest.approx(0.7 + 0.4 - 0.1)


@pytest.mark.parametrize(
    "jacobian", [np.array([[1.0, 2.0], [2.0, 4.0]]), np.zeros((1, 2)), np.ones((3, 2))]
)
def test_forces_that_are_not_determined_are_refused(jacobian):
    none = np.zeros(len(jacobian))
    held = Constraint(lambda q: none, lambda q: jacobian, lambda q, v: none)
    with pytest.raises(ValueError, match="not determined"):
        constrained_motion(RIG, held, [0.5, 0.0], [0.0, 0.0], [0.0, 0.0])


def test_a_mechanism_without_constraints_moves_freely():
    held = Constraint(lambda q: np.zeros(0), lambda q: np.zeros((0, 2)), lambda q, v: np.zeros(0))
    motion = constrained_motion(RIG, held, [0.5, 0.0], [0.3, 0.01], [0.1, 2.0])
    np.testing.assert_array_equal(motion.force, [])
    free = free_acceleration(RIG, [0.5, 0.0], [0.3, 0.01], [0.1, 2.0])
    np.testing.assert_allclose(motion.acceleration, free, rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: AxisLaw(0.0, FrictionLaw()), "inertia of an axis"),
        (lambda: AxisLaw(1.0, FrictionLaw(), rest_rate=-1.0), "rest rate"),
        (lambda: ContactLaw(-1.0), "stiffness of a contact"),
        (lambda: ContactLaw(1.0, math.nan), "damping of a contact"),
        (
            lambda: free_acceleration(
                Mechanism(np.array([[1.0, 2.0], [2.0, 1.0]]), RIG.effort), [0, 0], [0, 0], [0, 0]
            ),
            "positive definite",
        ),
    ],
)
def test_what_no_mechanism_has_is_refused(make, match):
    with pytest.raises(ValueError, match=match):
        make()
