"""A virtual hand: it closes the handles in smooth strokes, opens them, and advances.

Each movement follows a minimum-jerk path (Flash and Hogan 1985,
doi:10.1523/JNEUROSCI.05-07-01688.1985). The hand holds the handles as through a damped spring of
limited strength, with tremor. It knows where the cut ends, as a person sees it; without
material it takes the end of the cut to be where the blades last crossed.
"""

import math
from collections.abc import Iterator
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.sim.blade import BladeOnSheet
from scissorcal.device.sim.sensors import standard_normals
from scissorcal.device.sim.specimen import Specimen

TREMOR_BANDWIDTH_HZ = 2.0


Number = TypeVar("Number", float, NDArray[np.float64])


def minimum_jerk(elapsed: Number) -> tuple[Number, Number]:
    """Share of the way, and its derivative, at a share ``elapsed`` (0 to 1) of a movement's time.

    The derivative is largest in the middle: 15 / 8 of the mean.

    >>> minimum_jerk(0.5)
    (0.5, 1.875)
    """
    square = elapsed * elapsed
    rest = 1.0 - elapsed
    share = square * elapsed * (10.0 + elapsed * (6.0 * elapsed - 15.0))
    return share, 30.0 * square * rest * rest


class Phase(Enum):
    """What the hand is doing."""

    REST = "rest"
    OPENING = "opening"
    MOVING = "moving"
    CLOSING = "closing"


class VirtualHand:
    """Forces of the hand on handles and carriage, one tick at a time.

    A round is: open the blades, move on until they just reach the end of the cut, close them.
    After ``strokes`` rounds (or at the end of the sheet or of the carriage's travel) the hand opens
    the blades once more and releases them.
    """

    def __init__(
        self, specimen: Specimen, blade: BladeOnSheet, tick_s: float, rng: np.random.Generator
    ) -> None:
        self._law = specimen.hand
        self._blade = blade
        self._radius = specimen.mechanism.handle_radius_mm * 1e-3
        self._tick = tick_s
        self._tremor = _tremor(self._law.tremor_N, self._law.tremor_Hz, tick_s, rng)
        self._presses = specimen.material.fracture_energy is None
        low, high = specimen.mechanism.advance.range_mm
        self._way = (low * 1e-3 + 1e-3, high * 1e-3 - 1e-3)
        self._sheet_end = specimen.material.sheet_length_mm * 1e-3
        self._open = math.radians(self._law.open_deg)
        self.phase = Phase.REST
        self.strokes = 4
        self.strokes_done = 0
        self._speed = 0.0
        self._seen = 0.0
        self._elapsed = 0.0
        self._opening_path = (0.0, 0.0, 1.0)
        self._advance_path = (0.0, 0.0, 1.0)

    def start(self, speed: float, opening: float, advance: float) -> None:
        """Begin strokes with a mean rate of ``speed`` rad/s; 0 releases the handles."""
        self._speed = speed
        self.strokes_done = 0
        self._seen = 0.0
        if speed <= 0.0:
            self.phase = Phase.REST
        else:
            self._begin(Phase.OPENING, opening, advance)

    def forces(
        self, opening: float, rate: float, advance: float, advance_rate: float, crack: float | None
    ) -> tuple[float, float]:
        """Force on the handles (N, positive closes) and on the carriage (N, positive forwards).

        ``crack`` is where the cut ends (m, plate frame), None where there is no material.
        """
        if self.phase is Phase.REST:
            return 0.0, 0.0
        law = self._law
        if crack is not None:
            self._seen = crack
        elif not self._presses:
            self._seen = max(self._seen, advance + self._blade.crossing(opening))
        self._elapsed += self._tick
        due = max(self._opening_path[2], self._advance_path[2]) + law.pause_s
        if self._elapsed >= due and not self._next_phase(opening, advance):
            return 0.0, 0.0
        target, target_rate = _on_path(self._opening_path, self._elapsed)
        place, place_rate = _on_path(self._advance_path, self._elapsed)
        torque = law.stiffness_Nm_per_rad * (opening - target)
        torque += law.damping_Nm_s_per_rad * (rate - target_rate)
        force = law.advance_stiffness_N_per_m * (place - advance)
        force += law.advance_damping_N_s_per_m * (place_rate - advance_rate)
        return (
            _clip(torque / self._radius + next(self._tremor), law.strength_N),
            _clip(force, law.advance_strength_N),
        )

    def _next_phase(self, opening: float, advance: float) -> bool:
        """Go on to the next phase; False if the hand releases instead."""
        if self.phase is Phase.OPENING:
            if self.strokes_done >= self.strokes or not self._room_for_stroke():
                self.phase = Phase.REST
                return False
            self._begin(Phase.MOVING, opening, advance)
        elif self.phase is Phase.MOVING:
            self._begin(Phase.CLOSING, opening, advance)
        else:
            self.strokes_done += 1
            self._begin(Phase.OPENING, opening, advance)
        return True

    def _begin(self, phase: Phase, opening: float, advance: float) -> None:
        """Plan the paths of a phase from the current position."""
        law = self._law
        self.phase = phase
        self._elapsed = 0.0
        to_opening = self._opening_path[1] if phase is Phase.MOVING else self._open
        to_advance = self._advance_path[1] if phase is Phase.CLOSING else advance
        speed = law.opening_speed_rad_per_s
        if phase is Phase.MOVING:
            to_advance = self._stroke_advance()
        elif phase is Phase.CLOSING:
            to_opening = self._closed(to_advance)
            speed = self._speed
        self._opening_path = (opening, to_opening, abs(to_opening - opening) / speed + 1e-3)
        way_time = abs(to_advance - advance) / (law.advance_speed_mm_per_s * 1e-3) + 1e-3
        self._advance_path = (advance, to_advance, way_time)

    def _stroke_advance(self) -> float:
        """Where the carriage must stand for the next stroke."""
        law = self._law
        if self._presses:
            return _between(self._seen - law.press_contact_mm * 1e-3, self._way)
        reach = self._blade.crossing(self._open) + law.margin_mm * 1e-3
        return _between(self._seen - reach, self._way)

    def _room_for_stroke(self) -> bool:
        if self._presses:
            return True
        inside = self._seen < self._sheet_end - 1e-3
        return inside and self._stroke_advance() < self._way[1]

    def _closed(self, advance: float) -> float:
        """Opening at which the stroke ends: closed, or pressed to the intended depth."""
        closed = math.radians(self._law.closed_deg)
        if not self._presses:
            return closed
        contact = self._seen - advance
        depth = self._law.press_depth_mm * 1e-3
        low, high = closed, self._open
        if self._blade.indentation(low, contact) < depth:
            return closed
        for _ in range(40):
            middle = 0.5 * (low + high)
            if self._blade.indentation(middle, contact) > depth:
                low = middle
            else:
                high = middle
        return low


def _on_path(path: tuple[float, float, float], elapsed: float) -> tuple[float, float]:
    """Place and speed at ``elapsed`` seconds on the path (from, to, duration)."""
    start, end, duration = path
    if elapsed >= duration:
        return end, 0.0
    share, grade = minimum_jerk(elapsed / duration)
    return start + (end - start) * share, (end - start) * (grade / duration)


def _tremor(
    rms: float, frequency: float, tick_s: float, rng: np.random.Generator
) -> Iterator[float]:
    """Narrow-band noise around ``frequency`` (Hz): a resonator driven by white noise."""
    radius = math.exp(-math.pi * TREMOR_BANDWIDTH_HZ * tick_s)
    first = 2.0 * radius * math.cos(2.0 * math.pi * frequency * tick_s)
    second = -radius * radius
    variance = (1.0 - second) / ((1.0 + second) * ((1.0 - second) ** 2 - first * first))
    gain = rms / math.sqrt(variance)
    drawn = standard_normals(rng)
    last = before = 0.0
    while True:
        last, before = first * last + second * before + gain * next(drawn), last
        yield last


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _between(value: float, bounds: tuple[float, float]) -> float:
    return max(bounds[0], min(bounds[1], value))
