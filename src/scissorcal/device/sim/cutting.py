"""Cutting: a crack that rests until the drive meets the toughness, runs, stops, and never closes.

The crack starts where the released energy per metre exceeds the local fracture energy, and runs
on until it has fallen to kappa times that: a running crack needs less than one that has to start.
So a run of length dX takes kappa J_c h dX for its new surface, and what it releases beyond that is
lost when it stops. Both are booked, and neither is ever negative. (J_c h dX itself would be more
than the run releases, unless kappa = 1.)
"""

import math
from collections.abc import Callable

from scissorcal.device.sim.blade import APART, BladeOnSheet, Sheet, Touch

RUNS_PER_STEP = 64
PLACE_TOLERANCE = 1e-12
SHORTEST_BRACKET = 1e-8
FORCE_TOLERANCE_N = 1e-11
DRIVE_TOLERANCE_N = 1e-8  # above what the last bit of a run's place may leave


class Cut:
    """The state of one cut: blades on a sheet, and the pose they came from.

    ``fracture_J`` and ``arrest_J`` are the energy of the new surface and what was lost at stops.
    """

    __slots__ = ("_drive", "_pose", "_width", "arrest_J", "blade", "fracture_J", "sheet")

    def __init__(self, blade: BladeOnSheet, sheet: Sheet) -> None:
        self.blade = blade
        self.sheet = sheet
        self.fracture_J = 0.0
        self.arrest_J = 0.0
        self._pose: tuple[float, float] | None = None
        self._drive = 0.0
        self._width = SHORTEST_BRACKET

    def move_to(self, opening: float, advance: float) -> Touch:
        """Bring the blades to a pose, advance the crack where driven, and return the forces.

        A run that starts on the way is placed on the way: at the pose between the last and this
        one at which the drive met the toughness. So the length of a step of time does not raise
        the force at which the sheet breaks.
        """
        sheet = self.sheet
        if sheet.severed:
            return APART
        touch = self.blade.touch(opening, sheet.crack - advance)
        if touch.drive > 0.0 and touch.drive > sheet.fracture_energy_at(sheet.crack):
            touch = self._run_along(opening, advance, touch)
        self._pose = (opening, advance)
        self._drive = touch.drive
        return touch

    def stored_energy(self, opening: float, advance: float) -> float:
        """Energy in joules that the sheet stores at a pose."""
        if self.sheet.severed:
            return 0.0
        return self.blade.energy(opening, self.sheet.crack - advance)

    def _run_along(self, opening: float, advance: float, touch: Touch) -> Touch:
        sheet = self.sheet
        start, drive = self._pose, self._drive
        for _ in range(RUNS_PER_STEP):
            cost = sheet.fracture_energy_at(sheet.crack)
            if touch.drive <= cost + DRIVE_TOLERANCE_N or sheet.severed:
                return touch
            at = (opening, advance)
            if sheet.kappa < 1.0 and start is not None and drive < cost:
                share = (cost - drive) / (touch.drive - drive)
                at = (
                    start[0] + share * (opening - start[0]),
                    start[1] + share * (advance - start[1]),
                )
            self._run(*at)
            start = at
            drive = 0.0 if sheet.severed else self.blade.touch(at[0], sheet.crack - at[1]).drive
            touch = APART if sheet.severed else self.blade.touch(opening, sheet.crack - advance)
        self._run(opening, advance)
        return APART if sheet.severed else self.blade.touch(opening, sheet.crack - advance)

    def _run(self, opening: float, advance: float) -> None:
        """Let the crack run at one pose until the drive is kappa times what cutting costs."""
        sheet, blade = self.sheet, self.blade
        before = sheet.crack
        stored = blade.energy(opening, before - advance)

        def excess(place: float) -> float:
            drive = blade.touch(opening, place - advance).drive
            return drive - sheet.kappa * sheet.fracture_energy_at(place)

        place = _first_fall(excess, before, sheet.length, self._width)
        if place is None:
            place = sheet.length
            sheet.severed = True
        sheet.crack = max(place, before)
        self._width = max(1.2 * (sheet.crack - before), SHORTEST_BRACKET)
        work = sheet.kappa * sheet.work_between(before, sheet.crack)
        left = 0.0 if sheet.severed else blade.energy(opening, sheet.crack - advance)
        self.fracture_J += work
        self.arrest_J += stored - left - work


def _first_fall(
    excess: Callable[[float], float], start: float, end: float, width: float
) -> float | None:
    """First place after ``start`` at which ``excess`` is no longer positive; None before ``end``.

    Widens a bracket step by step, beginning with ``width`` (the last run is a good guess), then
    closes it by the Illinois form of regula falsi, which needs no derivative and cannot leave the
    bracket.
    """
    low = start
    low_value = excess(start)
    if low_value <= 0.0:
        return start
    while True:
        high = min(low + width, end)
        high_value = excess(high)
        if high_value <= 0.0:
            break
        if high >= end:
            return None
        low, low_value = high, high_value
        width *= 2.0
    side = 0
    for _ in range(200):
        if high - low <= PLACE_TOLERANCE:
            break
        place = high - high_value * (high - low) / (high_value - low_value)
        if not low < place < high:
            place = 0.5 * (low + high)
        value = excess(place)
        if math.fabs(value) < FORCE_TOLERANCE_N:
            return place
        if value > 0.0:
            low, low_value = place, value
            if side == 1:
                high_value *= 0.5
            side = 1
        else:
            high, high_value = place, value
            if side == -1:
                low_value *= 0.5
            side = -1
    return high
