"""Cubic B-splines on evenly spaced knots, continued straight beyond their ends."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

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
    place = np.clip((s - start) / width, 0.0, float(pieces))
    known = np.where(np.isnan(place), 0.0, place)  # NaN stays NaN by t
    piece = np.minimum(known.astype(np.int64), pieces - 1)
    t = place - piece
    rates = _basis_slope(t)
    used = _four(w, piece)
    tilt = sum(weight * rate for weight, rate in zip(used, rates, strict=True)) / width
    if slope:
        return np.asarray(tilt)
    value = sum(weight * share for weight, share in zip(used, _basis(t), strict=True))
    return np.asarray(value + tilt * (s - start - width * place))


def _four(weights: Array, piece: NDArray[np.int64]) -> list[Array]:
    """The four weights that act on each piece, each of the broadcast shape."""
    if weights.ndim == 1:
        return [weights[piece + k] for k in range(FEWEST)]
    shape = np.broadcast_shapes(weights.shape[:-1], piece.shape)
    index = np.broadcast_to(piece, shape)[..., None]
    spread = np.broadcast_to(weights, (*shape, weights.shape[-1]))
    return [np.take_along_axis(spread, index + k, axis=-1)[..., 0] for k in range(FEWEST)]


def _basis(t: Array) -> tuple[Array, ...]:
    u = 1.0 - t
    return (
        u**3 / 6.0,
        (3.0 * t**3 - 6.0 * t**2 + 4.0) / 6.0,
        (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0,
        t**3 / 6.0,
    )


def _basis_slope(t: Array) -> tuple[Array, ...]:
    u = 1.0 - t
    return -(u**2) / 2.0, (1.5 * t - 2.0) * t, (2.0 - 1.5 * u) * u, t**2 / 2.0
