"""The noise of the drive's torque: a white and a correlated part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

LENGTHS = (4, 8, 16, 32, 64, 128)
"""Ticks over which the torque is summed."""
TIMES_S = tuple(np.geomspace(0.002, 0.3, 60).tolist())
FEWEST_SUMS = 20
BLOCKS = 12
"""Groups of stretches of which each is left out in turn for the errors."""


@dataclass(frozen=True)
class TorqueNoise:
    """Covariance of two samples i and j of the torque: B [i = j] + C exp(-|i - j| tick / time).

    ``white_Nm`` and ``slow_Nm`` are the roots of B and C, ``slow_time_s`` the time; each has its
    standard error (jackknife over stretches). Newtons for a linear joint.
    """

    white_Nm: float
    slow_Nm: float
    slow_time_s: float
    white_error_Nm: float = float("nan")
    slow_error_Nm: float = float("nan")
    slow_time_error_s: float = float("nan")

    def variance_of_mean(self, ticks: int, tick_s: float) -> float:
        """Variance of the mean of ``ticks`` successive samples.

        >>> round(TorqueNoise(1e-3, 0.0, 0.01).variance_of_mean(4, 1e-3) * 1e6, 3)
        0.25
        """
        slow = float(_memory(np.array([ticks]), np.exp(-tick_s / self.slow_time_s))[0])
        return (self.white_Nm**2 * ticks + self.slow_Nm**2 * slow) / ticks**2


def torque_noise(
    stretches: tuple[Array, ...],
    tick_s: float,
    momenta: tuple[Array, ...] | None = None,
    momentum_sd: float = 0.0,
    idle_white: float = 0.0,
) -> TorqueNoise | None:
    """Separate the noise's two time scales by the variance of sums over 4 to 128 ticks.

    ``stretches`` hold the torque's residuals (k,) at successive samples of uninterrupted motion,
    without inertia; ``momenta`` inertia times rate (k,) at the same samples. A sum over n ticks
    less the momentum gained has the variance

        B n + C sum_ij exp(-|i - j| tick / time) + 2 (momentum_sd / tick)^2,

    ``momentum_sd`` being the momenta's own noise, from the encoder's steps. B and C, both positive,
    are fitted for each of a range of times; B is at least the square of ``idle_white``, the
    sensors' noise at rest, which a coarse encoder's momenta hide in motion. Stretches' own means
    are taken out. None where there are fewer than 20 sums over 128 ticks.
    """
    kept = [k for k, one in enumerate(stretches) if len(one) > 2 * LENGTHS[0]]
    if not kept:
        return None
    moved = momenta or tuple(np.zeros(len(stretch)) for stretch in stretches)
    tables = np.stack([_squares(stretches[k], moved[k] / tick_s) for k in kept])
    if tables[:, -1, 1].sum() < FEWEST_SUMS:
        return None
    total, ends = tables.sum(axis=0), 2.0 * (momentum_sd / tick_s) ** 2
    white, slow, time_s = _fitted(total, tick_s, ends, idle_white)
    count = min(BLOCKS, len(tables))
    left = [total - tables[k::count].sum(axis=0) for k in range(count)]
    errors: list[float] = [float("nan")] * 3
    if min(table[-1, 1] for table in left) >= FEWEST_SUMS:
        others = [_fitted(table, tick_s, ends, idle_white) for table in left]
        errors = np.sqrt((count - 1) * np.var(others, axis=0)).tolist()
        if white <= idle_white:
            errors[0] = float("nan")  # known from rest, not from these stretches
    return TorqueNoise(white, slow, time_s, *errors)


def _squares(residuals: Array, momentum: Array) -> Array:
    """Sums of squares and numbers of the sums over each length, (lengths, 2)."""
    centred = residuals - (residuals.mean() - (momentum[-1] - momentum[0]) / len(residuals))
    running = np.concatenate([[0.0], np.cumsum(centred)])[:-1] - momentum
    rows = []
    for length in LENGTHS:
        sums = running[length:] - running[:-length]
        hop = max(1, length // 4)
        rows.append((float(np.sum(sums[::hop] ** 2)), float(len(sums[::hop]))))
    return np.array(rows)


def _fitted(
    table: Array, tick_s: float, ends: float, idle_white: float
) -> tuple[float, float, float]:
    """White, slow and time: the best over all times by weighted squares without negatives."""
    from scipy.optimize import nnls

    known = table[:, 1] >= FEWEST_SUMS
    lengths = np.array(LENGTHS)[known]
    variance = table[known, 0] / table[known, 1]
    weight = np.sqrt(table[known, 1] / np.maximum(lengths / 4, 1.0)) / np.maximum(variance, 1e-300)
    known_part = ends + idle_white**2 * lengths
    wanted = np.maximum(variance - known_part, 0.0) * weight
    fits = []
    for time_s in TIMES_S:
        memory = _memory(lengths, float(np.exp(-tick_s / time_s)))
        design = np.column_stack([lengths.astype(float), memory]) * weight[:, None]
        size = np.sqrt(np.sum(design**2, axis=0))
        found, left = nnls(design / size, wanted)
        fits.append((float(left), time_s, np.sqrt(found / size)))
    _, time_s, sds = min(fits, key=lambda fit: fit[0])
    return float(np.hypot(sds[0], idle_white)), float(sds[1]), time_s


def _memory(lengths: NDArray[np.int64], decay: float) -> Array:
    """Sum of decay^|i - j| over i, j below each length."""
    n = lengths.astype(float)
    return np.asarray(
        n + 2.0 * (n * decay / (1 - decay) - decay * (1 - decay**n) / (1 - decay) ** 2)
    )
