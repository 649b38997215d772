"""What the servo watches while it drives: each fault is noticed, named and stopped gently."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from scissorcal.kernel import Mode, Servo, ServoConfig, State, StateFlag, StopReason, WatchConfig
from tests.kernel.zoo import make_tables

WATCH = WatchConfig(
    held_s=0.5,
    swing_rate=0.5,
    swing_torque=0.05,
    swing_Hz=8.0,
    runaway_rate=1.0,
    still_rad=0.03,
    still_m=0.005,
    still_torque=0.05,
    rest_torque=0.05,
    least_ratio=0.7,
    most_ratio=1.4,
    ratio_torque=0.005,
    clock_share=0.02,
    host_clock_share=0.05,
    handle_radius=0.06,
)
CONFIG = ServoConfig(
    torque_limit=0.5,
    torque_slew=100.0,
    force_limit=10.0,
    force_slew=5000.0,
    ramp_s=0.1,
    rate_cutoff_Hz=120.0,
    opening_kp=6.0,
    opening_kd=0.06,
    opening_ki=20.0,
    opening_error_limit=0.3,
    watch=WATCH,
)
INERTIA = 2e-4
FRICTION = 0.012
NO_TORQUE = 1e-12


@dataclass
class Joint:
    """A joint with dry friction, and a device that measures it in its own way."""

    sense: float = 1.0  # of the motor
    late: int = 1  # ticks until a command acts
    measured: Callable[[float], float] = lambda torque: torque
    push: Callable[[int, float], float] = lambda tick, rate: 0.0  # of a hand [N m]
    force_zero: float = 0.0  # of the sensor [N]
    force_noise: Callable[[int], float] = lambda tick: 0.0
    seen: Callable[[int, float], float] = lambda tick, opening: opening
    clock: Callable[[int], int] = lambda tick: 1000 * tick
    host_us: int = 1000
    opening: float = 0.6
    rate: float = 0.0
    commands: list[float] = field(default_factory=list)
    flags: list[int] = field(default_factory=list)
    fastest: float = 0.0

    def run(self, servo: Servo, ticks: int) -> StopReason:
        enabled = False
        for tick in range(1, ticks + 1):
            due = len(self.commands) - self.late
            torque = self.commands[due] if due >= 0 and enabled else 0.0
            push = self.push(tick, self.rate)
            self._turn(self.sense * torque + push)
            state = State(
                int(StateFlag.MOTOR_ENABLED) * enabled,
                tick,
                self.clock(tick) % 2**32,
                self.seen(tick, self.opening),
                -0.02,
                self.measured(torque),
                -push / 0.06 + self.force_zero + self.force_noise(tick),
            )
            command = servo.step(state)
            enabled = bool(command.flags & 1)
            self.commands.append(command.torque)
            self.flags.append(command.flags)
            if servo.stop_reason is not StopReason.NONE:
                break
        return servo.stop_reason

    def _turn(self, torque: float) -> None:
        for _ in range(10):
            step = 1e-4
            free = self.rate + torque / INERTIA * step
            grip = FRICTION / INERTIA * step
            self.rate = math.copysign(max(abs(free) - grip, 0.0), free)
            self.opening += self.rate * step
        self.fastest = max(self.fastest, abs(self.rate))


def tracking(config: ServoConfig = CONFIG, seconds: float = 4.0) -> Servo:
    """A servo that closes from 0.6 to 0.3 rad and opens again, at up to 0.6 rad/s."""
    time = np.arange(round(seconds * 1000)) * 1e-3
    opening = 0.45 + 0.15 * np.cos(4.0 * time)
    servo = Servo(None, config)
    servo.set_reference(
        opening, -0.6 * np.sin(4.0 * time), np.full(len(time), -0.02), np.zeros(len(time))
    )
    servo.engage(Mode.TRACK)
    return servo


LET_GO_TICKS = 260
"""In which a gentle end is through."""


def ends_gently(commands: Sequence[float]) -> bool:
    steps = np.abs(np.diff(commands[-LET_GO_TICKS:]))
    return bool(abs(commands[-1]) < NO_TORQUE and steps.max() <= 0.1 * (1 + 1e-4))


def test_nothing_is_wrong_with_a_good_rig() -> None:
    joint, servo = Joint(), tracking()
    assert joint.run(servo, 4000) is StopReason.NONE
    assert max(servo.watched.values()) < 0.7, servo.watched


@pytest.mark.parametrize("late", [1, 2, 3, 5, 8])
def test_a_measured_torque_may_be_late_or_be_the_commanded_one(late: int) -> None:
    config = replace(CONFIG, opening_kp=1.0, opening_kd=0.01, opening_ki=2.0)
    joint, servo = Joint(late=late), tracking(config)
    joint.run(servo, 4000)
    assert servo.watched["measured_differs"] < 0.5


@pytest.mark.parametrize("late", [4, 5, 6, 8])
def test_a_late_loop_that_swings_is_stopped_before_it_is_wild(late: int) -> None:
    joint, servo = Joint(late=late), tracking()
    assert joint.run(servo, 4000) is StopReason.OSCILLATION
    assert len(joint.commands) < 350 + LET_GO_TICKS
    assert joint.fastest < 30.0
    assert ends_gently(joint.commands)
    assert "doctor" in servo.stop_reason.sentence


def test_a_motor_of_the_wrong_sense_is_stopped_before_it_is_fast() -> None:
    joint, servo = Joint(sense=-1.0), tracking()
    assert joint.run(servo, 1000) is StopReason.RUNAWAY
    assert joint.fastest < 8.0
    assert max(map(abs, joint.commands)) < 0.5
    assert joint.commands[-1] == 0.0


@pytest.mark.parametrize(
    ("measured", "reason"),
    [
        (lambda torque: -torque, StopReason.MEASURED_REVERSED),
        (lambda torque: 0.5 * torque, StopReason.MEASURED_DIFFERS),
        (lambda torque: 2.0 * torque, StopReason.MEASURED_DIFFERS),
        (lambda torque: 0.0, StopReason.MEASURED_DIFFERS),
        (lambda torque: 0.2, StopReason.MEASURED_DIFFERS),
    ],
)
def test_a_measured_torque_that_is_wrong_is_told_at_capture(
    measured: Callable[[float], float], reason: StopReason
) -> None:
    joint, servo = Joint(measured=measured), tracking()
    assert joint.run(servo, 4000) is reason
    assert len(joint.commands) < 2000
    assert ends_gently(joint.commands)


def test_a_zero_of_the_measured_torque_is_taken_off_while_the_motors_are_off() -> None:
    joint = Joint(measured=lambda torque: torque + 0.05)
    servo = tracking()
    servo.engage(Mode.IDLE)
    joint.run(servo, 300)
    servo.engage(Mode.TRACK)
    joint = replace(joint, clock=lambda tick: 1000 * (tick + 300))
    joint.commands.clear()
    second = _later(joint, 300)
    assert second.run(servo, 3500) is StopReason.NONE
    assert servo.watched["measured_differs"] < 0.5


class _Later:
    """States whose sequence goes on from an earlier run."""

    def __init__(self, servo: Servo, ticks: int) -> None:
        self._servo, self._ticks = servo, ticks

    def __getattr__(self, name: str) -> object:
        return getattr(self._servo, name)

    def step(self, state: State) -> object:
        return self._servo.step(state._replace(sequence=state.sequence + self._ticks))


def _later(joint: Joint, ticks: int) -> Joint:
    run = joint.run
    joint.run = lambda servo, count: run(_Later(servo, ticks), count)  # type: ignore[method-assign,assignment,arg-type,return-value]
    return joint


@pytest.mark.parametrize("since", [1, 700])
def test_an_encoder_that_stands_is_told_before_the_torque_is_large(since: int) -> None:
    stuck: list[float] = []

    def seen(tick: int, opening: float) -> float:
        if tick >= since:
            stuck.append(opening)
            return stuck[0]
        return opening

    joint, servo = Joint(seen=seen), tracking()
    assert joint.run(servo, 4000) is StopReason.OPENING_STANDS
    assert max(map(abs, joint.commands)) < 0.3
    assert joint.commands[-1] == 0.0, "at once: an encoder that is wrong damps nothing"


def test_blades_that_rest_under_unequal_torques_are_told() -> None:
    """An encoder that is stuck while a hand pushes against a rendering."""
    joint = Joint(seen=lambda tick, opening: 0.5, push=lambda tick, rate: -0.2)
    servo = Servo(make_tables(), CONFIG)
    servo.engage(Mode.RENDER)
    assert joint.run(servo, 3000) is StopReason.OPENING_STANDS
    assert len(joint.commands) < 800


def test_a_hand_that_rests_is_no_fault() -> None:
    joint = Joint(push=lambda tick, rate: -0.008)
    servo = Servo(make_tables(), CONFIG)
    servo.engage(Mode.RENDER)
    assert joint.run(servo, 3000) is StopReason.NONE


@pytest.mark.parametrize("seconds", [20, pytest.param(600, marks=pytest.mark.slow)])
def test_no_hand_that_holds_blades_still_is_a_stuck_encoder(seconds: int) -> None:
    """It trembles and leans this way and that, up to and beyond what friction holds; encoder steps
    of 40 urad, a noisy force sensor, and blades that rest most of the time."""
    rng = np.random.default_rng(7)
    turns, phases = rng.uniform(0.2, 3.0, 8), rng.uniform(0.0, 6.28, 8)
    noise = rng.normal(0.0, 0.02, 20_000)

    def push(tick: int, rate: float) -> float:
        time = 1e-3 * tick
        aim = 0.6 + 6e-4 * float(np.sin(turns * time + phases).sum())
        tremor = 4e-3 * math.sin(56.0 * time)
        return 8.0 * (aim - joint.opening) - 0.02 * rate + tremor

    joint = Joint(
        push=push,
        seen=lambda tick, opening: 4e-5 * math.floor(opening / 4e-5),
        force_noise=lambda tick: float(noise[tick % len(noise)]),
    )
    config = replace(CONFIG, watch=replace(WATCH, rest_torque=2.0 * FRICTION, rest_share=0.4))
    servo = Servo(make_tables(), config)
    servo.engage(Mode.RENDER)
    assert joint.run(servo, 1000 * seconds) is StopReason.NONE
    assert 0.3 < servo.watched["opening_stands"] < 0.8


@pytest.mark.parametrize("mode", [Mode.TRACK, Mode.RENDER])
def test_an_encoder_that_jitters_and_then_repeats_a_reading_is_stuck(mode: Mode) -> None:
    """Noise of one encoder step; the blades rest, or are moved gently by a hand."""
    noise = np.random.default_rng(3).normal(0.0, 4e-5, 60_000)

    def run(stuck_from: int, ticks: int) -> tuple[StopReason, int]:
        config = replace(CONFIG, rate_cutoff_Hz=30.0, watch=replace(WATCH, jitter_s=0.2))
        servo = Servo(make_tables(), config)
        servo.set_reference(*np.full((2, 1), [[0.6], [0.0]]), np.full(1, -0.02), np.zeros(1))
        servo.engage(mode)

        def seen(tick: int, opening: float) -> float:
            if tick <= stuck_from:
                last[0] = 4e-5 * math.floor((opening + noise[tick]) / 4e-5)
            return last[0]

        last = [0.0]
        joint = Joint(seen=seen, push=lambda tick, rate: 0.015 * math.sin(3e-3 * tick))
        return joint.run(servo, ticks), len(joint.commands)

    assert run(60_000, 20_000) == (StopReason.NONE, 20_000)
    reason, ticks = run(3_000, 4_000)
    assert reason is StopReason.OPENING_STANDS
    assert 3_190 <= ticks < 3_320


@pytest.mark.parametrize(("zero", "reason"), [(3.0, "NONE"), (0.0, "OPENING_STANDS")])
def test_a_known_zero_of_the_force_sensor_is_no_torque(zero: float, reason: str) -> None:
    """Blades at rest, a sensor that shows 3 N without a hand."""
    config = replace(CONFIG, watch=replace(WATCH, handle_zero=zero))
    joint = Joint(force_zero=3.0)
    servo = Servo(make_tables(), config)
    servo.engage(Mode.RENDER)
    assert joint.run(servo, 3000) is StopReason[reason]


def test_a_zero_of_the_measured_torque_is_no_torque_at_rest_either() -> None:
    """Taken with the motors off, and of a size at which blades would not rest."""
    watch = replace(WATCH, ratio_torque=0.0)
    servo = Servo(make_tables(), replace(CONFIG, watch=watch))
    joint = Joint(measured=lambda torque: torque + 0.2)
    joint.run(servo, 300)
    servo.engage(Mode.RENDER)
    joint = replace(joint, clock=lambda tick: 1000 * (tick + 300), commands=[])
    assert _later(joint, 300).run(servo, 3000) is StopReason.NONE
    assert servo.watched["opening_stands"] < 0.5


@pytest.mark.parametrize("ratio", [0.9, 1.05])
def test_a_clock_that_is_wrong_is_told_at_rest_already(ratio: float) -> None:
    joint = Joint(clock=lambda tick: round(1000 * ratio * tick))
    servo = Servo(None, CONFIG)
    assert joint.run(servo, 2000) is StopReason.CLOCK_RATE
    assert len(joint.commands) < 1000


def test_ticks_that_are_not_tick_us_long_are_told_by_this_computer() -> None:
    """The device counts 1000 us a tick, and a tick is 1100 us."""
    servo = Servo(None, replace(CONFIG, tick_us=1100))
    joint = Joint(clock=lambda tick: 1100 * tick)
    assert joint.run(servo, 4000) is StopReason.NONE
    off = replace(CONFIG, watch=replace(WATCH, clock_share=0.0), tick_us=1100)
    assert Joint(clock=lambda tick: 1000 * tick).run(Servo(None, off), 9000) is (
        StopReason.CLOCK_RATE
    )


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_torque_that_is_no_number_stops(bad: float) -> None:
    joint = Joint(measured=lambda torque: bad)
    assert joint.run(tracking(), 1000) is StopReason.UNREADABLE
    assert len(joint.commands) < 20 + LET_GO_TICKS


def test_a_torque_at_its_limit_for_too_long_stops() -> None:
    """Blades that are blocked by something springy: they move a little, and the torque is full."""
    config = replace(CONFIG, opening_kp=60.0, watch=replace(WATCH, still_rad=0.0))
    joint = Joint(seen=lambda tick, opening: 0.6 - 1e-5 * (tick % 2))
    assert joint.run(tracking(config), 4000) is StopReason.TORQUE_HELD
    assert ends_gently(joint.commands)


def watching() -> Servo:
    """A servo beside a device that renders by itself."""
    servo = Servo(None, CONFIG)
    servo.engage(Mode.WATCH)
    return servo


def stated(tick: int, torque: float) -> State:
    """A state of blades that jitter, of a device that states this torque."""
    return State(
        int(StateFlag.MOTOR_ENABLED), tick, 1000 * tick, 0.6 - 1e-5 * (tick % 2), -0.02, torque, 0.0
    )


def test_a_servo_that_watches_enables_the_motors_and_asks_for_nothing() -> None:
    servo = watching()
    commands = [servo.step(stated(tick, 0.2)) for tick in range(1000)]
    assert {(c.flags, c.torque, c.force) for c in commands} == {(1, 0.0, 0.0)}
    assert servo.stop_reason is StopReason.NONE


def test_a_servo_that_watches_takes_the_stated_torque_for_the_command() -> None:
    """A device that holds its limit for half a second is released at once, without a fall."""
    servo = watching()
    ticks = 0
    while servo.stop_reason is StopReason.NONE:
        command = servo.step(stated(ticks, 0.5))
        ticks += 1
        assert ticks < 600
    assert servo.stop_reason is StopReason.TORQUE_HELD
    assert ticks >= 500
    assert (command.flags, command.torque) == (0, 0.0)


def test_without_a_heartbeat_a_servo_that_watches_adds_no_damping_and_ends() -> None:
    servo = watching()
    ticks, torques = 0, set()
    while servo.stop_reason is StopReason.NONE:
        torques.add(servo.step(stated(ticks, 0.1), heartbeat=ticks < 10).torque)
        ticks += 1
        assert ticks < 1100
    assert servo.stop_reason is StopReason.SUPERVISOR_LOST
    assert torques == {0.0}
    assert servo.counters.fallback_frames == 0
    assert ticks >= 1000


def test_an_end_cannot_be_ordered_away() -> None:
    joint, servo = Joint(measured=lambda torque: -torque), tracking()
    joint.run(servo, 4000)
    assert servo.stop_reason is StopReason.MEASURED_REVERSED
    servo.engage(Mode.TRACK)
    command = servo.step(State(1, 5000, 5_000_000, 0.5, -0.02, 0.0, 0.0))
    assert (command.flags, command.torque) == (0, 0.0)


def test_a_watch_needs_sound_thresholds() -> None:
    with pytest.raises(ValueError, match="swing_rate"):
        WatchConfig(swing_rate=-1.0)
    with pytest.raises(ValueError, match="handle_zero"):
        WatchConfig(handle_zero=math.nan)
    with pytest.raises(ValueError, match="below 1"):
        WatchConfig(ratio_torque=0.01, least_ratio=1.2, most_ratio=1.4)


def test_what_is_seen_while_it_ends_does_not_take_the_first_reasons_place() -> None:
    """A torque that is no number ends it gently, an encoder that fails meanwhile at once."""
    servo, joint = tracking(), Joint(measured=lambda torque: math.nan)
    joint.run(servo, 60)
    assert servo.stop_reason is StopReason.NONE
    command = servo.step(State(65, 61, 61_000, 0.6, -0.02, math.nan, 0.0))
    assert servo.stop_reason is StopReason.UNREADABLE
    assert (command.flags, command.torque) == (0, 0.0)


def test_an_ending_ends_also_where_the_device_repeats_itself() -> None:
    servo, joint = tracking(replace(CONFIG, torque_slew=0.5)), Joint(measured=lambda _: math.nan)
    joint.run(servo, 60)
    assert servo.stop_reason is StopReason.NONE
    state = State(1, 60, 60_000, joint.opening, -0.02, math.nan, 0.0)
    for _ in range(370):
        command = servo.step(state)
    assert servo.stop_reason is StopReason.UNREADABLE
    assert command.torque == 0.0
