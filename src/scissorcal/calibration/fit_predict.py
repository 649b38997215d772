"""Predict the torque of empty motion from a fit of friction, at places a person names."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.calibration.friction.curve import angle_centre
from scissorcal.errors import InputError
from scissorcal.model.friction import FrictionLaw, friction_torque

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult

MOST_VALUES = 2_000_000
"""Values of torque that are held at once: draws times places."""


@dataclass(frozen=True)
class TorqueBand:
    """Torque at places: all arrays have the shape of the places, torque in ``unit``.

    ``torque`` is the median of the posterior, ``low`` and ``high`` bound its middle
    ``probability``.
    """

    opening: Array
    rate: Array
    torque: Array
    low: Array
    high: Array
    unit: str
    probability: float


def predict_torque(
    fit: "FitResult", motion: tuple[ArrayLike, ArrayLike, ArrayLike], probability: float
) -> TorqueBand:
    """Torque of a ``motion`` (opening, rate, acceleration, which broadcast) with its band.

    inertia * acceleration + F(opening, rate) + offset for every draw. Raises InputError for a cut,
    for a motion that is not finite, and for a probability outside 0 to 1.
    """
    if fit.what == "cut":
        raise InputError(
            "A fit of a cut holds the material alone: build the package with the fit of friction "
            "('scissorcal package build'), whose torque() and band() are those of both."
        )
    if not 0.0 < probability < 1.0:
        raise InputError(f"A probability of {probability} is not possible: give one from 0 to 1.")
    given = (np.asarray(values, dtype=np.float64) for values in motion)
    opening, rate, acceleration = np.broadcast_arrays(*given)
    if not all(np.all(np.isfinite(values)) for values in (opening, rate, acceleration)):
        raise InputError("The motion has a number that is not finite: leave those places out.")
    columns = fit.columns
    tail = 0.5 * (1.0 - probability)
    places = np.stack([values.ravel() for values in (opening, rate, acceleration)])
    step = max(1, MOST_VALUES // len(fit.draws))
    found = [
        np.quantile(_effort(fit, columns, places[:, at : at + step]), [tail, 0.5, 1.0 - tail], 0)
        for at in range(0, places.shape[1], step)
    ]
    low, torque, high = (
        part.reshape(opening.shape) for part in np.concatenate(found or [np.zeros((3, 0))], 1)
    )
    return TorqueBand(opening.copy(), rate.copy(), torque, low, high, fit.effort_unit, probability)


def _effort(fit: "FitResult", columns: dict[str, Array], places: Array) -> Array:
    """Effort (draws, n) at places (3, n): of each draw."""
    values: dict[str, float | Array] = {n: draws[:, None] for n, draws in columns.items()}
    law = FrictionLaw.of_fit(values, angle_centre(fit))
    opening, rate, acceleration = places
    nothing = np.zeros((len(fit.draws), 1))
    inertia, offset = values.get("inertia", nothing), values.get("offset", nothing)
    return np.asarray(inertia * acceleration + friction_torque(law, opening, rate) + offset)
