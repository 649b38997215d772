"""The exact model that a package's tables approximate: float64, no tables, any number of draws."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.structure import cutting_from
from scissorcal.calibration.result import FitResult
from scissorcal.model import Cutting, FrictionLaw, friction_torque
from scissorcal.model.cutting import contact_after_run, torque_on_blade

MOST_DRAWS = 200
MOST_AT_ONCE = 500_000
"""Draws times points evaluated in one sweep, to limit the memory of a large grid."""


@dataclass(frozen=True)
class ExactModel:
    """Cutting (or pressing) and friction as fitted; ``friction`` is None where it is not rendered.

    Both may hold draws: then their parameters have shape (draws, 1).
    """

    cutting: Cutting
    friction: FrictionLaw | None

    def torque(self, opening: ArrayLike, opening_rate: ArrayLike, contact: ArrayLike) -> Array:
        """Average torque felt in N m: cutting resists closing, friction resists any motion.

        Arguments (rad, rad/s, m) broadcast; shape (draws, points) with draws and flat arguments.
        Material beyond the blade's tip is out of reach and gives no torque; NaN where no edge
        stands over the place (:func:`edge_height`).
        """
        return self.torque_settled(opening, opening_rate, self.settled(opening, contact))

    def torque_settled(self, opening: ArrayLike, opening_rate: ArrayLike, place: Array) -> Array:
        """The torque of `torque` where the crack stands at ``place`` (m), as `settled` gives it."""
        felt = torque_on_blade(self.cutting, opening, place, opening_rate)
        if self.friction is None:
            return felt
        return np.asarray(felt - friction_torque(self.friction, opening, opening_rate))

    def settled(self, opening: ArrayLike, contact: ArrayLike) -> Array:
        """Contact x_c (m) after the crack has run outwards until it rests."""
        place = np.asarray(contact, dtype=np.float64)
        if self.cutting.fracture_energy is None:
            return place
        return contact_after_run(self.cutting, opening, place)

    def blade_angle(self, opening: ArrayLike) -> Array:
        """Rotation beta of one moving blade, in radians."""
        return np.asarray(opening, dtype=np.float64) / self.cutting.moving_blades


@dataclass(frozen=True)
class FitDraws:
    """What defines the law of one fit: discrete choices, and parameter draws (draws, names)."""

    structure: Mapping[str, Any]
    names: tuple[str, ...]
    draws: Array

    @classmethod
    def of(cls, fit: FitResult, draws: Array) -> "FitDraws":
        """The law of a fit at the given draws of its parameters."""
        return cls(fit.structure, tuple(parameter.name for parameter in fit.parameters), draws)

    @classmethod
    def centre(cls, fit: FitResult) -> "FitDraws":
        """The law of a fit at its MAP point."""
        return cls.of(fit, fit.map_point[None, :])

    def columns(self) -> dict[str, Array]:
        """Parameters by name, each of shape (draws, 1)."""
        return {name: self.draws[:, [index]] for index, name in enumerate(self.names)}

    def row(self, index: int) -> dict[str, Array]:
        """Parameters of one draw by name, as scalars."""
        return {name: self.draws[index, column] for column, name in enumerate(self.names)}


def exact_model(cut: FitDraws, friction: FitDraws | None) -> ExactModel:
    """Join draws of a cut fit with as many of a friction fit, one by one."""
    return _join(cut, cut.columns(), friction, friction.columns() if friction else {})


def central_model(cut: FitDraws, friction: FitDraws | None) -> ExactModel:
    """The model at the first draw alone, with scalar parameters."""
    return _join(cut, cut.row(0), friction, friction.row(0) if friction else {})


def torque_quantiles(
    model: ExactModel,
    opening: ArrayLike,
    opening_rate: ArrayLike,
    contact: ArrayLike,
    probabilities: tuple[float, ...],
) -> Array:
    """Quantiles over the draws of a model's torque, shape (probabilities, *broadcast shape)."""
    arrays = np.broadcast_arrays(
        *(np.asarray(a, dtype=np.float64) for a in (opening, opening_rate, contact))
    )
    flat = [array.ravel() for array in arrays]
    draws = np.shape(model.cutting.response.force)[0]
    chunk = max(1, MOST_AT_ONCE // draws)
    result = np.empty((len(probabilities), flat[0].size))
    for start in range(0, flat[0].size, chunk):
        part = slice(start, start + chunk)
        torque = model.torque(*(array[part] for array in flat))
        result[:, part] = np.quantile(torque, probabilities, axis=0)
    return result.reshape(len(probabilities), *arrays[0].shape)


def _join(
    cut: FitDraws,
    cut_values: dict[str, Array],
    friction: FitDraws | None,
    friction_values: dict[str, Array],
) -> ExactModel:
    return ExactModel(
        cutting_from(dict(cut.structure), cut_values),
        None
        if friction is None
        else FrictionLaw.of_fit(friction_values, float(friction.structure["angle_center"])),
    )


def pick_draws(
    cut: FitResult, friction: FitResult | None, rng: np.random.Generator
) -> dict[str, NDArray[Any]]:
    """Equally many draws of each fit, at most 200.

    A cut's fit draws friction's parameters jointly with its own, so those draws are used: torque
    that a draw attributes to the material is then not attributed to friction too. Parameters that
    it did not draw (the inertia, or all of them) are paired at random.
    """
    count = min(MOST_DRAWS, len(cut.draws), *([len(friction.draws)] if friction else []))
    rows = rng.permutation(len(cut.draws))[:count]
    picked = {"draws/cut.npy": np.asarray(cut.draws[rows], dtype=np.float64)}
    if friction is None:
        return picked
    own = friction.draws[rng.permutation(len(friction.draws))[:count]].astype(np.float64)
    if cut.nuisance_draws is not None:
        names = [parameter.name for parameter in cut.nuisance]
        for column, parameter in enumerate(friction.parameters):
            if parameter.name in names:
                own[:, column] = cut.nuisance_draws[rows, names.index(parameter.name)]
    return {**picked, "draws/friction.npy": own}
