"""The sheet between the blades: its response to an edge, and a toughness that varies along it."""

import math

import numpy as np

from scissorcal.device.sim.specimen import Material

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
