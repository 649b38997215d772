"""What holds or presses a mechanism: constraints phi(q) = 0, and material that gives way."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.checks import check_numbers


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

    def seen(q: Array) -> tuple[float, Array, Array, float]:
        level, gradient, hessian = surface.at(turn.T @ (point.place(q) - start))
        return level, turn @ gradient, turn @ hessian @ turn.T, float(np.linalg.norm(gradient))

    def value(q: Array) -> Array:
        level, _, _, length = seen(q)
        return np.array([level / length])

    def jacobian(q: Array) -> Array:
        _, gradient, _, length = seen(q)
        return np.asarray(gradient @ point.jacobian(q) / length)[None, :]

    def bias(q: Array, rates: Array) -> Array:
        _, gradient, hessian, length = seen(q)
        velocity = point.velocity(q, rates)
        along = gradient @ point.acceleration_bias(q, rates)
        return np.array([(along + velocity @ hessian @ velocity) / length])

    return Constraint(value, jacobian, bias)
