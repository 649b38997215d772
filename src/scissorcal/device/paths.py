"""Smooth paths on the device's ticks: glides, rests, multisines, and their joining. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recipe.pace import MOST_MIN, glide_speed, glide_time, ramp_time


@dataclass(frozen=True)
class Reference:
    """Commanded position at each tick; all arrays (n,).

    ``opening`` rad, ``opening_rate`` rad/s, ``advance`` m, ``stroke`` the stroke's index or -1.
    """

    opening: Array
    opening_rate: Array
    advance: Array
    stroke: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.opening)

    def head(self) -> "Reference":
        """Return the start as a rest of one tick that belongs to no stroke."""
        still = np.zeros(1)
        return Reference(self.opening[:1], still, self.advance[:1], np.full(1, -1, dtype=np.int32))

    @classmethod
    def joined(cls, parts: Sequence["Reference"]) -> "Reference":
        """Join parts that follow each other."""
        return cls(
            np.concatenate([part.opening for part in parts]),
            np.concatenate([part.opening_rate for part in parts]),
            np.concatenate([part.advance for part in parts]),
            np.concatenate([part.stroke for part in parts]),
        )


class PathBuilder:
    """Joins movements of one axis at a time, from a start position.

    >>> path = PathBuilder(opening=0.5, advance=0.0, tick_s=1e-3)
    >>> path.open_to(0.4, speed=0.1, acceleration=20.0, stroke=0)
    >>> path.rest(0.1)
    >>> reference = path.reference()
    >>> len(reference), float(reference.opening[-1])
    (1130, 0.4)
    """

    def __init__(self, opening: float, advance: float, tick_s: float) -> None:
        self.opening = opening
        self.advance = advance
        self._tick_s = tick_s
        self._parts: list[Reference] = []
        self._seconds = 0.0

    def open_to(self, opening: float, speed: float, acceleration: float, stroke: int = -1) -> None:
        """Turn the blades to ``opening`` at a cruising ``speed`` (rad/s), ramps included."""
        self._refuse_endless(glide_time(abs(opening - self.opening), speed, acceleration))
        way, rate = glide(opening - self.opening, speed, acceleration, self._tick_s)
        self._append(self.opening + way, rate, np.full(len(way), self.advance), stroke)
        self.opening = opening

    def advance_to(
        self, advance: float, speed: float, acceleration: float, stroke: int = -1
    ) -> None:
        """Move the pivot to ``advance`` at a cruising ``speed`` (m/s), the blades at rest."""
        self._refuse_endless(glide_time(abs(advance - self.advance), speed, acceleration))
        way, _ = glide(advance - self.advance, speed, acceleration, self._tick_s)
        self.slide(way, stroke)
        self.advance = advance

    def rest(self, seconds: float) -> None:
        """Hold still."""
        count = max(1, round(seconds / self._tick_s))
        still = np.full(count, self.opening)
        self._append(still, np.zeros(count), np.full(count, self.advance), -1)

    def swing(self, way: Array, rate: Array, stroke: int) -> None:
        """Follow an excitation around the current opening; it must end where it began."""
        self._append(self.opening + way, rate, np.full(len(way), self.advance), stroke)

    def slide(self, way: Array, stroke: int) -> None:
        """Follow a way of the pivot from where it stands, the blades at rest."""
        still = np.full(len(way), self.opening)
        self._append(still, np.zeros(len(way)), self.advance + way, stroke)

    def reference(self) -> Reference:
        """Return everything so far as one reference."""
        if not self._parts:
            self.rest(self._tick_s)
        return Reference.joined(self._parts)

    def _refuse_endless(self, seconds: float) -> None:
        """Raise InputError where the path becomes too long to be held in memory."""
        self._seconds += seconds
        if self._seconds > 60.0 * MOST_MIN:
            raise InputError(
                f"The planned motion takes {self._seconds / 3600.0:,.3g} hours and more, beyond "
                f"the {MOST_MIN / 60.0:g} that a capture may take: correct the speeds and numbers "
                "in the recipe's [capture] sections."
            )

    def _append(self, opening: Array, rate: Array, advance: Array, stroke: int) -> None:
        labels = np.full(len(opening), stroke, dtype=np.int32)
        self._parts.append(Reference(opening, rate, advance, labels))


def glide(distance: float, speed: float, acceleration: float, tick_s: float) -> tuple[Array, Array]:
    """Displacement and rate from rest to rest: raised-cosine ramps, between them ``speed``.

    ``acceleration`` bounds the ramps' peak; where the distance is too short to reach ``speed``,
    the cruise is slower. Both arrays (n,): the first entry is one tick after the start, the last
    is exactly ``distance`` at rate 0.
    """
    length = abs(distance)
    if length == 0.0:
        return np.zeros(0), np.zeros(0)
    total = glide_time(length, speed, acceleration)
    speed = glide_speed(length, speed, acceleration)
    ramp = ramp_time(speed, acceleration)
    time = np.minimum(np.arange(1, int(np.ceil(total / tick_s - 1e-9)) + 1) * tick_s, total)
    rising, falling = time < ramp, time > total - ramp
    way = speed * (time - 0.5 * ramp)
    way[rising] = _ramp_way(time[rising], speed, ramp)
    way[falling] = length - _ramp_way(total - time[falling], speed, ramp)
    rate = np.full(len(time), speed)
    rate[rising] = 0.5 * speed * (1.0 - np.cos(np.pi * time[rising] / ramp))
    rate[falling] = 0.5 * speed * (1.0 - np.cos(np.pi * (total - time[falling]) / ramp))
    way[-1], rate[-1] = length, 0.0
    return np.sign(distance) * way, np.sign(distance) * rate


class SwingLimits(NamedTuple):
    """Bounds of an excitation: amplitude (rad or m), rate and acceleration per s and s^2."""

    amplitude: float
    rate: float
    acceleration: float


def multisine(
    duration_s: float,
    band_Hz: tuple[float, float],
    limits: SwingLimits,
    tick_s: float,
    tones: int = 14,
) -> tuple[Array, Array]:
    """Displacement and rate of a multisine that fades in and out, as large as its limits allow.

    Tones lie evenly in the logarithm of frequency, on multiples of 1/duration, with equal rate
    amplitudes and Schroeder phases (Schroeder 1970, doi:10.1109/TIT.1970.1054411), which keep the
    crest low. It begins and ends at 0 and at rest.
    """
    count = max(2, round(duration_s / tick_s))
    time = tick_s * np.arange(1, count + 1, dtype=np.float64)
    duration = count * tick_s
    harmonics = np.unique(np.round(np.geomspace(*band_Hz, tones) * duration).clip(1))
    angular = 2.0 * np.pi * harmonics / duration
    order = np.arange(len(harmonics))
    phase = -np.pi * order * (order - 1) / len(harmonics)
    angle = np.outer(time, angular) + phase
    way = (np.sin(angle) / angular).sum(axis=1)
    rate = np.cos(angle).sum(axis=1)
    acceleration = (-np.sin(angle) * angular).sum(axis=1)
    window, slope, bend = _fades(time, duration)
    bent = acceleration * window + 2.0 * rate * slope + way * bend
    way, rate = way * window, rate * window + way * slope
    scale = min(
        limits.amplitude / np.abs(way).max(),
        limits.rate / np.abs(rate).max(),
        limits.acceleration / np.abs(bent).max(),
    )
    way, rate = scale * way, scale * rate
    way[-1] = rate[-1] = 0.0
    return way, rate


def _ramp_way(time: Array, speed: float, ramp: float) -> Array:
    return np.asarray(0.5 * speed * (time - ramp / np.pi * np.sin(np.pi * time / ramp)))


def _fades(time: Array, duration: float) -> tuple[Array, Array, Array]:
    """Window that rises and falls as smooth steps, with its first and second derivative."""
    fade = min(1.0, 0.25 * duration)
    edge = np.minimum(time, duration - time)
    u = np.clip(edge / fade, 0.0, 1.0)
    side = np.where(time <= duration / 2, 1.0, -1.0) / fade
    window = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    slope = 30.0 * u**2 * (1.0 - u) ** 2 * side
    bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / fade**2
    return window, slope, bend
