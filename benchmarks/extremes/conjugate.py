"""Normal linear models with their posteriors in exact fractions, sharing no code with inference."""

import math
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference import Problem


@dataclass(frozen=True)
class Linear:
    """y = X b + noise, with normal noise and a normal prior of independent parameters.

    ``columns`` X has shape (n, p), ``data`` y (n,); ``noise`` is the sd of a datum; ``centre`` and
    ``width`` are the prior's means and sds (p,). ``starts`` are those of the search, the prior's
    centre if None.
    """

    columns: Array
    data: Array
    noise: float
    centre: Array
    width: Array
    starts: Array | None = field(default=None)

    def problem(self, *, squares: bool, independent: bool) -> Problem:
        """The model as inference sees it, with or without its residuals."""
        log_sd = math.log(self.noise)

        def standardised(u: Array) -> tuple[Array, Array]:
            z = (self.data - self.columns @ u) / self.noise
            return z, np.full(len(z), log_sd)

        def terms(u: Array) -> Array:
            z, size = standardised(u)
            return -0.5 * z**2 - size

        def log_prior(u: Array) -> float:
            return float(-0.5 * np.sum(((u - self.centre) / self.width) ** 2))

        count, size = self.columns.shape
        return Problem(
            names=tuple(f"b{k}" for k in range(size)),
            log_prior=log_prior,
            log_likelihood_terms=terms,
            series=np.zeros(count, dtype=np.int64),
            prior_sd=self.width,
            starts=np.atleast_2d(self.centre if self.starts is None else self.starts),
            lower=np.full(size, -np.inf),
            upper=np.full(size, np.inf),
            standardised=standardised if squares else None,
            independent=independent,
        )

    def posterior(self) -> tuple[Array, Array]:
        """Exact means and standard deviations (p,): Gauss-Jordan elimination in fractions."""
        size = len(self.centre)
        weight = 1 / Fraction(self.noise) ** 2
        rows = [[Fraction(0)] * (size + 1) for _ in range(size)]
        for k in range(size):
            held = 1 / Fraction(float(self.width[k])) ** 2
            rows[k][k] += held
            rows[k][size] += held * Fraction(float(self.centre[k]))
        for x, y in zip(self.columns.tolist(), self.data.tolist(), strict=True):
            exact = [Fraction(value) for value in x]
            for i in range(size):
                rows[i][size] += weight * exact[i] * Fraction(y)
                for j in range(size):
                    rows[i][j] += weight * exact[i] * exact[j]
        table = [
            [*row[:size], *(Fraction(int(i == k)) for k in range(size)), row[size]]
            for i, row in enumerate(rows)
        ]
        for i in range(size):
            table[i] = [value / table[i][i] for value in table[i]]
            for k in range(size):
                if k != i and table[k][i]:
                    factor = table[k][i]
                    pairs = zip(table[k], table[i], strict=True)
                    table[k] = [a - factor * b for a, b in pairs]
        means = np.array([float(row[-1]) for row in table])
        return means, np.array([_root(table[k][size + k]) for k in range(size)])


def line(rng: np.random.Generator, count: int = 60) -> Linear:
    """An everyday line: 1 + 2 x over -1 to 1 with noise of 0.1, priors of 0 +- 10."""
    x = np.linspace(-1.0, 1.0, count)
    columns = np.stack([np.ones(count), x], axis=1)
    data = columns @ np.array([1.0, 2.0]) + 0.1 * rng.standard_normal(count)
    return Linear(columns, data, 0.1, np.zeros(2), np.full(2, 10.0))


def _root(value: Fraction) -> float:
    """Square root of a fraction beyond the range of a float."""
    half = (value.numerator.bit_length() - value.denominator.bit_length()) // 2
    return math.ldexp(math.sqrt(value / Fraction(4) ** half), half)
