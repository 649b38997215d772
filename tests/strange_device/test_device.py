"""The strange device keeps the protocol, and scissorcal drives it when nothing is wrong with it."""

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import Reference, open_motion
from scissorcal.kernel import ServoConfig, StopReason

from . import FAULTS, StrangeDevice, VirtualPort, wire
from .mechanics import Hand

GOLDEN = Path(__file__).parents[1] / "golden" / "wire.json"


def test_its_codec_passes_the_vectors_of_the_protocol() -> None:
    vectors = json.loads(GOLDEN.read_text(encoding="utf-8"))
    for message in vectors["messages"]:
        payload = bytes.fromhex(message["payload"])
        assert wire.frame(payload) == bytes.fromhex(message["frame"])
    for stream in vectors["streams"]:
        splitter = wire.Splitter()
        found = splitter.payloads(bytes.fromhex(stream["bytes"]))
        assert [payload.hex() for payload in found] == stream["payloads"]
        assert splitter.garbled == stream["garbled"]


def config(device_tick_us: int = 1000) -> ServoConfig:
    return ServoConfig(
        torque_limit=0.4,
        torque_slew=100.0,
        force_limit=20.0,
        force_slew=2000.0,
        opening_kp=4.0,
        opening_kd=0.05,
        opening_ki=10.0,
        advance_kp=2000.0,
        advance_kd=40.0,
        tick_us=device_tick_us,
    )


def swing(tick_s: float, seconds: float = 2.0) -> Reference:
    time_s = np.arange(round(seconds / tick_s)) * tick_s
    opening = 0.5 + 0.15 * np.cos(2 * np.pi * time_s)
    rate = -0.15 * 2 * np.pi * np.sin(2 * np.pi * time_s)
    stroke = np.zeros(len(time_s), dtype=np.int32)
    return Reference(opening, rate, np.full(len(time_s), -0.02), stroke)


@pytest.mark.parametrize("name", ["none", "500 Hz", "4 kHz", "motor and encoder reversed"])
def test_the_servo_follows_a_path_on_a_device_that_works(name: str) -> None:
    device = StrangeDevice(FAULTS[name], seed=3)
    link = VirtualPort(device)
    with open_motion(link, config(link.identity.tick_us)) as motion:
        samples = np.concatenate(list(motion.track(swing(motion.tick_s))))
        report = motion.report()
    tracked = samples[samples["stroke"] == 0]
    wanted = swing(link.identity.tick_us * 1e-6).opening[: len(tracked)]
    assert float(np.max(np.abs(tracked["opening"] - wanted))) < 0.02
    assert report.stop_reason is StopReason.NONE
    assert device.largest_torque < 0.4


def test_the_hand_moves_the_handles_while_the_motors_are_off() -> None:
    device = StrangeDevice(seed=4)
    with open_motion(VirtualPort(device), config()) as motion:
        device.grasp(Hand())
        samples = np.concatenate(list(motion.idle(8.0)))
    assert float(np.ptp(samples["opening"])) > 0.4
    closing = np.gradient(samples["opening"]) < -1e-4
    assert float(np.mean(samples["handle_force"][closing])) > 0.1


def test_the_device_brakes_without_commands_and_clears_on_request() -> None:
    device = StrangeDevice(seed=5)
    link = VirtualPort(device)
    link.configure(wire.STREAM, 1.0)
    device.tick(wire.frame(struct.pack("<BBHIff", wire.COMMAND, 0, wire.ENABLE, 0, 0.0, 0.0)))
    flags = [struct.unpack_from("<H", link.exchange(None)[0], 2)[0] for _ in range(20)]
    assert flags[5] & wire.MOTOR_ENABLED
    assert flags[-1] & wire.FAULT_LATCHED
    assert flags[-1] & wire.COMMANDS_LOST
    clear = struct.pack("<BBHIff", wire.COMMAND, 0, wire.ENABLE | wire.CLEAR_FAULT, 0, 0.0, 0.0)
    cleared = struct.unpack_from("<H", link.exchange(wire.frame(clear))[0], 2)[0]
    assert not cleared & (wire.FAULT_LATCHED | wire.COMMANDS_LOST)


def test_a_reversed_motor_turns_the_other_way() -> None:
    device = StrangeDevice(FAULTS["motor reversed"], seed=6)
    link = VirtualPort(device)
    link.configure(wire.STREAM, 1.0)
    push = wire.frame(struct.pack("<BBHIff", wire.COMMAND, 0, wire.ENABLE, 0, 0.05, 0.0))
    first = struct.unpack_from("<f", link.exchange(push)[0], 12)[0]
    for _ in range(60):
        (payload,) = link.exchange(push)
    last, measured = struct.unpack_from("<f", payload, 12)[0], struct.unpack_from("<f", payload, 20)
    assert last < first - 0.01
    assert math.isclose(measured[0], 0.05, abs_tol=0.01)
