"""Numbers that begin again, as a counter after its last one, and those in a measurement's place.

The latter are 9999, -32768, -1 and the like, for overflow and loss.
"""

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.recording.strokes import GAP_FACTOR, resolution_of

MOST_LEFT = 0.25
"""Share of a period that a step may have once it is continued: half of where its direction is a
guess."""
FASTER = 2.0
"""A step that begins again goes no farther, once continued, than this many of the largest other
step: a joint that gains all of its speed within one sample goes as far in the next."""
COUNTERS = range(8, 33)
"""Bits of a counter."""
WHOLE = 1e-3
"""Of a count: what a number of a few digits may be off the multiple of a counter's step."""
JUMP = 0.25
"""Share of the range that a jump covers at least: a stroke of four steps shows no motion."""
TICKS_S = (1e-3, 1e-6, 1e-9)
"""What counters of clocks count."""
OF_DAY_S = (1.0, 60.0, 3600.0, 43200.0, 86400.0)
"""A clock that shows the time of day without its larger parts begins again after these."""
WRAP = 2.0**32
"""Counter of a logger's us: 71.6 min."""
NEAR_END = 0.01
"""Share of ``WRAP`` within which its time lies before and after: samples may be missing there."""
HELD = 4
"""Samples in a row at the last number of a counter that say that it stands there: a value that goes
on through its end has no reason to stay."""


def continued(position: Array, counts: Array, turn: float | None) -> tuple[Array, Integers]:
    """A position (n,) that goes on where it jumps by its period, and the places after the jumps.

    ``counts`` (n,) are the numbers as they stand in the table, ``turn`` the length of a full turn
    in the unit of ``position`` (None for a linear joint). The period is a turn, or a counter's 2^k
    where all numbers are whole, or multiples of one step; a counter begins again between its ends,
    0 and 2^k or half of it to either side. A position that does not stay within one period, or that
    jumps farther than it moves once it is continued, is left as it is: then no place comes back.

    >>> angle = np.radians(np.array([350.0, 356.0, 2.0, 8.0]))
    >>> found, places = continued(angle, np.degrees(angle), 2.0 * np.pi)
    >>> np.degrees(found).round(6).tolist(), places.tolist()
    ([350.0, 356.0, 362.0, 368.0], [2])
    """
    if turn is not None:
        values, places = _gone_on(position, turn)
        if len(places):
            return values, places
    if not len(jumps_in(counts)):
        return position, np.zeros(0, dtype=np.int64)
    whole, bits = _whole(counts)
    if bits is not None:
        values, places = _gone_on(whole, 2.0**bits)
        if len(places) and _at_ends(whole, places, 2.0**bits):
            scale = float(np.ptp(position)) / float(np.ptp(whole))
            return position[0] + (values - values[0]) * _sense(position, whole) * scale, places
    return position, np.zeros(0, dtype=np.int64)


def overflows(counts: Array) -> tuple[int, Integers]:
    """Bits of the counter between whose ends a force or torque (n,) jumps, and the places after.

    A negative number that is read without its sign is near 2^k, and one that is too large for its
    bits begins again at the other end. Numbers that stand at an end are cut off there instead. 0
    bits where nothing jumps so.

    >>> overflows(np.array([3.0, 2.0, 0.0, 65534.0, 65533.0, 65535.0, 1.0, 2.0]))
    (16, array([3, 6]))
    """
    none = 0, np.zeros(0, dtype=np.int64)
    if not len(jumps_in(counts)):
        return none
    whole, bits = _whole(counts)
    if bits is None:
        return none
    _, places = _gone_on(whole, 2.0**bits)
    ends = (float(whole.min()), float(whole.max()))
    if not len(places) or not _at_ends(whole, places, 2.0**bits) or _stands(whole, ends):
        return none
    return bits, places


def continued_clock(time: Array, unit_s: float) -> tuple[Array, Integers, float]:
    """A clock (n,) that goes on where it begins again, the places after, and its period.

    ``time`` is in units of ``unit_s`` seconds. The period is 2^k of its unit, of ms, us or ns, or a
    second, minute, hour, half a day or day; the clock begins at 0, or at half of the period below.
    It is the one with which each step across is as the usual one; with 2^32, which loggers of us
    have, an end may also be missing (``NEAR_END``), which then is a gap. A clock whose usual step
    is more than ``MOST_LEFT`` of the period may have begun again unseen, and is left as it is, as
    is one that goes back otherwise: then no place comes back.

    >>> time, places, period = continued_clock(np.array([65520.0, 65530.0, 4.0, 14.0]), 1e-3)
    >>> time.tolist(), places.tolist(), period
    ([65520.0, 65530.0, 65540.0, 65550.0], [2], 65536.0)
    """
    step = np.diff(time)
    falls = np.flatnonzero(step < 0.0)
    rises = step[step > 0.0]
    if not len(falls) or not len(rises):
        return time, falls[:0], 0.0
    usual = float(np.median(rises))
    low, high = float(time.min()), float(time.max())
    fitting = {}
    for period in _clock_periods(unit_s):
        begins = 0.0 if low >= 0.0 else -0.5 * period
        across = step[falls] + period
        inside = low >= begins and high < begins + period and usual <= MOST_LEFT * period
        if not inside:
            continue
        if across.min() > 0.0 and across.max() < GAP_FACTOR * usual:
            fitting[period] = abs(float(across.mean()) - usual)
        elif period == WRAP:
            near = NEAR_END * WRAP
            if np.all(time[falls] > begins + WRAP - near) and np.all(
                time[falls + 1] < begins + near
            ):
                fitting[period] = np.inf
    if not fitting:
        return time, falls[:0], 0.0
    period = min(fitting, key=lambda candidate: fitting[candidate])
    turns = np.zeros(len(time))
    turns[falls + 1] = period
    return time + np.cumsum(turns), falls + 1, period


def _clock_periods(unit_s: float) -> list[float]:
    """Periods of clocks, in units of ``unit_s`` seconds, without repetitions."""
    counted = [2.0**k * unit for k in COUNTERS for unit in (1.0, *(x / unit_s for x in TICKS_S))]
    stated = [seconds / unit_s for seconds in OF_DAY_S]
    return sorted({float(f"{period:.12g}") for period in (*counted, *stated)})


def jumps_in(values: Array) -> Integers:
    """Places (k,) after steps of more than ``JUMP`` of the range, where all others are far smaller.

    Empty where some step lies between: then the log shows fast motion. The others are at most half
    as large as the jumps, by ``FASTER``.

    >>> jumps_in(np.array([88.0, 89.0, 90.0, 1.0, 2.0, 3.0]))
    array([3])
    """
    halves = 0.5 * values  # of the largest numbers, which have no difference
    step = np.abs(np.diff(halves))
    jumps = step > JUMP * float(np.ptp(halves))
    others = float(step[~jumps].max(initial=0.0))
    if not np.any(jumps) or others == 0.0 or step[jumps].min() <= FASTER * others:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(jumps) + 1


def _whole(counts: Array) -> tuple[Array, int | None]:
    """The numbers in steps of their sensor, and the bits of a counter that they would fill."""
    if not np.all(counts == np.rint(counts)):
        step = resolution_of(counts)
        scaled = counts / step
        if not np.isfinite(step) or np.abs(scaled - np.rint(scaled)).max() > WHOLE:
            return counts, None
        counts = np.rint(scaled)
    span = float(np.ptp(counts))
    return counts, next((k for k in COUNTERS if 2.0**k > span), None) if span > 0.0 else None


def _gone_on(values: Array, period: float) -> tuple[Array, Integers]:
    none = np.zeros(0, dtype=np.int64)
    step = np.diff(values)
    jumps = np.abs(step) > 0.5 * period
    if not np.any(jumps) or np.ptp(values) > period * (1.0 + 1e-9):
        return values, none
    turns = np.concatenate([[0.0], np.cumsum(np.where(jumps, -np.sign(step), 0.0))])
    unwrapped = values + period * turns
    went = np.abs(np.diff(unwrapped))
    usual = FASTER * went[~jumps].max(initial=0.0)
    if went.max() > MOST_LEFT * period or went[jumps].max() > usual + 1e-9 * period:
        return values, none
    return np.asarray(unwrapped), np.flatnonzero(jumps) + 1


def _at_ends(counts: Array, places: Integers, period: float) -> bool:
    """Whether the numbers beside each jump lie as near opposite ends of a counter as one step."""
    below, above = (pick(counts[places - 1], counts[places]) for pick in (np.minimum, np.maximum))
    most = FASTER * float(np.delete(np.abs(np.diff(counts)), places - 1).max(initial=0.0))
    return any(
        bool(np.all((below - low <= most) & (low + period - above <= most)))
        for low in (0.0, -0.5 * period)
    )


def _stands(counts: Array, ends: tuple[float, float]) -> bool:
    """Whether the numbers stand at an end of their range for ``HELD`` samples in a row."""
    window = np.ones(HELD)
    return any(
        bool(np.any(np.convolve(counts == end, window, "valid") > HELD - 0.5)) for end in ends
    )


def _sense(position: Array, counts: Array) -> float:
    """1 or -1: whether the position grows with the counts."""
    far = int(np.argmax(np.abs(counts - counts[0])))
    return float(np.sign((position[far] - position[0]) * (counts[far] - counts[0])))


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
    marks: set[float] = set()
    while True:
        rest = values[~np.isin(values, list(marks))] if marks else values
        more = _apart(rest) or _excursions(rest)
        if not more:
            return tuple(sorted(marks))
        marks |= more


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
        excursion = step[[place, place + 1]]
        excursion = excursion[[place > 0, place < len(values) - 1]]
        others = np.delete(step, [place, place + 1])
        if excursion.min() > FASTER * others.max() > 0.0:
            return place
    return None


def _apart(values: Array) -> set[float]:
    """Values at the ends of the range that lie apart from all others."""
    levels, counts = np.unique(values, return_counts=True)
    if len(levels) < FEWEST_LEVELS:
        return set()
    apart: set[float] = set()
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
                apart |= set(marks.tolist())
                break
    return apart


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
