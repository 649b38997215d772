"""Fewer numbers for figures and tables: block means, thinning, and norms that skip gaps."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array


def rms(values: Array) -> float:
    """Root mean square of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else float("nan")


def mean(values: Array) -> float:
    """Mean of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.mean(kept)) if len(kept) else float("nan")


def median(values: Array) -> float:
    """Median of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.median(kept)) if len(kept) else float("nan")


def block_means(values: Array, blocks: int) -> Array:
    """Means of what is finite over consecutive blocks of nearly equal length.

    Shape (min(blocks, n),); NaN for a block without a finite value.
    """
    count = min(blocks, len(values))
    if count == 0:
        return np.zeros(0)
    starts = np.arange(count) * len(values) // count
    known = np.isfinite(values)
    sums = np.add.reduceat(np.where(known, values, 0.0), starts)
    counts = np.add.reduceat(known.astype(np.float64), starts)
    means = np.full(count, np.nan)
    np.divide(sums, counts, out=means, where=counts > 0)
    return means


def thinned(places: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most ``most`` of the places, evenly spread."""
    if len(places) <= most:
        return places
    return places[np.linspace(0, len(places) - 1, most).round().astype(np.int64)]


def limits_of(*values: Array, margin: float = 0.06) -> tuple[float, float] | None:
    """Limits of an axis that holds all finite values; None where there are none."""
    joined = np.concatenate([np.ravel(value) for value in values]) if values else np.zeros(0)
    kept = joined[np.isfinite(joined)]
    if len(kept) == 0:
        return None
    low, high = float(kept.min()), float(kept.max())
    room = margin * (high - low) or 0.1 * abs(high) or 1.0
    return low - room, high + room
