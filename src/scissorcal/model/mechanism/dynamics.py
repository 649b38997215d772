"""Forward dynamics: accelerations and contact forces of a mechanism at one state."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.mechanism.contact import Constraint, ContactLaw

INDEPENDENT = 1e-7
"""Least singular value of the constraints' directions, each scaled to one, over the largest: below
it their forces would have fewer than two digits."""


@dataclass(frozen=True)
class Mechanism:
    """Inertia D(q) and effort n(q, qd) of k axes: of the rig (:func:`rig_mechanism`) or any chain.

    ``inertia`` is D, a symmetric positive definite (k, k), or a function of q (k,) that gives it.
    ``effort`` gives n (k,) at q and qd: all that the drive must provide beside D qdd, as friction,
    weight and the Coriolis terms of a chain.

    >>> falling = Mechanism(np.eye(2), lambda q, rates: np.array([0.0, 9.81]))
    >>> free_acceleration(falling, [0.0, 0.0], [1.0, 0.0], [0.0, 0.0])
    array([ 0.  , -9.81])
    """

    inertia: Array | Callable[[Array], Array]
    effort: Callable[[Array, Array], Array]

    def inertia_at(self, q: Array) -> Array:
        """D(q), (k, k)."""
        return np.asarray(self.inertia(q) if callable(self.inertia) else self.inertia)


@dataclass(frozen=True)
class ConstrainedMotion:
    """Accelerations qdd (k,) of the axes, and the forces lambda (c,) of c contacts.

    A force below 0 pulls: where a constraint stands for a contact, the contact has ended.
    """

    acceleration: Array
    force: Array


def free_acceleration(
    mechanism: Mechanism, q: ArrayLike, rates: ArrayLike, drive: ArrayLike
) -> Array:
    """Accelerations D^-1 (tau - n) of the axes (k,) without contact.

    ``q``, ``rates`` and ``drive`` (k,) in the axes' units: rad, rad/s and N m, or m, m/s and N.
    ValueError where D is not positive definite.
    """
    half, left = _driven(mechanism, q, rates, drive)
    return np.asarray(half.T @ left)


def constrained_motion(
    mechanism: Mechanism,
    constraint: Constraint,
    q: ArrayLike,
    rates: ArrayLike,
    drive: ArrayLike,
    *,
    stabilisation_per_s: float = 0.0,
) -> ConstrainedMotion:
    """Accelerations and forces while phi(q) = 0 is held, by the Karush-Kuhn-Tucker system

        [ D  -J^T ] [ qdd    ]   [ tau - n                            ]
        [ J   0   ] [ lambda ] = [ -Jdot qd - 2 w J qd - w^2 phi      ]

    With w = ``stabilisation_per_s`` = 0 the second row is exact, and what integration leaves of phi
    and its rate stays or grows. With w > 0 both decay as exp(-w t), critically damped (Baumgarte
    1972, doi:10.1016/0045-7825(72)90018-7). A tenth of the integrator's steps per second is
    enough; explicit integrators are unstable from about two of them.

    ValueError where D is not positive definite, and where constraints depend on each other or one
    of them is moved by no axis: their forces are not determined then.
    """
    half, left = _driven(mechanism, q, rates, drive)
    place, speed = np.asarray(q, dtype=np.float64), np.asarray(rates, dtype=np.float64)
    jacobian = np.asarray(constraint.jacobian(place))
    w = stabilisation_per_s
    wanted = -constraint.bias(place, speed) - 2.0 * w * (jacobian @ speed)
    wanted = wanted - w * w * constraint.value(place)
    directions = half @ jacobian.T
    force = _force(directions, left, wanted)
    return ConstrainedMotion(np.asarray(half.T @ (left + directions @ force)), force)


def compliant_motion(
    mechanism: Mechanism,
    constraint: Constraint,
    contact: ContactLaw,
    q: ArrayLike,
    rates: ArrayLike,
    drive: ArrayLike,
) -> ConstrainedMotion:
    """Accelerations and forces where material gives way: lambda of a :class:`ContactLaw`.

    ``constraint`` gives the gaps (c,); each has the same law. As the stiffness grows, the motion
    goes to that of :func:`constrained_motion` while no force pulls. ValueError where D is not
    positive definite.
    """
    half, left = _driven(mechanism, q, rates, drive)
    place, speed = np.asarray(q, dtype=np.float64), np.asarray(rates, dtype=np.float64)
    jacobian = np.asarray(constraint.jacobian(place))
    force = contact.force(constraint.value(place), jacobian @ speed)
    pushed = left + half @ (jacobian.T @ force)
    return ConstrainedMotion(np.asarray(half.T @ pushed), force)


def _driven(
    mechanism: Mechanism, q: ArrayLike, rates: ArrayLike, drive: ArrayLike
) -> tuple[Array, Array]:
    """L^-1, with D = L L^T, and L^-1 (tau - n)."""
    place, speed = np.asarray(q, dtype=np.float64), np.asarray(rates, dtype=np.float64)
    try:
        half = np.linalg.inv(np.linalg.cholesky(mechanism.inertia_at(place)))
    except np.linalg.LinAlgError:
        raise ValueError("the inertia D(q) of a mechanism has to be positive definite") from None
    left = np.asarray(drive, dtype=np.float64) - mechanism.effort(place, speed)
    return np.asarray(half, dtype=np.float64), np.asarray(half @ left)


def _force(directions: Array, driven: Array, wanted: Array) -> Array:
    """lambda (c,) from W^T (driven + W lambda) = wanted, with W = L^-1 J^T (k, c)."""
    size = np.linalg.norm(directions, axis=0)
    if len(size) == 0:
        return np.zeros(0)
    left, spread, right = np.linalg.svd(
        directions / np.where(size > 0.0, size, 1.0), full_matrices=False
    )
    if len(spread) < len(size) or not spread[-1] > INDEPENDENT * spread[0]:
        raise ValueError(
            "the constraints depend on each other at this place, or no axis moves one of them, so "
            "their forces are not determined: leave one out"
        )
    missing = right @ (wanted / size) / spread - left.T @ driven
    return np.asarray(right.T @ (missing / spread) / size)
