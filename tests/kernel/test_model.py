"""The kernel's model against closed forms, its own gradient, and the books of energy."""

import math

import numpy as np
import pytest

from scissorcal.kernel import Kernel, StepFlag, Table
from tests.kernel.zoo import (
    BLADE_LENGTH,
    EDGE_OFFSET,
    EDGE_TAPER,
    REFERENCE,
    arc_edge,
    line_edge,
    make_tables,
    power_response,
    straight,
)

JCH = 0.6
THROUGH_PIVOT = {"edge": line_edge(offset=0.0, slope=0.0), "upper_face": 0.01}


@pytest.mark.parametrize(("force", "exponent"), [(2.0, 1.0), (40.0, 1.5), (900.0, 3.0)])
def test_smooth_cut_by_two_blades_needs_jch_x_over_sine(force: float, exponent: float) -> None:
    """Straight edge through the pivot: tau = J_c h x_c / sin(theta), whatever the stiffness."""
    response = power_response(force, exponent, last=0.1)
    kernel = Kernel(make_tables(**THROUGH_PIVOT, response=response, contact_max=1.0))
    for opening in (0.3, 0.6, 0.9):
        kernel.reset(0.0)
        out = kernel.step(opening, -1.0, -0.001)
        assert out.torque == pytest.approx(JCH * out.contact / math.sin(opening), rel=2e-4)
        assert out.force == pytest.approx(-JCH, rel=2e-4)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_smooth_cut_by_one_blade_needs_twice_over_sine_of_twice(exponent: float) -> None:
    response = power_response(40.0, exponent, last=0.1)
    kernel = Kernel(make_tables(**THROUGH_PIVOT, response=response, moving_blades=1))
    for opening in (0.3, 0.6, 0.9):
        kernel.reset(0.0)
        out = kernel.step(opening, -1.0, -0.001)
        expected = 2.0 * JCH * out.contact / math.sin(2.0 * opening)
        assert out.torque == pytest.approx(expected, rel=2e-4)


def test_published_closure_is_contact_times_response_times_cosine() -> None:
    kernel = Kernel(make_tables(closure="eq4"))
    out = kernel.step(0.6, -1.0, -0.015)
    taper = math.radians(2.0)
    assert out.response > 0.1
    assert out.torque == pytest.approx(out.contact * out.response * math.cos(taper), rel=1e-5)


@pytest.mark.parametrize("blades", [1, 2])
@pytest.mark.parametrize("curvature", [-2.0, 0.0, 2.0])
def test_torque_and_force_are_the_gradient_of_the_stored_energy(
    blades: int, curvature: float
) -> None:
    """With the crack held, tau = -dE/d(theta) and f = -dE/d(x_n), central differences of E."""
    tables = make_tables(
        moving_blades=blades, edge=arc_edge(curvature), fracture_energy=0.0, upper_face=1e-4
    )
    kernel = Kernel(tables)
    angle, place, h = 0.55 * blades / 2, -0.024 if blades == 2 else -0.025, 1e-3
    while kernel.step(angle, 0.0, place).indentation < 4e-4:
        angle -= 1e-3

    def energy(opening: float, advance: float) -> float:
        return kernel.step(opening, 0.0, advance).stored_J

    out = kernel.step(angle, 0.0, place)
    by_angle = -(energy(angle + h, place) - energy(angle - h, place)) / (2 * h)
    step = 2e-5
    by_place = -(energy(angle, place + step) - energy(angle, place - step)) / (2 * step)
    assert out.torque == pytest.approx(by_angle, rel=2e-3)
    assert out.force == pytest.approx(by_place, rel=2e-3)


def work_of(out: np.ndarray, opening: np.ndarray, advance: np.ndarray) -> float:
    """Work that the outside does on the blades, by the trapezoidal rule."""
    torque = 0.5 * (out["torque"][1:].astype(float) + out["torque"][:-1])
    force = 0.5 * (out["force"][1:].astype(float) + out["force"][:-1])
    return float(-np.sum(torque * np.diff(opening)) - np.sum(force * np.diff(advance)))


def booked(out: np.ndarray) -> float:
    return float(
        out["stored_J"][-1].astype(float)
        - out["stored_J"][0]
        + out["fracture_J"][1:].astype(float).sum()
        + out["arrest_J"][1:].astype(float).sum()
    )


@pytest.mark.parametrize(("kappa", "tolerance"), [(1.0, 2e-4), (0.7, 1e-3)])
@pytest.mark.parametrize("blades", [1, 2])
@pytest.mark.parametrize("curvature", [-1.5, 0.0, 2.0])
def test_work_is_stored_or_dissipated(
    kappa: float, tolerance: float, blades: int, curvature: float
) -> None:
    """Work done = change of stored energy + fracture + arrest losses, over whole strokes.

    At 30000 steps a stroke, to 0.02 % of the work for smooth fracture and 0.1 % for rippled,
    whose steep runs the trapezoidal rule sees less well.
    """
    n = 30_000
    opening = np.concatenate([np.linspace(0.8, 0.3, n), np.linspace(0.3, 0.7, n)])
    opening = np.concatenate([opening, np.linspace(0.7, 0.25, n)]) * blades / 2
    advance = np.linspace(-0.03, -0.02, opening.size)
    opening, advance = opening.astype(np.float32), advance.astype(np.float32)
    tables = make_tables(kappa=kappa, moving_blades=blades, edge=arc_edge(curvature))
    out = Kernel(tables).step_many(opening, 0.0, advance)
    work = work_of(out, opening.astype(float), advance.astype(float))
    assert work > 0.005
    assert abs(work - booked(out)) < tolerance * work


@pytest.mark.parametrize("n", [300, 3000])  # 2 rad/s and 0.2 rad/s at 1 kHz
def test_the_energies_balance_at_servo_rates_too(n: int) -> None:
    opening = np.linspace(0.8, 0.2, n, dtype=np.float32)
    advance = np.full(n, -0.02, dtype=np.float32)
    out = Kernel(make_tables()).step_many(opening, 0.0, advance)
    work = work_of(out, opening.astype(float), advance.astype(float))
    assert abs(work - booked(out)) < 1e-4 * work


def test_with_kappa_one_the_fracture_energy_is_jch_per_metre() -> None:
    kernel = Kernel(make_tables())
    out = kernel.step_many(np.linspace(0.8, 0.3, 2000), -0.3, -0.02)
    assert out["fracture_J"].astype(float).sum() == pytest.approx(JCH * kernel.crack, rel=1e-4)
    assert np.all(out["arrest_J"] == 0)


def test_ripple_stays_between_kappa_and_one_and_keeps_its_mean_at_any_step() -> None:
    """The release m g tan(psi) swings between kappa J_c h and J_c h; coarse steps do not bias it.

    The mean over a cycle of g = F (d/d0)^n, d uniform between both ends, is a closed form.
    """
    kappa, n = 0.6, 1.5
    tables = make_tables(kappa=kappa)
    low = kappa ** (1 / n)
    mean = (1 - low ** (n + 1)) / ((n + 1) * (1 - low))
    for steps in (200, 1000, 20_000):
        out = Kernel(tables).step_many(np.linspace(0.7, 0.3, steps), -0.5, -0.02)
        settled = out[steps // 10 :]
        release = -settled["force"]
        assert release.min() >= kappa * JCH * 0.999
        assert release.max() <= JCH * 1.001
        assert release.mean() == pytest.approx(mean * JCH, rel=0.02)


def test_crack_never_falls_back_and_closing_again_over_the_cut_is_free() -> None:
    kernel = Kernel(make_tables())
    closing = np.linspace(0.8, 0.4, 800)
    kernel.step_many(closing, -0.5, -0.02)
    crack = kernel.crack
    opened = kernel.step_many(closing[::-1], 0.5, -0.02)
    assert kernel.crack == crack
    # with the pivot drawn back so far that the tip is out of reach, closing again feels nothing
    again = kernel.step_many(closing[closing > 0.45], -0.5, -0.02)
    touching = again["torque"] > 0
    assert kernel.crack == crack
    assert not touching[: touching.size // 2].any()
    assert opened["torque"][-1] == 0.0


def test_pressing_never_moves_the_crack() -> None:
    kernel = Kernel(make_tables(fracture_energy=0.0))
    kernel.reset(0.03)
    out = kernel.step_many(np.linspace(0.8, 0.1, 500), -0.5, 0.0)
    assert kernel.crack == pytest.approx(0.03)
    assert out["fracture_J"].sum() == 0
    assert out["arrest_J"].sum() == 0
    assert np.all(np.diff(out["torque"][out["indentation"] > 0]) > 0)


def test_pressing_far_beyond_the_table_stays_finite() -> None:
    kernel = Kernel(make_tables(fracture_energy=0.0, response=power_response(1e5, 8.0, 5e-4)))
    kernel.reset(0.06)
    out = kernel.step(0.0, -1.0, 0.0)
    assert out.indentation > 10 * 5e-4
    assert out.response == pytest.approx(1e6)  # the cap
    assert math.isfinite(out.torque)


@pytest.mark.parametrize("opening", [0.0, 1e-6, 1e-3, -0.02])
def test_parallel_edges_press_without_cutting(opening: float) -> None:
    """tan(psi) -> 0: nothing is released however hard they press, so the crack stays."""
    kernel = Kernel(make_tables(edge=line_edge(slope=0.0, offset=-0.001), upper_face=2e-3))
    kernel.reset(0.03)
    out = kernel.step(opening, -0.1, 0.0)
    if opening <= 0.0:
        assert out.flags & StepFlag.NOT_CUTTING
        assert kernel.crack == pytest.approx(0.03)
    assert kernel.crack >= 0.03 - 1e-9
    assert math.isfinite(out.torque)
    assert math.isfinite(out.force)


def test_closing_to_zero_with_a_real_edge_stays_finite() -> None:
    kernel = Kernel(make_tables())
    out = kernel.step_many(np.linspace(0.5, 0.0, 5000), -1.0, -0.02)
    assert all(np.isfinite(out[name]).all() for name in out.dtype.names)
    assert np.all(np.diff(out["contact"]) > -1e-6)


def test_beyond_the_tip_nothing_is_felt_until_the_blades_have_opened() -> None:
    kernel = Kernel(make_tables(tip_station=0.05))
    closed = kernel.step_many(np.linspace(0.8, 0.2, 2000), -0.5, -0.02)
    left = np.flatnonzero(closed["flags"] & StepFlag.BEYOND_TIP)
    assert left.size > 0
    assert np.all(closed["torque"][left] == 0)
    crack = kernel.crack
    assert crack == pytest.approx(-0.02 + 0.05 + 0.02, abs=0.03)
    # still closed, pushed forward: the blade is through already, nothing appears from nothing
    pushed = kernel.step_many(0.2, 0.0, np.linspace(-0.02, 0.0, 100))
    assert np.all(pushed["torque"] == 0)
    assert kernel.crack == crack
    # opened, then closed: felt again
    kernel.step(0.8, 1.0, 0.0)
    again = kernel.step_many(np.linspace(0.8, 0.4, 500), -0.5, 0.0)
    assert again["torque"].max() > 0.01


def test_the_stored_energy_is_counted_as_lost_beyond_the_tip() -> None:
    opening = np.linspace(0.8, 0.2, 20_000).astype(np.float32)
    advance = np.full_like(opening, -0.02)
    out = Kernel(make_tables(tip_station=0.05)).step_many(opening, -0.5, advance)
    work = work_of(out, opening.astype(float), advance.astype(float))
    assert out["stored_J"][-1] == 0
    assert abs(work - booked(out)) < 2e-3 * work


@pytest.mark.parametrize("advance", [0.005, 0.0, -0.0001])
def test_contact_at_the_pivot_and_behind_it(advance: float) -> None:
    """With a crack at or behind the pivot the blades are deep in: it runs out at once."""
    kernel = Kernel(make_tables())
    out = kernel.step(0.5, 0.0, advance)
    assert out.contact > 0.02
    assert out.force == pytest.approx(-JCH, rel=1e-4)
    pressing = Kernel(make_tables(fracture_energy=0.0))
    out = pressing.step(0.5, 0.0, advance)
    assert out.flags & StepFlag.OUT_OF_RANGE
    assert math.isfinite(out.torque)


def test_out_of_range_is_flagged_and_still_evaluated() -> None:
    kernel = Kernel(make_tables())
    out = kernel.step(0.15, -1.0, -0.02)
    assert out.flags & StepFlag.OUT_OF_RANGE
    assert out.torque > 0


def test_a_nick_stops_the_crack_at_its_first_place() -> None:
    """On an edge with a dent the crack runs to the first place where the release is paid."""
    s = np.linspace(0.0, BLADE_LENGTH, 151)
    dent = -6e-4 * np.exp(-(((s - 0.035) / 0.002) ** 2))
    edge = Table(s, -0.008 + 0.035 * s + dent, 0.035 - 2 * (s - 0.035) / 0.002**2 * dent)
    tables = make_tables(edge=edge)
    assert not tables.release_falls
    kernel = Kernel(tables)
    opening = np.linspace(0.8, 0.3, 4000)
    out = kernel.step_many(opening, -0.5, -0.02)
    assert all(np.isfinite(out[name]).all() for name in out.dtype.names)
    assert np.all(np.diff(out["contact"]) > -1e-6)
    release = -out["force"][out["flags"] & StepFlag.ADVANCED > 0]
    assert release.max() <= JCH * 1.001


@pytest.mark.parametrize("curvature", [-2.0, 0.0, 2.0])
@pytest.mark.parametrize("kappa", [1.0, 0.7])
def test_along_a_smooth_blade_the_release_falls(curvature: float, kappa: float) -> None:
    assert make_tables(edge=arc_edge(curvature), kappa=kappa).release_falls


def test_static_torque_is_what_a_slow_stroke_settles_at() -> None:
    kernel = Kernel(make_tables())
    opening = np.linspace(0.8, 0.3, 4000).astype(np.float32)
    out = kernel.step_many(opening, -0.1, -0.02)
    cutting = (out["flags"] & StepFlag.ADVANCED) > 0
    static = kernel.torque(opening, -0.1, 0.01)
    assert cutting.mean() > 0.8
    np.testing.assert_allclose(static[cutting], out["torque"][cutting], rtol=2e-4)
    ahead = kernel.torque(opening, -0.1, out["contact"] + 1e-3)
    assert np.all(ahead <= static)


def test_static_torque_broadcasts_and_refuses_what_is_not_finite() -> None:
    kernel = Kernel(make_tables())
    assert kernel.torque([[0.3], [0.4]], -0.1, [0.02, 0.03, 0.04]).shape == (2, 3)
    assert kernel.torque(0.4, -0.1, 0.02).shape == ()
    with pytest.raises(ValueError, match="not finite"):
        kernel.torque(math.nan, -0.1, 0.02)


def test_friction_opposes_the_motion_and_vanishes_at_rest() -> None:
    kernel = Kernel(make_tables(render_friction=True, fracture_energy=0.0))
    level = {-1: straight(0.012, 0.018), 1: straight(0.010, 0.014)}
    factor = straight(0.9, 1.1)
    for rate in (-5.0, -0.5, -0.011, 0.011, 0.5, 5.0):
        table = level[int(math.copysign(1, rate))]
        expected = float(table.evaluate(abs(rate), held=True)) * float(factor.evaluate(0.8))
        out = kernel.step(0.8, rate, -0.5)
        assert out.torque == pytest.approx(-math.copysign(expected, rate), rel=1e-5)
        assert out.friction_torque == out.torque
    inside = kernel.step_many(0.8, np.linspace(-0.01, 0.01, 5), -0.5)["torque"]
    assert inside[2] == 0
    np.testing.assert_allclose(inside[:2] / inside[0], [1.0, 0.5], rtol=1e-5)
    np.testing.assert_allclose(inside[3:] / inside[4], [0.5, 1.0], rtol=1e-5)


def test_rate_damping_adds_while_going_in_and_never_pulls() -> None:
    still = Kernel(make_tables(fracture_energy=0.0)).step(0.3, 0.0, -0.03)
    damped = Kernel(make_tables(fracture_energy=0.0, rate_damping=10.0))
    going_in = damped.step(0.3, -0.5, -0.03)
    leaving = damped.step(0.3, 1e4, -0.03)
    lever = still.torque / still.response
    assert going_in.torque == pytest.approx(still.torque * (1 + 10.0 * lever * 0.5 / 2), rel=1e-5)
    assert leaving.torque == 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("which", range(3))
def test_an_input_that_is_not_finite_gives_zero_and_a_flag(bad: float, which: int) -> None:
    kernel = Kernel(make_tables(render_friction=True))
    kernel.step(0.5, -1.0, -0.02)
    crack = kernel.crack
    inputs = [0.4, -1.0, -0.02]
    inputs[which] = bad
    out = kernel.step(*inputs)
    assert out.flags == StepFlag.INVALID
    assert (out.torque, out.force) == (0.0, 0.0)
    assert kernel.crack == crack
    assert kernel.step(0.5, -1.0, -0.02).torque > 0


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0, 8.0])
@pytest.mark.parametrize("toughness", [1e-4, 1.0, 1e2])
def test_extremes_of_material_cut_at_the_energy_they_need(
    exponent: float, toughness: float
) -> None:
    """J_c h from 0.1 mN to 100 N, exponents 0.5 to 8: the release settles at J_c h."""
    response = power_response(2.0, exponent, last=3e-2 if exponent < 4 else 2e-3)
    kernel = Kernel(make_tables(response=response, fracture_energy=toughness))
    opening = np.linspace(0.8, 0.4, 1000)
    out = kernel.step_many(opening, -0.5, -0.01)
    advanced = (out["flags"] & StepFlag.ADVANCED) > 0
    depth = REFERENCE * (toughness / (4.0 * 0.2)) ** (1 / exponent)
    if depth < 5e-3:  # else the blades close before the material gives way
        assert advanced.any()
    if advanced.any() and depth > 1e-7:  # below, float32 cannot tell the indentation
        np.testing.assert_allclose(-out["force"][advanced], toughness, rtol=0.02)
    assert all(np.isfinite(out[name]).all() for name in out.dtype.names)


def nicked_edge(depth: float) -> Table:
    """A line with a nick of 2 mm at 35 mm."""
    s = np.linspace(0.0, BLADE_LENGTH, 151)
    away = (s - 0.035) / 0.002
    nick = -depth * np.exp(-(away**2))
    return Table(s, EDGE_OFFSET + EDGE_TAPER * s + nick, EDGE_TAPER - 2.0 * away / 0.002 * nick)


def test_an_edge_that_leans_back_is_refused_at_the_openings_where_it_does() -> None:
    """Behind a steep nick more than one point of the edge stands over a place."""
    kernel = Kernel(make_tables(edge=nicked_edge(3e-3), opening_max=2.0))
    shallow, deep = kernel.step(0.4, -0.1, -0.03), kernel.step(1.6, -0.1, -0.03)
    assert not shallow.flags & StepFlag.INVALID
    assert deep.flags & StepFlag.INVALID
    assert deep.torque == deep.force == 0.0
    torque = kernel.torque([0.4, 1.6, 3.5], -0.1, 0.03)
    assert np.isfinite(torque).tolist() == [True, False, False]


def test_a_smooth_edge_is_refused_only_where_it_stands_upright() -> None:
    kernel = Kernel(make_tables(moving_blades=1, opening_max=2.0))
    limit = math.acos(0.05) - math.radians(2.0)
    for opening, refused in ((limit - 0.01, False), (limit + 0.01, True)):
        assert bool(kernel.step(opening, 0.0, -0.03).flags & StepFlag.INVALID) is refused
