"""Blade on sheet: the edge's place over the crack tip, and every force that follows from it.

All forces are gradients of one stored energy E(theta, x_n, X) = m w(s) G(delta), with G the
integral of the response, s the station on the blade above the crack tip, and w a weight that is 1
along the blade and fades to 0 beyond its tip. So nothing that the simulation does to the blades
can make energy: torque = -dE/d(theta), force on the pivot = -dE/d(x_n), and -dE/dX drives the
crack.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from scissorcal.device.sim.specimen import Material, Specimen
from scissorcal.device.sim.wave import Wave

FORCE_CEILING_N = 1000.0
"""Beyond this force at the edge the response stays constant: no sheet sustains more, and the steel
yields. It keeps every number finite without a step in the force."""

STEPS_PER_LENGTH = 16


class Response:
    """Force at the edge against indentation, exact and scalar.

    ``power``: g = G (delta / ref)^n. ``exponential``: g = G (exp(b delta) - 1) / (exp(b ref) - 1)
    with b = n / ref. Both are capped at FORCE_CEILING_N; ``energy`` is the integral of the capped
    force.
    """

    __slots__ = ("ceiling", "ceiling_energy", "exponent", "is_power", "rate", "scale")

    def __init__(self, material: Material) -> None:
        reference = material.reference_m
        self.is_power = material.response == "power"
        self.exponent = material.response_exponent
        self.rate = material.response_exponent / reference
        if self.is_power:
            self.scale = material.response_force_N / math.pow(reference, self.exponent)
        else:
            self.scale = material.response_force_N / math.expm1(self.exponent)
        self.ceiling = self.indentation(FORCE_CEILING_N)
        self.ceiling_energy = self.energy(self.ceiling)

    def force(self, indentation: float) -> float:
        """Force g in newtons at ``indentation`` (m); 0 where there is no contact."""
        if indentation <= 0.0:
            return 0.0
        if indentation >= self.ceiling:
            return FORCE_CEILING_N
        if self.is_power:
            return self.scale * math.pow(indentation, self.exponent)
        return self.scale * math.expm1(self.rate * indentation)

    def energy(self, indentation: float) -> float:
        """Stored energy in joules, the integral of the force from 0."""
        if indentation <= 0.0:
            return 0.0
        if indentation > self.ceiling:
            return self.ceiling_energy + FORCE_CEILING_N * (indentation - self.ceiling)
        if self.is_power:
            grown = self.exponent + 1.0
            return self.scale * math.pow(indentation, grown) / grown
        argument = self.rate * indentation
        if argument < 1e-4:
            return self.scale / self.rate * argument * argument * (0.5 + argument / 6.0)
        return self.scale / self.rate * (math.expm1(argument) - argument)

    def indentation(self, force: float) -> float:
        """Indentation in metres at which the response reaches ``force`` > 0."""
        if self.is_power:
            return math.pow(force / self.scale, 1.0 / self.exponent)
        return math.log1p(force / self.scale) / self.rate


class Sheet:
    """One fresh piece of material: how far it is cut, and its toughness at each place.

    The fracture energy per metre of cut is ``mean * (1 + variation * xi(X))``, piecewise linear
    on a grid that is fine against the correlation length. ``xi`` is Gaussian with unit variance
    before its mean over this very sheet is taken off, so that the mean is exactly ``mean``.
    """

    __slots__ = ("_grid", "_step", "_work", "crack", "kappa", "length", "mean", "severed")

    def __init__(self, material: Material, rng: np.random.Generator | None) -> None:
        """``rng`` draws the toughness field; None gives the mean toughness everywhere."""
        self.length = material.sheet_length_mm * 1e-3
        self.crack = 0.0
        self.severed = False
        self.kappa = material.kappa
        self.mean = material.fracture_energy
        mean = math.inf if self.mean is None else self.mean
        count = 1
        relative = [1.0, 1.0]
        if rng is not None and material.toughness_variation > 0.0 and self.mean is not None:
            count, relative = _toughness_field(material, rng)
        self._step = self.length / count
        self._grid = [mean * value for value in relative]
        self._work = [0.0]
        for left, right in zip(self._grid[:-1], self._grid[1:], strict=True):
            self._work.append(self._work[-1] + 0.5 * self._step * (left + right))

    def fracture_energy_at(self, place: float) -> float:
        """Energy per metre of cut (N) at ``place`` (m, plate frame); inf where nothing is cut."""
        grid = self._grid
        at = place / self._step
        index = int(at)
        if index >= len(grid) - 1:
            return grid[-1]
        left = grid[index]
        right = grid[index + 1]
        return left if left == right else left + (at - index) * (right - left)

    def work_between(self, start: float, end: float) -> float:
        """Energy in joules that cutting from ``start`` to ``end`` takes."""
        return self._work_to(end) - self._work_to(start)

    def _work_to(self, place: float) -> float:
        index = min(int(place / self._step), len(self._grid) - 2)
        rest = place - index * self._step
        here = self._grid[index]
        grade = (self._grid[index + 1] - here) / self._step
        return self._work[index] + rest * (here + 0.5 * grade * rest)


def _toughness_field(material: Material, rng: np.random.Generator) -> tuple[int, list[float]]:
    """Number of cells and relative toughness at their ends: white noise, smoothed by a Gaussian."""
    correlation = material.correlation_length_mm * 1e-3
    length = material.sheet_length_mm * 1e-3
    count = max(2, math.ceil(length / correlation * STEPS_PER_LENGTH))
    width = 0.5 * correlation * count / length
    reach = math.ceil(4.0 * width)
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    window /= np.sqrt(np.sum(window**2))
    noise = rng.standard_normal(count + 1 + 2 * reach)
    field = np.clip(np.convolve(noise, window, mode="valid"), -4.0, 4.0)
    ends = np.full(count + 1, 1.0)
    ends[[0, -1]] = 0.5
    field -= np.sum(ends * field) / np.sum(ends)
    return count, [float(value) for value in 1.0 + material.toughness_variation * field]


class Touch(NamedTuple):
    """What the edge does at the crack tip.

    ``torque`` (N m) opens the blades; ``drive`` (N) = -dE/dX, and the force on the pivot is its
    negative; ``lever`` = d(phi)/d(beta) (m) and ``slope`` = tan(psi) turn rates into the rate of
    indentation; ``share`` is the tip's weight w.
    """

    torque: float
    drive: float
    lever: float
    slope: float
    share: float


NEWTON_STEPS, HALVINGS, CELLS = 20, 200, 8
CLOSE_M = 1e-15
APART = Touch(0.0, 0.0, 0.0, 0.0, 0.0)


class BladeOnSheet:
    """The exact contact law of one specimen. Angles in rad, lengths in m, forces in N.

    Made by :func:`blade_on`, as a blade with a wave is a :class:`WavyBladeOnSheet`.
    """

    __slots__ = (
        "curvature",
        "fade",
        "length",
        "moving",
        "offset",
        "response",
        "taper",
        "upper_face",
    )

    def __init__(self, specimen: Specimen) -> None:
        blade = specimen.blade
        if blade.wave_mm is not None and type(self) is BladeOnSheet:
            raise ValueError("this blade has a wave: make it with blade_on")
        self.moving = float(blade.moving_blades)
        self.offset = blade.offset_mm * 1e-3
        self.taper = math.tan(math.radians(blade.taper_deg))
        self.curvature = blade.curvature_per_m
        self.length = blade.length_mm * 1e-3
        self.fade = blade.tip_fade_mm * 1e-3
        self.upper_face = specimen.upper_face_m
        self.response = Response(specimen.material)

    def touch(self, opening: float, contact: float) -> Touch:
        """Forces with the crack tip ``contact`` metres from the pivot."""
        beta = opening / self.moving
        sine = math.sin(beta)
        cosine = math.cos(beta)
        station, edge, taper = self._place(sine, cosine, contact)
        beyond = station - self.length
        if beyond >= self.fade:
            return APART
        height = station * sine + edge * cosine
        indentation = self.upper_face - height
        if indentation <= 0.0:
            return APART
        run = cosine - taper * sine
        slope = (sine + taper * cosine) / run
        lever = contact + height * slope
        force = self.response.force(indentation)
        if beyond <= 0.0:
            return Touch(force * lever, self.moving * force * slope, lever, slope, 1.0)
        weight, grade = self._fading(beyond)
        lost = grade * self.response.energy(indentation) / run
        return Touch(
            weight * force * lever - lost * height,
            self.moving * (weight * force * slope - lost),
            lever,
            slope,
            weight,
        )

    def indentation(self, opening: float, contact: float) -> float:
        """How deep the edge stands below the sheet's upper face; negative where it is above."""
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        station, edge, _ = self._place(sine, cosine, contact)
        return self.upper_face - station * sine - edge * cosine

    def energy(self, opening: float, contact: float) -> float:
        """Energy in joules that the sheet stores, all moving blades together."""
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        station, edge, _ = self._place(sine, cosine, contact)
        beyond = station - self.length
        weight = 1.0 if beyond <= 0.0 else self._fading(beyond)[0]
        if weight == 0.0:
            return 0.0
        indentation = self.upper_face - station * sine - edge * cosine
        return self.moving * weight * self.response.energy(indentation)

    def crossing(self, opening: float) -> float:
        """Distance from the pivot at which the edge passes the sheet's upper face.

        From s sin(beta) + e(s) cos(beta) = y_top, quadratic in s; inf where the edge never
        comes up.
        """
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        rise = self.upper_face - self.offset * cosine
        grade = sine + self.taper * cosine
        below = grade * grade + 2.0 * (self.curvature if rise > 0.0 else 0.0) * cosine * rise
        if below < 0.0:
            return math.inf
        base = grade + math.sqrt(below)
        if base <= 0.0:
            return math.inf
        station = 2.0 * rise / base
        bend = self.curvature * station if station > 0.0 else 0.0
        edge = self.offset + station * (self.taper + 0.5 * bend)
        return station * cosine - edge * sine

    def _place(self, sine: float, cosine: float, contact: float) -> tuple[float, float, float]:
        """Station over ``contact``, and the edge's offset e and slope there.

        Solves contact = s cos(beta) - e(s) sin(beta), a quadratic in s, for its near root.
        Written so that it neither divides by the curvature nor cancels. Behind the pivot the
        edge goes on straight. Where a curved edge never stands over ``contact``, a station beyond
        its tip is given.
        """
        run = cosine - self.taper * sine
        reach = contact + self.offset * sine
        if self.curvature == 0.0 or reach <= 0.0:
            station = reach / run
            return station, self.offset + station * self.taper, self.taper
        below = run * run - 2.0 * self.curvature * sine * reach
        station = 2.0 * reach / (run + math.sqrt(below)) if below > 0.0 else 2.0 * reach / run
        bend = self.curvature * station if station > 0.0 else 0.0
        return station, self.offset + station * (self.taper + 0.5 * bend), self.taper + bend

    def _fading(self, beyond: float) -> tuple[float, float]:
        """Weight w and its derivative with the station, ``beyond`` metres past the blade's tip."""
        along = beyond / self.fade
        if along >= 1.0:
            return 0.0, 0.0
        weight = 1.0 - along * along * (3.0 - 2.0 * along)
        return weight, -6.0 * along * (1.0 - along) / self.fade


class WavyBladeOnSheet(BladeOnSheet):
    """The same law for a line with a wave on it, e(s) = offset + s tan(taper) + wave(s)."""

    __slots__ = ("wave",)

    def __init__(self, specimen: Specimen) -> None:
        super().__init__(specimen)
        wave = specimen.blade.wave
        if wave is None:
            raise ValueError("this blade has no wave: make it with blade_on")
        self.wave: Wave = wave

    def crossing(self, opening: float) -> float:
        """As for other edges; where the edge comes up more than once, the place nearest its tip."""
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        bracket = self._last_rise(sine, cosine)
        if bracket is None:
            return math.inf
        station = _root(lambda s: self._height(sine, cosine, s), *bracket)
        edge = self.offset + station * self.taper + self.wave.at(station)[0]
        return station * cosine - edge * sine

    def _height(self, sine: float, cosine: float, station: float) -> tuple[float, float]:
        """Height of the edge over the sheet's upper face, and its derivative with the station."""
        value, slope = self.wave.at(station)
        edge = self.offset + station * self.taper + value
        return station * sine + edge * cosine - self.upper_face, sine + (
            self.taper + slope
        ) * cosine

    def _last_rise(self, sine: float, cosine: float) -> tuple[float, float] | None:
        """Stations between which the edge comes up for the last time, on a fine grid."""
        first, last = min(0.0, self.wave.stations[0]), max(self.length, self.wave.stations[-1])
        height, grade = self._height(sine, cosine, last)
        if height < 0.0:
            return (last, last - 2.0 * height / grade) if grade > 0.0 else None
        width = (last - first) / (CELLS * len(self.wave.stations))
        high = last
        while high > first:
            low = high - width
            if self._height(sine, cosine, low)[0] < 0.0:
                return low, high
            high = low
        height, grade = self._height(sine, cosine, high)
        return (high - 2.0 * height / grade, high) if grade > 0.0 else None

    def _place(self, sine: float, cosine: float, contact: float) -> tuple[float, float, float]:
        """Newton from where the line alone stands: x rises with s, as no edge is near upright."""
        wave, line = self.wave, self.taper
        run = cosine - line * sine
        reach = contact + self.offset * sine
        station = reach / run
        for _ in range(NEWTON_STEPS):
            value, slope = wave.at(station)
            step = (station * run - value * sine - reach) / (run - slope * sine)
            station -= step
            if -CLOSE_M < step < CLOSE_M:
                break
        else:
            station = self._place_by_halving(sine, run, reach)
        value, slope = wave.at(station)
        return station, self.offset + station * line + value, line + slope

    def _place_by_halving(self, sine: float, run: float, reach: float) -> float:
        """Between two bounds that the least and the largest slope of x(s) give."""
        wave = self.wave

        def away(station: float) -> tuple[float, float]:
            value, slope = wave.at(station)
            return station * run - value * sine - reach, run - slope * sine

        middle = reach / run
        off = abs(away(middle)[0]) / (run - wave.largest[1] * sine) + CLOSE_M
        return _root(away, middle - off, middle + off)


def blade_on(specimen: Specimen) -> BladeOnSheet:
    """The contact law of a specimen, whether or not its blade has a wave."""
    return (BladeOnSheet if specimen.blade.wave_mm is None else WavyBladeOnSheet)(specimen)


def _root(law: Callable[[float], tuple[float, float]], low: float, high: float) -> float:
    """Root of a law (value, slope) that is below 0 at ``low`` and not at ``high``.

    Newton, and halving where that leaves the bracket, to the last bits.
    """
    station = 0.5 * (low + high)
    for _ in range(HALVINGS):
        value, slope = law(station)
        low, high = (station, high) if value < 0.0 else (low, station)
        trial = station - value / slope if slope > 0.0 else low
        before, station = station, trial if low < trial < high else 0.5 * (low + high)
        if abs(station - before) < CLOSE_M:
            break
    return station
