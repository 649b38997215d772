"""A proposal for curved posteriors: normal given each place along a few bent directions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import gamma

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.inference.mixture import Mixture

Many = Callable[[Array], Array]
Node = tuple[int, ...]

KERNEL = 0.75
"""Width of a component along the lattice, in distances of nodes: a sum of equal normals so wide is
level to 2 exp(-2 pi^2 0.75^2) = 3e-5 of itself. Nodes are a standard deviation apart, or nearer
where the others' optimum leaves a straight line by more than its own conditional standard deviation
from one to the next."""

DEPTH = 8.0
"""Fall of the marginal log density, in nats, at which the lattice ends: that of a normal at 4 of
its standard deviations, beyond which lies a tenth of what one of 2,000 draws weighs."""

MOST_NODES = 400
"""Nodes of a lattice: one of three parameters, a standard deviation apart, has 268 within
``DEPTH``, and those beside them. Where it is too few, the highest are there."""

STEP = 0.3
"""Step of differences, in conditional standard deviations, as where a fit measures curvature."""

ROUNDS = 6
ARRIVED = 0.05
"""Nats that a further Newton step would have to promise."""

LEAST_CURVATURE = 0.05
"""Curvature of a conditional, in that at the optimum, below which it is taken as this."""

SHORTER = np.array([1.0, 0.5, 0.25, 0.1])


@dataclass(frozen=True)
class _Given:
    """The optimum (p,) given some parameters: log density, the covariance of the others there.

    ``follow`` (others, given) is how much the others move with those.
    """

    point: Array
    height: float
    covariance: Array
    follow: Array

    @cached_property
    def mass(self) -> float:
        """Log of the marginal density, up to a constant, as Laplace approximates it."""
        return self.height + 0.5 * float(np.linalg.slogdet(self.covariance)[1])


def nested_mixture(
    log_posteriors: Many, centre: Array, covariance: Array, along: Sequence[int], budget: int
) -> Mixture | None:
    """A mixture that follows a posterior along a few parameters in which it bends.

    On a lattice over the parameters at ``along``, as wide and as oblique as their covariance, the
    others are brought to their optimum, and their covariance is that of the curvature there: the
    nested approximation of Rue, Martino and Chopin (2009, doi:10.1111/j.1467-9868.2008.00700.x), of
    which an importance proposal is made. ``log_posteriors`` gives those of points (k, p), shape
    (k,); ``centre`` (p,) and ``covariance`` (p, p) are the normal approximation at the optimum. The
    lattice grows from there, at its highest end first, as long as the marginal density is within
    ``DEPTH`` nats of the highest. None where the curvature at the centre is not finite, and where
    it takes more than ``budget`` evaluations.
    """
    given, others = np.array(along), np.setdiff1d(np.arange(len(centre)), along)
    narrow = 1.0 / np.sqrt(np.diag(np.linalg.inv(covariance)))
    root = np.linalg.cholesky(covariance[np.ix_(given, given)])
    spent = 0

    def many(points: Array) -> Array:
        nonlocal spent
        spent += len(points)
        return log_posteriors(points)

    def solved(from_node: _Given, to: Array) -> _Given | None:
        start = from_node.point.copy()
        start[given] = to
        start[others] += from_node.follow @ (to - from_node.point[given])
        return _conditional(many, start, given, others, narrow)

    first = _conditional(many, centre, given, others, narrow)
    if first is None:
        return None
    beside = [
        [solved(first, centre[given] + sign * axis) for sign in (-1.0, 1.0)] for axis in root.T
    ]
    root = root * _spacing(first, beside, others)
    origin: Node = (0,) * len(given)
    nodes: dict[Node, _Given] = {origin: first}
    waiting, highest = [origin], first.mass
    while waiting and len(nodes) < MOST_NODES:
        if spent > budget:
            return None
        waiting.sort(key=lambda node: nodes[node].mass)
        here = waiting.pop()
        for node in _neighbours(here):
            if node in nodes:
                continue
            found = solved(nodes[here], centre[given] + root @ np.array(node))
            if found is None:
                continue
            nodes[node] = found
            highest = max(highest, found.mass)
            if found.mass > highest - DEPTH:
                waiting.append(node)
    kept = [node for node in nodes.values() if node.mass > highest - DEPTH]
    width = KERNEL**2 * root @ root.T
    return Mixture.of(
        np.exp(np.array([node.mass for node in kept]) - highest),
        np.stack([node.point for node in kept]),
        np.stack([_joint(node, width, given, others) for node in kept]),
    )


def _spacing(first: _Given, beside: Sequence[Sequence[_Given | None]], others: Integers) -> Array:
    """Distances of nodes along each axis (k,), in its standard deviations.

    ``beside`` are the optima one standard deviation to either side of the first, along each axis.
    """
    inverse = np.linalg.inv(first.covariance)
    wanted = np.ones(len(beside))
    for axis, (before, after) in enumerate(beside):
        if before is not None and after is not None:
            bend = (0.5 * (before.point + after.point) - first.point)[others]
            wanted[axis] = 1.0 / max(1.0, float(bend @ inverse @ bend) ** 0.25)
    size = len(wanted)
    ball = (2.0 * np.pi * DEPTH) ** (0.5 * size) / gamma(0.5 * size + 1.0)
    found = wanted
    for _ in range(size):  # as far apart as leaves so many nodes; none farther than one
        wide = found < 1.0
        lacking = ball / MOST_NODES / float(np.prod(found))
        if lacking > 1.0 and np.any(wide):
            share = lacking ** (1.0 / np.count_nonzero(wide))
            found = np.minimum(1.0, np.where(wide, found * share, found))
    return found


def _neighbours(node: Node) -> list[Node]:
    return [
        (*node[:place], node[place] + step, *node[place + 1 :])
        for place in range(len(node))
        for step in (-1, 1)
    ]


def _joint(node: _Given, width: Array, given: Integers, others: Integers) -> Array:
    """Covariance (p, p) of a component whose other parameters follow those of the lattice."""
    joint = np.empty((len(node.point), len(node.point)))
    shared = node.follow @ width
    joint[np.ix_(given, given)] = width
    joint[np.ix_(others, given)] = shared
    joint[np.ix_(given, others)] = shared.T
    joint[np.ix_(others, others)] = node.covariance + shared @ node.follow.T
    return joint


def _conditional(
    log_posteriors: Many, start: Array, given: Integers, others: Integers, narrow: Array
) -> _Given | None:
    """Newton's optimum over ``others``; None where a density beside it is not finite."""
    point, scale = start, narrow[others]
    unit = np.outer(scale, scale)
    for _ in range(ROUNDS):
        height, slope, curvature = _derivatives(log_posteriors, point, STEP * narrow)
        if not np.all(np.isfinite(curvature)):
            return None
        values, vectors = np.linalg.eigh(-curvature[np.ix_(others, others)] * unit)
        covariance = (vectors / np.maximum(values, LEAST_CURVATURE)) @ vectors.T * unit
        move = covariance @ slope[others]
        found = _Given(point, height, covariance, covariance @ curvature[np.ix_(others, given)])
        if slope[others] @ move < ARRIVED:
            break
        tried = np.repeat(point[None], len(SHORTER), axis=0)
        tried[:, others] += SHORTER[:, None] * move
        heights = log_posteriors(tried)
        if not np.max(heights) > height:
            break
        point = tried[int(np.argmax(heights))]
    return found


def _derivatives(log_posteriors: Many, point: Array, step: Array) -> tuple[float, Array, Array]:
    """Value, gradient (p,) and Hessian (p, p) by differences, of points evaluated at once."""
    size = len(point)
    reach = np.diag(step)
    first, second = np.tril_indices(size, -1)
    away = np.concatenate([np.zeros((1, size)), reach, -reach, reach[first] + reach[second]])
    heights = log_posteriors(point + away)
    height, up, down, both = np.split(heights, [1, size + 1, 2 * size + 1])
    with np.errstate(invalid="ignore"):
        hessian = np.diag((up - 2.0 * height + down) / step**2)
        mixed = (both - up[first] - up[second] + height) / (step[first] * step[second])
        hessian[first, second] = hessian[second, first] = mixed
        slope = (up - down) / (2.0 * step)
    return float(height[0]), slope, hessian
