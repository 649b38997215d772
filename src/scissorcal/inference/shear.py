"""Coordinates in which the curved ridge of a posterior is straight."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.mixture import Mixture

Array = NDArray[np.float64]

STEP = 1e-4


@dataclass(frozen=True)
class Shear:
    """The parameter at ``place`` less ``bend`` of the one at ``other``; the rest as they are.

    Where data determine a combination of two parameters, the posterior is a curved ridge, and no
    Student-t fits it. Such a change of one coordinate has a Jacobian of 1: densities are the same.
    At points whose ``bend`` is beyond ``most`` there is no such ridge.
    """

    place: int
    other: int
    bend: Callable[[Array], Array]
    most: float = np.inf

    def serves(self, point: Array) -> bool:
        """Whether a posterior with its optimum at ``point`` (p,) has the ridge."""
        return bool(self.bend(point[self.other]) <= self.most)

    def straight(self, points: Array) -> Array:
        """Points (..., p) in the coordinates in which the ridge is straight.

        >>> ridge = Shear(0, 1, np.square)
        >>> ridge.straight(np.array([[9.0, 3.0], [4.0, 2.0]]))
        array([[0., 3.],
               [0., 2.]])
        >>> ridge.bent(ridge.straight(np.array([5.0, 3.0])))
        array([5., 3.])
        """
        moved = np.array(points, dtype=np.float64)
        moved[..., self.place] -= self.bend(moved[..., self.other])
        return moved

    def bent(self, points: Array) -> Array:
        """Points (..., p) back in the parameters' own coordinates."""
        moved = np.array(points, dtype=np.float64)
        moved[..., self.place] += self.bend(moved[..., self.other])
        return moved

    def mixture(self, mixture: Mixture) -> Mixture:
        """A mixture of the parameters' own coordinates, component by component."""
        slopes = np.stack([self._slope(centre) for centre in mixture.centres])
        covariances = mixture.roots @ mixture.roots.transpose(0, 2, 1)
        moved = slopes @ covariances @ slopes.transpose(0, 2, 1)
        return Mixture.of(mixture.weights, self.straight(mixture.centres), moved)

    def _slope(self, centre: Array) -> Array:
        """Derivative (p, p) of straight coordinates at ``centre`` (p,)."""
        slope = np.eye(len(centre))
        at = centre[self.other]
        above, below = self.bend(np.asarray(at + STEP)), self.bend(np.asarray(at - STEP))
        slope[self.place, self.other] = -(above - below) / (2.0 * STEP)
        return slope
