"""Where the recipe's edge crosses the plate, for planning cuts and presses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.recipe.edge import StatedCurve, stated_curve
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

        >>> from scissorcal.recipe.load import builtin_recipe
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
