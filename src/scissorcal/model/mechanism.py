"""Dynamics of the rig's two axes, or of any chain: free, constrained and in compliant contact.

    D(q) qdd + n(q, qd) = tau + J^T lambda

q are the axes, tau what drives them, J the gradient of a gap that is positive outside the material,
and lambda >= 0 the force with which the material presses. (With a gap that is positive inside, J
has the opposite sign, and the last term is written - J^T lambda.)
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.checks import SMALLEST, check_numbers
from scissorcal.model.friction import FrictionLaw, friction_torque

__all__ = [
    "AxisLaw",
    "BladePoint",
    "ConstrainedMotion",
    "Constraint",
    "ContactLaw",
    "Level",
    "Mechanism",
    "compliant_motion",
    "constrained_motion",
    "free_acceleration",
    "rig_mechanism",
    "surface_constraint",
]


@dataclass(frozen=True)
class Constraint:
    """Gaps phi(q) of c contacts, positive outside, as functions of q (k,) and qd (k,).

    ``value`` gives phi (c,), ``jacobian`` J = d(phi)/dq (c, k), ``bias`` Jdot qd (c,), the gaps'
    second derivatives while no axis accelerates. A gap in metres has a force in newtons.
    """

    value: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    bias: Callable[[Array, Array], Array]


@dataclass(frozen=True)
class ContactLaw:
    """Force of material that gives way, lambda = -k phi - b phi' where phi < 0, and never pulling.

    ``stiffness_N_per_m`` k and ``damping_N_s_per_m`` b (Kelvin-Voigt). The force is 0 outside, and
    where damping would pull a point that leaves faster than the material follows.

    >>> law = ContactLaw(stiffness_N_per_m=10_000.0, damping_N_s_per_m=20.0)
    >>> law.force([1e-4, -1e-4, -1e-4, -1e-4], [0.0, 0.0, -0.01, 0.1])
    array([0. , 1. , 1.2, 0. ])
    """

    stiffness_N_per_m: float
    damping_N_s_per_m: float = 0.0

    def __post_init__(self) -> None:
        check_numbers("the stiffness of a contact (N/m)", self.stiffness_N_per_m, 0.0)
        check_numbers("the damping of a contact (N s/m)", self.damping_N_s_per_m, 0.0)

    def force(self, gap: ArrayLike, gap_rate: ArrayLike) -> Array:
        """lambda [N] at gaps [m] and their rates [m/s], which broadcast."""
        depth = -np.asarray(gap, dtype=np.float64)
        pushed = self.stiffness_N_per_m * depth
        pushed = pushed - self.damping_N_s_per_m * np.asarray(gap_rate, dtype=np.float64)
        return np.where(depth > 0.0, np.maximum(pushed, 0.0), 0.0)


class Level(Protocol):
    """A surface as the zero of a twice differentiable level, positive outside the material."""

    def at(self, point: Array) -> tuple[float, Array, Array]:
        """Level, gradient (3,) and Hessian (3, 3) at one point (3,)."""
        ...


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


@dataclass(frozen=True)
class AxisLaw:
    """One axis: inertia * acceleration + F(place, rate) + offset = drive.

    ``inertia`` in kg m^2 (kg for a sliding axis), ``offset`` in N m (N). Dry friction jumps at
    rest; below ``rest_rate`` (rad/s or m/s) friction is the damper F(rest_rate) / rest_rate, as a
    package's tables have it (0: it jumps, and no integrator of fixed steps stands still).
    ModelError for an inertia that is not positive.
    """

    inertia: float
    friction: FrictionLaw
    offset: float = 0.0
    rest_rate: float = 0.0

    def __post_init__(self) -> None:
        check_numbers("the inertia of an axis (kg m^2 or kg)", self.inertia, SMALLEST)
        check_numbers("the offset of an axis (N m or N)", self.offset)
        check_numbers("the rest rate of an axis (rad/s or m/s)", self.rest_rate, 0.0)

    @classmethod
    def of_fit(
        cls, values: Mapping[str, float], angle_center: float, rest_rate: float
    ) -> "AxisLaw":
        """The axis from a friction fit's parameters by name, at its MAP point or mean."""
        law = FrictionLaw.of_fit(values, angle_center)
        return cls(float(values["inertia"]), law, float(values.get("offset", 0.0)), rest_rate)

    def effort(self, place: ArrayLike, rate: ArrayLike) -> Array:
        """F + offset, what the drive must give at an even rate; places and rates broadcast.

        >>> carriage = AxisLaw(0.8, FrictionLaw({"coulomb": 0.8, "viscous": 4.0}), rest_rate=1e-3)
        >>> carriage.effort(0.0, [-0.1, 0.0, 5e-4, 0.1])
        array([-1.2  ,  0.   ,  0.402,  1.2  ])
        """
        speed = np.asarray(rate, dtype=np.float64)
        if self.rest_rate == 0.0:
            return friction_torque(self.friction, place, speed) + self.offset
        least = np.copysign(np.maximum(np.abs(speed), self.rest_rate), speed)
        share = np.abs(speed) / np.abs(least)
        return share * friction_torque(self.friction, place, least) + self.offset


def rig_mechanism(opening: AxisLaw, advance: AxisLaw) -> Mechanism:
    """The rig's mechanism over q = (opening, advance), from what was identified of each axis.

    D is diagonal: the blades' centre of mass, which would couple the axes by its distance from the
    pivot, is not identified (docs/model.md).
    """
    axes = (opening, advance)
    return Mechanism(
        np.diag([axis.inertia for axis in axes]),
        lambda q, rates: np.array([float(a.effort(q[i], rates[i])) for i, a in enumerate(axes)]),
    )


def surface_constraint(
    point: BladePoint, surface: Level, rotation: ArrayLike, origin: ArrayLike
) -> Constraint:
    """The gap between a point of the blade and a surface, for the rig's two axes.

        phi(q) = phi0(R^T (p(q) - o)) / |grad phi0|

    ``rotation`` R (3, 3) and ``origin`` o (3,) give the pose of the surface's frame in the rig's
    plane. J is n^T dp/dq with the unit normal n out of the material, and the bias
    n^T Jdot qd + v^T H v / |grad phi0| with the Hessian H: the rows of phi0 over the length of its
    gradient, so that lambda is in newtons. That length's own change is left out: it multiplies phi,
    which is 0 on the surface.
    """
    turn = np.asarray(rotation, dtype=np.float64)
    start = np.asarray(origin, dtype=np.float64)

    def level_at(q: Array) -> tuple[float, Array, Array, float]:
        level, gradient, hessian = surface.at(turn.T @ (point.place(q) - start))
        return level, turn @ gradient, turn @ hessian @ turn.T, float(np.linalg.norm(gradient))

    def value(q: Array) -> Array:
        level, _, _, length = level_at(q)
        return np.array([level / length])

    def jacobian(q: Array) -> Array:
        _, gradient, _, length = level_at(q)
        return np.asarray(gradient @ point.jacobian(q) / length)[None, :]

    def bias(q: Array, rates: Array) -> Array:
        _, gradient, hessian, length = level_at(q)
        velocity = point.velocity(q, rates)
        along = gradient @ point.acceleration_bias(q, rates)
        return np.array([(along + velocity @ hessian @ velocity) / length])

    return Constraint(value, jacobian, bias)
