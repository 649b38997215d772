"""Cubic B-splines on evenly spaced knots, continued straight beyond their ends."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array

FEWEST = 4
"""Weights of the shortest cubic spline, which is one cubic."""


def spline_value(weights: ArrayLike, start: float, end: float, at: ArrayLike) -> Array:
    """Value of the spline with ``weights`` (..., n) between ``start`` and ``end`` at ``at``.

    The axes of ``weights`` before its last broadcast with ``at``, so that draws of a spline are
    weights (draws, 1, n) with places (points,). Beyond its ends it goes on as a straight line.
    """
    return _evaluate(weights, start, end, at, slope=False)


def spline_slope(weights: ArrayLike, start: float, end: float, at: ArrayLike) -> Array:
    """Derivative of :func:`spline_value` by place."""
    return _evaluate(weights, start, end, at, slope=True)


def spline_design(count: int, start: float, end: float, at: ArrayLike) -> Array:
    """Matrix (points, count) that takes weights to values at the places ``at`` (points,)."""
    places = np.asarray(at, dtype=np.float64)
    return spline_value(np.eye(count)[:, None, :], start, end, places).T


def spline_powers(weights: ArrayLike) -> Array:
    """Coefficients (..., pieces, 4) of 1, t, t^2 and t^3 on each piece of a spline.

    ``weights`` (..., n) make n - 3 pieces; t goes from 0 to 1 along each.

    >>> spline_powers([0.0, 0.0, 0.0, 6.0]).tolist()
    [[0.0, 0.0, 0.0, 1.0]]
    """
    four = np.lib.stride_tricks.sliding_window_view(np.asarray(weights, np.float64), FEWEST, -1)
    return np.asarray(four @ _POWERS)


_POWERS = (
    np.array(((1, -3, 3, -1), (4, 0, -6, 3), (1, 3, 3, -3), (0, 0, 0, 1)), dtype=np.float64) / 6.0
)
"""Row k: the powers of t in the k-th of the four basis functions on a piece."""


def _evaluate(weights: ArrayLike, start: float, end: float, at: ArrayLike, slope: bool) -> Array:
    w = np.asarray(weights, dtype=np.float64)
    s = np.asarray(at, dtype=np.float64)
    pieces = w.shape[-1] - FEWEST + 1
    if pieces < 1 or not end > start:
        raise ValueError("a cubic spline needs at least four weights, and its end after its start")
    width = (end - start) / pieces
    along = (s - start) / width
    place = np.clip(along, 0.0, float(pieces))
    known = np.where(np.isnan(place), 0.0, place)  # NaN stays NaN by t
    piece = np.minimum(known.astype(np.int64), pieces - 1)
    t = place - piece
    zeroth, first, second, third = (_of_piece(row, piece) for row in _rows(w))
    beyond = along - place
    outside = bool(np.any(beyond))
    if slope or outside:
        tilt = first + t * (2.0 * second + 3.0 * third * t)
    if slope:
        return np.asarray(tilt / width)
    value = zeroth + t * (first + t * (second + t * third))
    return np.asarray(value + tilt * beyond if outside else value)


def _rows(weights: Array) -> tuple[Array, ...]:
    """Coefficients of 1, t, t^2 and t^3, each (..., pieces)."""
    return tuple(np.moveaxis(spline_powers(weights), -1, 0))


def _of_piece(row: Array, piece: NDArray[np.int64]) -> Array:
    """The coefficient that acts at each place, of the broadcast shape."""
    if row.ndim == 1:
        return np.asarray(row[piece])
    shape = np.broadcast_shapes(row.shape[:-1], piece.shape)
    spread = np.broadcast_to(row, (*shape, row.shape[-1]))
    index = np.broadcast_to(piece, shape)[..., None]
    return np.asarray(np.take_along_axis(spread, index, axis=-1)[..., 0])
