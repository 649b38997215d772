"""The mean torque from the kernel's tables, with fracture's ripple averaged out."""

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Kernel
from scissorcal.package.compile import Arrays, kernel_tables, table_of
from scissorcal.package.manifest import Mechanics, Ranges

LEVELS = 9
EVEN = 1e-6


def energy_levels(mean_energy: Array) -> Array:
    """Energies (J/m) for which there are kernels, from the values of the mean energy's table."""
    lowest, highest = float(np.min(mean_energy)), float(np.max(mean_energy))
    even = highest - lowest <= EVEN * highest
    return np.linspace(lowest, highest, 1 if even else LEVELS)


class AverageTorque:
    """Evaluates a package's tables with the ripple averaged out.

    A kernel whose crack is smooth and costs the ripple's mean energy gives the mean torque. That
    energy depends a little on the opening, and a kernel knows one energy: so there are kernels for
    a few levels of it, and the torque is taken linearly between the two nearest. Without a ripple,
    or with a power law, there is one kernel. Raises ValueError where the parts make no model.
    """

    def __init__(self, mechanics: Mechanics, ranges: Ranges, arrays: Arrays) -> None:
        mean = arrays.get("tables/mean_energy.npy")
        self._energy = None if mean is None else table_of(mean)
        if mean is None:
            self._kernels = [Kernel(kernel_tables(mechanics, ranges, arrays))]
            return
        levels = energy_levels(mean[1])
        self._lowest, self._highest = float(levels[0]), float(levels[-1])
        self._kernels = [
            Kernel(kernel_tables(mechanics, ranges, arrays, mean_energy=float(level)))
            for level in levels
        ]

    def torque(self, opening: Array, opening_rate: Array, contact: Array) -> Array:
        """Torque in N m over arrays of one shape (rad, rad/s, m); the result has that shape."""
        flat = opening.ravel(), opening_rate.ravel(), contact.ravel()
        if self._energy is None or len(self._kernels) == 1:
            torque = self._kernels[0].torque(*flat).astype(np.float64)
            return np.asarray(torque.reshape(opening.shape))
        energy = self._energy.evaluate(flat[0], held=True).astype(np.float64)
        span = (self._highest - self._lowest) / (len(self._kernels) - 1)
        place = np.clip((energy - self._lowest) / span, 0.0, len(self._kernels) - 1)
        below = np.minimum(place.astype(np.int64), len(self._kernels) - 2)
        result = np.empty(flat[0].shape)
        for level in np.unique(below):
            here = below == level
            where = [array[here] for array in flat]
            low, high = (self._kernels[level + i].torque(*where).astype(np.float64) for i in (0, 1))
            result[here] = low + (place[here] - level) * (high - low)
        return result.reshape(opening.shape)
