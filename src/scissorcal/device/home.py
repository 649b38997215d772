"""Have a device find the zero of its encoders: asked for, never by itself."""

import math
from contextlib import suppress
from dataclasses import dataclass

from scissorcal.device.faults import fault_sentence
from scissorcal.device.link import Link
from scissorcal.device.probe.talk import RELEASE, Bounds, Stage, Talk
from scissorcal.device.session import Operator, is_simulator, refuse_nobody
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    HOME_CAUSE,
    Capability,
    ConfigKey,
    HomeResult,
    Identity,
    State,
    StateFlag,
)

LONGEST_S = 60.0
"""A device ends its search by itself; what takes longer is stopped."""
BEGINS_S = 0.5
"""A device that states no HOMING so long after HOME = 1 has found its zero, or does not look."""
CLEARINGS = 100
REQUEST = (
    "The device will look for the zero of its encoders: the blades move by themselves, slowly, "
    "until they meet their stop{carriage}. Clear the space between the blades and let go of the "
    "handles"
)
CARRIAGE = ", and the carriage may do the same"
RANGE_RAD = 0.05
"""Openings may lie so far beyond the stops that the device states (docs/protocol.md)."""
WHY_GAVE_UP = {
    HOME_CAUSE + HomeResult.STOPPED: "it was told to stop, or heard nothing of this computer for "
    "5 s. Check the cable, and that no other program uses the port",
    HOME_CAUSE + HomeResult.TIMED_OUT: "the blades moved, but did not meet it in time. Check its "
    "home switch where it has one, and that home lies the way they moved",
    HOME_CAUSE + HomeResult.JAMMED: "its motor did not move the blades. Check that nothing blocks "
    "them, that the motor has its supply, and that its torque for homing exceeds friction",
    HOME_CAUSE + HomeResult.FAULT: "a fault ended the search. Look for what the device was stopped "
    "by",
}
"""By the ``cause`` of a STATE after a search without a zero; other devices state none."""
GAVE_UP = (
    "Check that nothing blocks the blades on their way to the stop, that the motor turns them, and "
    "its home switch where it has one"
)


@dataclass(frozen=True)
class Homed:
    """How a device found its zero: seconds, the opening (rad) after it, and whether it had one."""

    seconds: float
    opening_rad: float
    was_homed: bool


def home(link: Link, operator: Operator | None = None) -> Homed:
    """Set HOME = 1 and follow the search until the device states that it knows its zero.

    The person is asked before anything moves; a simulator clears its blades itself. The search is
    stopped, and the motors are off, where this ends in another way. Raises DeviceError where the
    device does not home, has a fault, ends without a zero, or states one that does not lie between
    its stops; InputError where a person is needed and nobody can be asked.
    """
    operator = operator or Operator()
    identity = link.identity
    if not identity.capabilities & Capability.HOMES or identity.protocol_version < 2:
        raise DeviceError(
            f"{identity.name} (protocol version {identity.protocol_version}) does not look for its "
            "zero by command, as it states: nothing is to be done, or home it as its manual says."
        )
    refuse_nobody(identity, operator.confirm, "Homing must ask a person to clear the blades first")
    if is_simulator(identity):
        link.configure(ConfigKey.MATERIAL, 0.0)
    elif operator.confirm is not None:
        moves = identity.capabilities & Capability.ADVANCE_MOTOR
        operator.confirm(REQUEST.format(carriage=CARRIAGE if moves else "") + ".")
    with Talk(link, Bounds(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)) as talk:
        first = talk.play(_cleared())
        if first.flags & StateFlag.FAULT_LATCHED:
            raise DeviceError(f"The device was not homed. {_why_fault(first)}")
        begun = talk.sequence
        try:
            link.configure(ConfigKey.HOME, 1.0)
            operator.progress(0.0, "the device looks for its zero")
            last = talk.play(_search(talk))
        finally:
            with suppress(DeviceError):
                link.configure(ConfigKey.HOME, 0.0)
        seconds = (talk.sequence - begun) * talk.tick_s
    operator.progress(1.0, "done")
    _check(last, identity, seconds)
    return Homed(seconds, last.opening, not first.flags & StateFlag.NOT_HOMED)


def _cleared() -> Stage[State]:
    """Clear a fault from before; the last state."""
    state = yield RELEASE
    for _ in range(CLEARINGS):
        if not state.flags & StateFlag.FAULT_LATCHED:
            break
        state = yield RELEASE._replace(clear=True)
    return state


def _search(talk: Talk) -> Stage[State]:
    """Follow the search to its end; the last state."""
    seen = False
    for tick in range(talk.ticks(LONGEST_S)):
        state = yield RELEASE
        looks = bool(state.flags & StateFlag.HOMING)
        seen = seen or looks
        ended = seen or tick >= talk.ticks(BEGINS_S)
        if state.flags & StateFlag.FAULT_LATCHED or (ended and not looks):
            break
    return state


def _check(last: State, identity: Identity, seconds: float) -> None:
    """Raise DeviceError unless the device knows its zero, and one that fits its stops."""
    if last.flags & StateFlag.FAULT_LATCHED:
        raise DeviceError(f"The device stopped looking for its zero. {_why_fault(last)}")
    if last.flags & StateFlag.HOMING:
        raise DeviceError(
            f"The device still looked for its zero after {LONGEST_S:g} s, and was stopped. Check "
            "that the blades can reach their stop, and its home switch where it has one."
        )
    if last.flags & StateFlag.NOT_HOMED:
        why = WHY_GAVE_UP.get(last.cause)
        raise DeviceError(
            f"The device gave up after {seconds:.1f} s without finding its zero"
            f"{f': {why}' if why else f'. {GAVE_UP}'}; then run 'scissorcal device home' again."
        )
    low, high = identity.opening_min - RANGE_RAD, identity.opening_max + RANGE_RAD
    if not low <= last.opening <= high:
        raise DeviceError(
            "The device found a zero that cannot be right: the opening is "
            f"{math.degrees(last.opening):.3g} degrees, and its stops are at "
            f"{math.degrees(identity.opening_min):.3g} and "
            f"{math.degrees(identity.opening_max):.3g} degrees. Look for what stopped the blades "
            "on the way, and home again."
        )


def _why_fault(state: State) -> str:
    stated = "It has latched a fault and states no cause: switch it off and on, and try again."
    return fault_sentence(state.cause) or stated
