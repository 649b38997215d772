"""The likelihood of a cut: mean torque, noise, and what a fracture in steps adds to both."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import CrackHistory, CutData, cutting_from
from scissorcal.calibration.layout import Layout
from scissorcal.model import Cutting, ripple_spread

Array = NDArray[np.float64]

BLOCK_BINS = 8
UNEVEN_LENGTH_M = 2e-3
"""Length over which a sheet's toughness is taken to vary: fibres of paper, threads of cloth."""


@dataclass(frozen=True)
class Expected:
    """What parameters expect of each bin's torque (n,): mean in N m, and two variances.

    ``slow`` is the variance that bins of a block have in common, ``fast`` what each has alone.
    """

    mean: Array
    slow: Array
    fast: Array


@dataclass(frozen=True)
class Blocks:
    """Short runs of neighbouring bins: ``place`` (n,) is a bin's number in its block, ``first``
    (n,) the index at which its block begins, ``length`` (n,) the block's length."""

    place: NDArray[np.int64]
    first: NDArray[np.int64]
    length: NDArray[np.int64]


def make_blocks(run: NDArray[np.int64]) -> Blocks:
    """Cut runs of equal labels (n,) into blocks of ``BLOCK_BINS``, the last of each shorter."""
    index = np.arange(len(run))
    begins = np.maximum.accumulate(np.where(np.diff(run, prepend=run[0] - 1) != 0, index, 0))
    place = (index - begins) % BLOCK_BINS
    first = index - place
    return Blocks(place, first, np.bincount(first, minlength=len(run))[first])


def split(residuals: Array, expected: Expected, blocks: Blocks) -> tuple[Array, Array]:
    """Residuals (n,) as block means and contrasts over their standard deviations, and log of those.

    Helmert's orthonormal transform: the first of a block becomes its mean times the root of its
    length, the k-th the difference between itself and the mean of those before. An uneven material
    varies slowly and shows in the means, a ripple is fast and shows in the contrasts, so that
    neither is taken for the other.
    """
    k, first, length = blocks.place, blocks.first, blocks.length
    total = np.cumsum(residuals)
    before = total - residuals - (total - residuals)[first]
    last = first + length - 1
    whole = total[last] - (total - residuals)[first]
    contrast = (before - k * residuals) / np.sqrt(np.maximum(k * (k + 1), 1))
    coefficients = np.where(k == 0, whole / np.sqrt(length), contrast)
    fast = _block_mean(expected.fast, first, length)
    slow = _block_mean(expected.slow, first, length)
    variance = np.where(k == 0, fast + length * slow, fast)
    return coefficients / np.sqrt(variance), 0.5 * np.log(variance)


def _block_mean(values: Array, first: NDArray[np.int64], length: NDArray[np.int64]) -> Array:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[first + length] - total[first]) / length)


class MaterialModel:
    """What the material's parameters expect, remembering the last ones it was asked for.

    Differences by friction's parameters leave the material unchanged, and the material is what
    costs time.
    """

    def __init__(
        self,
        data: CutData,
        structure: dict[str, Any],
        layout: Layout,
        history: CrackHistory | None = None,
    ) -> None:
        """Bind the data; a rippled structure needs the crack's ``history``."""
        self.data, self.structure, self.layout, self.history = data, structure, layout, history
        self.last: tuple[bytes, Expected] | None = None

    def __call__(self, u: Array) -> Expected:
        """Expected torque at unconstrained material parameters (p,)."""
        key = u.tobytes()
        if self.last is None or self.last[0] != key:
            self.last = (key, self._expect(u))
        return self.last[1]

    def _expect(self, u: Array) -> Expected:
        data, values = self.data, self.layout.natural(u)
        cutting = cutting_from(self.structure, values)
        torque, tip = data.along(cutting)
        mean = torque[data.used]
        travel = np.where(data.begins, 0.0, np.diff(tip, prepend=tip[:1]))[data.used]
        blocks_apart = BLOCK_BINS * travel / UNEVEN_LENGTH_M
        within = blocks_apart / (3.0 + blocks_apart)
        uneven = (values["variation"] * mean) ** 2
        slow = values["slow_noise"] ** 2 + uneven * (1.0 - within)
        fast = values["noise"] ** 2 + uneven * within
        if self.history is not None:
            window = data.bins.bin_s * float(values["ripple_period"])
            advancing, resting = self._ripple(cutting, tip, self.history, window)
            fast = fast + (values["ripple_visibility"] * advancing[data.used]) ** 2
            slow = slow + (values["ripple_visibility"] * resting[data.used]) ** 2
        return Expected(mean, slow, fast)

    def _ripple(
        self, cutting: Cutting, tip: Array, history: CrackHistory, window_s: float
    ) -> tuple[Array, Array]:
        """Spread by the ripple at every bin: of the saw-tooth, and of where the crack rests.

        The place of a resting crack is common to all bins of a rest, which blocks respect only
        within themselves: the autocorrelation that is left widens the posterior afterwards.
        """
        whole = self.data.whole
        contact = tip - whole.advance
        spread = ripple_spread(cutting, whole.opening, whole.rate, contact, window_s)
        place_sd = np.where(history.begun, spread.cycle_m[history.last] / np.sqrt(12.0), 0.0)
        return (
            np.where(history.advancing, spread.advancing, 0.0),
            np.where(history.advancing, 0.0, spread.torque_per_metre * place_sd),
        )
