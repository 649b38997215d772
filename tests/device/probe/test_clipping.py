"""A torque above the limit for one tick: told on heavy blades, and never by an accident."""

from typing import Any

import pytest

from scissorcal.device.probe.clipping import clipping
from scissorcal.device.probe.probe import ProbeRefusedError, bounds_of, probe
from scissorcal.device.probe.talk import StalledError, Talk
from scissorcal.device.session import Operator, RigSession
from scissorcal.errors import DeviceError
from scissorcal.kernel import Command, ConfigKey, decode
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import Estimate
from scissorcal.verdicts import Verdict
from tests.strange_device import Faults, Person, StrangeDevice, VirtualPort, wire

RECIPE = builtin_recipe("paper-80gsm")
INERTIA = 3e-3
LATE_S = (0.0, 0.0005, 0.001, 0.0015)
"""Each way: 0 to 3 ms together; what falls between two ticks waits for the next."""


def heavy(late_s: float = 0.0, *, clips: bool = True) -> Faults:
    """Blades that one tick at the limit cannot bring above the bounds."""
    return Faults(inertia=INERTIA, clips=clips, delay_to_host_s=late_s, delay_to_device_s=late_s)


def clipping_of(link: VirtualPort) -> Verdict:
    """The last stage of a probe, after the ones before found the inertia to 5 %."""
    with Talk(link, bounds_of(RECIPE, link.identity), RECIPE.rig.motor_sign) as talk:
        inertia = Estimate(INERTIA, 0.05 * INERTIA)
        return clipping(talk, inertia, RECIPE.rig.line.brake_after_ms)


@pytest.mark.parametrize("late_s", LATE_S)
def test_a_heavy_device_that_clips_passes(late_s: float) -> None:
    device = StrangeDevice(heavy(late_s), seed=1)
    assert clipping_of(VirtualPort(device)).status == "pass"
    assert device.largest_rate < RECIPE.rig.probe.largest_rate_rad_per_s


class Holding(VirtualPort):
    """Notes the hold_ticks of every COMMAND."""

    def __init__(self, device: StrangeDevice) -> None:
        self.holds: list[int] = []
        super().__init__(device)

    def exchange(self, command_frame: bytes | None) -> list[bytes]:
        payload = wire.payload_of(command_frame[:-1]) if command_frame else None
        if payload and payload[0] == wire.COMMAND:
            self.holds.append(payload[1])
        return super().exchange(command_frame)


@pytest.mark.parametrize("version", [1, 2])
def test_a_device_of_version_2_is_told_to_strike_for_one_tick(version: int) -> None:
    line = Holding(StrangeDevice(heavy(), seed=1, version=version))
    assert clipping_of(line).status == "pass"
    assert line.holds.count(1) == (version == 2)
    assert set(line.holds) <= {0, 1}


@pytest.mark.parametrize("late_s", LATE_S)
def test_a_heavy_device_that_does_not_clip_fails(late_s: float) -> None:
    device = StrangeDevice(heavy(late_s, clips=False), seed=1)
    verdict = clipping_of(VirtualPort(device))
    assert verdict.status == "fail"
    assert "must clip what exceeds its limit" in verdict.why
    assert device.largest_rate < RECIPE.rig.probe.largest_rate_rad_per_s


def test_a_probe_refuses_a_device_that_does_not_clip() -> None:
    device = StrangeDevice(heavy(clips=False), seed=1)
    with pytest.raises(ProbeRefusedError, match="must clip what exceeds its limit"):
        probe(RigSession(VirtualPort(device), RECIPE, Operator(Person(device))))
    assert device.largest_rate < RECIPE.rig.probe.largest_rate_rad_per_s


class Losing(VirtualPort):
    """A line on which the first ``lost`` strikes do not arrive, or on which all break it."""

    def __init__(self, device: StrangeDevice, lost: int, *, breaks: bool = False) -> None:
        self.lost, self.breaks, self.strikes = lost, breaks, 0
        self.brakes_set: list[float] = []
        super().__init__(device)

    def exchange(self, command_frame: bytes | None) -> list[bytes]:
        if command_frame is not None:
            command = decode(command_frame_payload(command_frame))
            if isinstance(command, Command) and abs(command.torque) > self.identity.torque_limit:
                self.strikes += 1
                if self.breaks:
                    raise DeviceError("The cable hiccups.")
                command_frame = None if self.strikes <= self.lost else command_frame
        return super().exchange(command_frame)

    def configure(self, key: int, value: float) -> float:
        if key == ConfigKey.BRAKE_AFTER_MS:
            self.brakes_set.append(value)
        return super().configure(key, value)


def command_frame_payload(frame: bytes) -> bytes:
    (payload,) = wire.Splitter().payloads(frame)
    return payload


@pytest.mark.parametrize("lost", [1, 2])
def test_a_strike_that_was_lost_is_repeated(lost: int) -> None:
    device = StrangeDevice(heavy(), seed=1)
    line = Losing(device, lost)
    assert clipping_of(line).status == "pass"
    assert line.strikes == lost + 1
    assert line.brakes_set[-2:] == [1.0, RECIPE.rig.line.brake_after_ms]


@pytest.mark.parametrize("clips", [True, False])
def test_strikes_that_never_arrive_refuse_nothing(clips: bool) -> None:
    line = Losing(StrangeDevice(heavy(clips=clips), seed=1), lost=9)
    verdict = clipping_of(line)
    assert verdict.status == "not_evaluated"
    assert "in 3 attempts" in verdict.why
    assert line.strikes == 3


def test_the_watchdog_is_restored_when_the_strike_fails() -> None:
    device = StrangeDevice(heavy(), seed=1)
    line = Losing(device, 0, breaks=True)
    with pytest.raises(DeviceError, match="hiccups"):
        clipping_of(line)
    assert line.brakes_set[-2:] == [1.0, RECIPE.rig.line.brake_after_ms]
    assert not device._enabled


def test_a_stall_during_the_strike_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    stalls = iter([True, True, False])
    play = Talk.play

    def stalled(talk: Talk, stage: Any, **how: Any) -> Any:
        if stage.gi_code.co_name == "_struck" and next(stalls):
            raise StalledError("late")
        return play(talk, stage, **how)

    monkeypatch.setattr(Talk, "play", stalled)
    assert clipping_of(VirtualPort(StrangeDevice(heavy(), seed=1))).status == "pass"
