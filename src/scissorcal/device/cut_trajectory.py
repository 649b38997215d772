"""The plan of a capture with material: strokes through sheets, or presses."""

from dataclasses import dataclass
from itertools import cycle
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.device.paths import PathBuilder
from scissorcal.device.trajectory import (
    Plan,
    Segment,
    StrokeList,
    opening_range,
    refuse_linear,
    usable_opening,
)
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import Capability, Identity
from scissorcal.recipe.edge import StatedCurve, stated_curve
from scissorcal.recipe.pace import (
    ADVANCE_ACCELERATION,
    ADVANCE_SPEED,
    DWELL_S,
    OPENING_SPEED,
    SETTLE_S,
    TURN_ACCELERATION,
)
from scissorcal.recipe.schema import Recipe

TIP_SHARE = 0.97
"""Share of the blade's length that a plan uses: the very tip is rounded."""

GRID = 2001


@dataclass(frozen=True)
class Blade:
    """The recipe's edge over its plate, SI; the curve is the model's."""

    moving_blades: int
    curve: StatedCurve
    upper_face: float

    @classmethod
    def of(cls, recipe: Recipe) -> "Blade":
        return cls(recipe.rig.moving_blades, stated_curve(recipe.rig.edge), recipe.upper_face_m)

    @property
    def length(self) -> float:
        return self.curve.edge.length_m

    def crossing(self, opening: ArrayLike, above: float = 0.0) -> Array:
        """Distance from the pivot (m) at which the edge is ``above`` m over the upper face.

        The root of s sin(beta) + e(s) cos(beta) = y_top + above, put into x = s cos(beta) - e(s)
        sin(beta). NaN where the edge never reaches it, or only beyond the blade's tip, and where a
        curve through points rises through it more than once.

        >>> from scissorcal.recipe.library import builtin_recipe
        >>> blade = Blade.of(builtin_recipe("paper-80gsm"))
        >>> np.round(1e3 * blade.crossing(np.radians([50.0, 12.0])), 1)
        array([17.7, 57.8])
        """
        beta = np.asarray(opening, dtype=np.float64) / self.moving_blades
        edge = self.curve.edge
        station = edge.station_at_height(self.upper_face + above, beta)
        reached = (station >= 0) & (station <= TIP_SHARE * self.length)
        along = station * np.cos(beta) - edge.offset_at(station) * np.sin(beta)
        return np.where(reached, along, np.nan)

    def opening_at(
        self, contact: float, openings: tuple[float, float], above: float = 0.0
    ) -> float | None:
        """Opening (rad) within ``openings`` at which the edge crosses at ``contact`` (m), or None.

        The inverse of :meth:`crossing`, which falls as the blades open, by interpolation on a
        fine grid. None, too, in a gap of it, where the edge rises through the face twice.
        """
        grid = np.linspace(*openings, GRID)
        reach = self.crossing(grid, above)
        known = np.isfinite(reach)
        grid, reach = grid[known], reach[known]
        if len(grid) < 2 or np.any(np.diff(reach) >= 0) or not reach[-1] <= contact <= reach[0]:
            return None
        found = float(np.interp(contact, reach[::-1], grid[::-1]))
        return found if np.isfinite(self.crossing(found, above)) else None

    def cutting_range(
        self, openings: tuple[float, float], contacts: tuple[float, float]
    ) -> tuple[float, float] | None:
        """Widest range of openings within ``openings`` whose crossing lies within ``contacts``.

        None where there is none, or where the crossing does not move outwards as the blades
        close.
        """
        grid = np.linspace(*openings, GRID)
        reach = self.crossing(grid)
        inside = np.flatnonzero((reach >= contacts[0]) & (reach <= contacts[1]))
        if len(inside) < 2 or np.any(np.diff(reach[inside]) >= 0) or np.any(np.diff(inside) != 1):
            return None
        return float(grid[inside[0]]), float(grid[inside[-1]])


FIRST_LEAD_M = 1e-3
LEAD_M = 4e-3
"""Distance before the end of the cut at which a stroke starts: the crack lags the blades."""

ADVANCE_MARGIN_M = 2e-3
SHEET_MARGIN_M = 2e-3
LEAST_CUT_M = 5e-3

CLEARANCE_M = 1e-3
DEPTH_PER_REFERENCE = 1.5
DEPTH_PER_FACE = 0.9


def cut_plan(recipe: Recipe, identity: Identity) -> Plan:
    """Plan strokes through fresh material, or presses where the scene cuts nothing.

    Every sheet is one segment: close at one of the recipe's speeds (in turn), open, advance so
    that the next stroke starts just before the end of the cut, and finally return to where the
    next sheet is loaded. A press closes at one contact position and opens again. Raises
    DeviceError where the rig has no advance motor or too little travel, InputError where the recipe
    leaves nothing to cut or press.
    """
    refuse_linear(recipe)
    if not identity.capabilities & Capability.ADVANCE_MOTOR:
        raise DeviceError(
            f"The device {identity.name} has no advance motor, so it cannot advance through the "
            "material: capture with --hand."
        )
    if recipe.scene.cut:
        return _through_sheets(recipe, identity)
    return _presses(recipe, identity)


def hand_requests(recipe: Recipe) -> tuple[str, ...]:
    """Sentences that ask a person for the strokes of a capture by hand, one for each sheet."""
    refuse_linear(recipe)
    capture = recipe.capture.cut
    verb = "cut" if recipe.scene.cut else "press without cutting"
    slow, fast = min(capture.speeds_rad_per_s), max(capture.speeds_rad_per_s)
    return tuple(
        f"Put in a fresh piece of {recipe.material.name} (piece {sheet + 1} of {capture.sheets}), "
        f"then {verb} {capture.strokes_per_sheet} times by hand: some slowly ({slow:g} rad/s), "
        f"some fast ({fast:g} rad/s)."
        for sheet in range(capture.sheets)
    )


def cut_openings(recipe: Recipe, identity: Identity) -> tuple[float, float]:
    """Openings (rad) of the scene between which the blades cross the sheet at its contacts."""
    openings = Blade.of(recipe).cutting_range(
        opening_range(recipe, identity), recipe.scene.contact_m
    )
    if openings is None:
        raise InputError(_never_crosses(recipe))
    return openings


def press_openings(recipe: Recipe, identity: Identity) -> tuple[tuple[float, float], ...]:
    """Return the openings (rad) between which the presses of a recipe move: (deep, clear) each."""
    places = _press_places(recipe, identity, recipe.capture.cut.strokes_per_sheet)
    return tuple((place.bottom, place.top) for place in places)


class _Cut(NamedTuple):
    """One stroke: where the pivot stands, and the openings between which it closes."""

    advance: float
    top: float
    bottom: float


def _through_sheets(recipe: Recipe, identity: Identity) -> Plan:
    cuts = _cuts_of_a_sheet(recipe, identity)
    tick_s = identity.tick_us * 1e-6
    opening_speed = min(OPENING_SPEED, recipe.scene.opening_rate_rad_per_s[1])
    speeds = cycle(recipe.capture.cut.speeds_rad_per_s)
    strokes = StrokeList()
    segments = []
    sheets = recipe.capture.cut.sheets
    for sheet in range(sheets):
        path = PathBuilder(cuts[0].top, cuts[0].advance, tick_s)
        path.rest(DWELL_S)
        for cut in cuts:
            path.advance_to(cut.advance, ADVANCE_SPEED, ADVANCE_ACCELERATION)
            path.rest(SETTLE_S)
            speed = next(speeds)
            closing = strokes.add("closing", speed, sheet)
            path.open_to(cut.bottom, speed, TURN_ACCELERATION, closing)
            path.rest(DWELL_S)
            opening = strokes.add("opening", opening_speed, sheet)
            path.open_to(cut.top, opening_speed, TURN_ACCELERATION, opening)
            path.rest(DWELL_S)
        path.advance_to(cuts[0].advance, ADVANCE_SPEED, ADVANCE_ACCELERATION)
        path.rest(DWELL_S)
        request = (
            f"Put in a fresh piece of {recipe.material.name} (piece {sheet + 1} of {sheets}), its "
            "near edge at the mark; the blades stand open before it."
        )
        segments.append(Segment(path.reference(), "sheet", sheet, request))
    return Plan(tuple(segments), tuple(strokes.all), tick_s)


def _cuts_of_a_sheet(recipe: Recipe, identity: Identity) -> tuple[_Cut, ...]:
    """Place up to strokes_per_sheet strokes on a sheet, within it and the carriage's travel."""
    blade = Blade.of(recipe)
    openings = bottom, top = cut_openings(recipe, identity)
    inner, outer = float(blade.crossing(top)), float(blade.crossing(bottom))
    end = recipe.material.sheet_length_mm * 1e-3 - SHEET_MARGIN_M
    first, last = _carriage_travel(identity)
    cuts: list[_Cut] = []
    crack = 0.0
    for number in range(recipe.capture.cut.strokes_per_sheet):
        advance = crack - inner - (FIRST_LEAD_M if number == 0 else LEAD_M)
        reach = min(outer, end - advance)
        if advance > last or advance + reach < crack + LEAST_CUT_M:
            break
        if advance < first:
            raise DeviceError(
                f"Before a fresh sheet the carriage must stand at {1e3 * advance:.0f} mm, and the "
                f"device {identity.name} goes no further back than "
                f"{1e3 * identity.advance_min:.0f} mm: raise the low end of scene.contact_mm no "
                "further than the blades need, or mount the material further out."
            )
        closed = bottom if reach == outer else blade.opening_at(reach, openings)
        if closed is None:
            break
        cuts.append(_Cut(advance, top, closed))
        crack = advance + reach
    if not cuts:
        raise InputError(
            f"material.sheet_length_mm = {recipe.material.sheet_length_mm:g} leaves no stroke of "
            f"at least {1e3 * LEAST_CUT_M:.0f} mm: use longer pieces."
        )
    return tuple(cuts)


def _presses(recipe: Recipe, identity: Identity) -> Plan:
    """Press at several contact positions, every speed at each, round after round."""
    capture = recipe.capture.cut
    places = _press_places(recipe, identity, capture.strokes_per_sheet)
    speeds = capture.speeds_rad_per_s
    tick_s = identity.tick_us * 1e-6
    strokes = StrokeList()
    path = PathBuilder(places[0].top, places[0].advance, tick_s)
    path.rest(DWELL_S)
    for number in range(capture.sheets):
        for index, place in enumerate(places):
            speed = speeds[(index + number) % len(speeds)]
            path.open_to(max(path.opening, place.top), OPENING_SPEED, TURN_ACCELERATION)
            path.advance_to(place.advance, ADVANCE_SPEED, ADVANCE_ACCELERATION)
            path.open_to(place.top, OPENING_SPEED, TURN_ACCELERATION)
            path.rest(SETTLE_S)
            path.open_to(place.bottom, speed, TURN_ACCELERATION, strokes.add("press", speed, 0))
            path.rest(DWELL_S)
            path.open_to(place.top, speed, TURN_ACCELERATION, strokes.add("opening", speed, 0))
            path.rest(DWELL_S)
    request = (
        f"Put in the {recipe.material.name}, its near edge at the mark; the blades stand open "
        "before it and will press it without cutting."
    )
    segment = Segment(path.reference(), "sheet", 0, request)
    return Plan((segment,), tuple(strokes.all), tick_s)


def _press_places(recipe: Recipe, identity: Identity, count: int) -> tuple[_Cut, ...]:
    """Contacts spread over the scene's range, each with openings from just above to deep.

    How deep follows from the material, so the blades may close farther than in the scene: there
    the depths of its nearest contact are not reached at its farthest.
    """
    blade = Blade.of(recipe)
    openings = usable_opening(identity)[0], opening_range(recipe, identity)[1]
    deepest = min(
        DEPTH_PER_REFERENCE * recipe.fit.cut.reference_indentation_mm * 1e-3,
        DEPTH_PER_FACE * recipe.upper_face_m,
    )
    clear = blade.cutting_range(openings, recipe.scene.contact_m)
    if clear is None:
        raise InputError(_never_crosses(recipe))
    above = [value for value in blade.crossing(openings, CLEARANCE_M) if np.isfinite(value)]
    below = [value for value in blade.crossing(openings, -deepest) if np.isfinite(value)]
    tip = TIP_SHARE * blade.length
    nearest = max(recipe.scene.contact_m[0], min(above, default=np.inf))
    farthest = min(recipe.scene.contact_m[1], max(below, default=-np.inf), tip)
    first, last = _carriage_travel(identity)
    places = []
    for contact in np.linspace(nearest, farthest, count) if nearest < farthest else ():
        top = blade.opening_at(float(contact), openings, CLEARANCE_M)
        bottom = blade.opening_at(float(contact), openings, -deepest)
        if top is not None and bottom is not None and first <= -contact <= last:
            places.append(_Cut(-float(contact), top, bottom))
    if not places:
        raise InputError(_never_crosses(recipe))
    return tuple(places)


def _carriage_travel(identity: Identity) -> tuple[float, float]:
    return identity.advance_min + ADVANCE_MARGIN_M, identity.advance_max - ADVANCE_MARGIN_M


def _never_crosses(recipe: Recipe) -> str:
    scene, edge = recipe.scene, recipe.rig.edge
    stated, signs = (
        (f"offset {edge.offset_mm:g} mm, taper {edge.taper_deg:g} deg", "offset_mm < 0")
        if edge.points_mm is None
        else (f"{len(edge.points_mm)} points", "offsets of points_mm < 0, without waves")
    )
    return (
        f"With rig.edge ({stated}) the blades reach the plate nowhere within "
        f"scene.opening_deg = {list(scene.opening_deg)} and "
        f"scene.contact_mm = {list(scene.contact_mm)} that this device can go to: check the "
        f"edge's signs (the edges of scissors lie beyond the pivot, {signs}) and the ranges."
    )
