"""Bounds of a law's derivatives over any interval, from bounds over many small ones."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model.curvature import Span
from scissorcal.package.proved_tables import running_maxima
from scissorcal.package.tables import TableLaw

CELLS = 1024


def profiles(law: TableLaw, array: NDArray[np.float32]) -> "tuple[Profile, Profile]":
    """Profiles of a law's first and second derivative over its table (3, knots).

    ValueError where the law has no bound of its second derivative.
    """
    if law.curvature is None:
        raise ValueError("the law has no bound of its second derivative")
    low, high = float(array[0, 0]), float(array[0, -1])
    ends = np.linspace(low, high, CELLS + 1)
    if law.monotone and low == 0.0:
        ends = np.concatenate([ends, ends[1] * 2.0 ** -np.arange(1.0, 40.0)])
    inside = law.breaks[(law.breaks > low) & (law.breaks < high)]
    return Profile.of(law.derivative, law.curvature, np.unique(np.concatenate([ends, inside])))


@dataclass(frozen=True)
class Profile:
    """Bounds of a function of one variable over cells, and so over any interval."""

    ends: Array
    lows: Array
    highs: Array

    @classmethod
    def of(
        cls,
        slope: Callable[[Array], Array],
        curvature: Callable[[Array, Array], tuple[Array, Array]],
        ends: Array,
    ) -> "tuple[Profile, Profile]":
        """Profiles of a law's first and second derivative."""
        low, high = ends[:-1], ends[1:]
        with np.errstate(all="ignore"):
            least, most = curvature(low, high)
            first, last = slope(low), slope(high)
        size, width = np.maximum(np.abs(least), np.abs(most)), high - low
        spare = 0.5 * np.where(np.isfinite(size), size, 0.0) * width
        # where f'' has one sign f' is monotone; else it strays from its ends by half a cell's bend
        spare = np.where((least >= 0.0) | (most <= 0.0), 0.0, spare)
        highest = np.where(np.isneginf(least), np.inf, np.maximum(first, last) + spare)
        firsts = cls(ends, np.minimum(first, last) - spare, highest)
        return firsts, cls(ends, least, most)

    def over(self, span: Span) -> Span:
        """Bounds over each interval; those of the ends beyond them."""
        count = len(self.lows)
        first = np.clip(np.searchsorted(self.ends, span.low, side="left") - 1, 0, count - 1)
        last = np.clip(np.searchsorted(self.ends, span.high, side="right"), 1, count)
        length = np.maximum(last - first, 1)
        level = np.log2(length).astype(np.int64)
        start, end = first, first + length - 2**level
        lows, highs = running_maxima(-self.lows), running_maxima(self.highs)
        return Span(
            -np.maximum(lows[level, start], lows[level, end]),
            np.maximum(highs[level, start], highs[level, end]),
        )
