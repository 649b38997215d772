"""Candidate edges - line, arc, cubic, smoothing spline - compared by their evidence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.candidates import Account, compare
from scissorcal.calibration.edge.model import (
    FAMILIES,
    CellData,
    EdgeEvidence,
    Family,
    Found,
    basis_of,
    search,
)
from scissorcal.calibration.edge.result import RungRow
from scissorcal.inference import InferOptions
from scissorcal.inference.infer import infer
from scissorcal.inference.posterior import Effort
from scissorcal.inference.status import SamplingStatus
from scissorcal.model import Edge, EdgeBelief
from scissorcal.recipe.photograph_priors import BladePriors

POLYNOMIAL = ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2")

MOST_EVALUATIONS: dict[Effort, int] = {"draft": 0, "standard": 20_000, "thorough": 200_000}
"""Evaluations of the likelihood that sampling the sizes of the errors may take."""

_COUNT = {"draft": 200, "standard": 300, "thorough": 600}


@dataclass(frozen=True)
class EdgeComparison:
    """All families compared, their errors' sizes at the optimum, and the chosen one fitted.

    ``belief`` is the edge with its covariance, ``draws`` (n, k) are of its parameters, ``residual``
    (n,) is of all cells in the order of the photographs. ``status`` and ``sentence`` are the
    sampler's, ``evaluations`` counts those of the likelihood over all families.
    """

    rows: tuple[RungRow, ...]
    belief: EdgeBelief
    draws: Array
    residual: Array
    status: SamplingStatus
    sentence: str
    evaluations: int

    @property
    def best(self) -> RungRow:
        return next(row for row in self.rows if row.chosen)


def compare_edges(
    data: CellData,
    effort: Effort,
    rng: np.random.Generator,
    families: tuple[Family, ...] = FAMILIES,
    priors: BladePriors = BladePriors(),
    progress: Progress | None = None,
) -> EdgeComparison:
    """Compare families of edges by their evidence, and fit the chosen one.

    Cells are normal about the edge with five kinds of error: their own noise; roughness of the
    edge, which neighbours share and every photograph sees; what neighbours of one photograph share
    (its compression, its light); what moves a whole photograph (its pivot, centreline, mapping);
    and what is alike in all of them (the print, the camera, its tone curve). All that is linear is
    integrated in closed form. The sizes of the errors are inferred with it: in every family by
    their optimum, in the chosen one at the ``effort`` asked for. Evaluations have a limit
    (`MOST_EVALUATIONS`, `SEARCH_EVALUATIONS`), and ``sentence`` says what came of it.
    """
    tell = progress or (lambda done, sentence: None)
    found, evidences = [], []
    for number, family in enumerate(families):
        tell(0.4 * number / len(families), f"comparing edges: {family}")
        evidences.append(EdgeEvidence(data, basis_of(data, family, priors), priors))
        found.append(search(evidences[-1]))
    sizes = [evidence.basis.columns.shape[1] for evidence in evidences]
    chosen = _chosen(families, sizes, [one.evidence for one in found])
    rows = tuple(
        _row(data, family, one, index == chosen)
        for index, (family, one) in enumerate(zip(families, found, strict=True))
    )
    evidence = evidences[chosen]
    posterior = infer(
        evidence.problem(),
        effort,
        rng,
        count=_COUNT[effort],
        optimum=found[chosen].optimum,
        options=InferOptions(
            budget=MOST_EVALUATIONS[effort] or None,
            progress=lambda done, sentence: tell(0.4 + 0.5 * done, sentence),
        ),
    )
    draws = np.stack([_draw(evidence, u, rng) for u in posterior.draws])
    residual = data.offset - evidence.basis.columns @ draws.mean(axis=0)
    belief, natural = _belief(data, families[chosen], draws)
    others = sum(one.evaluations for index, one in enumerate(found) if index != chosen)
    tell(1.0, f"edge fitted: {families[chosen]}")
    return EdgeComparison(
        rows,
        belief,
        natural,
        residual,
        posterior.status,
        posterior.sentence,
        posterior.evaluations + others,
    )


def _row(data: CellData, family: Family, found: Found, chosen: bool) -> RungRow:
    noise, rough, length, _, *more = (float(size) for size in np.exp(found.optimum.point))
    between = more[0] if data.several else 0.0
    return RungRow(family, found.evidence, chosen, noise, rough, length, between)


def _chosen(families: Sequence[Family], sizes: Sequence[int], evidences: Sequence[float]) -> int:
    """The simplest family that the evidence does not distinguish from the best.

    The evidence is the log density of all cells, each predicted from those before it: one unit, as
    photographs of one blade share its roughness.
    """
    rows = compare(families, sizes, [Account(np.array(evidences)[:, None])])
    return next(index for index, row in enumerate(rows) if row.chosen)


def _draw(evidence: EdgeEvidence, u: Array, rng: np.random.Generator) -> Array:
    """The edge's parameters given the sizes of the errors: a draw from their exact posterior."""
    from scipy.linalg import cho_factor, cho_solve

    covariance, prior = evidence.covariances(u)
    factor = cho_factor(covariance, lower=True)
    columns = evidence.basis.columns
    scale = np.sqrt(np.diag(prior))
    information = columns.T @ cho_solve(factor, columns) * np.outer(scale, scale)
    information += np.linalg.pinv(prior / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    pull = columns.T @ cho_solve(factor, evidence.data.offset) * scale
    levels, vectors = np.linalg.eigh(0.5 * (information + information.T))
    levels = np.maximum(levels, 1e-12 * levels.max())
    mean = vectors @ ((vectors.T @ pull) / levels)
    return np.asarray(
        scale * (mean + vectors @ (rng.standard_normal(len(levels)) / np.sqrt(levels)))
    )


def _belief(data: CellData, family: Family, draws: Array) -> tuple[EdgeBelief, Array]:
    """The normal distribution that the draws amount to, and the draws in the edge's parameters."""
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
