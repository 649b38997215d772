"""Compare candidate models by the densities of unseen strokes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.inference import Counter, Problem, smooth_weights

POSITIVE_EVIDENCE = 3.0
"""Log density, counting independent observations only, that the best candidate must gain: a factor
of 20 (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, call this strong)."""

FEWEST_UNITS = 6
"""With fewer units their spread is hardly known, and the evidence alone decides."""

RELIABLE_UNITS = 0.8
"""Share of units that must have reliable scores for an account to count."""


@dataclass(frozen=True)
class Account:
    """Log densities (candidates, units) of hold-out units, simplest candidate first.

    A unit is what errs independently of the others: a stroke, a photograph. ``reliable``
    (candidates, units) marks the densities to use; None stands for all.
    """

    scores: Array
    reliable: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class CandidateRow:
    """One candidate in a comparison.

    ``score`` is the log density of all hold-out units, ``behind`` that of the best candidate less
    this one's, ``behind_se`` its standard error over units (NaN for a single unit).
    ``equivalent`` candidates are not distinguishable from the best, the ``chosen`` one is used.
    """

    name: str
    parameters: int
    score: float
    behind: float
    behind_se: float
    equivalent: bool
    chosen: bool


def compare(
    names: Sequence[str],
    parameters: Sequence[int],
    accounts: Sequence[Account],
    negligible: Sequence[bool] | None = None,
) -> tuple[CandidateRow, ...]:
    """Choose the simplest candidate that is not distinguishable from the best.

    Candidates stand simplest first. The best has the highest log density of hold-out units in the
    first account. Another one is distinguishable from it where every account rejects it: the best
    gains `POSITIVE_EVIDENCE` in sum, and more than one standard error of the paired differences
    over units (the one-standard-error rule of Breiman, Friedman, Olshen and Stone 1984, chapter 3,
    on the densities of Vehtari, Gelman and Gabry 2017, doi:10.1007/s11222-016-9696-4). An account
    in which too few units are reliable for both does not count, the first always does.
    ``negligible`` marks candidates whose error exceeds the best one's by too little to matter:
    these are equivalent in any case.
    """
    scores = accounts[0].scores
    best = int(np.argmax(scores.sum(axis=1)))
    equivalent = [
        (negligible is not None and bool(negligible[index]))
        or not all(_rejects(account, best, index) for account in accounts)
        for index in range(len(names))
    ]
    chosen = equivalent.index(True)
    rows = []
    for index, name in enumerate(names):
        gained = scores[best] - scores[index]
        rows.append(
            CandidateRow(
                name=name,
                parameters=parameters[index],
                score=float(scores[index].sum()),
                behind=float(gained.sum()),
                behind_se=standard_error(gained),
                equivalent=equivalent[index],
                chosen=index == chosen,
            )
        )
    return tuple(rows)


def comparison_sentence(rows: Sequence[CandidateRow], units: str) -> str:
    """Say which candidate is used, and which others the hold-out ``units`` do not reject.

    "Do not distinguish" is said of differences below ``POSITIVE_EVIDENCE`` alone.
    """
    (chosen,) = (row for row in rows if row.chosen)
    if len(rows) == 1:
        return f"{chosen.name} is the only candidate."
    near = [row for row in rows if row.equivalent]
    others = [row.name for row in near if not row.chosen]
    if not others:
        return f"{chosen.name} is used: every other candidate predicts hold-out {units} worse."
    also = f"The others are {', '.join(others)}."
    if len(others) == 1:
        also = f"The other is {others[0]}."
    count = f"{len(near)} candidates that hold-out {units} do not distinguish from the best"
    behind = [row for row in near if row.behind >= POSITIVE_EVIDENCE]
    if behind:
        count = f"{len(near)} candidates near the best"
        also += "".join(
            f" {row.name} is {row.behind:.0f} nats behind the best, with a standard error of "
            f"{row.behind_se:.0f} over {units}."
            for row in behind
        )
    if chosen.parameters > min(row.parameters for row in near):
        return f"{chosen.name} is used, one of {count}, though not the simplest (see notes). {also}"
    return f"{chosen.name} is used: the simplest of {count}. {also}"


def standard_error(scores: Array) -> float:
    """Of a sum over independent units (units,); NaN for a single one."""
    if len(scores) < 2:
        return float("nan")
    return float(np.sqrt(len(scores) * np.var(scores, ddof=1)))


def _rejects(account: Account, best: int, index: int) -> bool:
    """Whether an account distinguishes a candidate from the best one, or does not count."""
    gained = account.scores[best] - account.scores[index]
    if account.reliable is not None:
        both = account.reliable[best] & account.reliable[index]
        if np.mean(both) < RELIABLE_UNITS:
            return True
        gained = gained[both]
    return is_positive(gained)


def is_positive(gained: Array) -> bool:
    """Whether log density gained by unit (units,) is strong evidence, and more than its spread.

    The sum must exceed one standard error over units. A single unit reaches that limit and never
    exceeds it, so that one unit alone decides nothing; a unit in which two candidates predict the
    same says nothing for or against either.
    """
    total = float(gained.sum())
    if total < POSITIVE_EVIDENCE:
        return False
    return len(gained) < FEWEST_UNITS or total > standard_error(gained)


DRAWS, MULTIPLIER = 256, 75
"""Draws, and the multiplier of their lattice."""
DEGREES_OF_FREEDOM = 7.0
ROUNDS = 4
GOOD = 0.5
"""Tail index of the weights of all strokes together, above which draws are taken once more."""
RELIABLE = 1.0 - 1.0 / np.log10(DRAWS)
"""Tail index from which a stroke's weights mean nothing: 0.58 for so few draws, not 0.7 (Vehtari et
al. 2024, JMLR 25:72, section 3.2.4)."""


@dataclass(frozen=True)
class LeftOut:
    """Log density (strokes,) of each stroke without it, and the tail index k-hat of its weights.

    ``evaluations`` counts those of the likelihood. ``densities`` (draws, strokes) are
    log-likelihoods at ``points`` (draws, p), unconstrained, whose posterior weights have the
    logarithms ``log_weights`` (draws,); all are empty where no draw could be used.

    Densities count all bins in full; who compares them multiplies by the share of bins that are
    independent.
    """

    scores: Array
    k_hats: Array
    evaluations: int = 0
    densities: Array = field(default_factory=lambda: np.zeros((0, 0)))
    log_weights: Array = field(default_factory=lambda: np.zeros(0))
    points: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def reliable(self) -> NDArray[np.bool_]:
        """Strokes (strokes,) whose density is reliable."""
        return np.asarray(np.isfinite(self.scores) & (self.k_hats < RELIABLE))


def leave_strokes_out(
    problem: Problem,
    point: Array,
    precision: Array,
    labelled: tuple[NDArray[np.int64], ...],
    share: float,
    by_stroke: Callable[[Array], Array] | None = None,
) -> LeftOut:
    """PSIS-LOO over whole strokes, from draws around the optimum (Vehtari, Gelman and Gabry 2017).

    Single bins are never left out: a neighbour gives them away (doi:10.1007/s11222-016-9696-4 for
    the method, Buerkner, Gabry and Vehtari 2020, doi:10.1080/00949655.2020.1783262 for blocks).
    ``share`` is the share of bins that are independent, and the likelihood is taken to that power,
    so that the posterior is as wide as correlated bins make it. Draws are points of an even
    lattice, mapped to a Student-t about ``point`` with the curvature of the tempered posterior;
    weights correct for both the approximation and the stroke that is missing, and their k-hat
    judges both. Where the curvature describes the posterior badly, draws are taken again from the
    moments that they find. ``precision`` (p, p) is that of the tempered posterior at
    ``point``; ``labelled`` are the bins (k,) of each stroke. ``by_stroke`` gives the log-likelihood
    (k, strokes) of each stroke at draws (k, p), where that is cheaper than by bins.
    """
    from scipy.special import logsumexp

    counter = Counter()
    problem = counter.over(problem)
    tried: list[tuple[float, Array, Array, Array]] = []
    centre, covariance = point, _inverse(precision)
    for _ in range(ROUNDS):
        draws, log_density = _around(centre, covariance)
        densities, log_prior = _densities(problem, draws, labelled, by_stroke)
        usable = np.isfinite(log_prior) & np.all(np.isfinite(densities), axis=1)
        if usable.sum() < DRAWS // 4:
            break
        tempered = share * densities[usable]
        log_weights = log_prior[usable] + tempered.sum(axis=1) - log_density[usable]
        weights, k_hat = _smoothed(log_weights[None, :])
        tried.append((float(k_hat[0]), log_weights, tempered, draws[usable]))
        if k_hat[0] < GOOD:
            break
        shares = np.exp(weights[0])
        centre = shares @ draws[usable]
        away = draws[usable] - centre
        covariance = (shares * away.T) @ away + 1e-3 * covariance
    if not tried:
        nothing = np.full(len(labelled), np.nan), np.full(len(labelled), np.inf)
        return LeftOut(*nothing, counter.calls)
    _, log_weights, tempered, points = min(tried, key=lambda attempt: attempt[0])
    weights, k_hats = _smoothed((log_weights[:, None] - tempered).T)
    scores = np.asarray(logsumexp(weights + tempered.T, axis=1)) / share
    whole, _ = _smoothed(log_weights[None, :])
    return LeftOut(scores, k_hats, counter.calls, tempered / share, whole[0], points)


def _inverse(precision: Array) -> Array:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors / np.maximum(values, 1e-12 * values.max())) @ vectors.T)


def _densities(
    problem: Problem,
    draws: Array,
    labelled: tuple[NDArray[np.int64], ...],
    by_stroke: Callable[[Array], Array] | None,
) -> tuple[Array, Array]:
    """Log density by stroke (draws, strokes) and of the prior (draws,), -inf out of bounds."""
    rows = np.full((len(draws), len(labelled)), -np.inf)
    log_prior = np.full(len(draws), -np.inf)
    within = np.all((draws >= problem.lower) & (draws <= problem.upper), axis=1)
    if by_stroke is not None:
        rows[within] = by_stroke(draws[within])
        log_prior[within] = problem.log_priors(draws[within])
        return rows, log_prior
    for index in np.flatnonzero(within):
        draw = draws[index]
        terms = problem.log_likelihood_terms(draw)
        rows[index] = [float(terms[here].sum()) for here in labelled]
        log_prior[index] = float(problem.log_prior(draw))
    return rows, log_prior


def _around(centre: Array, covariance: Array) -> tuple[Array, Array]:
    """Draws (DRAWS, p) of a Student-t, and their log density (DRAWS,) up to a constant."""
    from scipy.special import gammaincinv, ndtri

    p, nu = len(centre), DEGREES_OF_FREEDOM
    uniform = _evenly(p + 1)
    normal = ndtri(uniform[:, :p])
    stretch = np.sqrt(0.5 * nu / gammaincinv(0.5 * nu, uniform[:, p]))
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))
    distance = np.sum(normal**2, axis=1) * stretch**2
    log_density = -0.5 * (nu + p) * np.log1p(distance / nu)
    return centre + (normal * stretch[:, None]) @ root.T, log_density


def _evenly(size: int) -> Array:
    """Points (DRAWS, size) spread evenly over a cube: Korobov's lattice.

    Niederreiter 1992, doi:10.1137/1.9781611970081, chapter 5. Means over 5 to 16 normal variables
    come out within 1.4 times the error of a Sobol' sequence, which takes half a second to import.
    """
    powers = [pow(MULTIPLIER, power, DRAWS) for power in range(size)]
    return np.asarray((np.outer(np.arange(DRAWS), powers) % DRAWS + 0.5) / DRAWS)


def _smoothed(log_ratio: Array) -> tuple[Array, Array]:
    """Pareto-smoothed normalised log weights (strokes, draws) and k-hats (strokes,)."""
    weights, k_hats = smooth_weights(log_ratio)
    return weights, np.atleast_1d(k_hats)
