"""How stiff a package is over its scene, and the same package with a softer elastic response."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import (
    STEP_DTYPE,
    Kernel,
    ModelTables,
    Piece,
    PiecesModel,
    StepOutput,
    Table,
)
from scissorcal.package.layer_slopes import LayerSlopes
from scissorcal.package.tangent import Tangent
from scissorcal.render.drops import largest_drop
from scissorcal.render.felt_cost import plate_strokes

OPENINGS, CONTACTS = 48, 24
HALVINGS = 20
"""Of an interval of openings, to where the torque reaches its limit: to 1e-6 of the interval."""
TRIED_EVERY = 4
"""Ticks of a stroke between places at which a slope is taken."""
LEAST_FACTOR = 0.05
"""A response twenty times as soft as the material's is another material: refused."""
WIDENINGS = 8
"""Rounds in which intervals are widened; each takes most of what is too steep."""


@dataclass(frozen=True)
class Needs:
    """What a package asks of the loop, within its torque limit.

    ``stiffness`` (N m/rad): largest elastic slope of torque over the opening, at about ``opening``
    (rad) and ``contact`` (m): of a drawn plate a proved bound, else the largest that is found.
    ``found`` is the largest that is found in any case. ``drop_Nm``: largest drop of torque as a
    crack runs. ``damper`` (N m s/rad): largest damping of the material, a bound as ``stiffness``
    is. ``friction_Nm``: largest rendered friction.
    """

    stiffness: float
    opening: float
    contact: float
    drop_Nm: float
    damper: float
    friction_Nm: float
    found: float


def needs_of(tables: ModelTables, torque_limit: float) -> Needs:
    """Search the scene for the steepest slopes; places whose torque exceeds the limit do not count.

    At each opening and contact the crack first runs to where it holds (with the peak force of a
    ripple); the slope there is the tangent of what is rendered (`tangent.Tangent`). Where the limit
    is reached between two openings, the place at which it is counts, too.
    """
    quiet = replace(tables, render_friction=False)
    sheet, drop, damper = _Sheet(quiet, torque_limit), 0.0, 0.0
    places = [
        place
        for contact in np.linspace(tables.contact_min, tables.contact_max, CONTACTS)
        for place in sheet.places(float(contact))
    ]
    if not places:
        opening, contact = tables.opening_max, tables.contact_min
        return Needs(0.0, opening, contact, 0.0, 0.0, _friction(tables), 0.0)
    for place in places:
        drop = max(drop, sheet.drop(place))
        damper = max(damper, sheet.damper(place))
    openings = np.array([np.float32(place.opening) for place in places], dtype=np.float64)
    steps = np.array([tuple(place.step) for place in places], dtype=STEP_DTYPE)
    slopes = Tangent(quiet).at(openings, steps)
    worst = int(np.argmax(slopes))
    steepest = max(float(slopes[worst]), 0.0)
    return Needs(
        stiffness=steepest,
        opening=places[worst].opening,
        contact=places[worst].step.contact,
        drop_Nm=drop,
        damper=damper,
        friction_Nm=_friction(tables),
        found=steepest,
    )


class _Place(NamedTuple):
    """A fresh sheet pressed at ``contact``, and what the step gave there."""

    opening: float
    contact: float
    step: StepOutput


class _Sheet:
    """A uniform sheet that is put anew at each place, with smooth fracture and with teeth."""

    def __init__(self, quiet: ModelTables, torque_limit: float) -> None:
        self._smooth, self._teeth = Kernel(replace(quiet, kappa=1.0)), Kernel(quiet)
        self._openings = np.linspace(quiet.opening_min, quiet.opening_max, OPENINGS).tolist()
        self._limit = torque_limit

    def places(self, contact: float) -> list[_Place]:
        """Where the sheet at a contact is felt within the limit, and where it reaches the limit."""
        found: list[_Place] = []
        before: _Place | None = None
        for opening in self._openings:
            place = self._pressed(opening, contact)
            if before and self._is_beyond(before) != self._is_beyond(place):
                found.append(self._at_limit(before, place))
            found.append(place)
            before = place
        return [place for place in found if 0.0 < place.step.torque <= self._limit]

    def drop(self, place: _Place) -> float:
        """By how much torque falls at once as a crack with teeth runs there."""
        self._teeth.reset(place.contact)
        ran = self._teeth.step(place.opening, 0.0, 0.0)
        return place.step.torque - ran.torque if ran.fracture_J > 0.0 else 0.0

    def damper(self, place: _Place) -> float:
        """By how much torque grows there with a rate of 1 rad/s, the crack held."""
        self._smooth.reset(place.step.contact)
        return self._smooth.step(place.opening, -1.0, 0.0).torque - place.step.torque

    def _pressed(self, opening: float, contact: float) -> _Place:
        self._smooth.reset(contact)
        return _Place(opening, contact, self._smooth.step(opening, 0.0, 0.0))

    def _is_beyond(self, place: _Place) -> bool:
        return place.step.torque > self._limit

    def _at_limit(self, one: _Place, other: _Place) -> _Place:
        """The last place within the limit between one on each side of it."""
        within, beyond = (other, one) if self._is_beyond(one) else (one, other)
        for _ in range(HALVINGS):
            middle = self._pressed(0.5 * (within.opening + beyond.opening), one.contact)
            within, beyond = (within, middle) if self._is_beyond(middle) else (middle, beyond)
        return within


def needs_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> Needs:
    """What a package with a drawn plate asks of the loop; without pieces as `needs_of`.

    ``stiffness`` and ``damper`` are the proved bounds of `package.layer_slopes` over all pieces
    that can be pressed at once, ``found`` the largest slope in the strokes that cut the plate
    (`felt_cost.plate_strokes`). Were that the larger, by float32 or where a piece is pressed before
    the scene's nearest contact, ``stiffness`` is it, too. ``drop_Nm`` is found at 48 openings:
    within a strip, at the border of one that a running crack goes on into, and where a piece is cut
    through, added up over pieces that can be pressed at once. What is pressed beyond the blade's
    tip is not in it.
    """
    if not pieces:
        return needs_of(tables, torque_limit)
    friction = _friction(tables)
    slopes = LayerSlopes(tables, torque_limit + friction, pieces)
    steepest = slopes.bound("opening")
    found = _found_on(tables, torque_limit, pieces)
    return Needs(
        stiffness=max(steepest.value, found),
        opening=steepest.opening,
        contact=steepest.contact,
        drop_Nm=largest_drop(tables, torque_limit, pieces),
        damper=slopes.bound("rate").value if tables.rate_damping > 0.0 else 0.0,
        friction_Nm=friction,
        found=found,
    )


def stiffness_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> float:
    """The stiffness of `needs_on` alone."""
    if not pieces:
        return needs_of(tables, torque_limit).stiffness
    slopes = LayerSlopes(tables, torque_limit + _friction(tables), pieces)
    return max(slopes.bound("opening").value, _found_on(tables, torque_limit, pieces))


def _found_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> float:
    """The largest tangent of the torque (N m/rad) where cracks rest, along the strokes."""
    quiet = replace(tables, render_friction=False)
    tangent, found = Tangent(quiet), 0.0
    each = [PiecesModel(quiet, [piece]) for piece in pieces]
    for opening, advance, counts in plate_strokes(quiet, pieces):
        places = opening[counts][::TRIED_EVERY]
        torque, slope = np.zeros(len(places)), np.zeros(len(places))
        for piece, model in zip(pieces, each, strict=True):
            steps = model.step_many(opening, 0.0, advance)[counts][::TRIED_EVERY]
            torque += steps["torque"]
            slope += piece.scale * tangent.at(places.astype(np.float32).astype(np.float64), steps)
        found = max(found, float(np.max(slope[torque <= torque_limit], initial=0.0)))
    return found


class Derated(NamedTuple):
    """To which slope (N/m) the response is limited, None where it is not, and what is left of the
    package's stiffness (N m/rad)."""

    steepest_N_per_m: float | None
    stiffness: float

    def is_refused(self, needed: float, allowed: float) -> bool:
        """Whether it is still too stiff, or less than LEAST_FACTOR of what is needed."""
        return self.stiffness > allowed or self.stiffness < LEAST_FACTOR * needed


def derate(
    tables: ModelTables, needed: float, allowed: float, limit: float, pieces: Sequence[Piece] = ()
) -> Derated:
    """The steepest response that is allowed, found in steps, as levers change with the depth."""
    if needed <= allowed:
        return Derated(None, needed)
    steepest, left = float(tables.response.slope.max()), needed
    while left > allowed and left > LEAST_FACTOR * needed:
        steepest *= max(0.999 * allowed / left, 0.5)
        left = stiffness_on(softened(tables, steepest), limit, pieces)
    return Derated(steepest, left)


def limited(tables: ModelTables, steepest: float | None, damping_share: float = 1.0) -> ModelTables:
    """What is rendered of a model: its response limited to a slope, a share of its damping."""
    soft = tables if steepest is None else softened(tables, steepest)
    if damping_share == 1.0:
        return soft
    return replace(soft, rate_damping=damping_share * soft.rate_damping)


def softened(tables: ModelTables, steepest: float) -> ModelTables:
    """The same model with a response that is nowhere steeper than ``steepest`` (N/m).

    Where it was steeper it becomes straight, so that a force is reached at a greater indentation.
    Gentle parts stay as they are, and so do fracture energy and arrest ratio: with them the forces
    at which cracks start and stop, and the work of a cut. Raises ValueError unless steepest > 0.
    """
    if not steepest > 0.0:
        raise ValueError(f"The steepest slope of a response is above 0, not {steepest}.")
    response = tables.response
    x, y = response.x.astype(np.float64), response.y.astype(np.float64)
    rise = np.diff(y)
    width = np.maximum(np.diff(x), rise / steepest)
    slope = np.minimum(response.slope, np.float32(steepest))
    for _ in range(WIDENINGS):  # between few knots a cubic is steeper than at them
        over = _steepest_inside(width, rise, slope.astype(np.float64)) / steepest
        width = width * np.maximum(over, 1.0)
    place = np.concatenate([[0.0], np.cumsum(width)]).astype(np.float32)
    return replace(tables, response=Table(place, response.y, slope))


def _steepest_inside(width: Array, rise: Array, slope: Array) -> Array:
    """Largest derivative of a table's cubics within each interval."""
    first, last = slope[:-1] * width, slope[1:] * width
    third = first + last - 2.0 * rise
    second = rise - first - third
    turn = np.clip(
        np.divide(-second, 3.0 * third, out=np.zeros_like(third), where=third < 0.0), 0, 1
    )
    inside = first + turn * (2.0 * second + 3.0 * turn * third)
    return np.asarray(np.maximum(inside, np.maximum(first, last)) / width)


def _friction(tables: ModelTables) -> float:
    """Largest rendered friction of both directions, N m."""
    if not tables.render_friction:
        return 0.0
    level = max(float(tables.friction_opening.y.max()), float(tables.friction_closing.y.max()))
    return level * float(np.abs(tables.friction_angle.y).max())
