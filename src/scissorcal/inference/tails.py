"""Tails of the noise: normal, or a Student-t where residuals have outliers."""

import numpy as np

from scissorcal.aliases import Array

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
