"""Cells of posteriors that are not normal: hills, funnels, valleys, boxes, tails, plateaus."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged
from scipy.stats import cauchy, norm, uniform
from scipy.stats import t as student

from scissorcal.aliases import Array
from scissorcal.inference import Posterior, Problem, infer

Density = Callable[[Array], float]

COMPARED = 24
"""Quantiles that the cells compare."""
FALSE_ALARMS = 0.01
"""Of runs of all cells, at most."""
ERRORS = float(norm.isf(0.5 * FALSE_ALARMS / COMPARED))
"""Standard errors by which a quantile may be off: 3.5 for 24 of them."""
TRUTH = "closed form"


def shape_cells() -> tuple[Cell, ...]:
    """Cells of posteriors whose quantiles are known."""
    right = f"quantiles to {ERRORS:.1f} standard errors of the effective draws, or flagged"

    def cell(name: str, extreme: str, run: Callable[[np.random.Generator], Found]) -> Cell:
        return Cell(name, "inference", extreme, right, TRUTH, run)

    return (
        cell("two hills", "two normal hills 16 sds apart, 0.3 and 0.7 of the mass", _two_hills),
        cell("two hills, one start", "the same, searched from the lower hill alone", _one_start),
        cell("funnel", "Neal's funnel: widths differ by e^9 within the posterior", _funnel),
        cell("bent valley", "Rosenbrock's valley: a curved ridge 20 times longer than wide", _bent),
        cell("box 1e-3 of the prior", "a uniform posterior, 1e-3 of the prior wide", _box),
        cell("tails without moments", "a Cauchy posterior: k-hat at its limit", _cauchy),
        cell("exponent of tails 1.5", "Student-t of 1.5 degrees of freedom, 5 parameters", _heavy),
        cell("plateau", "neither data nor prior hold a parameter", _plateau),
        cell("ridge", "only a sum is held, by data; no prior", _ridge),
        cell("noise without spread", "constant data, the noise's sd a parameter", _no_spread),
    )


def _problem(
    names: tuple[str, ...], log_density: Density, starts: Array, bound: float = np.inf
) -> Problem:
    """A posterior as written: one term, and a flat prior."""
    size = len(names)
    return Problem(
        names=names,
        log_prior=lambda u: 0.0,
        log_likelihood_terms=lambda u: np.array([log_density(u)]),
        series=np.zeros(1, dtype=np.int64),
        prior_sd=np.ones(size),
        starts=np.atleast_2d(starts),
        lower=np.full(size, -bound),
        upper=np.full(size, bound),
        independent=True,
    )


class Quantile(NamedTuple):
    """A share of the mass, the value below which it lies, and the density there."""

    share: float
    value: float
    density: float


def _of(distribution: Any, *shares: float) -> tuple[Quantile, ...]:
    """Quantiles of a distribution of scipy.stats."""
    values = [float(distribution.ppf(share)) for share in shares]
    return tuple(
        Quantile(share, value, float(distribution.pdf(value)))
        for share, value in zip(shares, values, strict=True)
    )


def _judge(
    posterior: Posterior, quantiles: tuple[Quantile, ...], sd: float, column: int = 0
) -> Found:
    """Judge draws of one parameter by its quantiles, errors in units of ``sd``.

    The standard error of a quantile of share p is sqrt(p (1 - p) / n) / f, f the density there
    (Serfling 1980, section 2.3.3, doi:10.1002/9780470316481). The draws are taken with equal
    weights from the effective ones that the posterior states, so both numbers count:
    1 / n = 1 / effective + 1 / draws.
    """
    draws = posterior.draws[:, column]
    variance = 1.0 / posterior.effective + 1.0 / len(draws)
    misses = []
    for share, value, density in quantiles:
        standard = np.sqrt(share * (1.0 - share) * variance) / density
        miss = abs(float(np.quantile(draws, share)) - value)
        misses.append((miss / sd, ERRORS * float(standard) / sd))
    error, stated = max(misses, key=lambda miss: miss[0] / miss[1])
    if error > stated and not posterior.optimum.success:
        return Found("flagged", posterior.optimum.sentence, error, stated)
    if error > stated and not posterior.status.trusted:
        return Found("flagged", posterior.sentence, error, stated)
    return judged(error, stated, "quantiles")


def _hills(u: Array) -> float:
    near = np.log(0.3) - 0.5 * float(np.sum((u + 8.0) ** 2))
    far = np.log(0.7) - 0.5 * float(np.sum((u - 8.0) ** 2))
    return float(np.logaddexp(near, far))


HILLS = (
    Quantile(0.15, -8.0, 0.3 * float(norm.pdf(0.0))),
    Quantile(0.65, 8.0, 0.7 * float(norm.pdf(0.0))),
)
"""Medians of either hill: half of 0.3, and 0.3 and half of 0.7."""


def _two_hills(rng: np.random.Generator) -> Found:
    starts = np.array([[-7.0, -7.0], [7.0, 7.0]])
    return _judge(infer(_problem(("a", "b"), _hills, starts), "standard", rng), HILLS, 1.0)


def _one_start(rng: np.random.Generator) -> Found:
    """What no start leads to cannot be seen; a search with one start says that it had one."""
    posterior = infer(_problem(("a", "b"), _hills, np.array([[-7.0, -7.0]])), "standard", rng)
    found = _judge(posterior, HILLS, 1.0)
    if found.outcome == "wrong" and posterior.optimum.starts == 1:
        said = "one start: the search says that 1 of 1 starts ended at its optimum"
        return Found("flagged", said, found.error, found.allowed)
    return found


def _funnel(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        v, x = u
        return float(-0.5 * (v / 3.0) ** 2 - 0.5 * v - 0.5 * x**2 * np.exp(-v))

    posterior = infer(_problem(("v", "x"), density, np.zeros(2)), "standard", rng)
    return _judge(posterior, _of(norm(0.0, 3.0), 0.05, 0.5, 0.95), 3.0)


def _bent(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        return float(-0.5 * u[0] ** 2 - 0.5 * ((u[1] - u[0] ** 2) / 0.05) ** 2)

    posterior = infer(_problem(("a", "b"), density, np.array([1.0, 1.0])), "standard", rng)
    return _judge(posterior, _of(norm(), 0.05, 0.5, 0.95), 1.0)


def _box(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        return 0.0 if 0.0 <= u[0] <= 1e-3 else -np.inf

    posterior = infer(_problem(("a",), density, np.array([3e-4])), "standard", rng)
    return _judge(posterior, _of(uniform(0.0, 1e-3), 0.05, 0.5, 0.95), 2.89e-4)


def _cauchy(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        return -float(np.log1p(u[0] ** 2))

    posterior = infer(_problem(("a",), density, np.array([0.5])), "standard", rng)
    return _judge(posterior, _of(cauchy(), 0.25, 0.5, 0.75), 1.0)


def _heavy(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        return -0.5 * (1.5 + 5.0) * float(np.log1p(u @ u / 1.5))

    names = ("a", "b", "c", "d", "e")
    posterior = infer(_problem(names, density, np.full(5, 0.5)), "standard", rng)
    return _judge(posterior, _of(student(1.5), 0.25, 0.5, 0.75), 1.0)


def _unheld(posterior: Posterior) -> Found:
    if not posterior.optimum.success:
        return Found("flagged", posterior.optimum.sentence)
    return Found("wrong", f"a proper answer to an improper posterior: {posterior.sentence}")


def _plateau(rng: np.random.Generator) -> Found:
    return _unheld(infer(_problem(("a",), lambda u: 0.0, np.array([0.5])), "standard", rng))


def _ridge(rng: np.random.Generator) -> Found:
    def density(u: Array) -> float:
        return -0.5 * float((u[0] + u[1] - 1.0) / 0.1) ** 2

    return _unheld(infer(_problem(("a", "b"), density, np.zeros(2)), "standard", rng))


def _no_spread(rng: np.random.Generator) -> Found:
    """Constant data of which the mean is known: log sd is N(-n, 1), n sds off its prior N(0, 1)."""
    count = 50

    def terms(u: Array) -> Array:
        return np.full(count, -float(u[0]))

    problem = Problem(
        names=("log_sd",),
        log_prior=lambda u: -0.5 * float(u[0]) ** 2,
        log_likelihood_terms=terms,
        series=np.zeros(count, dtype=np.int64),
        prior_sd=np.ones(1),
        starts=np.zeros((1, 1)),
        lower=np.full(1, -np.inf),
        upper=np.full(1, np.inf),
        standardised=lambda u: (np.zeros(count), np.full(count, float(u[0]))),
        independent=True,
    )
    posterior = infer(problem, "standard", rng)
    return _judge(posterior, _of(norm(-count), 0.05, 0.95), 1.0)
