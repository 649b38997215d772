"""The likelihood of a cut: mean torque, noise, and what a fracture in steps adds to both."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import CutData, cutting_from
from scissorcal.calibration.layout import Layout
from scissorcal.model import ripple_spread

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Expected:
    """What a point of the parameters expects of each bin, all (n,) in N m.

    ``variance`` is that of independent noise. ``shared`` is torque per standard deviation of the
    place at which the crack rests; bins of one ``rest`` (numbered) share that place.
    """

    mean: Array
    variance: Array
    shared: Array
    rest: NDArray[np.int64]


@dataclass(frozen=True)
class Innovations:
    """What each bin adds to those before it in the same rest of the crack."""

    standardised: Array
    sd: Array


def innovations(residuals: Array, expected: Expected) -> Innovations:
    """Whiten residuals (n,) whose rests of the crack share an unknown place.

    Within a rest the residuals are v z + noise with one z ~ N(0, 1). The one-step predictions of
    that model, which is a Kalman filter with a constant state, need cumulative sums only: after
    bins 1..i-1 the place has precision 1 + sum v^2 / d and mean sum v r / d over that precision.
    """
    v, d = expected.shared, expected.variance
    if not np.any(v):
        sd = np.sqrt(d)
        return Innovations(residuals / sd, sd)
    information = _before(v**2 / d, expected.rest)
    evidence = _before(v * residuals / d, expected.rest)
    precision = 1.0 + information
    sd = np.sqrt(d + v**2 / precision)
    return Innovations((residuals - v * evidence / precision) / sd, sd)


class MaterialModel:
    """What the material's parameters expect, remembering the last ones it was asked for.

    Differences by friction's parameters leave the material unchanged, and the material is what
    costs time.
    """

    def __init__(self, data: CutData, structure: dict[str, Any], layout: Layout) -> None:
        self.data, self.structure, self.layout = data, structure, layout
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
        variance = values["noise"] ** 2 + (values["variation"] * mean) ** 2
        nothing = np.zeros_like(mean)
        if "kappa" not in values:
            return Expected(mean, variance, nothing, np.zeros(len(mean), dtype=np.int64))
        moved = np.concatenate([[False], np.diff(tip) > 0])
        whole, used = data.whole, data.used
        contact = tip - whole.advance
        spread = ripple_spread(cutting, whole.opening, whole.rate, contact, whole.bin_s)
        last = np.maximum.accumulate(np.where(moved | data.begins, np.arange(len(tip)), 0))
        place_sd = spread.cycle_m[last] / np.sqrt(12.0)
        resting = np.where(moved | (tip <= 0.0), 0.0, spread.torque_per_metre * place_sd)
        rest = np.cumsum((moved | data.begins).astype(np.int64))
        advancing = np.where(moved, spread.advancing, 0.0)[used]
        return Expected(mean, variance + advancing**2, resting[used], rest[used])


def _before(values: Array, rest: NDArray[np.int64]) -> Array:
    """Sum of the values before each one within its rest."""
    total = np.cumsum(values) - values
    first = np.concatenate([[True], np.diff(rest) != 0])
    start = np.maximum.accumulate(np.where(first, np.arange(len(rest)), 0))
    return np.asarray(total - total[start])
