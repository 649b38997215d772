"""The whole image of the STM32F405, from reset, on a model of its registers, motor and blades."""

import zlib
from collections.abc import Sequence
from typing import Any

import pytest

from scissorcal.kernel import (
    IMAGE_FORMAT,
    Command,
    CommandFlag,
    Config,
    ConfigEcho,
    ConfigKey,
    FaultCause,
    Hello,
    Identity,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    Message,
    State,
    StateFlag,
    encode,
    model_image,
)

from .elf import Image
from .test_rendering import FELT, PAPER

model = pytest.importorskip(
    "tests.firmware.stm32f405", reason="needs unicorn, of the extra 'dev'", exc_type=ImportError
)

STACK_BYTES = 1024
HOME_TICKS = 4000
CHUNK_BYTES = 192
"""Most that a LOAD_CHUNK holds."""
TORQUE_N_m = 0.12


def states_of(messages: Sequence[object]) -> list[State]:
    return [message for message in messages if isinstance(message, State)]


@pytest.fixture
def device(stm32f405: Image) -> Any:
    """A device that streams."""
    device = model.Device().power_on(stm32f405)
    device.tick(encode(Config(int(ConfigKey.STREAM), 1, 1.0)))
    return device


def homed(device: Any) -> State:
    device.tick(encode(Config(int(ConfigKey.HOME), 2, 1.0)))
    for _ in range(HOME_TICKS):
        for state in states_of(device.tick()):
            if not state.flags & StateFlag.NOT_HOMED:
                return state
    raise AssertionError("home was not found")


def test_power_on_releases_the_motor_and_starts_the_watchdog(stm32f405: Image) -> None:
    device = model.Device().power_on(stm32f405)
    assert device.drive is None
    assert device.watchdog[0] == model.RUNNING
    device.tick()
    assert device.watchdog[-1] == model.RELOAD
    assert device.drive is None


def test_it_introduces_itself_and_streams_what_its_sensors_give(stm32f405: Image) -> None:
    device = model.Device().power_on(stm32f405)
    sent = device.tick(encode(Hello(7))) + device.tick()
    (identity,) = [message for message in sent if isinstance(message, Identity)]
    assert (identity.name, identity.nonce_echo, identity.tick_us) == ("stm32f405", 7, 1000)
    sent = device.tick(encode(Config(int(ConfigKey.STREAM), 8, 1.0)))
    assert [type(message) for message in sent] == [ConfigEcho, State]
    device.opening += 0.1
    (state,) = states_of(device.tick())
    counts = int(0.1 / model.RAD_PER_COUNT)
    assert state.opening == pytest.approx(counts * model.RAD_PER_COUNT, abs=model.RAD_PER_COUNT)
    assert state.device_us == 4000
    assert abs(state.handle_force) < 0.1
    assert state.flags == StateFlag.NOT_HOMED


def test_frames_arrive_whole_where_the_ring_wraps(device: Any) -> None:
    answered = 0
    for nonce in range(200):
        sent = device.tick(encode(Config(int(ConfigKey.STREAM), nonce, 1.0)))
        answered += sum(isinstance(m, ConfigEcho) and m.nonce == nonce for m in sent)
    assert answered == 200


def test_it_homes_at_the_stop_and_obeys_commands(device: Any) -> None:
    state = homed(device)
    assert state.opening == pytest.approx(1.05, abs=2 * model.RAD_PER_COUNT)
    assert device.opening == model.STOPS_rad[1]
    held = []
    for _ in range(50):  # the stop holds the blades: current alone shows the torque
        command = Command(int(CommandFlag.ENABLE), 0, TORQUE_N_m, 0.0)
        held += states_of(device.tick(encode(command)))
    assert held[-1].flags & StateFlag.OPENING_AT_STOP
    # beyond the stop nothing pushes; away from it the command acts
    assert device.current == pytest.approx(0.0, abs=0.01)
    command = Command(int(CommandFlag.ENABLE), 0, -TORQUE_N_m, 0.0)
    for tick in range(60):  # a hand closes them a little and holds them there
        device.opening, device.rate = 1.05 - 0.01 * min(tick, 20), 0.0
        held += states_of(device.tick(encode(command)))
    assert device.current == pytest.approx(-TORQUE_N_m / model.TORQUE_PER_A, rel=0.03)
    assert held[-1].motor_torque == pytest.approx(-TORQUE_N_m, rel=0.03)
    for _ in range(12):  # longer than BRAKE_AFTER_MS: both inputs high short the winding
        (state,) = states_of(device.tick())
    assert (state.cause, device.drive) == (FaultCause.WATCHDOG, 0.0)


def test_a_broken_stop_line_and_a_faulty_bridge_brake(device: Any) -> None:
    homed(device)
    clear = Command(int(CommandFlag.ENABLE | CommandFlag.CLEAR_FAULT), 0, 0.0, 0.0)
    for name, cause in (
        ("stop_button", FaultCause.STOP_BUTTON),
        ("bridge_fault", FaultCause.DRIVER),
    ):
        (state,) = states_of(device.tick(encode(clear)))
        assert (state.cause, device.drive) == (FaultCause.NONE, 0.0)
        assert state.flags & StateFlag.MOTOR_ENABLED
        setattr(device, name, True)
        (state,) = states_of(device.tick())
        assert (state.cause, device.drive) == (cause, 0.0)
        setattr(device, name, False)


def test_a_long_reply_delays_no_state(device: Any) -> None:
    sent = [device.tick(encode(Hello(nonce)) if nonce < 5 else b"") for nonce in range(20)]
    assert sum(isinstance(message, Identity) for tick in sent for message in tick) == 5
    assert all(len(states_of(tick)) <= 1 for tick in sent)
    assert all(len(states_of(tick)) == 1 for tick in sent[-10:])


def test_the_stack_of_the_loop_stays_small_while_it_renders(device: Any) -> None:
    image = model_image(PAPER, FELT)
    homed(device)
    device.processor.paint_stack()
    parts: list[Message] = [LoadBegin(IMAGE_FORMAT, 0, len(image), zlib.crc32(image))]
    for offset in range(0, len(image), CHUNK_BYTES):
        piece = image[offset : offset + CHUNK_BYTES]
        parts.append(LoadChunk(len(piece), 0, offset, piece))
    for message in (*parts, LoadCommit(0), Config(int(ConfigKey.RENDER), 1, 1.0)):
        sent = device.tick(encode(message)) + device.tick()
        (echo,) = [reply for reply in sent if isinstance(reply, LoadEcho | ConfigEcho)]
        assert echo.status == 0
    for tick in range(600):  # a hand closes the blades into the sheet
        device.opening, device.rate = 1.05 - 1.5e-3 * tick, 0.0
        states = states_of(device.tick(encode(Command(int(CommandFlag.ENABLE), 0, 0.0, 0.0))))
    assert states[0].flags & StateFlag.RENDERING
    assert device.current != 0.0
    stack = device.processor.stack_bytes()
    print(f"{stack} bytes of stack for the board's loop")
    assert 400 < stack <= STACK_BYTES
