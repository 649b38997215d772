"""Predict torque from a fit of friction, or of a cut, at places a person names."""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.calibration.cut.structure import fitted_cutting
from scissorcal.calibration.friction.curve import angle_centre
from scissorcal.errors import InputError
from scissorcal.model import settled_contact
from scissorcal.model.cutting import contact_after_run, torque_on_blade
from scissorcal.model.friction import FrictionLaw, friction_torque

if TYPE_CHECKING:
    from collections.abc import Callable

    from scissorcal.calibration import FitResult

MOST_VALUES = 2_000_000
"""Values of torque that are held at once: draws times places."""


@dataclass(frozen=True)
class TorqueBand:
    """Torque at places: all arrays have the shape of the places, torque in ``unit``.

    ``torque`` is the median of the posterior, ``low`` and ``high`` bound its middle
    ``probability``. ``contact`` (m) is of a cut, None where none was given.
    """

    opening: Array
    rate: Array
    torque: Array
    low: Array
    high: Array
    unit: str
    probability: float
    contact: Array | None = None


def predict_torque(
    fit: "FitResult",
    motion: tuple[ArrayLike, ArrayLike, ArrayLike],
    probability: float,
    contact: ArrayLike | None = None,
) -> TorqueBand:
    """Torque of a ``motion`` (opening, rate, acceleration, which broadcast) with its band.

    Of friction: inertia * acceleration + F(opening, rate) + offset for every draw. Of a cut: the
    material's mean torque with the crack at ``contact`` (m from the pivot), which runs outwards
    where it does not rest there; without a contact, that of a crack that just rests. Raises
    InputError for a motion that is not finite or not of such a fit, and for a probability outside 0
    to 1.
    """
    if not 0.0 < probability < 1.0:
        raise InputError(f"A probability of {probability} is not possible: give one from 0 to 1.")
    places = (*motion, *(() if contact is None else (contact,)))
    given = np.broadcast_arrays(*(np.asarray(values, dtype=np.float64) for values in places))
    if not all(np.all(np.isfinite(values)) for values in given):
        raise InputError("The motion has a number that is not finite: leave those places out.")
    torque_of = _of_cut(fit, given) if fit.what == "cut" else _of_friction(fit, contact)
    tail = 0.5 * (1.0 - probability)
    flat = np.stack([values.ravel() for values in given])
    step = max(1, MOST_VALUES // len(fit.draws))
    found = [
        np.quantile(torque_of(*flat[:, at : at + step]), [tail, 0.5, 1.0 - tail], 0)
        for at in range(0, flat.shape[1], step)
    ]
    shape = given[0].shape
    low, torque, high = (
        part.reshape(shape) for part in np.concatenate(found or [np.zeros((3, 0))], 1)
    )
    opening, rate, where = given[0].copy(), given[1].copy(), given[3:]
    at_contact = where[0].copy() if where else None
    unit = fit.effort_unit
    return TorqueBand(opening, rate, torque, low, high, unit, probability, at_contact)


def _of_friction(fit: "FitResult", contact: ArrayLike | None) -> "Callable[..., Array]":
    """Effort (draws, n) of each draw at openings, rates and accelerations (n,)."""
    if contact is not None:
        raise InputError(
            "A fit of friction has no contact: it is of empty motion. Leave contact out, or take "
            "the fit of the cut."
        )
    values: dict[str, float | Array] = {n: draws[:, None] for n, draws in fit.columns.items()}
    law = FrictionLaw.of_fit(values, angle_centre(fit))
    nothing = np.zeros((len(fit.draws), 1))
    inertia, offset = values.get("inertia", nothing), values.get("offset", nothing)

    def effort(opening: Array, rate: Array, acceleration: Array) -> Array:
        return np.asarray(inertia * acceleration + friction_torque(law, opening, rate) + offset)

    return effort


def _of_cut(fit: "FitResult", given: tuple[Array, ...]) -> "Callable[..., Array]":
    """Torque (draws, n) of each draw at openings, rates, accelerations and contacts (n,)."""
    cutting = fitted_cutting(fit, fit.draws[:, None, :])
    if cutting is None:
        raise InputError(
            "This fit of a cut holds no finite numbers to predict from: look at its verdicts, "
            "correct what they name and fit again."
        )
    if np.any(given[2]):
        raise InputError(
            "A fit of a cut has no inertia, which is the fit of friction's: leave acceleration "
            "out, and take the drive's torque of the motion from that fit's predict()."
        )
    pressed = cutting.fracture_energy is None
    if pressed and len(given) < 4:
        raise InputError(
            "This material is pressed and not cut, so no crack says where it lies: give contact, "
            "its distance from the pivot in metres."
        )
    settled = (lambda opening, contact: contact) if pressed else partial(contact_after_run, cutting)

    def torque(opening: Array, rate: Array, _: Array, *contact: Array) -> Array:
        at = settled(opening, *contact) if contact else settled_contact(cutting, opening)
        return torque_on_blade(cutting, opening, at, rate)

    return torque
