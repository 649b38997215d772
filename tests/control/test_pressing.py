"""The C law with designed gains on the plant: touching, pressing along a path, losing, limits.

The plant has a blade of 41 g along the normal, dry friction of 5 mN m and 0.8 N that builds up over
a distance, encoders, motors of 1.5 ms and, where nothing else is said, a tick of delay.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.control import choose_gains, friction_rates
from scissorcal.kernel import HybridFlag, NormalLaw, hybrid_inputs
from tests.control.plant import Blade, Disc
from tests.control.rig import MASSES_KG, designed, loop_of, mass_at, resting, steered, swinging
from tests.control.steering import Known, Steering, Wish

LATE = Blade(delay_s=1e-3)
SOFT = Disc(stiffness=3e3)
HARD = Disc(stiffness=7e3)
SMOOTH = replace(LATE, dry=(0.0, 0.0))


def flags_of(run: dict[str, np.ndarray]) -> np.ndarray:
    return run["flags"].astype(int)


def after(run: dict[str, np.ndarray], time: float) -> dict[str, np.ndarray]:
    """The part of a run from a time on."""
    return {name: values[run["time"] >= time] for name, values in run.items()}


@pytest.mark.parametrize("blade", [LATE, SMOOTH], ids=["dry friction", "smooth"])
@pytest.mark.parametrize(
    ("disc", "delay_s", "speed"), [(SOFT, 1e-3, 0.02), (SOFT, 1e-3, 0.05), (HARD, 0.0, 0.035)]
)
def test_a_touch_peaks_at_speed_times_root_of_stiffness_and_mass(
    blade: Blade, disc: Disc, delay_s: float, speed: float
) -> None:
    """Until the ramp of the wanted force passes it; once, without leaving again."""
    steering = steered(
        replace(blade, delay_s=delay_s), disc, gap=2e-3, approach_speed=speed, force_slew=5.0
    )
    run = steering.run(1.6, resting())
    hit = int(np.argmax(run["gap"] <= 0.0))
    met = (run["gap"][hit - 1] - run["gap"][hit]) / 1e-3
    assert 0.9 * speed < met < 1.05 * speed
    impact = met * math.sqrt(disc.stiffness * 0.0415)
    half = math.ceil(math.pi * math.sqrt(0.0415 / disc.stiffness) / 1e-3)  # of a swing, in ticks
    peak = run["force"][hit : hit + half].max()
    assert peak < 1.1 * impact + 0.05
    ramp = np.maximum(run["force_aim"], impact)
    assert (run["force"] - ramp).max() < 0.25 * impact + 0.12
    assert np.count_nonzero(flags_of(run) & HybridFlag.TOUCHED) == 1
    assert not (flags_of(run) & HybridFlag.LOST).any()
    assert np.abs(after(run, 1.5)["force"] - 2.0).max() < 0.02


RMS_N = 0.03
PATHS = {
    "slow": (LATE, SOFT, Known(), 0.5, 2.0),
    "fast": (LATE, SOFT, Known(), 1.5, 3.0),
    "hard, without delay": (replace(LATE, delay_s=0.0), HARD, Known(), 0.5, 2.0),
    "moving disc": (LATE, replace(SOFT, swing_m=2e-3), Known(), 0.5, 2.0),
    "disc off by 0.3 mm": (LATE, SOFT, Known(off=(2e-4, -2e-4)), 0.5, 2.0),
    "friction and mass off": (LATE, SOFT, Known(dry=(1.3, 0.7), inertia=1.1), 0.5, 2.0),
    "coarse encoders": (replace(LATE, step=(3.1e-4, 5e-6)), SOFT, Known(), 0.5, 2.0),
}
QUICK = ("fast", "hard, without delay", "moving disc", "coarse encoders")
"""What the default suite tries; a wrong disc or friction is tried by the other tests, too."""


@pytest.mark.parametrize(
    "title",
    [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in PATHS],
)
def test_the_force_holds_along_a_curved_path(title: str) -> None:
    """0.6 rad to either side of the top of a disc of 20 mm; measured: 0.015 to 0.022 N rms."""
    blade, disc, known, hertz, force = PATHS[title]
    steering = steered(blade, disc, known)
    run = after(steering.run(3.0, swinging(0.6, hertz, force)), 1.0)
    assert (flags_of(run) == HybridFlag.CONTACT).all()
    assert math.sqrt(np.mean((run["force"] - force) ** 2)) < RMS_N
    assert math.sqrt(np.mean(run["path_error"] ** 2)) < 2e-4


def test_a_surface_that_moves_untold_is_felt() -> None:
    """2 mm at 1 Hz, which the law is told to rest: 0.061 N rms, and 0.040 N where it is felt."""
    swaying, untold = replace(SOFT, swing_m=2e-3), Known(rising=0.0)
    rms = []
    for cutoff in (0.0, 100.0):
        steering = steered(LATE, swaying, untold, surface_cutoff_Hz=cutoff)
        run = after(steering.run(4.0, resting()), 1.0)
        assert (flags_of(run) == HybridFlag.CONTACT).all()
        rms.append(math.sqrt(np.mean((run["force"] - 2.0) ** 2)))
    assert rms[1] < 0.75 * rms[0]


@pytest.mark.slow
def test_feeling_a_surface_does_not_excite_friction_where_the_compliance_is_wrong() -> None:
    """At rest, compliance stated 1.5 times too high; the gains allow for as much."""
    soft = Disc(stiffness=1e3)
    loops = [
        loop_of(LATE, soft, mass, surface_cutoff_Hz=100.0, stiffness_factor=1.5)
        for mass in MASSES_KG
    ]
    gains = choose_gains(loops, peak_N=1.0).settings()
    noise = []
    for share in (0.0, 0.7):
        steering = steered(
            LATE,
            soft,
            Known(compliance=1.5),
            **{**gains, "surface_cutoff_Hz": 100.0, "friction_share": share},
        )
        noise.append(after(steering.run(3.0, resting()), 2.0)["force"].std())
    assert noise[1] < 0.004 > noise[0]


def test_a_far_surface_is_approached_by_a_share_of_the_gap() -> None:
    """20 mm at 2/s, and from 2.5 mm on at 5 mm/s."""
    steering = steered(LATE, SOFT, gap=0.02, approach_speed=5e-3, approach_rate=2.0)
    run = steering.run(2.5, resting())
    falling = -np.diff(run["gap"]) / 1e-3
    gap = run["gap"][:-1]
    far = (gap > 4e-3) & (gap < 0.015)
    assert np.abs(falling[far] / (2.0 * gap[far]) - 1.0).max() < 0.1
    near = (gap > 1e-4) & (gap < 1.5e-3)
    assert np.abs(falling[near] / 5e-3 - 1.0).max() < 0.1


def test_friction_on_the_surface_is_compensated_where_it_is_known() -> None:
    rough = replace(SOFT, friction=0.3)
    rms = []
    for known in (Known(), Known(surface_friction=0.3)):
        run = after(steered(LATE, rough, known).run(3.0, swinging(0.6, 0.5)), 1.0)
        rms.append(math.sqrt(np.mean((run["force"] - 2.0) ** 2)))
    assert rms[1] < 0.12 < 2.0 * rms[1] < rms[0]


@pytest.mark.slow
def test_the_curvature_of_the_surface_is_needed_on_fast_paths() -> None:
    """Without it the point leaves along the tangent: m v^2 / R, 1.2 m/s^2 at the top."""
    swing = swinging(0.6, 2.0)
    told, untold = (
        after(steered(SMOOTH, SOFT, Known(curvature=one)).run(2.5, swing), 1.0)["force"] - 2.0
        for one in (True, False)
    )
    assert np.std(untold) > 1.3 * np.std(told)


def test_position_control_presses_by_where_it_assumes_the_surface() -> None:
    """A disc assumed 1 mm too low is pressed harder by position control, and not by the law.

    Position control is a spring of mass times normal_kp, in series with the material.
    """
    forces: dict[NormalLaw, list[float]] = {law: [] for law in NormalLaw}
    for law in NormalLaw:
        for off in (0.0, -1e-3):
            steering = steered(SMOOTH, SOFT, Known(off=(0.0, off)), normal_law=law)
            spring = mass_at(SMOOTH, steering.plant.place[0]) * steering.config.normal_kp
            deep = -2.0 / SOFT.stiffness - 2.0 / spring
            run = steering.run(1.5, lambda time, gap=deep: Wish(gap=gap))
            forces[law].append(float(run["force"][-300:].mean()))
    change = 1e-3 * spring * SOFT.stiffness / (spring + SOFT.stiffness)
    held, harder = forces[NormalLaw.POSITION]
    assert held == pytest.approx(2.0, abs=0.03)
    assert harder - held == pytest.approx(change, rel=0.03)
    assert forces[NormalLaw.FORCE] == pytest.approx([2.0, 2.0], abs=0.01)


def swing_at_rest(share: float, width: float) -> tuple[float, float, float]:
    """Standard deviations of torque, push and force while the point should rest."""
    gains = designed(LATE, SOFT)
    rates = friction_rates(gains, (LATE.inertia, LATE.mass), LATE.dry)
    steering = steered(
        LATE, SOFT, friction_share=share, friction_rate=tuple(width * rate for rate in rates)
    )
    run = after(steering.run(2.0, resting()), 1.0)
    return tuple(float(run[name].std()) for name in ("torque", "push", "force"))


@pytest.mark.slow
def test_all_of_the_friction_compensated_chatters_and_70_percent_does_not() -> None:
    """In half the band at which damping is left; in that band neither does."""
    some, every = swing_at_rest(0.7, 0.5), swing_at_rest(1.0, 0.5)
    assert all(more > 2.5 * less for more, less in zip(every, some, strict=True))
    assert every[2] > 0.008
    assert some[2] < 0.004
    assert all(more < 0.4 * less for more, less in zip(swing_at_rest(1.0, 1.0), every, strict=True))


@pytest.mark.parametrize(("drop", "lost"), [(1e-3, False), (5e-3, True)])
def test_material_that_gives_way_is_met_again_at_a_bounded_speed(drop: float, lost: bool) -> None:
    """A short gap is a bounce; a long one ends touching, and an approach begins."""
    steering = steered(LATE, SOFT)
    steering.run(1.2, resting())
    plant, disc = steering.plant, steering.plant.disc
    plant.disc = replace(disc, centre=(disc.centre[0], disc.centre[1] - drop))
    steering.known = Known(off=(0.0, drop))  # nobody tells the law
    run = steering.run(1.0, resting())
    flags, speed = flags_of(run), steering.config.approach_speed
    assert (flags & HybridFlag.LOST).any() == lost
    assert np.count_nonzero(flags & HybridFlag.TOUCHED) == int(lost)
    falling = -np.diff(run["gap"]) / 1e-3
    # what 2 N do to 41 g until their end has been measured, answered and has left the motor
    free = 2.0 / 0.0415 * (1e-3 + LATE.delay_s + LATE.lag_s)
    assert falling.max() < speed + free
    if lost:
        met = int(np.argmax(flags & HybridFlag.TOUCHED > 0))
        assert falling[met - 30 : met - 10].max() < 1.05 * speed
    assert run["force"].max() < 2.1
    assert np.abs(run["force"][-100:] - 2.0).max() < 0.02


def test_the_integral_does_not_wind_up_against_a_limit() -> None:
    """A motor that presses by 1.2 N at most, asked for 2 N for a second, then for 0.6 N."""
    steering = steered(LATE, SOFT, effort_limit=(0.07 * 1.2, 30.0), force_ki=20.0)
    run = steering.run(1.5, resting())
    assert run["force"][-1] == pytest.approx(1.2, abs=0.08)
    assert run["integral"].max() < 0.2
    assert flags_of(run)[-1] & (HybridFlag.INTEGRAL_HELD | HybridFlag.EFFORT_LIMITED) != 0
    assert np.abs(run["torque"]).max() <= np.float32(0.07 * 1.2)
    down = steering.run(0.6, resting(0.6))
    slewed = 1.4 / steering.config.force_slew
    settled = down["time"] - down["time"][0] > slewed + 0.05
    assert np.abs(down["force"][settled] - 0.6).max() < 0.08
    assert down["force"].min() > 0.5


def test_the_path_yields_before_the_force() -> None:
    """A path that jumps by 6 mm asks for more than a weak carriage has."""
    steering = steered(LATE, SOFT, effort_limit=(0.5, 2.0), path_error_most=1e-2)
    steering.run(1.2, resting())
    run = steering.run(1.0, resting(angle=0.3))
    assert np.abs(run["push"]).max() <= 2.0
    assert run["path_share"].min() < 0.3
    assert (flags_of(run) & HybridFlag.PATH_YIELDS).any()
    assert not (flags_of(run) & HybridFlag.EFFORT_LIMITED).any()
    assert np.abs(run["force"] - 2.0).max() < 0.12
    assert run["path_error"][-1] < 1e-4


def test_a_blade_that_stands_upright_is_let_go() -> None:
    """Both axes then move its tip along the cut alone."""
    steering = steered(LATE, SOFT)
    steering.run(1.2, resting())
    assert steering.law.touching
    inputs = steering.inputs.copy()
    length = steering.plant.blade.length
    inputs["jacobian"][0, :2, :2] = [[-length, 1.0], [1e-4 * length, 0.0]]
    out = steering.law.step(inputs)[0]
    assert out["flags"] == HybridFlag.SINGULAR
    assert not out["effort"].any()
    assert not steering.law.touching


def test_three_axes_press_and_move_as_their_equations_say() -> None:
    """A skewed gantry against a sloping wall, integrated here: force and path are held."""
    inertia = np.array([[0.6, 0.1, 0.0], [0.1, 0.4, -0.05], [0.0, -0.05, 0.5]])
    jacobian = np.array([[1.0, 0.2, 0.0], [0.0, 1.0, 0.3], [0.1, 0.0, 0.8]])
    normal = np.array([2.0, 1.0, 2.0]) / 3.0
    steering = steered(LATE, SOFT)
    mass = float(1.0 / (normal @ jacobian @ np.linalg.solve(inertia, jacobian.T @ normal)))
    law = Steering(
        steering.plant,
        replace(
            steering.config,
            axes=3,
            contact_kd=60.0,
            force_ki=15.0,
            effort_limit=(20.0,) * 3,
            friction_rate=(0.1,) * 3,
            approach_speed=5e-3,
        ),
    ).law
    q, rates = np.zeros(3), np.zeros(3)
    along = np.array([1.0, -2.0, 0.0]) / math.sqrt(5.0)
    forces, errors, tick, fine = [], [], 1e-3, 20
    for k in range(2500):
        time = k * tick
        phase = 2.0 * math.pi * 0.5 * max(time - 1.0, 0.0)
        place = 0.01 * (1.0 - math.cos(phase)) * along
        point, gap = jacobian @ q, float(normal @ jacobian @ q) - 0.0
        force = max(0.0, -5e3 * (gap + 1e-3))
        out = law.step(
            hybrid_inputs(
                dt=tick,
                rate=rates,
                inertia=inertia,
                jacobian=jacobian,
                point=point,
                normal=normal,
                gap=gap + 1e-3,
                force=force,
                force_wanted=3.0,
                path=place,
                path_rate=0.01 * math.pi * math.sin(phase) * along,
                path_acceleration=0.01 * math.pi**2 * math.cos(phase) * along * (time > 1.0),
            )
        )[0]
        assert out["mass"] == pytest.approx(mass, rel=1e-5)
        forces.append(force)
        errors.append(float(out["path_error"]))
        for _ in range(fine):
            pressed = max(0.0, -5e3 * (float(normal @ jacobian @ q) + 1e-3))
            push = out["effort"].astype(float) + jacobian.T @ normal * pressed
            rates = rates + np.linalg.solve(inertia, push) * tick / fine
            q = q + rates * tick / fine
    assert np.abs(np.array(forces[1200:]) - 3.0).max() < 0.02
    assert max(errors[1200:]) < 2e-5
