"""The likelihood of a cut's segments, evaluated in C."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.path_work import advance_line, kinetic_variance, mean_advance
from scissorcal.calibration.cut.segments import Segments
from scissorcal.calibration.cut.teeth import Line
from scissorcal.kernel import (
    CutFitData,
    CutFitParameters,
    cut_log_likelihood,
    cut_log_likelihoods,
)
from scissorcal.model import Response

TABLE_SIZE = 97
TABLE_SPAN = (2e-3, 30.0)
"""Number of knots of the response's table, and its range in multiples of the reference, evenly in
the logarithm: an exponential is within 1e-8 of its value. A power law needs two knots."""


class Evaluation(NamedTuple):
    """Log-likelihood by segment (n,), residuals (N m), standardised ones, and places of rests.

    ``log_period`` is the weighted mean logarithm of the teeth's period (rad) at the line's torque.
    """

    total: float
    terms: Array
    residuals: Array
    standardised: Array
    places: Array
    log_period: float


@dataclass(frozen=True)
class CutLikelihood:
    """Segments with their geometry, ready to be compared with parameters by name.

    Elastic segments come first, piece by piece, then running ones, stretch by stretch; all arrays
    by segment have that order. ``line`` adds one normal term, spread over the segments that show
    it. ``fracture`` is "none", "smooth" or "rippled".
    """

    segments: Segments
    geometry: Geometry
    fracture: str
    line: Line | None = None
    measured: Array | None = field(default=None, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        """Leave C structs out of a pickle; they are made again."""
        return {name: value for name, value in self.__dict__.items() if name != "data"}

    def evaluate(self, values: Mapping[str, Array], response: Response) -> Evaluation:
        """Compare with parameters by name (scalars) and a response."""
        evaluation = Evaluation(*cut_log_likelihood(self.data, self._parameters(values, response)))
        if self.line is None:
            return evaluation
        away = (evaluation.log_period - self.line.log_period) / self.line.sd
        share = -0.5 * away**2 * self.data.line_weight
        terms = evaluation.terms.copy()
        terms[self._elastic_count :] += share
        return evaluation._replace(total=evaluation.total - 0.5 * away**2, terms=terms)

    def log_likelihoods(self, values: Mapping[str, Array], response: Response) -> Array:
        """Log-likelihoods (k,) at parameters by name (k,), those of the response among them."""
        given = self._parameters(values, response)
        totals, periods = cut_log_likelihoods(self.data, given, len(given.log_force))
        if self.line is not None:
            totals -= 0.5 * ((periods - self.line.log_period) / self.line.sd) ** 2
        return totals

    @cached_property
    def _elastic_count(self) -> int:
        """Elastic segments."""
        return sum(len(piece.torque) for piece in self.segments.pieces)

    @cached_property
    def torque(self) -> Array:
        """Mean torques (n,) as they were measured, with no delay."""
        parts = [p.torque for p in self.segments.pieces]
        parts += [s.torque for s in self.segments.stretches]
        return np.concatenate(parts) if parts else np.zeros(0)

    def torque_at(self, found: Evaluation) -> Array:
        """Expected mean torque (n,), without the delay's part."""
        measured = self.torque if self.measured is None else self.measured
        return measured - found.residuals

    @cached_property
    def data(self) -> CutFitData:
        """What C reads."""
        return CutFitData(**self._elastic(), **self._rests(), **self._running(), **self._common())

    def _common(self) -> dict[str, Any]:
        return {
            "moving_blades": float(self.geometry.moving_blades),
            "reference_depth": self.geometry.reference_m,
            "edge_count": len(self.geometry.edge_prior.names),
            "known_sd": max(motion.advance_sd for motion in self.segments.motions),
        }

    def _elastic(self) -> dict[str, Any]:
        segments, geometry = self.segments, self.geometry
        pieces = segments.pieces
        opening, contact, rate = [np.zeros((0, 2))], [np.zeros((0, 2))], [np.zeros(0)]
        for piece in pieces:
            motion, ends = segments.motions[piece.motion], piece.ends
            opening.append(np.stack([motion.opening[ends[:-1]], motion.opening[ends[1:]]], axis=1))
            contact.append(segments.rests[piece.rest].place - advance_line(motion, ends))
            rate.append(np.diff(motion.opening[ends]) / (np.diff(ends) * motion.tick_s))
        spans = geometry.spans(*(np.concatenate(rows) for rows in (opening, rate, contact)))
        whiteners = [_whitener(piece.covariance) for piece in pieces]
        lengths = [len(w) for w in whiteners]
        measured = self._measured(pieces, 0)
        return {
            "piece_first": _starts([len(p.torque) for p in pieces]),
            "piece_rest": np.array([p.rest for p in pieces], dtype=np.int32),
            "piece_closing": np.array([p.kind != "unloading" for p in pieces], dtype=np.int32),
            "white_first": _starts(lengths)[:-1],
            "whitener": _joined(whiteners),
            "torque": measured,
            "late": _joined([p.late for p in pieces]),
            "direction": _joined([p.direction for p in pieces]),
            "depth": spans.depth.ravel(),
            "depth_dx": spans.depth_dx.ravel(),
            "lever": spans.lever,
            "lever_dx": spans.lever_dx,
            "sinking": spans.sinking,
            "depth_de": spans.depth_de.ravel(),
            "lever_de": spans.lever_de.ravel(),
        }

    def _rests(self) -> dict[str, Any]:
        rests, geometry = self.segments.rests, self.geometry
        known = np.array([rest.fresh or self.fracture == "none" for rest in rests])
        opening = np.array([0.5 if rest.fresh else rest.opening for rest in rests])
        advance = np.array([0.0 if rest.fresh else rest.advance for rest in rests])
        place = np.array([rest.place for rest in rests])
        at = geometry.resting(opening, np.where(known, np.nan, place - advance))
        return {
            "rest_known": known.astype(np.int32),
            "rest_place": place,
            "rest_at_reference": at.place + advance,
            "rest_slope": at.slope,
            "rest_de": at.place_de.ravel(),
        }

    def _running(self) -> dict[str, Any]:
        segments, geometry = self.segments, self.geometry
        runs = segments.stretches
        opening, rate, place, start, end = [], [], [], [], []
        for run in runs:
            motion = segments.motions[run.motion]
            low, high = run.ends[:-1], run.ends[1:]
            middle = 0.5 * (motion.opening[high] + motion.opening[low])
            opening.append(middle)
            rate.append(np.diff(motion.opening[run.ends]) / ((high - low) * motion.tick_s))
            place.append(
                geometry.place(middle, geometry.reference_m) + mean_advance(motion, run.ends)
            )
            energy = kinetic_variance(motion, run.ends) + run.tooth_sd**2
            start.append(energy[:-1])
            end.append(energy[1:])
        openings = _joined(opening)
        view = geometry.running(openings)
        sheets = np.array([run.sheet for run in runs], dtype=np.int64)
        counts = [len(run.torque) for run in runs]
        by_sheet = [
            sum(c for c, s in zip(counts, sheets, strict=True) if s == sheet)
            for sheet in np.unique(sheets)
        ]
        joined = [np.arange(count) > 0 for count in counts]
        shown = dict(zip(self.line.stretches, self.line.weights, strict=True)) if self.line else {}
        weight = _joined([shown.get(i, np.zeros(count)) for i, count in enumerate(counts)])
        arm = -view.lever * _joined(rate) / geometry.moving_blades
        return {
            "run_first": _starts(by_sheet),
            "joined": np.concatenate(joined).astype(np.int32) if runs else np.zeros(0, np.int32),
            "run_torque": self._measured(runs, self._elastic_count),
            "run_late": _joined([run.late for run in runs]),
            "run_direction": _joined([run.direction for run in runs]),
            "run_lever": view.lever,
            "run_lever_dd": view.lever_dd,
            "run_slope": view.slope,
            "run_slope_dd": view.slope_dd,
            "run_lever_de": view.lever_de.ravel(),
            "run_slope_de": view.slope_de.ravel(),
            "run_sinking": arm,
            "run_place": _joined(place),
            "run_step": _joined([run.path for run in runs]),
            "run_noise": _joined([run.noise for run in runs]),
            "start_noise": _joined(start),
            "end_noise": _joined(end),
            "line_weight": weight / weight.sum() if weight.sum() > 0 else weight,
            "line_log_torque": self.line.log_torque if self.line else 0.0,
        }

    def _measured(self, parts: Any, first: int) -> Array:
        if self.measured is None:
            return _joined([part.torque for part in parts])
        return np.ascontiguousarray(
            self.measured[first : first + sum(len(part.torque) for part in parts)]
        )

    def _parameters(self, values: Mapping[str, Array], response: Response) -> CutFitParameters:
        edge_prior, reference = self.geometry.edge_prior, self.geometry.reference_m
        log_depth, log_force, slope, log_energy = response_table(response, reference)
        edge = np.zeros((len(log_force), len(edge_prior.names)))
        for column, (name, mean) in enumerate(zip(edge_prior.names, edge_prior.mean, strict=True)):
            edge[:, column] = values.get(f"edge_{name}", mean) - mean
        return CutFitParameters(
            first=float(log_depth[0]),
            step=float(log_depth[1] - log_depth[0]),
            log_force=log_force,
            force_slope=slope,
            log_energy=log_energy,
            fracture=self.fracture,
            energy=values.get("fracture_energy", 1.0),
            kappa=values.get("kappa", 1.0) if self.fracture == "rippled" else 1.0,
            rest_phase=values.get("rest_phase", 0.5),
            rest_spread=values.get("rest_spread", 0.0),
            variation=values.get("variation", 0.0),
            variation_length=values.get("variation_length", 1.0),
            sheet_variation=values.get("sheet_variation", 0.0),
            offset_closing=values.get("offset_closing", 0.0),
            offset_opening=values.get("offset_opening", 0.0),
            load=values.get("load_share", 0.0),
            noise_scale=values.get("noise_scale", 1.0),
            damping=values.get("rate_damping", 0.0),
            delay=values.get("torque_delay", 0.0),
            edge=edge,
        )


def response_table(response: Response, reference_m: float) -> tuple[Array, Array, Array, Array]:
    """Log depth (size,) at the table's knots, and what a response with parameters (k,) has there.

    Those are log force, d(log force)/d(log depth) and log energy, all (k, size); k is 1 where the
    parameters are scalars.
    """
    size = 2 if response.family == "power" else TABLE_SIZE
    log_depth = np.log(reference_m) + np.linspace(
        np.log(TABLE_SPAN[0]), np.log(TABLE_SPAN[1]), size
    )
    force, exponent = np.atleast_1d(response.force), np.atleast_1d(response.exponent)
    if response.family == "power":
        slope = np.repeat(exponent[:, None], size, axis=1)
        log_force = np.log(force)[:, None] + slope * (log_depth - np.log(reference_m))
        return log_depth, log_force, slope, log_force + log_depth - np.log(slope + 1.0)
    depth, shapes = np.exp(log_depth), np.reshape(response.shape, (len(force), -1))
    rows = []
    for one_force, one_exponent, shape in zip(force, exponent, shapes, strict=True):
        drawn = replace(response, force=one_force, exponent=one_exponent, shape=shape)
        held, energy = (
            np.maximum(some, np.finfo(np.float64).tiny)  # a trial exponent of 13 underflows
            for some in (drawn.force_at(depth), drawn.energy_at(depth))
        )
        rows.append((np.log(held), drawn.stiffness_at(depth) * depth / held, energy))
    log_force, slope, energy = (np.stack(row) for row in zip(*rows, strict=True))
    return log_depth, log_force, slope, np.log(energy)


def _whitener(covariance: Array) -> Array:
    """Rows of the lower triangle of the inverse Cholesky factor, one after the other."""
    from scipy.linalg import solve_triangular

    root = np.linalg.cholesky(covariance)
    inverse = solve_triangular(root, np.eye(len(root)), lower=True)
    return np.asarray(inverse[np.tril_indices(len(root))])


def _starts(lengths: list[int]) -> NDArray[np.int32]:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)


def _joined(parts: list[Array]) -> Array:
    return np.concatenate(parts) if parts else np.zeros(0)
