"""Values in the place of a measurement: 9999, -32768, -1 and the like, for overflow and loss."""

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recording.wraps import FASTER

MOST_MARKED = 0.05
"""Share of the samples above which a value that lies apart may be a level of the motion."""
FAR = 100.0
"""Ranges of a channel's other values: a sensor that resolves a hundredth of what it measures would
have a range of 10,000 steps to reach so far."""
FEWEST_LEVELS = 4
"""Different values without which none lies apart: two ends, and a range within them."""
MOST_KINDS = 3
"""Marks of one device at one end, such as -9997, -9998 and -9999 for three kinds of loss."""
LONGEST = 3
"""Samples in a row that an excursion lasts: of four, a sensor may show a load that is held."""


def marks_in(values: Array) -> tuple[float, ...]:
    """Values of a channel (m,) that are marks of overflow or loss, ascending.

    Values at an end of the range count that come at least twice to the last digit, and lie farther
    from the next one than all values within the ends are apart. What is sampled while it moves has
    values on its way, so that no measurement lies so far off. A value that is held for more of the
    time than ``MOST_MARKED`` may be a level, and one that comes once a spike, unless it lies
    ``FAR`` times farther off. Zero is what a sensor shows without a load, and a mark at an end only
    where it never stands for two samples in a row.

    A value anywhere counts that comes at least twice, each time for at most ``LONGEST`` samples,
    and that is reached and left by steps of more than ``FASTER`` times any other step: nothing goes
    so far and returns to where it was between two samples, and stops at the same last digit.

    >>> marks_in(np.array([1.0, 1.2, -1.0, 1.1, 1.3, -1.0, 1.2, 1.4]))
    (-1.0,)
    """
    found: set[float] = set()
    while True:
        rest = values[~np.isin(values, list(found))] if found else values
        more = _apart(rest) or _excursions(rest)
        if not more:
            return tuple(sorted(found))
        found |= more


def lone_excursion(values: Array) -> int | None:
    """Place of the one value (m,) that lies beyond all others, and farther than they go in a step.

    It lasts one sample, is reached and left by steps of more than ``FASTER`` times any other one,
    and so is a spike, or a motion that the clock is too slow for. None where there is none.

    >>> lone_excursion(np.array([1.0, 1.2, 1.1, 1.3, 4.0, 1.2, 1.4]))
    4
    """
    if len(values) < FEWEST_LEVELS:
        return None
    for place in (int(np.argmin(values)), int(np.argmax(values))):
        if np.count_nonzero(values == values[place]) > 1:
            continue
        step = np.abs(np.diff(np.concatenate([values[:1], values, values[-1:]])))
        own = step[[place, place + 1]]
        own = own[[place > 0, place < len(values) - 1]]
        others = np.delete(step, [place, place + 1])
        if own.min() > FASTER * others.max() > 0.0:
            return place
    return None


def _apart(values: Array) -> set[float]:
    """Values at the ends of the range that lie apart from all others."""
    levels, counts = np.unique(values, return_counts=True)
    if len(levels) < FEWEST_LEVELS:
        return set()
    found: set[float] = set()
    for sign in (1, -1):
        # From an end inwards; halves, because the largest numbers have no difference.
        level, count = levels[::sign], counts[::sign]
        for kinds in range(1, min(MOST_KINDS, len(levels) - FEWEST_LEVELS + 1) + 1):
            marks, others = level[:kinds], level[kinds:]
            inside = abs(0.5 * others[0] - 0.5 * others[-2])
            away = abs(0.5 * others[0] - 0.5 * marks[-1])
            far, held = away > FAR * inside, int(count[:kinds].sum())
            usual = held <= MOST_MARKED * len(values) and count[:kinds].min() > 1
            if away > inside and (far or usual) and not any(_rests(values, x) for x in marks):
                found |= set(marks.tolist())
                break
    return found


def _rests(values: Array, level: float) -> bool:
    """Whether a level is 0, and stands for two samples in a row: a sensor without a load."""
    return level == 0.0 and bool(np.any((values[1:] == 0.0) & (values[:-1] == 0.0)))


def _excursions(values: Array) -> set[float]:
    """Values that the channel goes to, and comes back from, in steps larger than any other."""
    edges = np.flatnonzero(np.diff(values)) + 1
    if len(edges) < FEWEST_LEVELS:
        return set()
    first, after = np.concatenate([[0], edges]), np.concatenate([edges, [len(values)]])
    levels, kind = np.unique(values[first], return_inverse=True)
    step = np.abs(np.diff(values[first]))
    nearer = np.minimum(np.append(step, np.inf), np.insert(step, 0, np.inf))
    least, lasting = np.full(len(levels), np.inf), np.zeros(len(levels), dtype=np.int64)
    np.minimum.at(least, kind, nearer)
    np.maximum.at(lasting, kind, after - first)
    least[(lasting > LONGEST) | (np.bincount(kind) < 2)] = 0.0
    order = np.argsort(-least, kind="stable")
    for kinds in range(min(MOST_KINDS, len(levels) - FEWEST_LEVELS + 2), 0, -1):
        chosen = order[:kinds]
        away = np.isin(kind, chosen)
        others = step[~(away[1:] | away[:-1])].max(initial=0.0)
        if others > 0.0 and least[chosen].min() > FASTER * others:
            return set(levels[chosen].tolist())
    return set()
