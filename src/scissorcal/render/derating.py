"""How stiff a package is over its scene, and the same package with a softer elastic response."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Kernel, ModelTables, Piece, Table, largest_overlap

Array = NDArray[np.float64]

OPENINGS, CONTACTS = 48, 24
STEP_RAD = 1e-3
"""Opening over which a slope is taken: some hundred steps of float32 in torque, and an indentation
change of some 20 um."""
WIDENINGS = 8
"""Rounds in which intervals are widened; each takes most of what is too steep."""


@dataclass(frozen=True)
class Needs:
    """What a package asks of the loop, within its torque limit.

    ``stiffness`` (N m/rad): largest elastic slope of torque over the opening, found at ``opening``
    (rad) and ``contact`` (m). ``drop_Nm``: largest drop of torque as a crack runs. ``damper``
    (N m s/rad): largest damping of the material. ``friction_Nm``: largest rendered friction.
    """

    stiffness: float
    opening: float
    contact: float
    drop_Nm: float
    damper: float
    friction_Nm: float


def needs_of(tables: ModelTables, torque_limit: float) -> Needs:
    """Search the scene for the steepest slopes; places whose torque exceeds the limit do not count.

    At each opening and contact the crack first runs to where it holds (with the peak force of a
    ripple), then the blades open by a milliradian: what torque falls by is elastic.
    """
    quiet = replace(tables, render_friction=False)
    smooth, teeth = Kernel(replace(quiet, kappa=1.0)), Kernel(quiet)
    found = Needs(0.0, tables.opening_max, tables.contact_min, 0.0, 0.0, _friction(tables))
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
    return found


def needs_on(tables: ModelTables, torque_limit: float, pieces: Sequence[Piece]) -> Needs:
    """What a package with a drawn plate asks of the loop; without pieces as `needs_of`.

    Each piece is a uniform sheet of its toughest strip. Those that a blade can press at once add
    up, each at its own worst, which a stack reaches where all are worst at one place. Slopes are
    found on a grid: in random steps the largest was up to 7 % above. ``drop_Nm`` leaves out the
    drop at a weaker strip and where a piece is cut through.
    """
    if not pieces:
        return needs_of(tables, torque_limit)
    each = []
    for piece in pieces:
        energy = max(strip.fracture_energy_J_per_m for strip in piece.strips) / piece.scale
        sheet = replace(tables, upper_face=piece.upper_face_m, fracture_energy=energy)
        each.append(needs_of(sheet, torque_limit / piece.scale))
    reach = _pressed_m(tables, pieces)
    scales = [piece.scale for piece in pieces]

    def together(amounts: Sequence[float]) -> float:
        own = [scale * amount for scale, amount in zip(scales, amounts, strict=True)]
        return largest_overlap(pieces, reach, own)

    worst = each[int(np.argmax([s * one.stiffness for s, one in zip(scales, each, strict=True)]))]
    return replace(
        worst,
        stiffness=together([one.stiffness for one in each]),
        drop_Nm=together([one.drop_Nm for one in each]),
        damper=together([one.damper for one in each]),
    )


def _pressed_m(tables: ModelTables, pieces: Sequence[Piece]) -> float:
    """Most length (m) of material along the cut that lies below a blade's edge at once.

    Between the place where it stands deepest and the one where it leaves the highest face: the
    depth of the response's table, and what faces differ in height, over the least slope.
    """
    beta = tables.opening_min / tables.moving_blades
    slope = np.tan(beta + np.arctan(float(tables.edge.slope.min())))
    faces = [piece.upper_face_m for piece in pieces]
    depth = float(tables.response.x[-1]) + max(faces) - min(faces)
    return float(min(depth / max(slope, 1e-6), tables.tip_station))


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
