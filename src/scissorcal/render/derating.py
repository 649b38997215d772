"""How stiff a package is over its scene, and the same package with a softer elastic response."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel, Table
from scissorcal.package.plate_slopes import PlateSlopes
from scissorcal.render.drops import largest_drop
from scissorcal.render.felt_cost import plate_strokes

Array = NDArray[np.float64]

OPENINGS, CONTACTS = 48, 24
STEP_RAD = 1e-3
"""Opening over which a slope is taken: some hundred steps of float32 in torque, and an indentation
change of some 20 um."""
TRIED_EVERY = 4
"""Ticks of a stroke between places at which a slope is taken."""
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
    ripple), then the blades open by a milliradian: what torque falls by is elastic.
    """
    quiet = replace(tables, render_friction=False)
    smooth, teeth = Kernel(replace(quiet, kappa=1.0)), Kernel(quiet)
    found = Needs(0.0, tables.opening_max, tables.contact_min, 0.0, 0.0, _friction(tables), 0.0)
    for opening in np.linspace(tables.opening_min, tables.opening_max, OPENINGS):
        for contact in np.linspace(tables.contact_min, tables.contact_max, CONTACTS):
            smooth.reset(float(contact))
            at = smooth.step(float(opening), 0.0, 0.0)
            if not 0.0 < at.torque <= torque_limit:
                continue
            settled = smooth.crack
            opened = smooth.step(float(opening) + STEP_RAD, 0.0, 0.0)
            slope = (at.torque - opened.torque) / STEP_RAD
            smooth.reset(settled)
            faster = smooth.step(float(opening), -1.0, 0.0)
            teeth.reset(float(contact))
            ran = teeth.step(float(opening), 0.0, 0.0)
            drop = at.torque - ran.torque if ran.fracture_J > 0.0 else 0.0
            found = replace(
                found,
                drop_Nm=max(found.drop_Nm, drop),
                damper=max(found.damper, faster.torque - at.torque),
            )
            if slope > found.stiffness:
                found = replace(
                    found, stiffness=slope, opening=float(opening), contact=float(settled)
                )
    return replace(found, found=found.stiffness)


def needs_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> Needs:
    """What a package with a drawn plate asks of the loop; without pieces as `needs_of`.

    ``stiffness`` and ``damper`` are the proved bounds of `package.plate_slopes` over all pieces
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
    slopes = PlateSlopes(tables, torque_limit + friction, pieces)
    steepest = slopes.bound("opening")
    damper = slopes.bound("rate").value if tables.rate_damping > 0.0 else 0.0
    found = _found_on(tables, torque_limit, pieces)
    return Needs(
        stiffness=max(steepest.value, found),
        opening=steepest.opening,
        contact=steepest.contact,
        drop_Nm=largest_drop(tables, torque_limit, pieces),
        damper=damper,
        friction_Nm=friction,
        found=found,
    )


def stiffness_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> float:
    """The stiffness of `needs_on` alone."""
    if not pieces:
        return needs_of(tables, torque_limit).stiffness
    slopes = PlateSlopes(tables, torque_limit + _friction(tables), pieces)
    return max(slopes.bound("opening").value, _found_on(tables, torque_limit, pieces))


def _found_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> float:
    """The largest slope of the torque (N m/rad) where blades open a little, along the strokes."""
    quiet = replace(tables, render_friction=False)
    model, found = PiecesModel(quiet, pieces), 0.0
    for opening, advance, counts in plate_strokes(quiet, pieces):
        model.step_many(opening[~counts], 0.0, advance[~counts])
        places = np.repeat(opening[counts][::TRIED_EVERY], 3)
        places[1::3] += STEP_RAD
        torque = model.step_many(places, 0.0, advance[-1])["torque"].astype(np.float64)
        at, opened = torque[0::3], torque[1::3]
        slope = (at - opened)[at <= torque_limit] / STEP_RAD
        found = max(found, float(np.max(slope, initial=0.0)))
    return found


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
