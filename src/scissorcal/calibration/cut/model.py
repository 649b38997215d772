"""The design of a cut's fit: segments, law and priors, to be compared with torques."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.likelihood import CutLikelihood, Evaluation
from scissorcal.calibration.cut.path_work import mean_advance
from scissorcal.calibration.cut.structure import NUISANCE, CutLaw, cutting_from, response_from
from scissorcal.calibration.fit_candidate import (
    SEARCH_REACH,
    Candidate,
    CandidateProblem,
    Likelihood,
)
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.model import settled_contact


@dataclass(frozen=True)
class CutCandidate(Candidate):
    """A candidate law of a cut; its segments are whitened, so that terms count as independent.

    ``log_likelihoods`` gives the likelihood over all segments at points (k, p), shape (k,).
    """

    log_likelihoods: Callable[[Array], Array] | None = None

    def problem(self, series: Integers, keep: NDArray[np.bool_] | None = None) -> CandidateProblem:
        """The posterior of this candidate, over the segments that ``keep`` selects."""
        many = self.log_likelihoods

        def log_posteriors(points: Array) -> Array:
            assert many is not None
            away = points - self.prior_mean
            prior = -0.5 * np.einsum("ki,ij,kj->k", away, self.prior_precision, away)
            return np.asarray(many(points) + prior)

        return replace(
            super().problem(series, keep),
            standardised=None,
            independent=True,
            smooth=True,
            log_posterior_many=log_posteriors if keep is None and many else None,
        )


@dataclass(frozen=True)
class CutExperiment:
    """One law over one set of segments, an :class:`~scissorcal.calibration.fit_model.Experiment`.

    ``likelihood`` holds segments and geometry; ``key`` the law's discrete choices with the
    geometry, ``layout`` the parameters and priors (the edge's last, with ``prior_precision`` for
    all). ``start`` (p,) is where a search begins.
    """

    likelihood: CutLikelihood
    law: CutLaw
    key: Mapping[str, Any]
    layout: Layout
    prior_precision: Array
    start: tuple[float, ...]
    what: Literal["friction", "cut"] = "cut"
    nuisance: tuple[str, ...] = NUISANCE
    _last: dict[bytes, Evaluation] = field(default_factory=dict, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """Leave the cache out of a pickle."""
        return {**self.__dict__, "_last": {}}

    @property
    def name(self) -> str:
        """The law in words."""
        return self.law.name

    @property
    def observed(self) -> Array:
        """Mean torque that was measured over each segment (n,)."""
        return self.likelihood.torque

    @property
    def series(self) -> Integers:
        """Pieces and stretches (n,)."""
        return self.bins.series

    @property
    def strokes(self) -> Integers:
        """The stroke that each segment belongs to (n,)."""
        return self.bins.stroke

    def evaluate(self, u: Array) -> Evaluation:
        """Compare with unconstrained parameters ``u`` (p,); the last point is remembered."""
        key = u.tobytes()
        if key not in self._last:
            values = self.layout.natural(u)
            evaluation = self.likelihood.evaluate(values, response_from(self.key, values))
            self._last.clear()
            self._last[key] = evaluation
        return self._last[key]

    def mean(self, u: Array) -> Array:
        """Expected mean torque (n,) at ``u`` (p,)."""
        return np.asarray(self.likelihood.torque_at(self.evaluate(u)))

    def candidate(self, measured: Array) -> Candidate:
        """Give the law over ``measured`` (n,), ready to be fitted."""
        design = self
        if measured is not self.observed:
            design = replace(self, likelihood=replace(self.likelihood, measured=measured), _last={})

        def residuals(u: Array) -> Array:
            return design.evaluate(u).residuals

        def normal(u: Array) -> tuple[Array, Array]:
            evaluation = design.evaluate(u)
            return evaluation.standardised, -evaluation.terms - 0.5 * evaluation.standardised**2

        def log_likelihoods(points: Array) -> Array:
            values = design.layout.natural(points)
            return design.likelihood.log_likelihoods(values, response_from(design.key, values))

        return CutCandidate(
            log_likelihoods=log_likelihoods,
            name=self.name,
            key=self.key,
            layout=self.layout,
            likelihood=Likelihood(residuals, normal),
            starts=np.array([self.start]),
            prior_mean=self.layout.mean,
            prior_precision=self.prior_precision,
            blocks=self.strokes,
        )

    @cached_property
    def bins(self) -> Bins:
        """Mean motion over each segment, for reports, in the likelihood's order."""
        segments = self.likelihood.segments
        rows: list[dict[str, Array]] = []
        parts = [(p.motion, p.ends, segments.rests[p.rest].sheet) for p in segments.pieces]
        parts += [(s.motion, s.ends, s.sheet) for s in segments.stretches]
        for number, (index, ends, sheet) in enumerate(parts):
            motion = segments.motions[index]
            low, high = ends[:-1], ends[1:]
            stroke = _most(motion.stroke[low[0] : high[-1]])
            rows.append(
                {
                    "time_s": 0.5 * (motion.time_s[low] + motion.time_s[high]),
                    "opening": 0.5 * (motion.opening[low] + motion.opening[high]),
                    "rate": np.diff(motion.opening[ends]) / ((high - low) * motion.tick_s),
                    "advance": mean_advance(motion, ends),
                    "series": np.full(len(low), number),
                    "recording": np.full(len(low), motion.recording),
                    "stroke": np.full(len(low), stroke),
                    "sheet": np.full(len(low), sheet),
                }
            )
        joined = {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
        count = len(joined["time_s"])
        return Bins(
            **joined,
            acceleration=np.zeros(count),
            drive=self.observed,
            moving=np.ones(count, dtype=bool),
            bin_s=float("nan"),
            rate_floor=0.0,
        )

    def contact(self, u: Array) -> Array:
        """Distance (m) of the contact from the pivot over each segment (n,).

        Where a crack runs the contact is where it settles, or at the reference indentation where
        no place is: the edges are parallel there.
        """
        segments, geometry = self.likelihood.segments, self.likelihood.geometry
        places = self.evaluate(u).places
        advance = self.bins.advance
        elastic = np.concatenate(
            [np.full(len(piece.torque), places[piece.rest]) for piece in segments.pieces]
            or [np.zeros(0)]
        )
        opening = self.bins.opening[len(elastic) :]
        running = geometry.place(opening, geometry.reference_m)
        if len(opening):
            settled = settled_contact(cutting_from(self.key, self.layout.natural(u)), opening)
            running = np.where(np.isfinite(settled), settled, running)
        return np.concatenate([elastic - advance[: len(elastic)], running])


def starting_point(layout: Layout, values: Mapping[str, float]) -> tuple[float, ...]:
    """An unconstrained point from values by name; others start at their prior's centre."""
    centre = layout.natural(layout.mean)
    merged = {name: float(value) for name, value in centre.items()}
    merged |= {name: value for name, value in values.items() if name in merged}
    return tuple(np.clip(layout.unconstrained(merged), *_reach(layout)).tolist())


def _reach(layout: Layout) -> tuple[Array, Array]:
    reach = 0.9 * SEARCH_REACH * layout.sd
    return layout.mean - reach, layout.mean + reach


def _most(labels: Integers) -> int:
    """The label that most samples have, and -1 only where all do."""
    real = labels[labels >= 0]
    return int(np.bincount(real).argmax()) if len(real) else -1
