"""The likelihood of a cut: mean torque, noise, and what a fracture in steps adds to both."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import CrackHistory, CutData, cutting_from
from scissorcal.calibration.layout import Layout
from scissorcal.model import Cutting, ripple_spread

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Expected:
    """Mean and standard deviation (n,) that parameters expect of each bin's torque, in N m."""

    mean: Array
    sd: Array


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
        variance = values["noise"] ** 2 + (values["variation"] * mean) ** 2
        if self.history is not None:
            spread = self._ripple(cutting, tip, self.history)[data.used]
            variance = variance + (values["ripple_visibility"] * spread) ** 2
        return Expected(mean, np.sqrt(variance))

    def _ripple(self, cutting: Cutting, tip: Array, history: CrackHistory) -> Array:
        """Spread by the ripple at every bin: of the saw-tooth, or of where the crack rests.

        The place of a resting crack is common to all bins of a rest, yet counts as independent
        here: the autocorrelation that this leaves widens the posterior afterwards.
        """
        whole = self.data.whole
        contact = tip - whole.advance
        spread = ripple_spread(cutting, whole.opening, whole.rate, contact, whole.bin_s)
        place_sd = np.where(history.begun, spread.cycle_m[history.last] / np.sqrt(12.0), 0.0)
        return np.where(history.advancing, spread.advancing, spread.torque_per_metre * place_sd)
