"""Swings that the loop feeds stop the servo, and those of a cut's teeth do not; what it holds at a
stop is let go of gently."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from scissorcal.device import Axis, Demand, design_gains
from scissorcal.kernel import Mode, Servo, ServoConfig, State, StateFlag, StopReason
from tests.kernel.test_servo_watch import CONFIG, FRICTION, INERTIA, WATCH, Joint, tracking

TICK_S = 1e-3
STEP = 4.8e-5


def known_rig(config: ServoConfig, delay_ticks: float, inertia: float = INERTIA) -> ServoConfig:
    """What a probe says of the rig, which is ``delay_ticks`` late; as in `watches_of`."""
    watch = replace(
        config.watch,
        swing_inertia=inertia,
        swing_delay_ticks=max(delay_ticks + 0.25, 0.0),
        held_up_ticks=2.0,
    )
    damping = 0.3 * inertia / ((max(delay_ticks, 0.0) + 1.0) * TICK_S)
    return replace(config, watch=watch, let_go_damping_Nm_s_per_rad=damping)


def designed(config: ServoConfig, delay_ticks: int) -> ServoConfig:
    """Gains as a capture's are designed."""
    axis = Axis(
        INERTIA, 0.002, FRICTION, delay_s=delay_ticks * TICK_S + 2e-4, tick_s=TICK_S, step=STEP,
        rate_cutoff_Hz=0.0, most_per_count=0.015, inertia_factor=1.2,
    )  # fmt: skip
    found = design_gains(axis, Demand(0.6, 20.0, 0.3, 0.5), (100.0, 200.0, 400.0, 1000.0))
    return replace(
        config,
        opening_kp=found.gains.kp,
        opening_kd=found.gains.kd,
        opening_ki=found.gains.ki,
        rate_cutoff_Hz=found.axis.rate_cutoff_Hz,
        opening_error_limit=0.5,
    )


@dataclass
class Sheet(Joint):
    """A joint that presses a spring until it yields, again and again, each time anew.

    ``yields`` gives the torque (N m) at which a tooth yields; ``kept`` is the share that is left.
    """

    stiffness: float = 15.0
    kept: float = 0.62
    yields: tuple[float, ...] = (math.inf,)
    base: float = math.nan
    tooth: int = 0

    def _turn(self, torque: float) -> None:
        for _ in range(10):
            step = 1e-4
            self.base = self.opening if math.isnan(self.base) else self.base
            load = self.stiffness * max(self.base - self.opening, 0.0)
            if load > self.yields[self.tooth % len(self.yields)]:
                self.tooth += 1
                self.base = self.opening + self.kept * load / self.stiffness
                load *= self.kept
            free = self.rate + (torque + load) / INERTIA * step
            grip = FRICTION / INERTIA * step
            self.rate = math.copysign(max(abs(free) - grip, 0.0), free)
            self.opening += self.rate * step
        self.fastest = max(self.fastest, abs(self.rate))


def closing(config: ServoConfig, speed: float = 0.6, seconds: float = 1.0) -> Servo:
    """A servo that closes from 0.8 rad at a steady rate."""
    time = np.arange(round(seconds * 1000)) * TICK_S
    rate = -speed * np.minimum(time / 0.1, 1.0)
    servo = Servo(None, config)
    servo.set_reference(
        0.8 + np.cumsum(rate) * TICK_S, rate, np.full(len(time), -0.02), np.zeros(len(time))
    )
    servo.engage(Mode.TRACK)
    return servo


def cotton(seed: int) -> Sheet:
    """Teeth of 0.08 to 0.3 N m in sheets from soft to stiff; every second rig is a tick late."""
    rng = np.random.default_rng(seed)
    return Sheet(
        late=1 + seed % 2,
        opening=0.8,
        stiffness=float(rng.uniform(7.0, 21.0)),
        kept=float(rng.uniform(0.5, 0.7)),
        yields=tuple(rng.uniform(0.13, 0.3, 100).tolist()),
    )


@pytest.mark.parametrize("wrong_ticks", [-0.5, 0.0, 0.5])
def test_the_teeth_of_40_cuts_are_no_oscillation(wrong_ticks: float) -> None:
    """Also with a delay that the probe found half a tick off, five of its standard deviations."""
    stops = []
    for seed in range(40):
        joint = cotton(seed)
        config = designed(CONFIG, joint.late - 1)
        servo = closing(known_rig(config, joint.late - 1 + wrong_ticks))
        stops.append(joint.run(servo, 1000))
        assert joint.tooth > 5
    assert stops == [StopReason.NONE] * 40


def test_the_same_teeth_look_like_an_oscillation_where_nothing_is_known_of_the_rig() -> None:
    """So that the test before says something."""
    stops = []
    for seed in range(40):
        joint = cotton(seed)
        stops.append(joint.run(closing(designed(CONFIG, joint.late - 1)), 1000))
    assert stops.count(StopReason.OSCILLATION) > 10


@pytest.mark.parametrize("late", [4, 5, 6, 8])
@pytest.mark.parametrize("wrong_ticks", [-0.5, 0.0, 0.5, 1.0])
@pytest.mark.parametrize("inertia", [0.5 * INERTIA, INERTIA, 2.0 * INERTIA])
def test_a_late_loop_is_found_also_with_a_delay_and_an_inertia_that_are_not_exact(
    late: int, wrong_ticks: float, inertia: float
) -> None:
    config = known_rig(CONFIG, late - 1 + wrong_ticks, inertia)
    joint, servo = Joint(late=late), tracking(config)
    assert joint.run(servo, 4000) is StopReason.OSCILLATION
    assert len(joint.commands) < 700


def test_a_computer_that_is_held_up_is_named_and_not_the_gains() -> None:
    """Answers come to every tenth state only, as beside other work: the loop swings for that."""
    servo = tracking(known_rig(CONFIG, 0.0))
    joint = Joint()
    enabled, torque = False, 0.0
    for tick in range(1, 4001):
        joint._turn(torque if enabled else 0.0)
        state = State(int(enabled), tick, 1000 * tick, joint.opening, -0.02, torque, 0.0)
        answered = tick % 10 == 0
        command = servo.step(state, answered=answered)
        if answered:
            torque, enabled = command.torque, bool(command.flags & 1)
        if servo.stop_reason is not StopReason.NONE:
            break
    assert servo.stop_reason is StopReason.HELD_UP
    assert "other work" in servo.stop_reason.sentence


@pytest.mark.parametrize("stiffness", [7.0, 15.0, 21.0])
@pytest.mark.parametrize("late", [1, 2, 3])
@pytest.mark.parametrize("known", [True, False])
def test_what_is_held_at_a_stop_is_let_go_of_below_half_a_radian_per_second(
    stiffness: float, late: int, known: bool
) -> None:
    """0.3 N m behind a sheet; the measured torque is no number from then on. Without a probe there
    is no damping against what swings already, and the ramp alone leaves up to 0.6 rad/s."""
    config = replace(designed(CONFIG, late - 1), watch=WATCH)
    config = known_rig(config, late - 1) if known else config
    _, gentle = _held_and_let_go(Sheet(late=late, opening=0.8, stiffness=stiffness), config, False)
    assert gentle < (0.5 if known else 0.7)


def test_motors_that_are_off_at_once_throw_the_blades() -> None:
    """What a stop does where torque may not be trusted, and the reason for the other one."""
    reason, rate = _held_and_let_go(Sheet(opening=0.8), designed(CONFIG, 0), True)
    assert reason is StopReason.ENCODER_FAULT
    assert rate > 2.0


def _held_and_let_go(
    sheet: Sheet, config: ServoConfig, encoder_fault: bool
) -> tuple[StopReason, float]:
    """Why it stopped, and the largest rate after the fault, which comes at 0.3 N m."""
    path = 0.8 - 1e-4 * np.arange(3000)
    servo = Servo(None, config)
    servo.set_reference(
        path, np.gradient(path, TICK_S), np.full(len(path), -0.02), np.zeros(len(path))
    )
    servo.engage(Mode.TRACK)
    enabled, faulty, fastest = False, False, 0.0
    for tick in range(1, 3000):
        due = len(sheet.commands) - sheet.late
        torque = sheet.commands[due] if due >= 0 and enabled else 0.0
        sheet._turn(torque)
        faulty = faulty or torque <= -0.3
        flags = int(enabled) | (StateFlag.ENCODER_FAULT if faulty and encoder_fault else 0)
        measured = math.nan if faulty else torque
        state = State(flags, tick, 1000 * tick, sheet.opening, -0.02, measured, 0.0)
        command = servo.step(state)
        enabled = bool(command.flags & 1)
        sheet.commands.append(command.torque)
        fastest = max(fastest, abs(sheet.rate)) if faulty else 0.0
    assert faulty
    return servo.stop_reason, fastest
