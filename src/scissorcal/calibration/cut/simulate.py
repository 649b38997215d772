"""Torques of a cut drawn from what its likelihood says of cracks, unevenness and noise."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scissorcal.calibration.cut.experiment import CutExperiment

Array = NDArray[np.float64]


def draw_torque(design: "CutExperiment", u: Array, rng: np.random.Generator) -> Array:
    """Draw the measured mean torque (n,) of every segment at ``u`` (p,), noise left out.

    Cracks that rest keep the places at which the data have them; the toughness that running ones
    meet is drawn, as one process over each sheet.
    """
    values = {name: float(value) for name, value in design.layout.natural(u).items()}
    expected = design.mean(u).copy()
    first = design.likelihood.elastic_count
    if "variation" not in values:
        return expected
    data = design.likelihood.data
    uneven = np.zeros(len(data.run_place))
    for low, high in zip(data.run_first[:-1], data.run_first[1:], strict=True):
        state = rng.standard_normal()
        sheet = values["sheet_variation"] * rng.standard_normal()
        for k in range(low, high):
            if k > low:
                gone = abs(data.run_place[k] - data.run_place[k - 1])
                keep = float(np.exp(-gone / values["variation_length"]))
                state = keep * state + np.sqrt(1.0 - keep**2) * rng.standard_normal()
            uneven[k] = values["variation"] * state + sheet
    expected[first:] *= 1.0 + uneven
    return expected
