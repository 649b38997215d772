"""Positions that begin again: an angle after a full turn, a counter after its last number."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_LEFT = 0.25
"""Share of a period that a step may have once it is continued: half of where its direction is a
guess."""
FASTER = 2.0
"""A step that begins again goes no farther, once continued, than this many of the largest other
step: a joint that gains all of its speed within one sample goes as far in the next."""
COUNTERS = range(8, 33)
"""Bits of a counter."""


def continued(position: Array, counts: Array, turn: float | None) -> tuple[Array, Integers]:
    """A position (n,) that goes on where it jumps by its period, and the places after the jumps.

    ``counts`` (n,) are the numbers as they stand in the table, ``turn`` the length of a full turn
    in the unit of ``position`` (None for a linear joint). The period is a turn, or the counter's
    2^k where all numbers are whole; a counter begins again between its ends, 0 and 2^k or half of
    it to either side. A position that does not stay within one period, or that jumps farther than
    it moves once it is continued, is left as it is: then no place comes back.

    >>> angle = np.radians(np.array([350.0, 356.0, 2.0, 8.0]))
    >>> found, places = continued(angle, np.degrees(angle), 2.0 * np.pi)
    >>> np.degrees(found).round(6).tolist(), places.tolist()
    ([350.0, 356.0, 362.0, 368.0], [2])
    """
    span = float(np.ptp(counts))
    if turn is not None:
        found, places = _gone_on(position, turn)
        if len(places):
            return found, places
    if span > 0.0 and np.all(counts == np.rint(counts)):
        bits = next((k for k in COUNTERS if 2.0**k > span), None)
        if bits is not None:
            found, places = _gone_on(counts, 2.0**bits)
            if not _at_ends(counts, places, 2.0**bits):
                places = places[:0]
            scale = float(np.ptp(position)) / span
            if len(places):
                return position[0] + (found - found[0]) * _sense(position, counts) * scale, places
    return position, np.zeros(0, dtype=np.int64)


def _gone_on(values: Array, period: float) -> tuple[Array, Integers]:
    none = np.zeros(0, dtype=np.int64)
    step = np.diff(values)
    jumps = np.abs(step) > 0.5 * period
    if not np.any(jumps) or np.ptp(values) > period * (1.0 + 1e-9):
        return values, none
    turns = np.concatenate([[0.0], np.cumsum(np.where(jumps, -np.sign(step), 0.0))])
    found = values + period * turns
    went = np.abs(np.diff(found))
    usual = FASTER * went[~jumps].max(initial=0.0)
    if went.max() > MOST_LEFT * period or went[jumps].max() > usual + 1e-9 * period:
        return values, none
    return np.asarray(found), np.flatnonzero(jumps) + 1


def _at_ends(counts: Array, places: Integers, period: float) -> bool:
    """Whether the numbers beside each jump lie as near opposite ends of a counter as one step."""
    below, above = (pick(counts[places - 1], counts[places]) for pick in (np.minimum, np.maximum))
    most = FASTER * float(np.delete(np.abs(np.diff(counts)), places - 1).max(initial=0.0))
    return any(
        bool(np.all((below - low <= most) & (low + period - above <= most)))
        for low in (0.0, -0.5 * period)
    )


def _sense(position: Array, counts: Array) -> float:
    """1 or -1: whether the position grows with the counts."""
    far = int(np.argmax(np.abs(counts - counts[0])))
    return float(np.sign((position[far] - position[0]) * (counts[far] - counts[0])))
