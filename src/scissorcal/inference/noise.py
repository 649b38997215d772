"""Noise with memory and with heavy tails: autoregressions, and Student-t."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

Labels = NDArray[np.int64]

MOST_ORDER = 12
LEAST_LEFT = 1e-9
"""Share of the power that innovations must keep. Below it the residuals follow from those before
them (a constant, a sine), and the autoregression is so near a unit root that its variance is lost
in rounding: the covariance's condition is about the square of the inverse."""


NEGLIGIBLE = 1e-18
"""Share of the variance below which autocovariances are taken as 0: a hundredth of rounding."""


@dataclass(frozen=True)
class ArNoise:
    """Stationary autoregression e_t = sum_k coefficients[k] e_(t-1-k) + sd * white.

    ``coefficients`` has ``order`` entries, the nearest neighbour first; ``sd`` is the standard
    deviation of the innovations, in the residuals' unit. Order 0 is white noise.
    """

    order: int
    coefficients: tuple[float, ...]
    sd: float

    def draw(self, series: Labels, rng: np.random.Generator) -> Array:
        """Draw noise (n,), every run of equal labels in ``series`` (n,) starting afresh.

        A run begins in the stationary distribution, so that no stretch is quieter than another.

        >>> noise = ArNoise(1, (0.9,), 1.0)
        >>> e = noise.draw(np.zeros(100000, dtype=np.int64), np.random.default_rng(0))
        >>> round(float(e.std()), 1), round(noise.marginal_sd, 1)
        (2.3, 2.3)
        """
        return np.asarray(self.draws(series, 1, rng)[0])

    def draws(self, series: Labels, count: int, rng: np.random.Generator) -> Array:
        """Several draws of the noise at once, (count, n).

        They solve one banded system: row t of it is e_t less its past within the run.
        """
        from scipy.linalg import solve_banded

        innovations = rng.standard_normal((count, len(series))) * self.sd
        if self.order == 0:
            return innovations
        bounds = runs(series)
        past = rng.standard_normal((count, len(bounds), self.order)) @ _root(self._stationary()).T
        band = np.zeros((self.order + 1, len(series)))
        band[0] = 1.0
        for lag, coefficient in enumerate(self.coefficients, start=1):
            for run, (low, high) in enumerate(bounds):
                band[lag, low : max(high - lag, low)] = -coefficient
                begun = min(lag, high - low)
                before = past[:, run, lag - begun : lag][:, ::-1]
                innovations[:, low : low + begun] += coefficient * before
        return np.asarray(solve_banded((self.order, 0), band, innovations.T).T)

    @property
    def marginal_sd(self) -> float:
        """Standard deviation of the noise itself."""
        return float(np.sqrt(self._stationary()[0, 0])) if self.order else self.sd

    def autocovariance(self, lags: int) -> Array:
        """Autocovariances at lags 0 to ``lags`` - 1, shape (lags,); 0 from where they are rounding.

        >>> ArNoise(1, (0.5,), 1.0).autocovariance(3).round(3)
        array([1.333, 0.667, 0.333])
        """
        values = np.zeros(max(lags, 1))
        values[0] = self.marginal_sd**2
        if self.order:
            begun = self._stationary()[0, : min(self.order, len(values))]
            values[: len(begun)] = begun
            back = np.asarray(self.coefficients)[::-1]
            least = NEGLIGIBLE * values[0]
            for lag in range(self.order, len(values)):
                before = values[lag - self.order : lag]
                if np.max(np.abs(before)) <= least:
                    break
                values[lag] = back @ before
        return values[:lags]

    def _stationary(self) -> Array:
        """Covariance of ``order`` neighbours, the solution of P = A P A' + Q."""
        from scipy.linalg import solve_discrete_lyapunov

        transition = np.eye(self.order, k=-1)
        transition[0] = self.coefficients
        noise = np.zeros((self.order, self.order))
        noise[0, 0] = self.sd**2
        return np.asarray(solve_discrete_lyapunov(transition, noise))


def fit_ar(residuals: Array, series: Labels, most: int = MOST_ORDER) -> ArNoise:
    """Fit an autoregression to residuals (n,), its order by BIC; never across two ``series`` (n,).

    Burg's recursion on forward and backward errors, whose reflection coefficients lie within
    one in magnitude, so that the result is always stationary (Burg 1967; Brockwell and Davis 1991,
    doi:10.1007/978-1-4419-0320-4, section 8.2); order by Schwarz 1978, doi:10.1214/aos/1176344136.
    ``most`` is the highest order tried. The residuals' mean is not taken out. Orders that would
    leave less than ``LEAST_LEFT`` of the power are not tried. ``sd`` is NaN where a residual is
    not finite.
    """
    if not np.all(np.isfinite(residuals)):
        return ArNoise(0, (), float("nan"))
    largest = float(np.max(np.abs(residuals), initial=0.0))
    if largest == 0.0:
        return ArNoise(0, (), 0.0)
    found = _by_burg(residuals / largest, series, most)
    return replace(found, sd=found.sd * largest)


def _by_burg(residuals: Array, series: Labels, most: int) -> ArNoise:
    """The autoregression of residuals (n,) whose largest is one."""
    n = len(residuals)
    lengths = [high - low for low, high in runs(series)]
    pieces = [residuals[low:high] for low, high in runs(series)]
    power = float(residuals @ residuals) / n
    least = LEAST_LEFT * power
    forward, backward = pieces, pieces
    coefficients = np.zeros(0)
    best = ArNoise(0, (), float(np.sqrt(power)))
    lowest = n * np.log(power)
    for order in range(1, min(most, max(lengths) // 4) + 1):
        pairs = [(f[1:], b[:-1]) for f, b in zip(forward, backward, strict=True) if len(f) > 1]
        size = sum(float(f @ f + b @ b) for f, b in pairs)
        if size <= 0.0:
            break
        reflection = 2 * sum(float(f @ b) for f, b in pairs) / size
        forward = [f - reflection * b for f, b in pairs]
        backward = [b - reflection * f for f, b in pairs]
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        power *= 1.0 - reflection**2
        if power <= least:
            break
        criterion = n * np.log(power) + order * np.log(n)
        if criterion < lowest:
            lowest = criterion
            best = ArNoise(order, tuple(coefficients.tolist()), float(np.sqrt(power)))
    return best


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def runs(series: Labels) -> list[tuple[int, int]]:
    """Bounds of the stretches of equal labels in ``series`` (n,), in order."""
    ends = [0, *(np.flatnonzero(np.diff(series)) + 1).tolist(), len(series)]
    return [(low, high) for low, high in pairwise(ends) if high > low]


HEAVIEST = 2.1
LIGHTEST = 200.0
STRONG_EVIDENCE = 5.0
"""Log-likelihood, counting independent observations only, that heavier tails must gain."""


def tails_of(residuals: Array, share: float) -> float:
    """Degrees of freedom of a Student-t that residuals (n,) call for; infinity for a normal.

    Fitted by maximum likelihood over scale and degrees of freedom (Lange, Little and Taylor 1989,
    doi:10.1080/01621459.1989.10478852). ``share`` is the share of residuals that are independent;
    tails count as heavy where they gain at least 5 in log-likelihood on that many. ValueError where
    a residual is not finite.

    >>> rng = np.random.default_rng(0)
    >>> float(tails_of(rng.standard_normal(4000), 1.0))
    inf
    >>> 3.0 < tails_of(rng.standard_t(4, 4000), 1.0) < 5.0
    True
    """
    from scipy.optimize import minimize

    if not np.all(np.isfinite(residuals)):
        raise ValueError("residuals that are not finite numbers have no tails")
    largest = float(np.max(np.abs(residuals), initial=0.0))
    if largest == 0.0:
        return float(np.inf)
    z = residuals / largest
    z = z / np.sqrt(np.mean(z**2))

    def lost(point: Array) -> float:
        nu = float(np.exp(point[1]))
        return -float(np.mean(log_density(z / np.exp(point[0]), nu))) + float(point[0])

    begin = np.array([-0.2, np.log(6.0)])
    bounds = [(-3.0, 1.0), (np.log(HEAVIEST), np.log(LIGHTEST))]
    found = minimize(lost, begin, bounds=bounds, method="L-BFGS-B")
    gained = (0.5 - found.fun) * len(z) * share
    return float(np.exp(found.x[1])) if gained > STRONG_EVIDENCE else float(np.inf)


def log_density(z: Array, tails: float) -> Array:
    """Log density of standardised residuals, any shape, relative to the normal's constant.

    >>> log_density(np.array([0.0, 2.0]), np.inf)
    array([-0., -2.])
    """
    if np.isinf(tails):
        return np.asarray(-0.5 * z**2)
    from scipy.special import gammaln

    constant = gammaln((tails + 1) / 2) - gammaln(tails / 2) - 0.5 * np.log(tails / 2)
    return np.asarray(constant - 0.5 * (tails + 1.0) * np.log1p(z**2 / tails))
