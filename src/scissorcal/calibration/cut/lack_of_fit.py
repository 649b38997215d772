"""A stated budget of lack of fit, propagated from the segments to the parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.inference.curvature import gradient, natural_step

PERTURBATION = 1e-3
LOAD_ERROR = 0.1
"""Share by which friction that grows with the load may depart from proportion: with 0.1 of the
torque as friction, a rig of other construction was recovered within 1.3 % of the force."""


@dataclass(frozen=True)
class Budget:
    """How far each kind of segment would move the parameters if the law were wrong in it.

    ``shifts`` has by kind the change (p,) of the unconstrained parameters for a relative error of
    one; ``shares`` the relative error that is allowed for in each kind.
    """

    shares: Mapping[str, float]
    shifts: Mapping[str, Array]

    @property
    def sd(self) -> Array:
        """Standard deviation (p,) that the budget adds, in unconstrained parameters."""
        rows = [self.shares[kind] * shift for kind, shift in self.shifts.items()]
        return np.asarray(np.sqrt(np.sum(np.square(rows), axis=0)))

    def widen(self, draws: Array, rng: np.random.Generator) -> Array:
        """Draws (n, p), each with an independent error of every kind added."""
        wider = draws.copy()
        for kind, shift in self.shifts.items():
            wider += self.shares[kind] * rng.standard_normal((len(draws), 1)) * shift
        return wider


def budget_of(design: CutExperiment, point: Array, covariance: Array, share: float) -> Budget:
    """Compute how an error of each kind of segment moves the optimum at ``point`` (p,).

    A relative error e of a kind's torques (of the line's period) moves the optimum by
    C d(score)/de, with C the covariance (p, p) of the normal approximation. A law that is wrong in
    the same way in every stroke leaves no trace in the residuals, so the recipe states its size.
    """
    problem = design.candidate(design.observed).problem(design.series)
    step = 0.1 * natural_step(problem.log_posterior, point, 0.1 * problem.prior_sd)
    shifts = {}
    for kind, changed in changed_designs(design).items():
        other = changed.candidate(changed.observed).problem(changed.series)

        def gained(u: Array, other: object = other, problem: object = problem) -> Array:
            return np.array([other.log_likelihood(u) - problem.log_likelihood(u)])  # type: ignore[attr-defined]

        score = gradient(gained, point, step)[0] / PERTURBATION
        shifts[kind] = covariance @ score
    return Budget(error_shares(design, point, share), shifts)


def error_shares(design: CutExperiment, point: Array, share: float) -> dict[str, float]:
    """The relative error that is allowed for in each kind of segment of a design."""
    load = float(design.layout.natural(point).get("load_share", 0.0))
    elastic = float(np.hypot(share, LOAD_ERROR * load))
    return {kind: elastic if "loading" in kind else share for kind in changed_designs(design)}


def changed_designs(design: CutExperiment) -> dict[str, CutExperiment]:
    """Designs in which one kind of segment was measured larger by ``PERTURBATION``.

    Elastic segments may also be wrong in proportion to their torque, from less to more within a
    piece: the exponent follows from that.
    """
    segments = design.likelihood.segments
    none = np.zeros(0)
    opening = [np.full(len(p.torque), float(p.kind == "unloading")) for p in segments.pieces]
    slopes = [2.0 * p.torque / float(np.abs(p.torque).max()) - 1.0 for p in segments.pieces]
    unloading, slope = np.concatenate([*opening, none]), np.concatenate([*slopes, none])
    elastic, count = len(unloading), len(design.observed)
    rest = np.zeros(count - elastic)
    weights = {
        "loading": np.concatenate([1.0 - unloading, rest]),
        "unloading": np.concatenate([unloading, rest]),
        "loading, by its torque": np.concatenate([(1.0 - unloading) * slope, rest]),
        "unloading, by its torque": np.concatenate([unloading * slope, rest]),
        "running": (np.arange(count) >= elastic).astype(np.float64),
    }
    found = {}
    for kind, weight in weights.items():
        if np.any(weight):
            measured = (1.0 + PERTURBATION * weight) * design.likelihood.torque
            likelihood = replace(design.likelihood, measured=measured)
            found[kind] = replace(design, likelihood=likelihood, _last={})
    line = design.likelihood.line
    if line is not None:
        moved = replace(line, log_period=line.log_period + PERTURBATION)
        found["line"] = replace(design, likelihood=replace(design.likelihood, line=moved), _last={})
    return found
