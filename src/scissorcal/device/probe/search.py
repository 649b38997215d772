"""From which effort on an axis moves, and which way: growing pushes, then pushes in pairs.

A passive joint at rest moves with the effort, whether it slides or only yields; what also moves it
(gravity, creep, drift) does so in both pushes of a pair and cancels in their difference. So a pair
tells the direction where a threshold of motion could not.
"""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from scissorcal.device.probe.hand_pass import stop_near
from scissorcal.device.probe.pushes import Axis, Pushed, push
from scissorcal.device.probe.talk import Talk

Direction = Literal["right", "reversed", "not determined"]

FIRST_NM, FIRST_N = 1e-3, 0.05
"""The first push: a twentieth of the friction of office scissors and less."""
GROWTH = 1.2
"""A push that first moves the axis is above breakaway by a fifth at most, which bounds its rate."""
PUSH_S = (4e-3, 15e-3, 45e-3)
"""Short pushes first at each effort: what is light moves in 4 ms, what is heavy needs 45 ms."""
PAIRS = (1.1, 1.3, 1.55)
"""Efforts of the pairs over that which first moved the axis."""
VOTES = 2
CALM = 0.5
"""Share of the rate that means motion times 1 / 0.4 up to which the efforts of the pairs grow."""
LARGEST_IMPULSE_NM_S = 2.25e-3
"""N m s of a push: it brings blades of 3e-3 kg m^2 to 0.75 rad/s. What does not move by it sticks,
and needs a larger torque, not a longer one."""
LEAST_INERTIA = 5e-5
"""kg m^2 of the opening: two halves of 10 g at 70 mm, smaller than any scissors with finger rings.
What bounds the rate of blades that an encoder does not show."""
LEAST_MASS = 0.05
"""kg of the carriage, for the same."""
ROOM = 4.0
"""In units of the way that means motion: nearer to a stop a push is not told from the stop."""
ROOM_PUSHES = 40


@dataclass(frozen=True)
class Search:
    """What moved the axis each way (None where nothing did), and why the search ended without.

    ``bounded_at`` is the effort beyond which blades behind a dead encoder could get too fast.
    ``stop`` is 1 (-1) where the blades lie on their closed (open) stop and fell back to it.
    """

    pushed: Pushed | None
    pulled: Pushed | None
    pushes: tuple[Pushed, ...]
    bounded_at: float | None = None
    stop: int = 0

    @property
    def hold(self) -> float:
        """The effort that stands against what carries the axis: the middle of both, if one sign."""
        if self.pushed is None or self.pulled is None:
            return 0.0
        same_way = self.pushed.went * self.pulled.went > 0.0
        return 0.5 * (self.pushed.effort + self.pulled.effort) if same_way else 0.0

    @property
    def effort(self) -> float:
        """Half the distance of the efforts that moved it; off a stop, that which did."""
        efforts = [abs(one.effort) for one in self.movers]
        return sum(efforts) / len(efforts)

    @property
    def movers(self) -> list[Pushed]:
        """The pushes that moved it, the positive one first."""
        return [one for one in (self.pushed, self.pulled) if one is not None]


class Sense(NamedTuple):
    """Votes of the pairs: those that moved with the effort less those against it."""

    votes: int
    pairs: int
    pushes: tuple[Pushed, ...]
    direction: Direction


def search(talk: Talk, axis: Axis, *, alive: bool) -> Search:
    """Push with growing efforts, by turns each way, until the axis has moved both ways.

    ``alive``: the axis has been seen to move, so that it cannot move unseen. Without that, no push
    may bring an axis of LEAST_INERTIA (LEAST_MASS) above the bound of the rate.
    """
    found: dict[int, Pushed | None] = {1: None, -1: None}
    pushes: list[Pushed] = []
    effort = FIRST_NM if axis.name == "opening" else FIRST_N
    signs = _away_first(talk, axis)
    while effort <= axis.effort:
        for seconds in PUSH_S:
            too_long = axis.name == "opening" and effort * seconds > LARGEST_IMPULSE_NM_S
            if too_long and seconds > PUSH_S[0]:
                continue
            if not alive and _could_reach(talk, axis, effort, seconds) > axis.rate:
                if seconds == PUSH_S[0]:
                    return Search(found[1], found[-1], tuple(pushes), effort)
                continue
            for sign in signs:
                if found[sign] is not None:
                    continue
                one = push(talk, axis, sign * effort, seconds)
                pushes.append(one)
                alive = alive or abs(one.went) >= axis.seen
                if not one.disturbed and one.moved(axis):
                    found[sign] = one
                    if found[-sign] is None:
                        pushes += _make_room(talk, axis, one)
        if found[1] is not None and found[-1] is not None:
            break
        moved = Search(found[1], found[-1], tuple(pushes))
        stop = _stop_of(talk, axis, moved)
        if stop:
            return replace(moved, stop=stop)
        effort *= GROWTH
    return Search(found[1], found[-1], tuple(pushes))


def sense(talk: Talk, axis: Axis, found: Search) -> Sense:
    """Push in pairs about ``found.hold`` and count which way the axis goes."""
    seconds = max(one.seconds for one in found.movers)
    hold, effort = found.hold, found.effort
    votes, factor = 0, PAIRS[0]
    wide = axis.until(2.0 * axis.moved)
    pushes: list[Pushed] = []
    for wanted in PAIRS:
        if not pushes or max(one.rate for one in pushes[-2:]) < CALM * axis.rate:
            factor = wanted
        pair = [
            push(talk, wide, sign * min(factor * effort, axis.effort), seconds, hold)
            for sign in (1, -1)
        ]
        pushes += pair
        apart = pair[0].went - pair[1].went
        if not any(one.disturbed for one in pair) and abs(apart) >= axis.seen:
            votes += 1 if apart > 0.0 else -1
    against = all(one.effort * one.went < 0.0 for one in found.movers)
    direction: Direction = "not determined"
    if votes >= VOTES and not against:
        direction = "right"
    elif votes <= -VOTES and against:
        direction = "reversed"
    return Sense(votes, len(PAIRS), tuple(pushes), direction)


def _could_reach(talk: Talk, axis: Axis, effort: float, seconds: float) -> float:
    """The rate that a push brings the lightest axis to, the watchdog's time after it included."""
    least = LEAST_INERTIA if axis.name == "opening" else LEAST_MASS
    lasting = talk.ticks(seconds) * talk.tick_s + talk.expiry_s
    return abs(effort) * lasting / least


def _away_first(talk: Talk, axis: Axis) -> tuple[int, int]:
    """Both signs, first away from the nearer stop."""
    identity = talk.identity
    if axis.name == "advance":
        return (1, -1)
    here = float(talk.heard(talk.mark() - 1)["opening"][0])
    middle = 0.5 * (identity.opening_min + identity.opening_max)
    return (1, -1) if here < middle else (-1, 1)


def _make_room(talk: Talk, axis: Axis, moved: Pushed) -> list[Pushed]:
    """Push on the same way while a stop is near on the other side."""
    identity = talk.identity
    low, high = (
        (identity.opening_min, identity.opening_max)
        if axis.name == "opening"
        else (identity.advance_min, identity.advance_max)
    )
    made: list[Pushed] = []
    for _ in range(ROOM_PUSHES):
        here = float(talk.heard(talk.mark() - 1)[axis.name][0])
        left = here - low if moved.went > 0.0 else high - here
        if left >= ROOM * axis.moved:
            break
        made.append(push(talk, axis.until(2.0 * axis.moved), moved.effort, moved.seconds))
        there = float(talk.heard(talk.mark() - 1)[axis.name][0])
        if abs(there - here) <= axis.rest:
            break  # something carries it back, as it will the next time
    return made


def _stop_of(talk: Talk, axis: Axis, found: Search) -> int:
    """Which stop the blades lie on: all efforts were tried both ways, one alone moved them, and
    they fell back near to a stop."""
    if axis.name != "opening" or len(found.movers) != 1:
        return 0
    one = found.movers[0]
    heard = talk.heard()["opening"]
    begun, ended = float(heard[one.begin]), float(heard[one.end - 1])
    stop = 1 if one.went > 0.0 else -1
    near = stop_near(begun, talk.identity) == stop
    return stop if near and abs(ended - begun) <= 0.5 * axis.moved else 0
