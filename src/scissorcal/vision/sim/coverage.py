"""The exact share of every pixel that a polygon covers."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array


def coverage(polygons: Iterable[Array], width: int, height: int) -> NDArray[np.float32]:
    """Share (height, width) of each pixel's area that lies within the polygons, summed over them.

    Vertices (n, 2) are pixels, with the centre of the first one at (0, 0). A polygon that runs the
    other way round subtracts, which makes holes. Every side is cut at the pixels' borders; a piece
    within one pixel covers all that is to the right of it by its height, and of that pixel the
    part to the right of its middle. The running sum over a row is then exact.
    """
    sides = np.concatenate(
        [np.hstack([p, np.roll(p, -1, axis=0)]) for p in map(np.asarray, polygons) if len(p)]
        or [np.empty((0, 4))]
    )
    sides = sides[np.isfinite(sides).all(axis=1)] + 0.5
    within = (np.maximum(sides[:, 1], sides[:, 3]) > 0) & (
        np.minimum(sides[:, 1], sides[:, 3]) < height
    )
    pieces = _cut(_cut(sides[within], axis=1), axis=0)
    row = np.floor(0.5 * (pieces[:, 1] + pieces[:, 3])).astype(np.int64)
    inside = (row >= 0) & (row < height)
    pieces, row = pieces[inside], row[inside]
    x = np.clip(0.5 * (pieces[:, 0] + pieces[:, 2]), 0.0, float(width))
    column = np.floor(x).astype(np.int64)
    rise = pieces[:, 3] - pieces[:, 1]
    share = x - column
    stride = width + 2
    cells = row * stride + column
    total = np.bincount(cells, rise * (1.0 - share), height * stride)
    total += np.bincount(cells + 1, rise * share, height * stride)
    grid = total.reshape(height, stride).astype(np.float32)
    np.cumsum(grid, axis=1, out=grid)
    covered = grid[:, :width]
    return np.clip(covered if covered.sum() >= 0 else -covered, 0.0, 1.0)


def _cut(sides: Array, axis: int) -> Array:
    """Cut sides (n, 4) of x0, y0, x1, y1 wherever they pass a whole number along ``axis``."""
    a, b = sides[:, axis], sides[:, axis + 2]
    low, high = np.floor(np.minimum(a, b)), np.floor(np.maximum(a, b))
    count = (high - low).astype(np.int64) + 1
    index = np.repeat(np.arange(len(sides)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    start, end = sides[index, :2], sides[index, 2:]
    run = (end - start)[:, axis]
    forward = run >= 0
    border = np.where(forward, low[index] + step, high[index] - step + 1)
    safe = np.where(run == 0.0, 1.0, run)
    first = np.where(step == 0, 0.0, (border - start[:, axis]) / safe)
    border = border + np.where(forward, 1.0, -1.0)
    last = np.where(step == count[index] - 1, 1.0, (border - start[:, axis]) / safe)
    first, last = np.clip(first, 0.0, 1.0)[:, None], np.clip(last, 0.0, 1.0)[:, None]
    return np.hstack([start + first * (end - start), start + last * (end - start)])
