"""CONTROL from Python: what it refuses, what it shares, and that efforts are always numbers."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import (
    CONTROL_DTYPE,
    Contour,
    LoopBlock,
    Mode,
    Servo,
    ServoConfig,
    State,
    StopReason,
)
from scissorcal.kernel.control import FRICTION_POINTS
from tests.kernel.zoo import CONTOUR, CONTROL, FLAT, LAW

SERVO = ServoConfig(torque_limit=0.5, torque_slew=200.0, force_limit=20.0, force_slew=5e3)
STILL: tuple[Any, ...] = ([0.0] * 10, [0.0] * 10, [2.0] * 10, [0] * 10)


def state(tick: int, opening: float = 0.5, torque: float = 0.0, handle: float = 0.0) -> State:
    return State(1, tick, 1000 * tick, opening, 0.0, torque, handle)


def pressing() -> Servo:
    servo = Servo(None, SERVO, CONTROL)
    assert servo.control is not None
    servo.control.set_path(*STILL)
    servo.engage(Mode.CONTROL)
    return servo


def test_it_needs_a_configuration_and_a_path() -> None:
    with pytest.raises(ValueError, match="set_path"):
        Servo(None, SERVO).engage(Mode.CONTROL)
    servo = Servo(None, SERVO, CONTROL)
    with pytest.raises(ValueError, match="set_path"):
        servo.engage(Mode.CONTROL)


def test_without_a_contour_there_is_no_effort_and_then_a_stop() -> None:
    servo = pressing()
    commands = [servo.step(state(tick)) for tick in range(2_200)]
    assert all(command.torque == command.force == 0.0 for command in commands)
    assert servo.stop_reason is StopReason.NO_CONTOUR


def test_it_closes_on_the_surface_and_tells_what_it_does() -> None:
    servo = pressing()
    assert servo.control is not None
    servo.control.send(CONTOUR)
    for tick in range(100):
        command = servo.step(state(tick))
    assert command.torque < -0.01
    sample = servo.control_telemetry()
    assert sample.dtype == CONTROL_DTYPE
    assert int(sample["sequence"][0]) == 99
    assert int(sample["contour"][0]) == 1
    beta = 0.25
    height = 0.075 * math.sin(beta) - 0.0054 * math.cos(beta)
    assert float(sample["gap"][0]) == pytest.approx(height - 0.008, abs=1e-6)
    assert float(sample["contour_age"][0]) == pytest.approx(0.099, abs=1e-5)


def test_a_held_handle_ends_it_softly() -> None:
    servo = pressing()
    assert servo.control is not None
    torques = []
    for tick in range(400):
        servo.control.send(CONTOUR)
        command = servo.step(state(tick, handle=3.0 if tick >= 200 else 0.0))
        torques.append(command.torque)
    assert servo.stop_reason is StopReason.HANDLE_HELD
    assert max(np.abs(np.diff(torques))) <= 0.2 + 1e-6
    assert torques[-1] == 0.0


def test_every_end_of_the_mode_has_a_sentence() -> None:
    for reason in StopReason:
        if 16 < reason < 32:
            assert reason.sentence.endswith(".")
    assert {r.name for r in StopReason if 16 < r < 32} == {
        "NO_CONTOUR", "HANDLE_HELD", "PRESSED_AWAY", "NO_SURFACE", "PRESSED_TOO_HARD", "PATH_LOST",
        "CONTROL_REFUSED",
    }  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [
        {"station": 0.0},
        {"moving_blades": 3},
        {"inertia": -1.0},
        {"presliding": 0.0},
        {"away": math.inf},
        {"handle_zero": math.nan},
        {"law": replace(LAW, axes=3, friction_rate=(1.0,) * 3, effort_limit=(1.0,) * 3)},
        {"law": replace(LAW, force_kp=0.5)},
        {"law": replace(LAW, surface_cutoff_Hz=100.0)},
        {"opening": replace(FLAT, positive=(0.01,))},
        {"opening": replace(FLAT, negative=(-0.01,) * FRICTION_POINTS)},
    ],
)
def test_a_configuration_that_is_none_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"CONTROL needs|finite number|sizes each way"):
        replace(CONTROL, **change)


@pytest.mark.parametrize(
    "change", [{"normal": (0.0, 0.5)}, {"place": math.nan}, {"velocity": (math.inf, 0.0)}]
)
def test_a_contour_that_is_none_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="contour"):
        replace(CONTOUR, **change)


def test_a_path_that_is_none_is_refused() -> None:
    servo = Servo(None, SERVO, CONTROL)
    assert servo.control is not None
    none, odd = ([], [], [], []), ([0.0], [0.0], [math.nan], [0])
    for path in (none, odd, ([0.0], [0.0], [1.0], [0, 1])):
        with pytest.raises(ValueError, match="path"):
            servo.control.set_path(*path)


def test_a_block_shares_configuration_path_and_contours() -> None:
    block = LoopBlock.create(SERVO, control=CONTROL, reference_capacity=10)
    with pytest.raises(ValueError, match="set_path"):
        block.engage(Mode.CONTROL)
    block.set_path(*STILL)
    block.control.send(CONTOUR)
    block.control.send(replace(CONTOUR, place=0.25))
    other = LoopBlock.attach(block.fileno())
    shared = other.pointer.control
    assert shared.has_config == 1
    assert shared.contour.number == 2
    assert shared.contour.place == 0.25
    assert shared.config.station == pytest.approx(0.075)
    assert shared.lock % 2 == 0
    assert len(other.control.read()) == 0
    block.engage(Mode.CONTROL)
    with pytest.raises(ValueError, match="cannot change"):
        block.set_path(*STILL)
    with pytest.raises(ValueError, match="does not fit"):
        LoopBlock.create(SERVO, control=CONTROL, reference_capacity=3).set_path(*STILL)


@settings(max_examples=60)
@given(data=st.data())
def test_no_contour_and_state_give_an_effort_that_is_no_number(data: st.DataObject) -> None:
    wide = st.floats(-1e6, 1e6, width=32)
    servo = pressing()
    assert servo.control is not None
    for tick in range(40):
        if data.draw(st.booleans()):
            angle = data.draw(st.floats(-3.2, 3.2))
            servo.control.send(
                Contour(
                    point=(data.draw(wide), data.draw(wide)),
                    normal=(math.sin(angle), math.cos(angle)),
                    curvature=data.draw(wide),
                    place=data.draw(wide),
                    velocity=(data.draw(wide), data.draw(wide)),
                    turn_rate=data.draw(wide),
                    lift=data.draw(st.booleans()),
                )
            )
        odd = data.draw(st.floats(allow_nan=True, allow_infinity=True, width=32))
        command = servo.step(state(tick, 0.5 + 1e-3 * tick, odd, data.draw(wide)))
        assert math.isfinite(command.torque)
        assert math.isfinite(command.force)
        assert abs(command.torque) <= 0.5
        assert abs(command.force) <= 20.0
