"""Where a curve over a range is level."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FLAT = 0.2
"""On a plateau the mean curve stays within this share of its mean, all in all."""
LEAST_PLATEAU = 0.15
"""A plateau is at least this share of the range."""
STEEP, WHOLE = 0.5, 0.8
"""It rises at most half as steeply as the whole range, or is nearly the whole itself."""


def plateau_of(curve: Array, places: Array) -> tuple[int, int] | None:
    """First bin and the one past the last of the longest level part of ``curve`` (n,)."""
    best: tuple[int, int] | None = None
    least = max(2, round(LEAST_PLATEAU * len(places)))
    steepness = float(np.ptp(curve)) / len(curve)
    for first in range(len(curve)):
        low = high = total = curve[first]
        for after in range(first + 2, len(curve) + 1):
            value = curve[after - 1]
            low, high, total = min(low, value), max(high, value), total + value
            if high - low > FLAT * abs(total / (after - first)):
                break
            size = after - first
            # A steady rise is no plateau, however high it stands: it is as steep as the whole.
            level = size >= WHOLE * len(curve) or (high - low) / size < STEEP * steepness
            if size >= least and level and (best is None or size > best[1] - best[0]):
                best = (first, after)
    return best
