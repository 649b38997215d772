"""A bridge to a motor controller, against a mock with stated delays and the maker's client."""

import asyncio
import math
import sys
from collections import deque
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scissorcal.device import Faults, LockstepLink, Operator, RigSession, VirtualRig
from scissorcal.device.bridge import Bridge, read_board, serve_bridge
from scissorcal.device.moteus import (
    FAULT,
    MODE,
    MODE_FAULT,
    MODE_TIMEOUT,
    POSITION,
    Q_CURRENT,
    TEMPERATURE,
    TORQUE,
    TWO_PI,
    VOLTAGE,
    MoteusController,
    open_moteus,
)
from scissorcal.device.probe.probe import probe
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import (
    Capability,
    Command,
    Config,
    ConfigKey,
    Drive,
    FaultCause,
    FrameDecoder,
    State,
    decode,
    encode,
)
from scissorcal.recipe import builtin_recipe
from scissorcal.verdicts import failed
from tests.firmware.side import SUPPLY_V, TORQUE_PER_A, board_of

TICK_S = 1e-3
STOPPED, POSITION_MODE, BRAKE = 0, 10, 15


class MockClient:
    """The vendor's client around a virtual rig's mechanics; each exchange passes a tick.

    ``late_ticks`` is how late a torque acts, ``answers`` may be set to False: no reply then.
    """

    def __init__(self, rig: VirtualRig, late_ticks: int = 0) -> None:
        self.rig = rig
        self.sent: list[dict[str, Any]] = []
        self.answers = True
        self.mode = STOPPED
        self._waiting: deque[dict[str, Any]] = deque([{"mode": STOPPED}] * late_ticks)

    def make_position(self, **values: Any) -> dict[str, Any]:
        return {"mode": POSITION_MODE, **values}

    def make_brake(self, **values: Any) -> dict[str, Any]:
        return {"mode": BRAKE, **values}

    def make_stop(self, **values: Any) -> dict[str, Any]:
        return {"mode": STOPPED, **values}

    async def execute(self, command: dict[str, Any]) -> SimpleNamespace | None:
        self.sent.append(command)
        if not self.answers:
            await asyncio.sleep(60.0)
        if self.mode not in (MODE_FAULT, MODE_TIMEOUT) or command["mode"] == STOPPED:
            self.mode = command["mode"]
        self._waiting.append(command)
        acts = self._waiting.popleft()
        torque = acts.get("feedforward_torque", 0.0)
        driven, braking = acts["mode"] == POSITION_MODE, acts["mode"] == BRAKE
        measured = self.rig.tick(torque, 0.0, driven, braking)
        return SimpleNamespace(
            values={
                MODE: self.mode,
                POSITION: measured.opening / TWO_PI,
                TORQUE: measured.motor_torque,
                Q_CURRENT: measured.motor_torque / TORQUE_PER_A,
                VOLTAGE: SUPPLY_V,
                TEMPERATURE: 25.0,
                FAULT: 0,
            }
        )


class MockBridge(Bridge):
    """A bridge in lockstep: the device side of a `LockstepLink`, with a clock of ticks."""

    def __init__(self, rig: VirtualRig, late_ticks: int = 0) -> None:
        wanted = Capability.TORQUE_MEASURED
        board = replace(
            board_of(rig.specimen),
            capabilities=int(wanted),
            force_limit=0.0,
            force_slew=0.0,
            advance_min=0.0,
            advance_max=0.0,
            advance_resolution=0.0,
            advance_leap=0.0,
            opening_leap=1.0,  # the person of this test moves the blades at once
        )
        self.client = MockClient(rig, late_ticks)
        controller = MoteusController(self.client, torque_limit=board.torque_limit, reply_s=0.05)
        super().__init__(board, controller, clock=lambda: round(1e6 * rig.time_s))


def link_of(late_ticks: int = 0) -> tuple[LockstepLink, MockBridge]:
    made: list[MockBridge] = []

    def make(rig: VirtualRig, rng: np.random.Generator, faults: Faults | None) -> MockBridge:
        made.append(MockBridge(rig, late_ticks))
        return made[0]

    link = LockstepLink("office-paper", np.random.default_rng(4), device=make)
    return link, made[0]


class PersonAtTheRig:
    """Moves the blades as a probe asks."""

    def __init__(self, rig: VirtualRig) -> None:
        self._joint = rig.joint

    def __call__(self, request: str) -> None:
        joint = self._joint
        if "close the blades by hand" in request:
            joint.place = joint.low
        elif "open the blades by hand" in request:
            joint.place = joint.high
        elif "half open" in request:
            joint.place = 0.5 * (joint.low + joint.high)
        joint.rate = 0.0


@pytest.mark.parametrize("late_ticks", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_the_probe_measures_the_delay_of_a_bridge(late_ticks: int) -> None:
    """The exchange comes first in a tick, so a command acts two ticks after its STATE's tick."""
    link, _ = link_of(late_ticks)
    found = probe(
        RigSession(link, builtin_recipe("paper-80gsm"), Operator(PersonAtTheRig(link.rig)))
    )
    verdicts = {verdict.check: verdict for verdict in found.verdicts}
    assert not failed(found.verdicts)
    assert verdicts["lag"].status == "pass"
    assert found.delay_s is not None
    wanted_s = (2 + late_ticks) * TICK_S
    assert found.delay_s.mean == pytest.approx(wanted_s, abs=1e-3), verdicts["lag"].why


def states_of(bridge: MockBridge, *sent: bytes) -> list[State]:
    """Pass a tick for each of these; the states that come."""
    decoder, states = FrameDecoder(), []
    for data in sent:
        bridge.receive(data)
        bridge.tick()
        for payload in decoder.feed(b"".join(bridge.take())):
            message = decode(payload)
            states += [message] if isinstance(message, State) else []
    return states


STREAM = encode(Config(int(ConfigKey.STREAM), 1, 1.0))
PUSH = encode(Command(1, 0, 0.02, 0.0))
CLEAR = encode(Command(3, 0, 0.0, 0.0))


def test_what_the_controller_is_told() -> None:
    _, bridge = link_of()
    sent = bridge.client.sent
    states_of(bridge, STREAM + encode(Config(int(ConfigKey.BRAKE_AFTER_MS), 2, 25.0)), PUSH, b"")
    told = sent[-1]
    assert math.isnan(told["position"])
    assert told["feedforward_torque"] == pytest.approx(0.02)
    assert (told["kp_scale"], told["kd_scale"], told["ilimit_scale"]) == (0.0, 0.0, 0.0)
    assert told["maximum_torque"] == bridge.client.rig.specimen.motor.torque_limit_Nm
    assert told["watchdog_timeout"] == pytest.approx(0.025), "BRAKE_AFTER_MS is the controller's"
    states = states_of(bridge, *[b""] * 30)
    assert states[-1].cause == FaultCause.WATCHDOG
    assert sent[-1]["mode"] == BRAKE
    states_of(bridge, encode(Command(2, 0, 0.0, 0.0)), b"")
    assert sent[-1]["mode"] == STOPPED


def test_a_controller_that_does_not_answer_is_a_fault_of_the_driver() -> None:
    _, bridge = link_of()
    states_of(bridge, STREAM, PUSH, b"")
    bridge.client.answers = False
    (state,) = states_of(bridge, PUSH)
    assert state.cause == FaultCause.DRIVER
    (state,) = states_of(bridge, CLEAR)
    assert state.cause == FaultCause.DRIVER, "it lasts"
    bridge.client.answers = True
    *_, state = states_of(bridge, b"", CLEAR)
    assert state.cause == FaultCause.NONE


def test_a_controller_that_never_answered_is_not_blamed_on_the_supply() -> None:
    bridge = MockBridge(link_of()[0].rig)
    bridge.client.answers = False
    *_, state = states_of(bridge, STREAM, PUSH)
    assert state.cause == FaultCause.DRIVER


def test_a_fault_of_the_controller_is_ended_by_a_stop() -> None:
    _, bridge = link_of()
    states_of(bridge, STREAM, PUSH, b"")
    bridge.client.mode = MODE_TIMEOUT
    (state,) = states_of(bridge, PUSH)
    assert state.cause == FaultCause.DRIVER
    states_of(bridge, b"")
    assert bridge.client.sent[-1]["mode"] == STOPPED
    *_, state = states_of(bridge, CLEAR, PUSH, PUSH)
    assert state.cause == FaultCause.NONE
    assert bridge.client.mode == POSITION_MODE


def test_a_bridge_is_served_on_a_port_and_leaves_the_motors_free() -> None:
    _, bridge = link_of()
    controller = MoteusController(bridge.client)
    ports: list[str] = []
    board = replace(board_of(bridge.client.rig.specimen), tick_us=5000, opening_leap=1.0)
    served = serve_bridge(board, controller, ports.append, lambda: len(bridge.client.sent) > 5)
    assert served.ticks > 0
    assert ports[0].startswith("/dev/")
    assert bridge.client.sent[-1]["mode"] == STOPPED


BOARD_TOML = """
name = "bridge"
serial = "1"
tick_us = 2000
capabilities = 4
torque_limit = 0.5
opening_min = 0.05
opening_max = 1.0
opening_resolution = 1e-4
handle_radius = 0.06
torque_slew = 500.0
overspeed = 30.0
opening_leap = 0.2
torque_per_A = 0.1
resistance = 0.5
current_limit = 10.0
current_continuous = 4.0
i2t_limit = 50.0
supply_min = 12.0

[controller]
id = 3
"""


def test_a_boards_file_is_read_and_what_is_wrong_with_it_named(tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_text(BOARD_TOML, encoding="utf-8")
    board, options = read_board(path)
    assert (board.tick_us, board.torque_limit, options) == (2000, 0.5, {"id": 3})
    for old, new, words in (
        ("torque_limit = 0.5", "torque_limit = 5.0", "all that the supply can give"),
        ("torque_limit = 0.5", "torque_limit = true", "wrong kind"),
        ("torque_limit = 0.5", "", "torque_limit"),
        ("tick_us = 2000", "tick_us = 20", "250 to 10,000"),
        ("tick_us = 2000", "ticks = 2000", "no constant of a board"),
        ("tick_us = 2000", "tick_us =", "cannot be read"),
    ):
        path.write_text(BOARD_TOML.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_board(path)
    with pytest.raises(InputError, match="no option of a moteus"):
        open_moteus(1.0, {"identifier": 3})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "bridge"', 'name = "a bridge of some length"', "at most 16 ASCII"),
        ('serial = "1"', 'serial = "\u00fc"', "at most 16 ASCII"),
        ("\n[controller]\nid = 3\n", "controller = 3\n", "controller is a table"),
    ],
)
def test_a_boards_file_of_the_wrong_form_is_named(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    assert old in BOARD_TOML
    path = tmp_path / "board.toml"
    path.write_text(BOARD_TOML.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_board(path)


@pytest.mark.parametrize("options", [{"sign": "x"}, {"id": 1.5}, {"reply_s": True}])
def test_an_option_that_is_no_number_is_named(options: dict[str, object]) -> None:
    with pytest.raises(InputError, match="is a number"):
        open_moteus(1.0, options)


def test_an_adapter_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_found() -> None:
        raise RuntimeError("No fdcanusb detected")

    maker = SimpleNamespace(
        QueryResolution=SimpleNamespace, F32=None, get_singleton_transport=none_found
    )
    monkeypatch.setitem(sys.modules, "moteus", maker)
    with pytest.raises(DeviceError, match="No adapter to the bus"):
        open_moteus(1.0, {})


def test_an_adapter_that_is_pulled_is_a_fault_of_the_driver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def gone(command: dict[str, Any]) -> None:
        raise OSError("Input/output error")

    _, bridge = link_of()
    states_of(bridge, STREAM, PUSH, b"")
    monkeypatch.setattr(bridge.client, "execute", gone)
    (state,) = states_of(bridge, PUSH)
    assert state.cause == FaultCause.DRIVER


def test_the_makers_client_takes_what_is_sent() -> None:
    moteus = pytest.importorskip("moteus")
    sent: list[Any] = []

    class Transport:
        async def cycle(self, commands: list[Any]) -> list[Any]:
            sent.extend(commands)
            return []

    client = moteus.Controller(id=1, transport=Transport())
    controller = MoteusController(client, torque_limit=0.5)
    for drive in Drive:
        assert controller.exchange(0.25 if drive is Drive.DRIVE else 0.0, 0.0, drive) is None
    modes = [command.data[2] for command in sent]
    assert modes == [int(moteus.Mode.STOPPED), int(moteus.Mode.POSITION), int(moteus.Mode.BRAKE)]
    registers = moteus.Register
    assert (MODE, POSITION, TORQUE, Q_CURRENT) == (
        registers.MODE, registers.POSITION, registers.TORQUE, registers.Q_CURRENT,
    )  # fmt: skip
    assert (VOLTAGE, TEMPERATURE, FAULT) == (
        registers.VOLTAGE, registers.TEMPERATURE, registers.FAULT,
    )  # fmt: skip
    assert (moteus.Mode.FAULT, moteus.Mode.TIMEOUT) == (MODE_FAULT, MODE_TIMEOUT)
    assert (moteus.Mode.STOPPED, moteus.Mode.POSITION, moteus.Mode.BRAKE) == (
        STOPPED, POSITION_MODE, BRAKE,
    )  # fmt: skip
