"""Strokes of a hand over a scene: the motions over which a loop's rate is judged."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.sim.hand import minimum_jerk
from scissorcal.recipe.schema import Recipe

SPEEDS = 3
PEAK_OVER_MEAN = 1.875
"""Largest over mean rate of a minimum-jerk movement, 15/8 (Flash and Hogan 1985,
doi:10.1523/JNEUROSCI.05-07-01688.1985)."""

SLOWEST_PEAK_rad_per_s = 0.1
"""A scene that begins at rest gets no slower stroke: it would last for minutes."""

SHEET_SHIFT_m = 2e-3
"""A few teeth of paper. In which phase of a tooth a stroke turns round is chance: a crack one tooth
ahead there is 20 % of the torque until the blades open, so repeats begin at different edges."""


@dataclass(frozen=True)
class Stroke:
    """The blades close from ``wide`` to ``narrow`` (rad) and open again, each in ``half_s``.

    Both movements are minimum-jerk. ``contact_m`` is where the material is met: the near edge of a
    fresh sheet, or where it is pressed.
    """

    wide: float
    narrow: float
    half_s: float
    contact_m: float

    @property
    def duration_s(self) -> float:
        """Seconds of closing and opening."""
        return 2.0 * self.half_s

    def at(self, time_s: Array) -> tuple[Array, Array]:
        """Opening (rad) and its rate (rad/s) at times (n,) from 0 to ``duration_s``."""
        closing = time_s < self.half_s
        elapsed = np.clip(time_s / self.half_s - np.where(closing, 0.0, 1.0), 0.0, 1.0)
        share, grade = minimum_jerk(elapsed)
        way = self.narrow - self.wide
        opening = np.where(closing, self.wide + way * share, self.narrow - way * share)
        return opening, np.where(closing, way, -way) * grade / self.half_s


def hand_strokes(recipe: Recipe, shift: float = 0.0) -> tuple[Stroke, ...]:
    """Strokes over the scene's openings whose peak rates span its rates.

    Where the scene cuts, each starts on a sheet whose near edge is at the scene's nearest contact,
    or farther by ``shift`` (0 to 1) of :data:`SHEET_SHIFT_m`, and the crack runs through the
    others; where it only presses, each is at another contact of the scene.
    """
    scene = recipe.scene
    low, high = scene.opening_rad
    slow, fast = scene.opening_rate_rad_per_s
    peaks = np.geomspace(min(max(2.0 * slow, SLOWEST_PEAK_rad_per_s), fast), fast, SPEEDS)
    nearest, farthest = scene.contact_m
    edge = nearest + shift * min(SHEET_SHIFT_m, farthest - nearest)
    contacts = np.full(SPEEDS, edge) if scene.cut else np.linspace(nearest, farthest, SPEEDS)
    return tuple(
        Stroke(high, low, PEAK_OVER_MEAN * (high - low) / float(peak), float(contact))
        for peak, contact in zip(peaks, contacts, strict=True)
    )
