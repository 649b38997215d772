"""Numbers that a person states with a standard deviation: what they say, and draws of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError


def as_pair(name: str, value: float | tuple[float, float]) -> tuple[float, float]:
    """A stated number with its standard deviation, 0 where none is given.

    >>> as_pair("force_N", 2.0), as_pair("force_N", (2.0, 0.1))
    ((2.0, 0.0), (2.0, 0.1))
    """
    pair = value if isinstance(value, tuple) else (value, 0.0)
    if len(pair) != 2 or not all(isinstance(part, int | float) for part in pair):
        raise InputError(f"{name} = {value!r} is no number, and no (number, standard deviation).")
    number, sd = (float(part) for part in pair)
    if not (math.isfinite(number) and math.isfinite(sd)) or number <= 0.0 or sd < 0.0:
        raise InputError(
            f"{name} = {value!r} must be above 0, and its standard deviation not below 0."
        )
    return number, sd


def as_share(name: str, value: float | tuple[float, float]) -> tuple[float, float]:
    """A stated share, above 0 and below 1, with its standard deviation, 0 where none is given.

    Raises InputError where the deviation is wider than a share of that mean can have with one most
    likely value. Of the beta distributions with mean m those have it whose parameters are both 1 or
    more (:func:`draw_share`), which is sd^2 <= m (1 - m) / (1 + 1 / min(m, 1 - m)): 0.289 at
    m = 0.5, where it is uniform, and about 1 - m near 1. Beyond it the draws gather at 0 or 1.

    >>> as_share("kappa", (0.8, 0.05))
    (0.8, 0.05)
    """
    mean, sd = as_pair(name, value)
    if mean >= 1.0:
        raise InputError(f"{name} = {value!r} is a share: it must lie below 1.")
    widest = math.sqrt(mean * (1.0 - mean) / (1.0 + 1.0 / min(mean, 1.0 - mean)))
    if sd > widest:
        raise InputError(
            f"{name} = {value!r} is a share between 0 and 1, and one of mean {mean:g} has a "
            f"standard deviation of at most {widest:.3g} unless it gathers at an end: state a "
            "narrower one."
        )
    return mean, sd


def log_normal(mean: float, sd: float) -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of a log-normal number with ``mean`` and ``sd``.

    >>> log_normal(2.0, 0.0) == (math.log(2.0), 0.0)
    True
    """
    variance = math.log1p((sd / mean) ** 2)
    return math.log(mean) - 0.5 * variance, math.sqrt(variance)


def draw_columns(
    stated: Mapping[str, tuple[float, float]], rng: np.random.Generator, count: int
) -> dict[str, Array]:
    """Columns (1 + count,) by name: the stated mean, then draws of a log-normal of its mean and sd.

    The columns are independent.
    """
    columns = {}
    for name, (mean, sd) in stated.items():
        _, spread = log_normal(mean, sd)
        z = rng.standard_normal(count)
        columns[name] = np.append(mean, mean * np.exp(spread * z - 0.5 * spread**2))
    return columns


def draw_share(mean: float, sd: float, rng: np.random.Generator, count: int) -> Array:
    """A column (1 + count,): a share's mean, then draws of a beta distribution of its mean and sd.

    What :func:`as_share` lets pass is drawn within (0, 1]; 1 is what a share rounds to whose
    distance from 1 is below the resolution of 64 bits.
    """
    if mean + sd == mean:  # narrower than the numbers' resolution
        return np.full(1 + count, mean)
    # mean = a / (a + b) and sd^2 = mean (1 - mean) / (a + b + 1), solved for a and b
    a = (1.0 - mean) / (sd / mean) ** 2 - mean
    b = a * (1.0 - mean) / mean
    return np.append(mean, rng.beta(a, b, count))
