"""Strokes of a hand over a scene, and the torque that a loop of one rate renders over them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.sim.hand import minimum_jerk
from scissorcal.kernel import Kernel, ModelTables, estimated_rates
from scissorcal.recipe.schema import Recipe
from scissorcal.render.admission_rule import RATE_CUTOFF_HZ

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


Torques = NDArray[np.float32]

CONTINUOUS_HZ = 64_000.0
"""Rate of the reference: eight times the fastest loop that is measured."""

BINS = 25
"""A stroke is averaged over so many parts of its time, which takes the ripple out."""


def continuous_torques(
    tables: ModelTables, strokes: Sequence[Stroke], limit: float
) -> tuple[Torques, ...]:
    """Torque (N m) of each stroke at 64 kHz with the true rate, within the torque limit."""
    found = []
    for stroke in strokes:
        time = _moments(stroke)
        opening, rate = stroke.at(time)
        found.append(_stepped(tables, stroke, opening, rate, limit))
    return tuple(found)


def rendered_error(
    tables: ModelTables,
    strokes: Sequence[Stroke],
    rate_Hz: float,
    limit: float,
    encoder_step: float = 0.0,
    phase: float = 0.0,
) -> dict[str, float]:
    """Errors of a loop that samples ``rate_Hz`` times a second and holds its torque in between.

    The kernel steps at that rate, with the rate of opening as the servo estimates it: differences
    of the encoder's counts (``encoder_step`` in rad, 0 for none) behind its low-pass. The first
    sample is taken ``phase`` (0 to 1) of a tick after the stroke's begin. The loop's delay is not
    among the errors: it depends on the line, not on the rate alone.

    In N m: ``average`` and ``worst`` of the mean torque over 25 parts of each movement, which takes
    the ripple out; ``moments``, the average at every moment, in which a tooth that starts a little
    late counts in full; ``largest``, the largest continuous torque.
    """
    continuous = continuous_torques(tables, strokes, limit)
    tick_us = round(1e6 / rate_Hz)
    means, away, total, largest = [], 0.0, 0, 0.0
    for stroke, reference in zip(strokes, continuous, strict=True):
        start = phase * tick_us * 1e-6
        samples = np.arange(start, stroke.duration_s, tick_us * 1e-6)
        opening, _ = stroke.at(samples)
        if encoder_step > 0.0:
            opening = encoder_step * np.round(opening / encoder_step)
        rate = estimated_rates(opening, tick_us, RATE_CUTOFF_HZ)
        torque = _stepped(tables, stroke, opening, rate, limit)
        held = np.searchsorted(samples, _moments(stroke), side="right") - 1
        first = np.where(held >= 0, torque[np.maximum(held, 0)], reference[0])
        error = first.astype(np.float64) - reference
        away, total = away + float(np.abs(error).sum()), total + len(error)
        largest = max(largest, float(np.abs(reference).max()))
        means += [float(part.mean()) for part in np.array_split(error, 2 * BINS)]
    size = np.abs(means)
    return {
        "average": float(size.mean()),
        "worst": float(size.max()),
        "moments": away / total,
        "largest": largest,
    }


def _moments(stroke: Stroke) -> Array:
    """Middles of the reference's ticks: there a held torque is off by half a tick on average."""
    count = int(stroke.duration_s * CONTINUOUS_HZ)
    return np.asarray((np.arange(count) + 0.5) / CONTINUOUS_HZ)


def _stepped(
    tables: ModelTables, stroke: Stroke, opening: Array, rate: Array, limit: float
) -> Torques:
    """Torque of a fresh kernel along a stroke, within the limit."""
    torque = Kernel(tables).step_many(opening, rate, -stroke.contact_m)["torque"]
    return np.asarray(np.clip(torque, -limit, limit), dtype=np.float32)
