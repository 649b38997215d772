"""Statistics of the verification: ranks, sensitivity to the prior, difference of two halves."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.verify.result import Diagnosis, RankBand

POINTS = 100
"""Places at which an empirical distribution is compared with the uniform one."""

SEARCH_STEPS = 40
LEAST_EXPECTED = 5
"""Ranks expected in each bin of the chi-square test."""


def rank_among(draws: Array, truth: Array, rng: np.random.Generator) -> Integers:
    """Ranks (p,) of a truth (p,) among independent draws (n, p) of a posterior.

    A rank is uniform on 0 ... n where the posterior is calibrated (Talts et al. 2018,
    arXiv:1804.06788). Ties are broken at random.
    """
    below = np.sum(draws < truth, axis=0)
    level = np.sum(draws == truth, axis=0)
    return np.asarray(below + rng.integers(0, level + 1), dtype=np.int64)


def ecdf_p_value(ranks: Integers, levels: int) -> float:
    """P-value of the hypothesis that ranks (n,) are independent and uniform on 0 ... levels - 1.

    The statistic is the least of the two-sided binomial p-values at ``POINTS`` places; its
    distribution is exact, by the recursion of Säilynoja, Bürkner and Vehtari 2022
    (doi:10.1007/s11222-022-10090-6, section 2.2). ``levels`` must be a multiple of ``POINTS``.

    >>> ecdf_p_value(np.arange(200), 200)
    1.0
    >>> ecdf_p_value(np.arange(200) // 2 + 50, 200) < 1e-6
    True
    """
    counts = _counts(ranks, levels)
    tails = _two_sided(len(ranks))
    least = float(tails[np.arange(POINTS - 1), counts].min())
    if least >= 1.0:
        return 1.0
    inside = [np.flatnonzero(row > least * (1 + 1e-12)) for row in tails]
    return float(np.clip(1.0 - _probability_inside(len(ranks), inside), 0.0, 1.0))


@lru_cache(maxsize=64)
def ecdf_band(count: int, alpha: float) -> RankBand:
    """Simultaneous band of level 1 - ``alpha`` for the ECDF of ``count`` uniform ranks.

    The pointwise binomial intervals are widened alike until the whole curve stays inside with at
    least that probability, as in :func:`ecdf_p_value`, whose p-value is below ``alpha`` where the
    band is left.
    """
    tails = _two_sided(count)
    low, high = 1e-12, 1.0
    for _ in range(SEARCH_STEPS):
        middle = float(np.sqrt(low * high))
        inside = [np.flatnonzero(row > middle) for row in tails]
        empty = any(len(row) == 0 for row in inside)
        if not empty and _probability_inside(count, inside) >= 1.0 - alpha:
            low = middle
        else:
            high = middle
    inside = [np.flatnonzero(row > low) for row in tails]
    return RankBand(
        alpha=alpha,
        z=tuple((np.arange(1, POINTS) / POINTS).tolist()),
        low=tuple(float(row[0]) / count for row in inside),
        high=tuple(float(row[-1]) / count for row in inside),
    )


def chi_square_p_value(ranks: Integers, levels: int) -> float:
    """P-value of the chi-square test of ranks (n,) in equal bins, 20 at most.

    NaN where there are too few ranks for two bins with an expectation of ``LEAST_EXPECTED``.
    """
    from scipy.stats import chisquare

    fitting = [
        bins
        for bins in (20, 10, 5, 2)
        if levels % bins == 0 and len(ranks) >= LEAST_EXPECTED * bins
    ]
    if not fitting:
        return float("nan")
    observed = np.bincount(ranks * fitting[0] // levels, minlength=fitting[0])
    return float(chisquare(observed).pvalue)


def acceptance(count: int, probability: float, alpha: float) -> tuple[float, float]:
    """Shares between which a binomial of ``count`` trials lies with probability 1 - ``alpha``.

    >>> acceptance(400, 0.9, 0.05)
    (0.87, 0.9275)
    """
    from scipy.stats import binom

    tails = np.array([alpha / 2, 1 - alpha / 2])
    low, high = np.asarray(binom.ppf(tails, count, probability)) / count
    return float(low), float(high)


def _counts(ranks: Integers, levels: int) -> Integers:
    """How many ranks lie below each of the inner places."""
    if levels % POINTS:
        raise ValueError(f"{levels} levels are no multiple of {POINTS}")
    by_place = np.bincount(np.asarray(ranks) * POINTS // levels, minlength=POINTS)
    return np.cumsum(by_place)[:-1]


@lru_cache(maxsize=8)
def _two_sided(count: int) -> Array:
    """Two-sided p-value of every count at every inner place, shape (POINTS - 1, count + 1)."""
    from scipy.stats import binom

    z = np.arange(1, POINTS)[:, None] / POINTS
    every = np.arange(count + 1)[None, :]
    below, above = binom.cdf(every, count, z), binom.sf(every - 1, count, z)
    return np.asarray(np.minimum(2 * np.minimum(below, above), 1.0))


def _probability_inside(count: int, inside: list[Integers]) -> float:
    """Probability that the ECDF's count lies in ``inside`` at each place, one after another.

    Given the count at one place, what comes until the next is binomial.
    """
    from scipy.special import gammaln

    log_factorial = gammaln(np.arange(count + 1) + 1.0)
    states, mass = np.array([0]), np.array([1.0])
    for place, reached in enumerate(inside):
        if len(reached) == 0:
            return 0.0
        share = 1.0 / (POINTS - place)
        left = count - states[None, :]
        come = reached[:, None] - states[None, :]
        possible = (come >= 0) & (come <= left)
        come, stay = np.where(possible, come, 0), np.where(possible, left - come, 0)
        left = come + stay
        log_mass = (
            log_factorial[left]
            - log_factorial[come]
            - log_factorial[stay]
            + come * np.log(share)
            + stay * np.log1p(-share)
        )
        states, mass = reached, np.where(possible, np.exp(log_mass), 0.0) @ mass
    return float(mass.sum())


STEP = 1.01
"""A component is raised to this power and to its reciprocal."""

SENSITIVE = 0.05
"""Sensitivity from which a component matters: a normal's mean then moves by about 0.3 standard
deviations when the component's weight is doubled (Kallioinen et al. 2023)."""


def power_sensitivity(draws: Array, log_component: Array) -> Array:
    """Sensitivity (p,) of marginals to the power of one component of their posterior.

    ``draws`` (n, p) come from the posterior, ``log_component`` (n,) is the log-prior or the
    log-likelihood at each, up to a constant. The cumulative Jensen-Shannon distance between the
    draws as they are and the draws reweighted for component^1.01 and component^(1/1.01), divided
    by the power's binary logarithm (Kallioinen, Paananen, Bürkner and Vehtari 2023,
    doi:10.1007/s11222-023-10366-5). Weights so near to one need no Pareto smoothing.
    """
    found = np.zeros(draws.shape[1])
    for power in (STEP, 1.0 / STEP):
        log_weights = (power - 1.0) * log_component
        weights = np.exp(log_weights - log_weights.max())
        weights /= weights.sum()
        found += [cumulative_distance(column, weights) for column in draws.T]
    return np.asarray(found / (2.0 * np.log2(STEP)))


def cumulative_distance(draws: Array, weights: Array) -> float:
    """Cumulative Jensen-Shannon distance, 0 to 1, from draws (n,) to the same draws weighted (n,).

    Nguyen and Vreeken 2015, doi:10.1007/978-3-319-23525-7_11; symmetric, normalised by its upper
    bound, and the larger one of the draws and their negatives, as the measure is not symmetric
    about zero. Equal draws have no distance.
    """
    order = np.argsort(draws)
    x, weighted = draws[order], weights[order] / weights.sum()
    width = np.diff(x)
    if not np.any(width > 0):
        return 0.0
    plain = np.arange(1, len(x)) / len(x)
    below = np.cumsum(weighted)[:-1]
    above = np.cumsum(weighted[::-1])[:-1]
    return float(
        np.sqrt(max(_divergence(plain, below, width), _divergence(plain, above, width[::-1])))
    )


def diagnose(prior: float, likelihood: float) -> Diagnosis:
    """Diagnosis of the two sensitivities.

    >>> diagnose(0.2, 0.3), diagnose(0.2, 0.01), diagnose(0.01, 0.3)
    ('prior-data conflict', 'weak likelihood', 'fine')
    """
    if prior < SENSITIVE:
        return "fine"
    return "prior-data conflict" if likelihood >= SENSITIVE else "weak likelihood"


def _divergence(P: Array, Q: Array, width: Array) -> float:
    middle = np.log2(0.5 * (P + Q))
    slope = 0.5 / np.log(2.0) * float((Q - P) @ width)
    one = float(_times_log(P, middle) @ width) + slope
    other = float(_times_log(Q, middle) @ width) - slope
    return float(max(one + other, 0.0) / ((P + Q) @ width))


def _times_log(P: Array, log_middle: Array) -> Array:
    """P log2(P / middle), and 0 where P is."""
    return np.where(P > 0, P * (np.log2(np.maximum(P, 1e-300)) - log_middle), 0.0)


PIECES = 4

BY_RECORDING = "whole recordings"
"""Start of the description of a split by recordings."""

SILENT = 0.02
"""Share of the variance of two independent halves below which both only repeat their prior."""

MIXTURE_DRAWS = 50_000


@dataclass(frozen=True)
class StrokeFacts:
    """A stroke's label, kind, speed, sheet, and the index of its recording."""

    label: int
    kind: str
    speed: float
    sheet: int | None = None
    recording: int = 0


@dataclass(frozen=True)
class Split:
    """Two disjoint halves of the bins (n,), and a description of the split.

    ``recordings`` are their numbers in each half where whole recordings were split, else None.
    """

    first: NDArray[np.bool_]
    second: NDArray[np.bool_]
    words: str
    recordings: tuple[int, int] | None = None


@dataclass(frozen=True)
class HalfFit:
    """The posterior of one half in unconstrained coordinates.

    ``mean`` (p,), ``covariance`` (p, p), and how many independent observations it rests on.
    """

    mean: Array
    covariance: Array
    independent: float


@dataclass(frozen=True)
class Difference:
    """Second minus first half (p,), its covariance (p, p), and the test of both.

    ``z`` (p,) is NaN where the halves repeat their prior. ``statistic`` over ``dimensions`` is
    F distributed with ``independent`` observations; ``p_value`` is NaN where no test is possible.
    """

    difference: Array
    covariance: Array
    z: Array
    statistic: float
    dimensions: int
    independent: float
    p_value: float


def split_strokes(strokes: Integers, facts: Sequence[StrokeFacts]) -> Split | None:
    """Split bins (n,), labelled by ``strokes`` (n,), into two halves of whole strokes.

    Where there are two recordings or more, whole recordings alternate: halves that share recordings
    cannot show a change between them. Else, where strokes belong to two sheets or more, whole
    sheets alternate. Otherwise strokes of a kind are ranked by speed and alternate, opening ones
    against closing ones, so that both halves see both directions and all speeds. A stroke that is
    the only one of its kind (an excitation) is cut into four pieces, the outer two for one half.
    None where there is only one stroke.
    """
    present = [fact for fact in facts if np.any(strokes == fact.label)]
    if len(present) < 2:
        return None
    sheets = sorted({fact.sheet for fact in present if fact.sheet is not None})
    recordings = sorted({fact.recording for fact in present})
    first = np.zeros(len(strokes), dtype=bool)
    if len(recordings) > 1:
        for fact in present:
            first[strokes == fact.label] = fact.recording in recordings[::2]
        counts = len(recordings[::2]), len(recordings[1::2])
        words = f"{BY_RECORDING}, {counts[0]} of {len(recordings)} in one half"
        return Split(first, ~first, words, counts)
    if len(sheets) > 1:
        taken = {sheet for index, sheet in enumerate(sheets) if index % 2 == 0}
        for fact in present:
            first[strokes == fact.label] = fact.sheet in taken
        return Split(first, ~first, f"whole sheets, {len(taken)} of {len(sheets)} in one half")
    phase = 0
    for kind in sorted({fact.kind for fact in present}):
        alike = sorted((fact for fact in present if fact.kind == kind), key=lambda f: f.speed)
        if len(alike) == 1:
            here = np.flatnonzero(strokes == alike[0].label)
            first[here] = (np.arange(len(here)) * PIECES // len(here)) % 3 == 0
            continue
        for index, fact in enumerate(alike):
            first[strokes == fact.label] = (index + phase) % 2 == 0
        phase += 1
    if not first.any() or first.all():
        return None
    return Split(first, ~first, "whole strokes of a kind, alternating by speed")


def compare(first: HalfFit, second: HalfFit, prior_precision: Array) -> Difference:
    """Compare two posteriors that share a prior but no data.

    With a common normal prior of precision P0 and posteriors of covariances A and B the difference
    of the means has the covariance A + B - A P0 B - B P0 A: the common part from the prior cancels.
    Directions in which hardly anything of A + B is left are taken out. The squared Mahalanobis
    length of the p others is compared with Hotelling's distribution for covariances that rest on
    n independent observations, T^2 (n - p + 1) / (n p) ~ F(p, n - p + 1)
    (Hotelling 1931, doi:10.1214/aoms/1177732979).
    """
    from scipy.stats import f

    A, B = first.covariance, second.covariance
    size = np.sqrt(np.diag(A + B))
    unit = np.outer(size, size)
    root = np.linalg.cholesky((A + B) / unit) * size[:, None]
    shared = A @ prior_precision @ B
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ (A + B - shared - shared.T) @ inverse.T)
    informed = values > SILENT
    axes = root @ vectors
    covariance = (axes * np.where(informed, values, 0.0)) @ axes.T
    difference = second.mean - first.mean
    along = vectors.T @ inverse @ difference
    spread = np.sqrt(np.diag(covariance))
    z = np.where(spread**2 > SILENT * size**2, difference / np.maximum(spread, 1e-300), np.nan)
    independent, p = min(first.independent, second.independent), int(informed.sum())
    statistic, probability = float("nan"), float("nan")
    freedom = independent - p + 1
    if p and freedom > 0:
        squared = float(np.sum(along[informed] ** 2 / values[informed]))
        statistic = squared / p
        probability = float(f.sf(squared * freedom / (independent * p), p, freedom))
    return Difference(difference, covariance, z, statistic, p, float(independent), probability)


def effort_difference(
    difference: Difference, slopes: Array, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Root mean square by which two halves' predictions differ, what is expected, and its p-value.

    ``slopes`` (n, p) are derivatives of the expected effort by the unconstrained parameters. The
    mean square of a normal difference is a weighted sum of chi-squares, whose weights are the
    eigenvalues of the effort's covariance; with few observations it is divided by that of the
    covariance itself. Its distribution is simulated from ``rng``.
    """
    predicted = slopes @ difference.difference
    mean_square = float(np.mean(predicted**2))
    root = _root(difference.covariance)
    weights = np.linalg.eigvalsh(root @ (slopes.T @ slopes / len(slopes)) @ root)
    weights = np.maximum(weights, 0.0)
    n = max(difference.independent, 1.0)
    drawn = rng.chisquare(1, (MIXTURE_DRAWS, len(weights))) @ weights
    drawn *= n / rng.chisquare(n, MIXTURE_DRAWS)
    above = float((np.count_nonzero(drawn >= mean_square) + 1) / (MIXTURE_DRAWS + 1))
    return float(np.sqrt(mean_square)), float(np.sqrt(weights.sum())), above


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
