"""The edge's ladder: line, arc, cubic, smoothing spline, compared by their evidence."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.blade_points import EdgeCells
from scissorcal.inference import Effort, Problem, infer
from scissorcal.model import Edge, EdgeBelief
from scissorcal.model.bspline import spline_design

Array = NDArray[np.float64]
Family = Literal["line", "arc", "cubic", "spline"]

FAMILIES: tuple[Family, ...] = ("line", "arc", "cubic", "spline")
POLYNOMIAL = ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2")
PRIOR_SD = (0.4, 0.3, 0.1, 0.4)
"""Before any photograph, for a blade of length 1: offset, slope, curvature and its change."""

KNOT_SHARE = 0.1
"""Distance of the spline's knots, in shares of the measured length."""

REFUTED = 5.0
"""Evidence (natural logarithm) against a richer polynomial from which on it is left out.

An edge that is said to be straight has intervals that say so too; odds of 150 to 1 are asked."""

SPLINE_GAIN = 2.0
"""Evidence by which a spline, with its many parameters, must beat every polynomial."""

_COUNT = {"draft": 200, "standard": 300, "thorough": 600}
_HALF_LOG_TWO_PI = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class EdgeRung:
    """One family fitted to all photographs of a blade.

    ``belief`` is the edge with its covariance, ``draws`` (n, k) are of its parameters. ``evidence``
    is the logarithm of the marginal likelihood. ``roughness_m`` and ``roughness_length_m`` tell
    what is left of the edge beyond its family, ``noise_factor`` how much noisier points are than
    the picture's light says, ``between_m`` how much photographs disagree. ``residual`` (n,) is of
    all cells, in the order of the photographs. ``status`` is the sampler's sentence.
    """

    family: Family
    belief: EdgeBelief
    draws: Array
    evidence: float
    noise_factor: float
    roughness_m: float
    roughness_length_m: float
    between_m: float
    residual: Array
    status: str


def fit_edge_rungs(
    photographs: tuple[EdgeCells, ...],
    length_m: float,
    effort: Effort,
    rng: np.random.Generator,
    families: tuple[Family, ...] = FAMILIES,
) -> tuple[tuple[EdgeRung, ...], int]:
    """Fit each family to the cells of all photographs; the rungs, and which of them is chosen.

    Cells are normal about the edge with five kinds of error: their own noise; roughness of the
    edge, which neighbours share and every photograph sees; what neighbours of one photograph share
    (its compression, its light); what moves a whole photograph (its pivot, centreline, mapping);
    and what is alike in all of them (the print, the camera, its tone curve). All that is linear is
    integrated in closed form; the sizes of the errors are inferred with it, at the ``effort`` asked
    for in the chosen rung and as a draft in those it is compared with.
    """
    data = _Data(photographs, length_m)
    rungs = [_fit(data, family, "draft", rng) for family in families]
    chosen = _chosen(tuple(rungs))
    if effort != "draft":
        rungs[chosen] = _fit(data, rungs[chosen].family, effort, rng)
    return tuple(rungs), chosen


def _chosen(rungs: tuple[EdgeRung, ...]) -> int:
    """The spline if it is clearly best, else the richest polynomial that is not refuted."""
    simple = [i for i, rung in enumerate(rungs) if rung.family != "spline"]
    best = max(range(len(rungs)), key=lambda i: rungs[i].evidence)
    if not simple:
        return best
    top = max(rungs[i].evidence for i in simple)
    if rungs[best].family == "spline" and rungs[best].evidence > top + SPLINE_GAIN:
        return best
    return max(i for i in simple if rungs[i].evidence > top - REFUTED)


class _Data:
    """All cells stacked, with the parts of their covariance that do not depend on parameters."""

    def __init__(self, photographs: tuple[EdgeCells, ...], length_m: float) -> None:
        self.length = length_m
        self.station = np.concatenate([cells.station for cells in photographs])
        self.offset = np.concatenate([cells.offset for cells in photographs])
        self.variance = np.concatenate([cells.sd for cells in photographs]) ** 2
        self.photo = np.repeat(np.arange(len(photographs)), [len(c.station) for c in photographs])
        self.several = len(photographs) > 1
        self.start = float(self.station.min())
        self.apart = np.abs(self.station[:, None] - self.station[None, :])
        self.same = self.photo[:, None] == self.photo[None, :]
        self.known = self._moved_together(photographs)
        tilt = self.station / length_m
        self.between = self.same * (1.0 + np.outer(tilt, tilt))
        self.spacing = float(np.median(np.diff(photographs[0].station)))

    def _moved_together(self, photographs: tuple[EdgeCells, ...]) -> Array:
        shared: dict[tuple[str, int], Array] = {}
        own: list[Array] = []
        for number, cells in enumerate(photographs):
            here = self.photo == number
            seen: dict[str, int] = {}
            for column, name in zip(cells.modes.T, cells.mode_names, strict=True):
                full = np.zeros(len(self.station))
                full[here] = column
                if name in ("shared mapping", "tone"):
                    key = (name, seen.setdefault(name, 0))
                    seen[name] += 1
                    shared[key] = shared.get(key, np.zeros_like(full)) + full
                else:
                    own.append(full)
        columns = np.stack([*shared.values(), *own], axis=1)
        return np.asarray(columns @ columns.T)


@dataclass(frozen=True)
class _Basis:
    """Columns (n, k) of a family and its prior: mean 0, ``prior`` (k, k) by the stiffness."""

    columns: Array
    loose: Array
    bent: Array | None

    def prior(self, bend: float) -> Array:
        return self.loose if self.bent is None else self.loose + bend**2 * self.bent


def _basis(data: _Data, family: Family) -> _Basis:
    s = data.station
    if family != "spline":
        powers = (np.ones_like(s), s, 0.5 * s**2, s**3 / 6.0)
        count = FAMILIES.index(family) + 2
        sd = np.array(PRIOR_SD) * data.length ** (1.0 - np.arange(4))
        return _Basis(np.stack(powers[:count], axis=1), np.diag(sd[:count] ** 2), None)
    count = max(round((data.length - data.start) / (KNOT_SHARE * data.length)), 2) + 3
    columns = spline_design(count, data.start, data.length, s)
    width = (data.length - data.start) / (count - 3)
    place = data.start + width * (np.arange(count) - 1.0)
    straight = np.stack([np.ones(count), place], axis=1)
    loose = straight @ np.diag([(PRIOR_SD[0] * data.length) ** 2, PRIOR_SD[1] ** 2]) @ straight.T
    curve = np.diff(np.eye(count), 2, axis=0)
    return _Basis(columns, loose, np.asarray(np.linalg.pinv(curve.T @ curve) * width**4))


def _fit(data: _Data, family: Family, effort: Effort, rng: np.random.Generator) -> EdgeRung:
    basis = _basis(data, family)
    problem = _problem(data, basis)
    posterior = infer(problem, effort, rng, count=_COUNT[effort])
    best = posterior.optimum.point
    spread = posterior.covariance
    evidence = (
        problem.log_posterior(best)
        + len(best) * _HALF_LOG_TWO_PI
        + 0.5 * float(np.linalg.slogdet(spread)[1])
    )
    draws = np.stack([_draw(data, basis, u, rng) for u in posterior.draws])
    weights = draws.mean(axis=0)
    residual = data.offset - basis.columns @ weights
    belief, natural = _belief(data, family, draws)
    sizes = np.exp(best)
    return EdgeRung(
        family,
        belief,
        natural,
        float(evidence),
        float(sizes[0]),
        float(sizes[1]),
        float(sizes[2]),
        float(sizes[4]) if data.several else 0.0,
        residual,
        posterior.sentence,
    )


def _names(data: _Data, basis: _Basis) -> tuple[tuple[str, float, float], ...]:
    """Hyperparameters with median and log sd of their prior: what sizes errors may have."""
    rows = [
        ("noise_factor", 1.2, 0.4),
        ("roughness_m", 4e-5 * data.length, 1.5),
        ("roughness_length_m", 0.02 * data.length, 0.6),
        ("streak_m", 3e-5 * data.length, 1.2),
    ]
    if data.several:
        rows.append(("between_m", 7e-5 * data.length, 1.0))
    if basis.bent is not None:
        rows.append(("bending_per_m", 0.1 / data.length, 2.0))
    return tuple(rows)


def _problem(data: _Data, basis: _Basis) -> Problem:
    rows = _names(data, basis)
    middle = np.log([row[1] for row in rows])
    sd = np.array([row[2] for row in rows])

    def log_prior(u: Array) -> float:
        z = (u - middle) / sd
        return float(-0.5 * z @ z - np.sum(np.log(sd)) - len(u) * _HALF_LOG_TWO_PI)

    def terms(u: Array) -> Array:
        covariance, prior = _covariances(data, basis, u)
        total = covariance + basis.columns @ prior @ basis.columns.T
        try:
            root = np.linalg.cholesky(total)
        except np.linalg.LinAlgError:
            return np.array([-np.inf])
        from scipy.linalg import solve_triangular

        white = solve_triangular(root, data.offset, lower=True)
        return -0.5 * white**2 - np.log(np.diag(root)) - _HALF_LOG_TWO_PI

    return Problem(
        names=tuple(row[0] for row in rows),
        log_prior=log_prior,
        log_likelihood_terms=terms,
        series=np.zeros(len(data.station), dtype=np.int64),
        prior_sd=sd,
        starts=middle[None, :],
        lower=middle - 5.0 * sd,
        upper=middle + 5.0 * sd,
        independent=True,
    )


def _covariances(data: _Data, basis: _Basis, u: Array) -> tuple[Array, Array]:
    """Covariance (n, n) of the cells about the edge, and the edge's prior (k, k)."""
    size = np.exp(u)
    covariance = data.known.copy()
    near = np.exp(-data.apart / size[2])
    covariance += size[1] ** 2 * near
    covariance += size[3] ** 2 * data.same * np.exp(-data.apart / (3.0 * data.spacing))
    if data.several:
        covariance += size[4] ** 2 * data.between
    covariance[np.diag_indices_from(covariance)] += size[0] ** 2 * data.variance
    return covariance, basis.prior(float(size[-1]) if basis.bent is not None else 0.0)


def _draw(data: _Data, basis: _Basis, u: Array, rng: np.random.Generator) -> Array:
    """The edge's parameters given the sizes of the errors: a draw from their exact posterior."""
    from scipy.linalg import cho_factor, cho_solve

    covariance, prior = _covariances(data, basis, u)
    factor = cho_factor(covariance, lower=True)
    columns = basis.columns
    scale = np.sqrt(np.diag(prior))
    information = columns.T @ cho_solve(factor, columns) * np.outer(scale, scale)
    information += np.linalg.pinv(prior / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    pull = columns.T @ cho_solve(factor, data.offset) * scale
    levels, vectors = np.linalg.eigh(0.5 * (information + information.T))
    levels = np.maximum(levels, 1e-12 * levels.max())
    mean = vectors @ ((vectors.T @ pull) / levels)
    return np.asarray(
        scale * (mean + vectors @ (rng.standard_normal(len(levels)) / np.sqrt(levels)))
    )


def _belief(data: _Data, family: Family, draws: Array) -> tuple[EdgeBelief, Array]:
    """The draws in the edge's own parameters, and the normal belief that they amount to."""
    natural = draws.copy()
    if family == "spline":
        names = tuple(f"spline_m_{index}" for index in range(draws.shape[1]))
    else:
        names = POLYNOMIAL[: draws.shape[1]]
        natural[:, 1] = np.arctan(draws[:, 1])
    blank = Edge(
        family,
        0.0,
        0.0,
        data.length,
        spline_m=(0.0,) * draws.shape[1] if family == "spline" else (),
        spline_start_m=data.start if family == "spline" else 0.0,
    )
    covariance = np.atleast_2d(np.cov(natural, rowvar=False))
    edge = EdgeBelief(blank, names, covariance).with_values(natural.mean(axis=0))
    return EdgeBelief(edge, names, covariance), natural
