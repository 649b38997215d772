"""A hand moves the blades from stop to stop, motors off: what the encoder says of it.

A person clears the blades anyway. That the encoder is alive, which way it counts, its scale and its
zero show without any torque, so that a later push in the wrong direction accuses the motor alone.
"""

import math
from typing import NamedTuple

import numpy as np

from scissorcal.device.probe.talk import RELEASE, SENSORS, Stage, Talk
from scissorcal.device.session import Confirm
from scissorcal.kernel import ConfigKey, Identity
from scissorcal.verdicts import Check, Verdict

CLOSE = (
    "Take everything out from between the blades. The motors are off: close the blades by hand to "
    "their stop, hold them there, and confirm."
)
OPEN = "Now open the blades by hand to their stop, hold them there, and confirm."
AGAIN = "The reading of the opening {what}. Once more, with nothing between the blades: "
STOOD = (
    "The blades stand at a stop. Leave them half open once more; where they fall back by "
    "themselves, let them lie there and keep clear. "
)
LISTEN_S = 0.1
DEAD_STEPS = 5.0
"""A hand that reached both stops moved the blades by a hundred steps of any encoder."""
AGREE_SHARE = 0.05
"""Two passes of a person who pressed on both stops agree so closely."""
FELL_RAD = 0.05
"""As near to a stop as its place is known (OPENING_ZERO)."""
HAND_RATE, HAND_S = 0.5, 3.0
LEFT_HALF_OPEN = Check("probe.sensors left half open", f"{SENSORS}: distance from a stop, rad")
COUNT_SCALE = Check(
    "probe.sensors count scale", f"{SENSORS}: range counted over range stated, less 1", at_most=0.10
)
"""Stops of rubber give by a degree or two of 50; a wrong count or gear is 50 % and more."""
OPENING_ZERO = Check(
    "probe.sensors opening zero", f"{SENSORS}: both stops by hand less stated, rad", at_most=0.05
)
"""Both stops off by so much the same way: a zero that is wrong by more than a degree or two of
give. At an edge of 60 mm it is 1.5 mm at the tip."""


class HandPass(NamedTuple):
    """Openings (rad) at the closed and the open stop, as two passes showed them if one was odd."""

    closed: tuple[float, ...]
    opened: tuple[float, ...]
    step: float

    @property
    def ranges(self) -> tuple[float, ...]:
        """The way from closed to open of each pass."""
        return tuple(b - a for a, b in zip(self.closed, self.opened, strict=True))

    @property
    def alive(self) -> bool:
        """Whether the encoder has been seen to move."""
        return any(abs(way) >= DEAD_STEPS * self.step for way in self.ranges)


def hand_pass(talk: Talk, confirm: Confirm) -> HandPass:
    """Ask a person to move the blades to both stops; twice where the first pass is odd."""
    identity = talk.identity
    step = identity.opening_resolution
    closed, opened = [], []
    before = ""
    for _ in range(2):
        closed.append(_held(talk, confirm, before + CLOSE))
        opened.append(_held(talk, confirm, OPEN))
        found = HandPass(tuple(closed), tuple(opened), step)
        if _is_right(found, identity):
            break
        before = AGAIN.format(what=_what(found, identity))
    return found


def let_go(talk: Talk, confirm: Confirm, request: str) -> None:
    """Ask a person to leave the blades half open and let go; twice where they stand at a stop."""
    if stop_near(_held(talk, confirm, request), talk.identity):
        _held(talk, confirm, STOOD + request)


def stop_near(place: float, identity: Identity) -> int:
    """1 where the blades are as near to their closed stop as it is known, -1 the open, else 0."""
    if abs(place - identity.opening_min) <= FELL_RAD:
        return 1
    return -1 if abs(place - identity.opening_max) <= FELL_RAD else 0


def fallen(place: float, identity: Identity) -> Verdict | None:
    """A verdict where blades that were left half open stand at a stop."""
    near = stop_near(place, identity)
    if not near:
        return None
    name, stop = ("closed", identity.opening_min) if near > 0 else ("open", identity.opening_max)
    why = (
        f"Not determined: the blades stand at their {name} stop although they were to be left half "
        "open, and no push took them clearly off it: gravity or a spring carries them there, "
        "somebody holds them, or nobody moved them. Balance them or leave them half open, let go, "
        "and probe again."
    )
    return LEFT_HALF_OPEN.not_evaluated(why, abs(place - stop), FELL_RAD)


def virtual_hand(talk: Talk) -> bool:
    """Let the hand of a virtual rig stroke; whether the encoder showed it."""
    talk.link.configure(ConfigKey.HAND_SPEED_rad_per_s, HAND_RATE)
    try:
        moved = talk.play(_watched(talk))
    finally:
        talk.link.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
    return moved >= DEAD_STEPS * talk.identity.opening_resolution


def judge_hand_pass(found: HandPass, identity: Identity) -> list[Verdict]:
    """Verdicts on scale, direction and zero of the encoder.

    Two passes that agree with each other and not with the identity are an encoder's fault (or
    something between the blades); two that disagree are a person's, and determine nothing.
    """
    if not found.alive:
        return [_not_determined()]
    stated = identity.opening_max - identity.opening_min
    if len(found.ranges) == 2 and not _is_right(found, identity) and not _agree(found):
        first, second = found.ranges
        why = (
            f"Not determined: two passes by hand from stop to stop gave {first:.3g} and "
            f"{second:.3g} rad. Probe again, and press on both stops."
        )
        return [COUNT_SCALE.not_evaluated(why)]
    way = found.ranges[-1]
    ratio = way / stated
    off = abs(ratio - 1.0)
    said = f"By hand from stop to stop the encoder counts {way:.3g} rad, {stated:.3g} stated"
    if ratio < 0.0:
        why = (
            f"{said}: the encoder is reversed, its reading shrinks while the blades open. Swap the "
            "encoder's channels, or turn its sign round in the firmware."
        )
        return [COUNT_SCALE.verdict("fail", off, why)]
    if off > COUNT_SCALE.threshold:
        why = (
            f"{said}: its counts per turn or its gear are wrong by a factor {ratio:.2g}, or "
            "something keeps the blades from their stops. Clear them, or correct the firmware."
        )
        return [COUNT_SCALE.verdict("fail", off, why)]
    zero = 0.5 * (found.closed[-1] - identity.opening_min + found.opened[-1] - identity.opening_max)
    verdicts = [COUNT_SCALE.verdict("pass", off, f"{said}.")]
    said = f"Both stops lie {zero:+.3g} rad from where the device states them"
    bad = (
        f"{said}: the zero of the encoder is wrong. Home it, or correct its zero in the firmware: "
        "an opening that is off by a constant looks like another edge and toughness."
    )
    return [*verdicts, OPENING_ZERO.judge(abs(zero), f"{said}.", bad)]


def _not_determined() -> Verdict:
    """Nobody moved the blades by hand, so nothing is known of scale, sign and zero."""
    why = (
        "Not determined: the opening did not change between the requests to close and to open the "
        "blades by hand, so either nobody moved them or the encoder is stuck or unplugged. Its "
        "scale, its sign and its zero are not checked. Probe again, and move the blades to both "
        "stops by hand when asked."
    )
    return COUNT_SCALE.not_evaluated(why)


def by_virtual_hand(alive: bool) -> Verdict:
    """What the hand of a virtual rig leaves unchecked."""
    seen = "shows that it moves" if alive else "did not move it"
    why = (
        f"Not checked on a virtual rig: scale and zero of the encoder; its own hand {seen}. A "
        "person moves the blades of a real one to both stops."
    )
    return COUNT_SCALE.not_evaluated(why)


def _is_right(found: HandPass, identity: Identity) -> bool:
    stated = identity.opening_max - identity.opening_min
    zero = 0.5 * (found.closed[-1] - identity.opening_min + found.opened[-1] - identity.opening_max)
    off = abs(found.ranges[-1] / stated - 1.0)
    return off <= COUNT_SCALE.threshold and abs(zero) <= OPENING_ZERO.threshold


def _agree(found: HandPass) -> bool:
    first, second = found.ranges
    return abs(first - second) <= AGREE_SHARE * max(abs(first), abs(second))


def _what(found: HandPass, identity: Identity) -> str:
    """What was odd in a pass, as part of a sentence."""
    way = found.ranges[-1]
    if abs(way) < DEAD_STEPS * found.step:
        return "did not change"
    if way < 0.0:
        return "shrank from close to open"
    stated = identity.opening_max - identity.opening_min
    if abs(way / stated - 1.0) > COUNT_SCALE.threshold:
        return f"changed by {math.degrees(way):.3g} degrees, {math.degrees(stated):.3g} are stated"
    return "is off at both stops"


def _held(talk: Talk, confirm: Confirm, request: str) -> float:
    """The opening once a person has done what was asked."""
    with talk.paused():
        confirm(request)
    begin = talk.mark()
    talk.play(_listened(talk))
    opening = talk.heard(begin)["opening"]
    opening = opening[np.isfinite(opening)]
    return float(np.median(opening)) if len(opening) else math.nan


def _listened(talk: Talk) -> Stage[None]:
    for _ in range(talk.ticks(LISTEN_S)):
        yield RELEASE


def _watched(talk: Talk) -> Stage[float]:
    """How far the opening went within HAND_S, motors off; ends early once it has moved."""
    state = yield RELEASE
    low = high = state.opening
    for _ in range(talk.ticks(HAND_S)):
        state = yield RELEASE
        low, high = min(low, state.opening), max(high, state.opening)
        if high - low >= 10.0 * DEAD_STEPS * talk.identity.opening_resolution:
            break
    return float(high - low)
