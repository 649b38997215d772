"""Small pulses of torque (or of force on the sledge): what moves, which way, and from when on."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.probe.idle import CLEARINGS
from scissorcal.device.probe.talk import (
    RATE_OVER_S,
    RELEASE,
    Answer,
    RunawayError,
    Stage,
    StalledError,
    Talk,
)
from scissorcal.kernel import State, StateFlag

AxisName = Literal["opening", "advance"]

RAMP_S = 0.01
HOLD_S = 0.02
LONG_HOLD_S = 0.08
GAIN_HOLD_S, HELD_SHARE = 0.1, 0.6
"""How long an effort is held for its gain, and its share of the one that moved the blades."""
BEFORE_S = 5e-3
REST_S = 0.02
"""Blades that stay within a step for so long are at rest."""
LONGEST_REST_S = 0.3
GROWTH = 1.4
"""From one pulse to the next: breakaway is known to this factor."""
FIRST_SHARE = 0.04
"""The first pulse, as a share of the largest."""
MOVED_STEPS = 5
MOVED_JITTERS = 8.0
FIRST_CUT, FIRST_RATE = 0.08, 0.15
"""Shares of the largest way and rate at which the first swing each way is cut."""
REACH = 0.5
"""Share of the largest way or rate that a swing shall reach, coasting included."""
CUT_SHARE = 0.4
"""A pulse ends at this share of the largest way or rate; delay and coasting add the rest."""
ATTEMPTS = 3
VARIED = (1.0, 0.88, 1.12, 0.94)
"""Shares of the swings' effort: swings that repeat each other would hide the encoder's steps."""


@dataclass(frozen=True)
class Axis:
    """One axis to push: its largest effort and way, and how far it must go to have moved."""

    name: AxisName
    effort: float
    way: float
    rate: float
    moved: float

    def answer(self, effort: float) -> Answer:
        """The command with this effort on this axis."""
        return Answer(torque=effort) if self.name == "opening" else Answer(force=effort)

    def place(self, state: State) -> float:
        return float(state.opening if self.name == "opening" else state.advance)


@dataclass(frozen=True)
class Cut:
    """Where a pulse ends: at this way or rate of the axis, or after this time."""

    way: float
    rate: float
    hold_s: float


@dataclass(frozen=True)
class Pulse:
    """One pulse: its effort, which way it moved the axis and how far, and where it was heard.

    ``moved`` is 0 where the axis stayed; ``at_effort`` what was commanded when it first moved.
    ``disturbed``: a fault or a gap fell into it.
    """

    effort: float
    moved: float
    at_effort: float
    begin: int
    end: int
    disturbed: bool


@dataclass(frozen=True)
class Stairs:
    """Pulses that grew until the axis moved, each way."""

    pulses: tuple[Pulse, ...]
    pushed: Pulse | None
    """The pulse of positive effort that moved it; None where none did."""
    pulled: Pulse | None
    """The same of negative effort."""


def axis_of(talk: Talk, name: AxisName, jitter: float, step: float) -> Axis:
    """The axis as the bounds of the talk allow to push it; ``jitter`` and ``step`` as seen idle."""
    bounds = talk.bounds
    moved = max(MOVED_STEPS * step, MOVED_JITTERS * jitter)
    if name == "opening":
        return Axis(name, bounds.torque_Nm, bounds.angle_rad, bounds.rate_rad_per_s, moved)
    return Axis(name, bounds.force_N, bounds.way_m, bounds.speed_m_per_s, moved)


def stairs(talk: Talk, axis: Axis, first_sign: int) -> Stairs:
    """Push with growing pulses, by turns each way, until the axis has moved both ways.

    The larger pulses of an axis that moved one way are spared: only the other way goes on growing.
    """
    found: dict[int, Pulse | None] = {1: None, -1: None}
    pulses: list[Pulse] = []
    effort = FIRST_SHARE * axis.effort
    cut = Cut(axis.moved, CUT_SHARE * axis.rate, HOLD_S)
    while True:
        for sign in (first_sign, -first_sign):
            if found[sign] is None:
                pulse = pulse_of(talk, axis, sign * effort, cut)
                pulses.append(pulse)
                found[sign] = pulse if pulse.moved else None
        if effort >= axis.effort or all(found.values()):
            return Stairs(tuple(pulses), found[1], found[-1])
        effort = min(GROWTH * effort, axis.effort)


def make_room(talk: Talk, axis: Axis, effort: float, pulses: int) -> None:
    """Push the same way until the axis is one largest way from where it was, or so many times."""
    start = talk.heard(talk.mark() - 1)[axis.name][0]
    cut = Cut(FIRST_CUT * axis.way, FIRST_RATE * axis.rate, HOLD_S)
    for _ in range(pulses):
        pulse_of(talk, axis, effort, cut)
        if abs(talk.heard(talk.mark() - 1)[axis.name][0] - start) > axis.way:
            return


def swings(talk: Talk, axis: Axis, push: float, pull: float) -> tuple[Pulse, ...]:
    """Move both ways by turns with the efforts ``push`` > 0 > ``pull``, as far as the bounds let.

    These motions tell inertia, friction and delay. How far the axis goes on after a pulse is not
    known beforehand (it may be heavy, or the line slow), so each way begins with a small pulse, and
    the next ones grow or shrink by what the last one reached.
    """
    ways = {1: FIRST_CUT * axis.way, -1: FIRST_CUT * axis.way}
    rates = {1: FIRST_RATE * axis.rate, -1: FIRST_RATE * axis.rate}
    found = []
    for share in VARIED:
        for effort in (push, pull):
            sign = 1 if effort > 0.0 else -1
            cut = Cut(ways[sign], rates[sign], LONG_HOLD_S)
            pulse = pulse_of(talk, axis, share * effort, cut)
            found.append(pulse)
            heard = talk.heard(pulse.begin)[axis.name]
            reached = max(float(np.ptp(heard)) / axis.way, _fastest(talk, heard) / axis.rate)
            grow = min(max(REACH / max(reached, 1e-3), 0.5), 3.0)
            ways[sign] = min(grow * ways[sign], CUT_SHARE * axis.way)
            rates[sign] = min(grow * rates[sign], CUT_SHARE * axis.rate)
    return tuple(found)


def holds(talk: Talk, axis: Axis, push: float, pull: float) -> tuple[Pulse, ...]:
    """Hold an effort each way that moves nothing, for the gain of the measured torque."""
    cut = Cut(axis.moved, CUT_SHARE * axis.rate, GAIN_HOLD_S)
    return tuple(pulse_of(talk, axis, HELD_SHARE * effort, cut) for effort in (push, pull))


def _fastest(talk: Talk, places: NDArray[np.float64]) -> float:
    """The largest rate over a few ticks."""
    span = min(talk.ticks(RATE_OVER_S), len(places) - 1)
    return float(np.abs(places[span:] - places[:-span]).max()) / (span * talk.tick_s)


def pulse_of(talk: Talk, axis: Axis, effort: float, cut: Cut) -> Pulse:
    """Ramp to an effort, hold it until the cut, and let the axis come to rest.

    Repeated where a fault, lost frames or a stall of this computer disturbed it.
    """
    for attempt in range(ATTEMPTS):
        begin = talk.mark()
        try:
            moved, at_effort = talk.play(_pulse(talk, axis, effort, cut))
        except StalledError:
            if attempt == ATTEMPTS - 1:
                raise
            continue
        heard = talk.heard(begin)
        faulty = bool(np.any(heard["flags"] & int(StateFlag.FAULT_LATCHED)))
        gaps = bool(np.any(np.diff(heard["sequence"]) > 3))
        found = Pulse(effort, moved, at_effort, begin, talk.mark(), faulty or gaps)
        if not found.disturbed:
            break
    return found


def _pulse(talk: Talk, axis: Axis, effort: float, cut: Cut) -> Stage[tuple[float, float]]:
    """One pulse; returns how far the axis went and the effort when it first moved."""
    state = yield Answer()
    for _ in range(talk.ticks(BEFORE_S)):
        state = yield Answer(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
    for _ in range(CLEARINGS):
        if not state.flags & StateFlag.FAULT_LATCHED:
            break
        state = yield Answer(clear=True)
    else:
        raise RunawayError(
            f"{talk.name} latched a fault that does not clear: remove its cause (emergency stop, "
            "motor supply, temperature) or restart the device."
        )
    start, place = axis.place(state), axis.place(state)
    ramp, hold = talk.ticks(RAMP_S), talk.ticks(cut.hold_s)
    span = talk.ticks(RATE_OVER_S)
    places = [start] * (span + 1)
    first = 0.0
    for tick in range(ramp + hold):
        asked = effort * min(1.0, (tick + 1) / ramp)
        state = yield axis.answer(asked)
        place = axis.place(state)
        places.append(place)
        rate = abs(place - places[-1 - span]) / (span * talk.tick_s)
        if not first and abs(place - start) >= axis.moved:
            first = asked
        if abs(place - start) >= cut.way or rate >= cut.rate:
            break
        if state.flags & StateFlag.FAULT_LATCHED:
            break
    still = 0
    for _ in range(talk.ticks(LONGEST_REST_S)):
        state = yield Answer()
        still = still + 1 if abs(axis.place(state) - place) < axis.moved else 0
        place = place if still else axis.place(state)
        if still > talk.ticks(REST_S):
            break
    yield RELEASE
    went = axis.place(state) - start
    return (went if abs(went) >= axis.moved or first else 0.0), first


def joined(
    talk: Talk, pulses: tuple[Pulse, ...], *, disturbed: bool = False
) -> list[NDArray[np.void]]:
    """What was heard in each pulse; in those that something disturbed only if asked for."""
    whole = talk.heard()
    return [whole[pulse.begin : pulse.end] for pulse in pulses if disturbed or not pulse.disturbed]
