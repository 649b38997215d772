"""When the blades withdraw from the cut and come back: rests of the crack, from geometry alone."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

WITHDRAWN_M = 5e-4
"""Blades that withdraw less than this from where they had reached have not let go of the crack."""


@dataclass(frozen=True)
class Rests:
    """Stretches in which the crack waits: all arrays (rests,), indices into the samples (n,).

    ``arrived`` is the sample at which the blades had reached furthest, ``turned`` the one at which
    they have withdrawn furthest. ``of`` (n,) is the rest that a sample belongs to or comes after,
    -1 before the first one of its sheet; ``leaving`` (n,) marks those before ``turned``.
    ``withdrawn`` (n,) is by how much the blades are behind where they had reached (m).
    """

    arrived: Integers
    turned: Integers
    of: Integers
    leaving: NDArray[np.bool_]
    withdrawn: Array


def find_rests(crossing: Array, sheet: Integers) -> Rests:
    """Find rests from where the edge crosses the sheet's upper face (n,), in the sheet's frame.

    A rest begins where ``crossing`` (m) was furthest, holds a withdrawal of more than
    ``WITHDRAWN_M``, and ends once the blades have come back: the crack stands all that while.
    Whatever the material, the crack is then where the furthest crossing left it. ``sheet`` (n,)
    labels pieces of material, each cut from its near edge at 0 on.
    """
    n = len(crossing)
    withdrawn = np.zeros(n)
    of = np.full(n, -1, dtype=np.int64)
    leaving = np.zeros(n, dtype=bool)
    arrived: list[int] = []
    turned: list[int] = []
    begins = [0, *(np.flatnonzero(np.diff(sheet)) + 1).tolist(), n] if n else []
    for low, high in pairwise(begins):
        here = crossing[low:high]
        furthest = np.maximum.accumulate(np.maximum(here, 0.0))
        back = furthest - here
        withdrawn[low:high] = back
        # samples that share a furthest place form one stretch, which rests if it withdraws enough
        stretch = np.cumsum(np.diff(furthest, prepend=furthest[0]) > 0)
        firsts = np.searchsorted(stretch, np.arange(stretch[-1] + 1)).tolist()
        for begin, end in pairwise([*firsts, high - low]):
            if furthest[begin] <= 0.0:
                continue
            deepest = begin + int(np.argmax(back[begin:end]))
            if back[deepest] < WITHDRAWN_M:
                continue
            number = len(arrived)
            arrived.append(low + begin)
            turned.append(low + deepest)
            of[low + begin : high] = number
            leaving[low + begin : low + deepest] = True
    return Rests(
        np.array(arrived, dtype=np.int64), np.array(turned, dtype=np.int64), of, leaving, withdrawn
    )
