"""Preliminary fits: segments and the line of the teeth, from a first estimate."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.geometry import Geometry, Running
from scissorcal.calibration.cut.guess import (
    CoarseEncoderError,
    Guess,
    NoUnloadingError,
    first_guess,
)
from scissorcal.calibration.cut.known import CutBasis
from scissorcal.calibration.cut.likelihood import CutLikelihood
from scissorcal.calibration.cut.model import CutExperiment, starting_point
from scissorcal.calibration.cut.path_motion import FEWEST_SEGMENTS, PathMotion
from scissorcal.calibration.cut.path_work import Material
from scissorcal.calibration.cut.segments import Segments, cut_into_segments
from scissorcal.calibration.cut.structure import (
    CutLaw,
    cut_layout,
    edge_layout,
    geometry_of,
    response_from,
)
from scissorcal.calibration.cut.teeth import Line, find_line, phase_signals
from scissorcal.calibration.parameters import Layout
from scissorcal.inference import Counter, Optimum, find_optimum
from scissorcal.model import Response

ROUNDS = 2
KAPPAS = np.linspace(0.05, 0.985, 188)
MOST_SDS = 4.0
"""A line is rejected where it lies more standard deviations from the rest of the data."""

FEWEST_FOR_A_PIECE = FEWEST_SEGMENTS + 0.5
"""Shortest segments of a loading or unloading from which it surely makes a piece."""

MOST_EVALUATIONS = 10_000
"""Likelihoods after which a preliminary search ends; those of virtual days take 240 to 1,300."""
LARGEST_MISFIT = 100.0
"""Root mean square of residuals, in their standard deviations, that no search is needed to reject:
0.9 to 1.1 where a law holds; over 1,000 with a single torque 1e6 standard deviations off."""


class MisfitError(ValueError):
    """A preliminary search found no optimum, and its best point is nowhere near the data."""


@dataclass(frozen=True)
class Scouted:
    """Segments placed by a preliminary fit, and the line of the teeth, accepted or rejected.

    ``values`` are that fit's parameters by name, ``line`` is what was found, ``accepted`` whether
    it is used, ``reason`` why not; ``without`` is kappa without the line. ``evaluations`` counts
    likelihoods.
    """

    segments: Segments
    materials: tuple[Material, ...]
    values: Mapping[str, float]
    line: Line | None
    accepted: bool
    without: float
    reason: str
    evaluations: int

    @property
    def accepted_line(self) -> Line | None:
        """The line if it is used."""
        return self.line if self.accepted else None


def scout(motions: tuple[PathMotion, ...], basis: CutBasis, fracture: str) -> Scouted:
    """Fit a power law twice, segment the recordings by its result, and look for the teeth.

    Raises NoUnloadingError where none was seen, CoarseEncoderError where the encoder shows too
    little of it, MisfitError where the law is nowhere near the data.
    """
    recipe, geometry, data = basis.recipe, basis.geometry, basis.data(motions)
    cuts, exponent = recipe.scene.cut, recipe.fit.cut.response_exponent
    rounds = [(False, False), (True, recipe.fit.cut.load_share != "none")]
    known_point = _known_point(basis, fracture)
    if known_point is None:
        guess = first_guess(data, geometry, cuts=cuts, exponent=exponent)
        values = _values_of(guess, fracture)
    else:
        (values, guess), rounds = known_point, rounds[1:]
    evaluations = 0
    for unseen, loaded in rounds:
        law = CutLaw("power", fracture, loaded=loaded)
        for _ in range(ROUNDS if loaded else 1):
            at = geometry.at(values)
            segments = cut_into_segments(data, at, guess, cuts, unseen=unseen)
            if not segments.pieces and not unseen:
                segments = cut_into_segments(data, at, guess, cuts)
            if not segments.pieces:
                refuse_coarse(segments)
                raise NoUnloadingError("no stroke shows unloading")
            design = make_experiment(segments, basis, law, values)
            optimum = _found(design)
            evaluations += optimum.evaluations
            values = _natural(design, optimum.point)
            guess = guess_at(design.key, values)
    scouted = Scouted(segments, data.materials, values, None, False, float("nan"), "", evaluations)
    if fracture != "rippled" or not segments.stretches:
        return scouted
    return _with_line(scouted, design, optimum, basis)


def _known_point(basis: CutBasis, fracture: str) -> tuple[dict[str, float], Guess] | None:
    """Where a study of simulated data begins: at the mean of its truths, if that is a power law."""
    recipe, known = basis.recipe, basis.friction
    if known.prior is None or known.prior.response != "power":
        return None
    law = CutLaw("power", fracture)
    layout = known.prior.layout(cut_layout(recipe, law, (known.closing_sd, known.opening_sd)))
    values = {name: float(value) for name, value in layout.natural(layout.mean).items()}
    return values, guess_at(
        {**law.key, **geometry_of(recipe, basis.geometry.edge_prior.edge)}, values
    )


def refuse_coarse(segments: Segments) -> None:
    """Raise CoarseEncoderError where no loading or unloading has segments enough."""
    if not 0.0 < segments.most_segments < FEWEST_FOR_A_PIECE:
        return
    steps = FEWEST_FOR_A_PIECE / segments.most_segments * segments.steps
    needed = steps * 2.0 * math.pi / segments.longest
    raise CoarseEncoderError(
        f"the blades load and unload the material over {1e3 * segments.longest:.2g} mrad of "
        f"opening, {segments.steps:.2g} steps of the encoder "
        f"({1e3 * segments.longest / segments.steps:.2g} mrad each), and its response takes "
        f"{math.ceil(steps)}. If rig.edge and the sheet's place are right, use an encoder of "
        f"at least {math.ceil(needed / 1000.0) * 1000:,} counts a turn, or a material that the "
        "blades sink into further."
    )


def cut_prior(basis: CutBasis, law: CutLaw) -> tuple[Layout, Array]:
    """The parameters of a law and of the edge, and the precision (p, p) of their prior."""
    known, edge_prior = basis.friction, basis.geometry.edge_prior
    layout = cut_layout(basis.recipe, law, (known.closing_sd, known.opening_sd))
    edge = edge_layout(edge_prior)
    whole = type(layout)((*layout.parameters, *edge.parameters))
    precision = np.diag(1.0 / whole.sd**2)
    count = len(edge.parameters)
    if count:
        precision[-count:, -count:] = np.linalg.inv(edge_prior.covariance)
    if known.prior is not None:
        stated = known.prior.of_response(law.response)
        precision, whole = stated.precision(whole, precision), stated.layout(whole)
    return whole, precision


def make_experiment(
    segments: Segments,
    basis: CutBasis,
    law: CutLaw,
    values: Mapping[str, float],
    line: Line | None = None,
) -> CutExperiment:
    """One law over segments, with priors from the recipe; a search begins at ``values``."""
    recipe, geometry = basis.recipe, basis.geometry
    whole, precision = cut_prior(basis, law)
    return CutExperiment(
        likelihood=CutLikelihood(
            segments, geometry, law.fracture, line if law.fracture == "rippled" else None
        ),
        law=law,
        key={**law.key, **geometry_of(recipe, geometry.edge_prior.edge)},
        layout=whole,
        prior_precision=precision,
        start=starting_point(whole, values),
    )


def tooth_periods(
    geometry: Geometry, response: Response, values: Mapping[str, Any], view: Running
) -> tuple[Array, Array]:
    """Logarithm of the teeth's period (rad) and mean torque (N m) of a running crack, (k,) each.

    ``view`` is :meth:`~.geometry.Geometry.running` at k openings.

    The crack starts at the indentation d_c of the energy J and stops at d_l of kappa J. From one
    start to the next the opening falls by p with d_c(theta - p / 2) - d_l(theta + p / 2) =
    p lever / m; to first order in p that is

        p = m (d_c - d_l) / (lever - (d_c + d_l) / 2 (1 + t^2) / (n t)),   t = tan(psi),

    n the response's exponent at d_c. Against a crack stepped exactly it is right to 0.02 %.
    """
    moving, energy = geometry.moving_blades, float(values["fracture_energy"])
    kappa = float(values["kappa"])
    peak = energy / (moving * np.maximum(view.slope, 1e-6))
    start, stop = response.indentation_at(peak), response.indentation_at(kappa * peak)
    away = 0.5 * (start + stop) - geometry.reference_m
    slope, lever = view.slope + view.slope_dd * away, view.lever + view.lever_dd * away
    gained = response.energy_at(start) - response.energy_at(stop)
    mean = gained / np.maximum(start - stop, 1e-15)
    power = response.stiffness_at(start) * start / response.force_at(start)
    turn = 0.5 * (start + stop) * (1.0 + slope**2) / (power * slope)
    period = moving * (start - stop) / np.maximum(lever - turn, 1e-6)
    torque = mean / peak * energy * lever / (moving * slope)
    return np.log(np.maximum(period, 1e-12)), torque


def _with_line(
    scouted: Scouted, design: CutExperiment, optimum: Optimum, basis: CutBasis
) -> Scouted:
    """Look for the teeth, test whether they agree with the rest, and fit again with them."""
    geometry = basis.geometry
    first = _line(scouted, geometry, design)
    scouted = replace(scouted, without=scouted.values["kappa"])
    if first is None:
        return replace(
            scouted, reason="no stroke shows the teeth of a running crack as a spectral line."
        )
    if not first.at_two_speeds:
        return replace(
            scouted,
            line=first,
            reason="the teeth's line appears at one stroke speed only; two are needed.",
        )
    alone = design.candidate(design.observed).problem(design.series)
    values, line, evaluations = dict(scouted.values), first, scouted.evaluations
    for _ in range(ROUNDS):
        values |= _kappa_at(values, geometry, scouted, line.log_period, line.stretches)
        design = make_experiment(scouted.segments, basis, design.law, values, line)
        with_line = _found(design)
        evaluations += with_line.evaluations
        values = _natural(design, with_line.point)
        again = _line(replace(scouted, values=values), geometry, design, near=True)
        if again is None:
            break
        line = again
    lost = optimum.value - alone.log_posterior(with_line.point)
    away = float(np.sqrt(max(2.0 * lost, 0.0)))
    if away > MOST_SDS:
        reason = (
            f"the line's period is {away:.1f} standard deviations (limit {MOST_SDS:g}) from the "
            "rest of the data, as for encoder counts that alias with the samples."
        )
        return replace(scouted, line=line, reason=reason, evaluations=evaluations)
    return replace(scouted, values=values, line=line, accepted=True, evaluations=evaluations)


def _found(design: CutExperiment) -> Optimum:
    """The optimum of a preliminary fit, or the best of ``MOST_EVALUATIONS``."""
    counter = Counter()
    problem = counter.over(design.candidate(design.observed).problem(design.series))
    optimum = find_optimum(problem, stop=lambda: counter.calls >= MOST_EVALUATIONS)
    if not optimum.success:
        misfit = float(np.sqrt(np.mean(design.evaluate(optimum.point).standardised ** 2)))
        if not misfit < LARGEST_MISFIT:
            raise MisfitError(f"residuals of {misfit:.3g} standard deviations")
    return optimum


def _line(
    scouted: Scouted, geometry: Geometry, design: CutExperiment, near: bool = False
) -> Line | None:
    response = response_from(design.key, {k: np.asarray(v) for k, v in scouted.values.items()})
    rows = [
        tooth_periods(
            geometry, response, scouted.values, geometry.running(_middles(scouted, index))
        )
        for index in range(len(scouted.segments.stretches))
    ]
    gain = 1.0 + float(scouted.values.get("load_share", 0.0))
    offset = float(scouted.values.get("offset_closing", 0.0))
    growth = 1.0 / float(np.asarray(response.exponent))
    periods, torques = [row[0] for row in rows], [gain * row[1] + offset for row in rows]
    signals = phase_signals(scouted.segments, scouted.materials, geometry, periods, torques, growth)
    return find_line(signals, periods, torques, near)


def _middles(scouted: Scouted, index: int) -> Array:
    stretch = scouted.segments.stretches[index]
    opening = scouted.segments.motions[stretch.motion].opening
    return 0.5 * (opening[stretch.ends[1:]] + opening[stretch.ends[:-1]])


def _kappa_at(
    values: Mapping[str, float],
    geometry: Geometry,
    scouted: Scouted,
    log_period: float,
    stretches: tuple[int, ...],
) -> dict[str, float]:
    """Kappa, and the energy that goes with it, that give a mean period at the same mean energy."""
    mean = values["fracture_energy"] * (1.0 + values["kappa"]) / 2.0
    response = Response(
        "power", values["response_force"], values["response_exponent"], geometry.reference_m
    )
    view = geometry.running(np.concatenate([_middles(scouted, index) for index in stretches])[::7])
    misses = []
    for kappa in KAPPAS:
        tried = {**values, "kappa": kappa, "fracture_energy": 2.0 * mean / (1.0 + kappa)}
        logs, _ = tooth_periods(geometry, response, tried, view)
        misses.append(abs(float(logs.mean()) - log_period))
    kappa = float(KAPPAS[int(np.argmin(misses))])
    return {"kappa": kappa, "fracture_energy": 2.0 * mean / (1.0 + kappa)}


def _values_of(guess: Guess, fracture: str) -> dict[str, float]:
    kappa = 2.0 / guess.peak_ratio - 1.0
    return {
        "response_force": float(np.asarray(guess.response.force)),
        "response_exponent": float(np.asarray(guess.response.exponent)),
        "fracture_energy": guess.mean_energy * (guess.peak_ratio if fracture == "rippled" else 1.0),
        "kappa": kappa,
    }


def guess_at(structure: Mapping[str, Any], values: Mapping[str, float]) -> Guess:
    """Where cracks rest and run by the parameters ``values`` of a law with that structure."""
    response = response_from(structure, {k: np.asarray(v) for k, v in values.items()})
    if "fracture_energy" not in values:
        return Guess(response, np.inf)
    kappa = values.get("kappa", 1.0)
    mean = values["fracture_energy"] * (1.0 + kappa) / 2.0
    return Guess(response, mean, 2.0 / (1.0 + kappa), values.get("load_share", 0.0))


def _natural(design: CutExperiment, point: Array) -> dict[str, float]:
    return {name: float(value) for name, value in design.layout.natural(point).items()}
