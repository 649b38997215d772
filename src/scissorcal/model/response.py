"""The material's response g(delta): force at the edge against indentation."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.errors import ModelError
from scissorcal.model.checks import SMALLEST, check_name, check_numbers
from scissorcal.model.log_spline import Bounds, LogSpline

Family = Literal["power", "exponential", "spline"]
_FAMILIES = get_args(Family)

LARGEST_ARGUMENT = 700.0
"""exp() overflows a float64 just above this; beyond it the exponential response is held."""

SERIES_UP_TO = 0.5
SERIES_TERMS = 15
"""0.5^15 / 15! is 2e-17 of the sum's first term, 0.5^2 / 2."""


@dataclass(frozen=True)
class Response:
    """A response family with its parameters, which may be arrays that broadcast.

    All families are written through ``force``, the force in newtons at the indentation
    ``reference_m``, so that their parameters are nearly uncorrelated and mean the same:

    * ``power``: g = force (delta / reference)^exponent
    * ``exponential``: g = force (exp(b delta) - 1) / (exp(b reference) - 1), with
      b = exponent / reference
    * ``spline``: a power whose exponent changes over the indentations ``knots_m`` (k,), one value
      between each two of them: their logarithms change by ``shape`` (..., k - 2) from one to the
      next, and ``exponent`` is their geometric mean. Beyond the knots the outermost powers go on.

    For delta <= 0 there is no contact and no force. ModelError for an unknown family, for a number
    that is not finite and above 0 (``shape``: finite), and for knots that do not rise or are not
    two more than the changes of shape.

    >>> float(Response("power", force=2.0, exponent=1.5, reference_m=3e-4).force_at(3e-4))
    2.0
    """

    family: Family
    force: float | Array
    exponent: float | Array
    reference_m: float
    shape: tuple[float, ...] | Array = ()
    knots_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_name("family of a response", self.family, _FAMILIES)
        check_numbers("the force of a response (N)", self.force, SMALLEST)
        check_numbers("the exponent of a response", self.exponent, SMALLEST)
        check_numbers("the reference indentation of a response (m)", self.reference_m, SMALLEST)
        if self.family == "spline":
            self._check_knots()

    def _check_knots(self) -> None:
        check_numbers("the changes of shape of a response", self.shape)
        check_numbers("the knots of a response (m)", self.knots_m, SMALLEST)
        changes, knots = np.shape(self.shape)[-1], len(self.knots_m)
        if knots < 2 or changes != knots - 2 or np.any(np.diff(self.knots_m) <= 0.0):
            raise ModelError(
                "A response that is a spline needs knots that rise, 2 or more, and one change of "
                f"shape for each inner knot: it has {knots} knots, {self.knots_m}, and {changes} "
                "changes."
            )

    def force_at(self, indentation: ArrayLike) -> Array:
        """Force g in newtons, shape of the broadcast of ``indentation`` (m) and parameters."""
        u = self._relative(indentation)
        if self.family == "spline":
            grown = np.minimum(self._spline.value(_logarithm(u)), LARGEST_ARGUMENT)
            return np.asarray(self.force * np.exp(grown))
        if self.family == "power":
            with np.errstate(divide="ignore"):
                return np.asarray(self.force * np.where(u > 0, u, 0.0) ** self.exponent)
        return np.asarray(self.force * np.expm1(self._argument(u)) / np.expm1(self.exponent))

    def energy_at(self, indentation: ArrayLike) -> Array:
        """Stored energy, the integral of g from 0 to delta, in joules."""
        u = self._relative(indentation)
        if self.family == "spline":
            return np.asarray(self.force * self.reference_m * self._spline.area(_logarithm(u)))
        if self.family == "power":
            power = np.asarray(self.exponent) + 1.0
            return np.asarray(self.force * self.reference_m * u**power / power)
        argument = self._argument(u)
        shape = _beyond_line(argument) / np.expm1(self.exponent)
        return np.asarray(self.force * self.reference_m * shape / self.exponent)

    def stiffness_at(self, indentation: ArrayLike) -> Array:
        """Stiffness dg/d(delta) in N/m; infinite at 0+ for a power below one."""
        u = self._relative(indentation)
        inside = np.asarray(indentation) > 0
        if self.family == "spline":
            v = _logarithm(np.where(inside, u, 1.0))
            grown = np.minimum(self._spline.value(v) - v, LARGEST_ARGUMENT)
            grade = self._spline.slope(v) * np.exp(grown)
        elif self.family == "power":
            with np.errstate(divide="ignore"):
                grade = self.exponent * np.where(u > 0, u, 0.0) ** (np.asarray(self.exponent) - 1.0)
        else:
            grade = self.exponent * np.exp(self._argument(u)) / np.expm1(self.exponent)
        return np.where(inside, self.force * grade / self.reference_m, 0.0)

    def indentation_at(self, force: ArrayLike) -> Array:
        """Indentation in metres at which the response reaches ``force`` >= 0 (the inverse of g)."""
        ratio = np.maximum(np.asarray(force, dtype=np.float64), 0.0) / self.force
        if self.family == "spline":
            return np.asarray(self.reference_m * np.exp(self._spline.inverse(_logarithm(ratio))))
        if self.family == "power":
            return np.asarray(self.reference_m * ratio ** (1.0 / np.asarray(self.exponent)))
        grown = np.log1p(ratio * np.expm1(self.exponent))
        return np.asarray(self.reference_m * grown / self.exponent)

    def log_bounds(self, low: Array, high: Array) -> tuple[Bounds, Bounds]:
        """Bounds of y' and y'' of a spline between logarithms, see :class:`LogSpline`."""
        return self._spline.derivative_bounds(low, high)

    @cached_property
    def _spline(self) -> LogSpline:
        steps = np.cumsum(np.asarray(self.shape, dtype=np.float64), axis=-1)
        logs = np.concatenate([np.zeros((*steps.shape[:-1], 1)), steps], axis=-1)
        logs = logs - logs.mean(axis=-1, keepdims=True)
        exponents = np.asarray(self.exponent)[..., None] * np.exp(logs)
        return LogSpline(np.log(np.asarray(self.knots_m) / self.reference_m), exponents)

    def _relative(self, indentation: ArrayLike) -> Array:
        return np.maximum(np.asarray(indentation, dtype=np.float64), 0.0) / self.reference_m

    def _argument(self, relative: Array) -> Array:
        return np.minimum(self.exponent * relative, LARGEST_ARGUMENT)


def _beyond_line(a: Array) -> Array:
    """exp(a) - 1 - a for a >= 0; where that would cancel, its series, to 1e-16 of it."""
    small = np.minimum(a, SERIES_UP_TO)
    term = total = 0.5 * small**2
    for power in range(3, SERIES_TERMS):
        term = term * small / power
        total = total + term
    return np.where(a <= SERIES_UP_TO, total, np.expm1(a) - a)


def _logarithm(x: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(x))
