"""Nearest points of a height field, by Newton's method on the conditions of Lagrange.

The nearest point q of p fulfils q - p + lambda grad phi0(q) = 0 and phi0(q) = 0. On z = f(x, y) the
second and the z of the first give lambda and q_z, and x, y minimise the distance D.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model.surface.protocol import NearestPoints, Surface

_SAMPLES = 2
"""Places searched on each interval of the spline."""

_STARTS = 8
"""Local minima of the searched places from which Newton's method starts."""

_MOST_DOUBLINGS = 40
"""Of the width of an interval: farther points start from the last of these."""

_AT_ONCE = 400_000
"""Distances held in memory."""

_MOST_STEPS = 200
"""A point at a centre of curvature converges linearly, by a third of the error each step."""

_CLOSED = 1e-6
"""Where 1 + distance x curvature is less than this, p is at a centre of curvature."""

_AS_NEAR = 1e-9
"""Distances that differ by less than this share, at places that are apart, count as equal."""


class Heights(Surface, Protocol):
    """What is asked of a height field: its rectangle and intervals beside level and derivatives."""

    @property
    def x_m(self) -> tuple[float, float]: ...

    @property
    def y_m(self) -> tuple[float, float]: ...

    @property
    def intervals(self) -> tuple[int, int]: ...

    @property
    def interval_m(self) -> tuple[float, float]: ...


def nearest_on_height_field(field: Heights, points: Array) -> NearestPoints:
    """Nearest points of a height field, from the lowest of several local minima of the distance.

    Minima are sought on a net of two places per interval, and of doubled gaps beyond. One between
    these places may be missed where the distance has several minima within an interval: on
    surfaces of random weights 5 of 30,000 were.
    """
    shape = points.shape[:-1]
    if points.size == 0:
        none = np.zeros(shape, dtype=bool)
        return NearestPoints(points, np.zeros(shape), none, none)
    flat = points.reshape(-1, 3)
    net = _net(field, flat)
    step = max(1, _AT_ONCE // net[..., 0].size)
    parts = [_search(field, net, flat[k : k + step]) for k in range(0, len(flat), step)]
    return NearestPoints(
        np.concatenate([part.points for part in parts]).reshape(points.shape),
        np.concatenate([part.distance for part in parts]).reshape(shape),
        np.concatenate([part.unique for part in parts]).reshape(shape),
        np.concatenate([part.converged for part in parts]).reshape(shape),
    )


def _net(field: Heights, points: Array) -> Array:
    """Places on the surface (n, m, 3), and on its continuation as far as ``points`` are."""
    far = float(np.linalg.norm(points[np.isfinite(points).all(axis=-1)], axis=-1).max(initial=0.0))
    axes = []
    for (start, end), count in zip((field.x_m, field.y_m), field.intervals, strict=True):
        width = (end - start) / count
        doublings = math.ceil(math.log2(max(2.0, 2.0 * far / width)))
        beyond = width * 2.0 ** np.arange(min(doublings, _MOST_DOUBLINGS) + 1)
        within = np.linspace(start, end, _SAMPLES * count + 1)
        axes.append(np.concatenate((start - beyond[::-1], within, end + beyond)))
    return _lifted(field, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))


def _search(field: Heights, net: Array, p: Array) -> NearestPoints:
    known = np.asarray(np.isfinite(p).all(axis=-1))
    target = np.where(known[:, None], p, 0.0)
    starts = _starts(field, net, target)
    many = np.broadcast_to(target[:, None], (*starts.shape[:-1], 3))
    place, good, strict = _descend(field, starts.reshape(-1, 2), many.reshape(-1, 3))
    q = _lifted(field, place).reshape(many.shape)
    good, strict = good.reshape(many.shape[:-1]), strict.reshape(many.shape[:-1])
    far = np.where(good, np.linalg.norm(q - many, axis=-1), np.inf)
    best = far.argmin(axis=-1)
    rows = np.arange(len(p))
    size, chosen = far[rows, best], q[rows, best]
    with np.errstate(invalid="ignore"):  # infinite distances of those that did not converge
        apart = np.linalg.norm(q - chosen[:, None], axis=-1) > 1e-3 * min(field.interval_m)
        tied = apart & (far - size[:, None] <= _AS_NEAR * size[:, None])
    converged = known & good[rows, best]
    points = np.where(converged[:, None], chosen, np.nan)
    distance = np.where(converged, np.copysign(size, field.level(target)), np.nan)
    unique = converged & strict[rows, best] & ~tied.any(axis=-1)
    return NearestPoints(points, distance, unique, converged)


def _starts(field: Heights, net: Array, p: Array) -> Array:
    """Where to start (points, starts, 2): local minima of the net, and places beside p."""
    squares = ((net - p[:, None, None]) ** 2).sum(axis=-1)
    padded = np.pad(squares, ((0, 0), (1, 1), (1, 1)), constant_values=np.inf)
    least = np.ones(squares.shape, dtype=bool)
    n, m = squares.shape[1:]
    for i in range(3):
        for j in range(3):
            least &= squares <= padded[:, i : i + n, j : j + m]
    ranked = np.where(least, squares, np.inf).reshape(len(p), -1)
    count = min(_STARTS, ranked.shape[1])
    order = np.argpartition(ranked, count - 1, axis=-1)[:, :count]
    minima = net[..., :2].reshape(-1, 2)[order]
    beside = [p[:, None, :2]]
    for axis in (0, 1):
        line = np.moveaxis(net, axis, 0)[0, :, :2]
        line = np.broadcast_to(line, (len(p), *line.shape)).copy()
        line[..., axis] = p[:, None, axis]
        gaps = ((_lifted(field, line) - p[:, None]) ** 2).sum(axis=-1)
        beside.append(np.take_along_axis(line, gaps.argmin(axis=-1)[:, None, None], axis=1))
    return np.concatenate([minima, *beside], axis=1)


def _descend(
    field: Heights, place: Array, p: Array
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Minimise the distance from each start; places, whether converged, whether a strict minimum.

    Newton steps on D = |q - p|^2 / 2; where its Hessian is not positive its negative eigenvalues
    are turned round, and a step that does not lower D enough is halved.
    """
    place = place.copy()
    reach = _reach(field)
    active = np.arange(len(place))
    good = np.zeros(len(place), dtype=bool)
    for _ in range(_MOST_STEPS):
        u, target = place[active], p[active]
        value, slope, bend, metric = _distance(field, u, target)
        step, across, _ = _step(slope, bend, metric)
        place[active] = _halved(field, u, target, value, slope, step)
        small = np.linalg.norm(step, axis=-1) <= 1e-13 * (reach + np.linalg.norm(u, axis=-1))
        done = small | (across <= 1e-15 * (reach + np.linalg.norm(target, axis=-1)))
        good[active[done]] = True
        active = active[~done]
        if active.size == 0:
            break
    _, slope, bend, metric = _distance(field, place, p)
    return place, good, _step(slope, bend, metric)[2] > _CLOSED


def _distance(field: Heights, u: Array, p: Array) -> tuple[Array, Array, Array, Array]:
    """D at places (n, 2), its gradient and Hessian by them, and the surface's metric I + f' f'."""
    at = np.concatenate((u, np.zeros((len(u), 1))), axis=-1)
    tilt = -field.gradient(at)[..., :2]
    rise = -field.level(at) - p[:, 2]
    metric = np.eye(2) + tilt[:, :, None] * tilt[:, None, :]
    bend = metric - rise[:, None, None] * field.hessian(at)[:, :2, :2]
    gap = u - p[:, :2]
    return (
        0.5 * ((gap**2).sum(axis=-1) + rise**2),
        gap + rise[:, None] * tilt,
        bend,
        metric,
    )


def _step(slope: Array, bend: Array, metric: Array) -> tuple[Array, Array, Array]:
    """Newton step (n, 2), how far q - p is off the normal (n,), and the least eigenvalue (n,).

    That of the Hessian in the surface's metric: 1 + distance x curvature, for one of the principal
    curvatures.
    """
    root = np.linalg.inv(np.linalg.cholesky(metric))
    values, axes = np.linalg.eigh(root @ bend @ root.swapaxes(-1, -2))
    along = np.einsum("nki,nkl,nl->ni", axes, root, slope)
    safe = np.maximum(np.abs(values), 1e-12)
    back = np.einsum("nlk,nli->nki", root, axes)
    step = -np.einsum("nki,ni->nk", back, along / safe)
    return step, np.linalg.norm(along, axis=-1), values[:, 0]


def _halved(field: Heights, u: Array, p: Array, value: Array, slope: Array, step: Array) -> Array:
    """The step that lowers D by a part of what its slope says, halved up to 40 times."""
    falls = (slope * step).sum(axis=-1)
    rounding = 1e-15 * (_reach(field) + np.linalg.norm(p, axis=-1)) * np.sqrt(value) + 1e-14 * value
    share = np.ones(len(u))
    for _ in range(40):
        tried = u + share[:, None] * step
        q = _lifted(field, tried)
        after = 0.5 * ((q - p) ** 2).sum(axis=-1)
        high = after > value + 1e-4 * share * falls + rounding
        if not high.any():
            break
        share = np.where(high, 0.5 * share, share)
    return np.asarray(u + share[:, None] * step)


def _reach(field: Heights) -> float:
    """Size of the numbers from which places are computed."""
    return max(map(abs, (*field.x_m, *field.y_m)))


def _lifted(field: Heights, place: Array) -> Array:
    """Points (..., 3) of the surface over places (..., 2)."""
    flat = np.concatenate((place, np.zeros((*place.shape[:-1], 1))), axis=-1)
    flat[..., 2] = -field.level(flat)
    return flat
