"""How many independent draws the draws of a posterior are worth."""

import numpy as np

from scissorcal.aliases import Array


def bulk_ess(draws: Array) -> float:
    """Effective sample size of one parameter for its location, from draws (chains, n).

    Chains are split in half and ranks take the place of values, so that heavy tails do no harm
    (Vehtari et al. 2021, doi:10.1214/20-BA1221); autocorrelations are summed as long as those of
    two neighbouring lags are together positive, and made to fall (Geyer 1992,
    doi:10.1214/ss/1177011137). NaN for fewer than eight draws each, or where one is not finite;
    their number where all are alike.

    >>> round(bulk_ess(np.random.default_rng(0).normal(size=(1, 2000))), -2)
    2000.0
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    half = draws.shape[1] // 2
    if half < 4 or not np.all(np.isfinite(draws)):
        return float("nan")
    split = np.concatenate([draws[:, :half], draws[:, -half:]])
    if np.ptp(split) == 0.0:
        return float(split.size)
    ranks = rankdata(split, axis=None).reshape(split.shape)
    scores = ndtri((ranks - 0.375) / (split.size + 0.25))
    rho = _correlations(scores)
    pairs = rho[: 2 * ((half - 1) // 2)].reshape(-1, 2)
    sums = pairs.sum(axis=1)
    ended = np.flatnonzero(sums[:-1] < 0.0)
    first = int(ended[0]) if len(ended) else len(sums) - 1
    falling = np.minimum.accumulate(sums[:first])
    tau = -1.0 + 2.0 * falling.sum() + max(float(pairs[first, 0]), 0.0)
    return float(split.size / max(tau, 1.0 / np.log10(split.size)))


def _correlations(scores: Array) -> Array:
    """Autocorrelations (n,) of chains (m, n) with one mean, from those within and between."""
    count = scores.shape[1]
    centred = scores - scores.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(centred, 2 * count)
    covariances = np.fft.irfft(np.abs(spectrum) ** 2, 2 * count)[:, :count].mean(axis=0) / count
    within = covariances[0] * count / (count - 1.0)
    total = covariances[0] + scores.mean(axis=1).var(ddof=1)
    rho = 1.0 - (within - covariances) / total
    rho[0] = 1.0
    return np.asarray(rho)
