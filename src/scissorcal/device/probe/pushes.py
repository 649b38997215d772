"""Pushes: a torque, or a force on the carriage, for a time by the device's ticks, rest to rest."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.probe.idle import CLEARINGS
from scissorcal.device.probe.talk import RELEASE, Answer, RunawayError, Stage, Talk
from scissorcal.kernel import State, StateFlag

AxisName = Literal["opening", "advance"]

MOVED_RAD, MOVED_M = 3e-3, 2e-4
"""Real joints yield by 0.1 to 30 mrad before they slide: moved is not slid. 3 mrad are 0.2 mm at a
handle of 60 mm, which a person would call moved; on the carriage as much."""
MOVED_STEPS, MOVED_JITTERS = 3.0, 8.0
"""Fewer steps are two readings and their rounding; 8 sds of jitter come once in 1e15 by chance."""
MOVED_RATE, MOVED_SPEED = 0.3, 0.02
"""rad/s, m/s: a fifth of what a probe may reach, so that what follows can still grow."""
REST_RAD, REST_M = 1e-4, 1e-5
REST_S, SETTLED_S, LONGEST_REST_S = 0.03, 0.1, 3.0
"""At rest: within REST_RAD, or what the encoder shows at rest, for REST_S (3 mrad/s is slower than
anything that a probe measures). Blades that went farther than RINGS such lengths may swing on what
yields, as slowly as 3 Hz, and stand at the turn of a swing: SETTLED_S shows that."""
RINGS = 5.0
BEFORE_S = 6e-3
ATTEMPTS = 6
"""A push during which the host is away for longer than the watchdog is braked, and repeated. Where
it is away for 17 % of the time, six in a row of 45 ms are braked in 1 of 200."""


@dataclass(frozen=True)
class Axis:
    """One axis to push: its bounds, how far it must go to have moved, and what is rest.

    ``moved`` and ``rest`` are lengths (rad or m) that hold for joints and their encoder's step and
    jitter; ``rate_moved`` is a rate that only a free axis has.
    """

    name: AxisName
    effort: float
    way: float
    rate: float
    moved: float
    rate_moved: float
    rest: float
    seen: float

    def until(self, way: float, rate: float | None = None) -> "Axis":
        """The axis whose push ends at ``way`` and ``rate``, not where it counts as moved."""
        return replace(self, moved=way, rate_moved=rate or self.rate_moved)

    def answer(self, effort: float) -> Answer:
        """The command with this effort on this axis."""
        return Answer(torque=effort) if self.name == "opening" else Answer(force=effort)

    def place(self, state: State) -> float:
        return float(state.opening if self.name == "opening" else state.advance)


@dataclass(frozen=True)
class Pushed:
    """One push as it went.

    ``effort`` for ``seconds`` about ``hold``; ``went`` is the place farthest from the start less
    the start, ``rate`` the largest seen. Heard from ``begin`` to ``end``; ``disturbed`` where a
    fault or lost frames fell into it; ``rested`` is False where the axis did not come to rest.
    """

    effort: float
    hold: float
    seconds: float
    went: float
    rate: float
    begin: int
    end: int
    disturbed: bool
    rested: bool

    def moved(self, axis: Axis) -> bool:
        """Whether the axis has moved, and not only its reading."""
        fast = self.rate >= axis.rate_moved and abs(self.went) >= axis.seen
        return abs(self.went) >= axis.moved or fast


def axis_of(talk: Talk, name: AxisName, jitter: float, step: float) -> Axis:
    """The axis as the bounds of the talk allow to push it; ``jitter`` and ``step`` as seen idle."""
    bounds = talk.bounds
    shown = max(MOVED_STEPS * step, MOVED_JITTERS * jitter)
    still = max(1.5 * step, 6.0 * jitter)
    if name == "opening":
        moved, rest = max(shown, MOVED_RAD), max(still, REST_RAD)
        return Axis(
            name, bounds.torque_Nm, bounds.angle_rad, bounds.rate_rad_per_s, moved, MOVED_RATE,
            rest, shown,
        )  # fmt: skip
    moved, rest = max(shown, MOVED_M), max(still, REST_M)
    return Axis(
        name, bounds.force_N, bounds.way_m, bounds.speed_m_per_s, moved, MOVED_SPEED, rest, shown
    )


def push(
    talk: Talk,
    axis: Axis,
    effort: float,
    seconds: float,
    hold: float = 0.0,
) -> Pushed:
    """Push with ``hold + effort`` for ``seconds``, at most until the axis has moved.

    `Axis.until` gives it another end. ``hold`` acts before and after. Repeated where a fault, lost
    frames or a stall of this computer disturbed it.
    """
    for _ in range(ATTEMPTS):
        begin = talk.mark()
        start, rested = talk.play(_pushed(talk, axis, effort, seconds, hold))
        heard = talk.heard(begin)
        faulty = bool(np.any(heard["flags"] & int(StateFlag.FAULT_LATCHED)))
        gaps = bool(np.any(np.diff(heard["sequence"]) > 1))
        first = int(np.searchsorted(heard["sequence"], start))
        places = heard[axis.name][first:]
        off = places - float(np.mean(places[: max(1, talk.ticks(BEFORE_S) // 2)]))
        went = float(off[int(np.argmax(np.abs(off)))])
        pushed = Pushed(
            effort, hold, seconds, went, fastest(talk, places), begin + first, talk.mark(),
            faulty or gaps, rested,
        )  # fmt: skip
        if not pushed.disturbed:
            break
    return pushed


def fastest(talk: Talk, places: NDArray[np.float64]) -> float:
    """The largest rate over a few ticks."""
    span = min(max(2, talk.ticks(talk.rate_over_s)), len(places) - 1)
    if span < 1:
        return 0.0
    return float(np.abs(places[span:] - places[:-span]).max()) / (span * talk.tick_s)


def _pushed(
    talk: Talk, axis: Axis, effort: float, seconds: float, hold: float
) -> Stage[tuple[int, bool]]:
    """One push; returns the sequence at which its rest began, and whether it came to rest again."""
    state = yield RELEASE if hold == 0.0 else axis.answer(hold)
    for _ in range(CLEARINGS):
        if not state.flags & StateFlag.FAULT_LATCHED:
            break
        state = yield axis.answer(hold)._replace(clear=True)
    else:
        raise RunawayError(
            f"{talk.name} latched a fault that does not clear: remove its cause (emergency stop, "
            "motor supply, temperature) or restart the device."
        )
    start_sequence, start = talk.sequence, axis.place(state)
    before = talk.ticks(BEFORE_S)
    while talk.sequence - start_sequence < before:
        state = yield axis.answer(hold)
    begun, lasting = talk.sequence, talk.ticks(seconds)
    places = [axis.place(state)]
    span = max(2, talk.ticks(talk.rate_over_s))
    while talk.sequence - begun < lasting:
        state = yield axis.answer(hold + effort)
        places.append(axis.place(state))
        rate = abs(places[-1] - places[max(0, len(places) - 1 - span)]) / (span * talk.tick_s)
        if abs(places[-1] - start) >= axis.moved or rate >= axis.rate_moved:
            break
        if state.flags & StateFlag.FAULT_LATCHED:
            break
    rested = yield from _rests(talk, axis, hold, start, state)
    return start_sequence, rested


def _rests(talk: Talk, axis: Axis, hold: float, start: float, state: State) -> Stage[bool]:
    """Wait until the axis rests; False where it does not within LONGEST_REST_S."""
    ended = since = talk.sequence
    low = high = None
    needed = REST_S
    while talk.sequence - ended < talk.ticks(LONGEST_REST_S):
        answer = RELEASE if hold == 0.0 else axis.answer(hold)
        state = yield answer._replace(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
        place = axis.place(state)
        low = place if low is None else min(low, place)
        high = place if high is None else max(high, place)
        if high - low > axis.rest:
            low = high = place
            since = talk.sequence
        if abs(place - start) > RINGS * axis.rest:
            needed = SETTLED_S
        if talk.sequence - since >= talk.ticks(needed) + talk.late_ticks:
            return True
    return False
