"""Whatever ends a probe, the last command is zero without ENABLE, also to a device that is mute."""

from dataclasses import replace

import pytest

from scissorcal.device.link import open_link
from scissorcal.device.probe.probe import probe
from scissorcal.device.session import Operator, RigSession
from scissorcal.errors import DeviceError
from scissorcal.kernel import Command, decode
from scissorcal.recipe import builtin_recipe
from tests.strange_device import Faults, Person, StrangeDevice, VirtualPort, serve_on_pty, wire

RECIPE = builtin_recipe("paper-80gsm")
DRIVEN = 50
"""Commands with a torque until the fault comes: pulses and swings have many more."""


class Tapped(VirtualPort):
    """Keeps the commands that went over the wire; a fault comes while they drive the blades."""

    def __init__(self, device: StrangeDevice, fault: str) -> None:
        self.commands: list[Command] = []
        self._fault = fault
        super().__init__(device)

    def exchange(self, command_frame: bytes | None) -> list[bytes]:
        for payload in wire.Splitter().payloads(command_frame or b""):
            message = decode(payload)
            assert isinstance(message, Command)
            self.commands.append(message)
            if sum(command.torque != 0.0 for command in self.commands) == DRIVEN:
                now = {self._fault: self.device.time_s - 1.0}
                self.device.faults = replace(self.device.faults, **now)  # type: ignore[arg-type]
        return super().exchange(command_frame)


def test_a_device_that_falls_mute_in_a_pulse_is_told_to_release() -> None:
    device = StrangeDevice(seed=1)
    line = Tapped(device, "silent_at_s")
    with pytest.raises(DeviceError, match="stopped sending STATE"):
        probe(RigSession(line, RECIPE, Operator(Person(device))))
    *before, first, second, last = line.commands
    assert (before[-1].flags, before[-1].torque != 0.0) == (1, True)
    for command in (first, second, last):
        assert (command.flags, command.torque, command.force) == (0, 0.0, 0.0)
    assert not device._enabled
    assert not device._streaming


def test_a_device_on_a_port_that_falls_mute_is_told_to_release() -> None:
    device = StrangeDevice(Faults(silent_at_s=2.0), seed=1)
    silent = pytest.raises(DeviceError, match="stopped sending STATE")
    with serve_on_pty(device) as port, open_link(port) as link, silent:
        probe(RigSession(link, RECIPE, Operator(Person(device))))
    assert not device._enabled


def test_no_torque_goes_out_after_the_release_of_a_runaway() -> None:
    device = StrangeDevice(seed=1)
    line = Tapped(device, "encoder_fault_at_s")
    with pytest.raises(DeviceError, match="fault of its encoder"):
        probe(RigSession(line, RECIPE, Operator(Person(device))))
    driven = [index for index, command in enumerate(line.commands) if command.torque != 0.0]
    after = line.commands[driven[-1] + 1 :]
    assert len(after) >= 3
    assert all(command.flags == 0 for command in after)
