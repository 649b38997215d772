"""What a design starts from, fits or the recipe's priors; planned motion as a fit would see it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.fit import cut_experiment, cut_optimum
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.known import USUAL_RATE, CutBasis, KnownFriction
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.path_work import torque_noise_of
from scissorcal.calibration.cut.scout import cut_prior, guess_at, make_experiment
from scissorcal.calibration.cut.segments import cut_into_segments
from scissorcal.calibration.cut.structure import CutLaw, allowed_laws, geometry_of
from scissorcal.calibration.cut.widening import error_shares
from scissorcal.calibration.design.band import Sharing
from scissorcal.calibration.design.information import (
    Information,
    Knowledge,
    cut_information,
    friction_information,
    line_information,
)
from scissorcal.calibration.friction.fit import friction_experiment
from scissorcal.calibration.friction.layout import LawChoice, friction_layout, friction_precision
from scissorcal.calibration.friction.model import FrictionExperiment, design
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.calibration.verify.simulated_motion import Motion, SmoothPiece
from scissorcal.calibration.verify.simulated_recordings import (
    cut_truth,
    friction_truth,
    simulate_cut,
    simulate_friction,
)
from scissorcal.inference.curvature import gradient
from scissorcal.model import EdgeDistribution, FrictionLaw, friction_torque
from scissorcal.recipe.schema import FitFriction, Recipe
from scissorcal.recording.recording import SAMPLE_DTYPE, Joint, Recording, Stroke

EXPECTED_LAW = "stribeck+angle"
"""Law of friction that is expected before any data: what draft effort fits to scissors."""
EXPECTED_SLOW_S = 0.01
"""Time over which the torque's slow noise is expected to last."""
ZERO_S = 1.5
"""Idle seconds at either end of a capture, which show the sensors' zeros."""
TICK_S = 1e-3


@dataclass(frozen=True)
class FrictionState:
    """Friction as it is known: ``structure`` of its law, noise by sample, spread of strokes.

    ``zero_sd`` (N m) is how well the sensors' zeros are known; None where the law holds no zero.
    """

    knowledge: Knowledge
    structure: Mapping[str, Any]
    noise: TorqueNoise
    stroke_sd: float
    zero_sd: float | None
    known: KnownFriction


@dataclass(frozen=True)
class CutState:
    """Response and fracture as they are known, with law and geometry of their fit."""

    knowledge: Knowledge
    structure: Mapping[str, Any]
    law: CutLaw
    geometry: Geometry


def fitted_friction(
    recordings: tuple[Recording, ...], recipe: Recipe, fit: FitResult
) -> FrictionState:
    """What a finished fit of friction knows by its own recordings."""
    design = friction_experiment(recordings, recipe.fit.friction, fit)
    point = design.layout.unconstrained(fit.best)
    noise = torque_noise_of(fit.diagnostics)
    stroke_sd = _number(fit.diagnostics.get("stroke_offset_sd_Nm"))
    information = friction_information(design, point, noise, stroke_sd)
    owners = {int(s): int(r) for s, r in zip(design.strokes, design.bins.recording, strict=True)}
    zeros = [p.sd for p in design.layout.parameters if p.name == "offset" and p.measured_prior]
    knowledge = Knowledge(
        design.layout,
        point,
        design.prior_precision,
        _by_recording(information, owners, len(point)),
        between=_between(design.layout, fit),
        usual_scatter=recipe.fit.friction.between_recordings,
    )
    known = KnownFriction.of(fit, recipe.fit.cut.priors)
    zero_sd = zeros[0] if zeros else None
    return FrictionState(knowledge, fit.structure, noise, stroke_sd, zero_sd, known)


def fitted_cut(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    edge: EdgeDistribution | None = None,
) -> CutState:
    """What a finished fit of a cut knows by its own recordings."""
    design = cut_experiment(recordings, recipe, friction, fit, edge)
    point = design.layout.unconstrained(fit.best)
    return _cut_state(design, point, recipe, _between(design.layout, fit))


def latest_cut(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    edge: EdgeDistribution | None = None,
    last_chosen: str | None = None,
) -> CutState:
    """What the strokes so far tell, by the optimum of draft effort's law and its information.

    For a capture that goes on meanwhile: it costs less than half of a fit at draft effort, whose
    band of the torque it gives. Raises InputError as ``fit_cut`` does.
    """
    design, point = cut_optimum(recordings, recipe, friction, edge, last_chosen)
    return _cut_state(design, point, recipe, None)


def expected_friction(recipe: Recipe) -> FrictionState:
    """Friction before any data: the recipe's priors at their centres.

    The noise is that of the prior, half of it lasting :data:`EXPECTED_SLOW_S`.
    """
    settings = recipe.fit.friction
    law = EXPECTED_LAW if settings.law == "auto" else settings.law
    choice = LawChoice(law, settings.symmetry == "symmetric", settings.adopt)
    centre = float(np.round(np.mean(recipe.scene.opening_rad), 3))
    structure = {
        "law": law,
        "symmetric": choice.symmetric,
        "angle_center": centre,
        "adopt": list(choice.adopt),
    }
    joint, priors = Joint("rotary"), settings.priors.of("rotary")
    free = friction_layout(choice, joint, priors, TICK_S)
    size = float(free.natural(free.mean)["noise"])
    noise = TorqueNoise(size, size, EXPECTED_SLOW_S)
    zero_sd = float(np.sqrt(noise.variance_of_mean(round(2.0 * ZERO_S / TICK_S), TICK_S)))
    layout = friction_layout(replace(choice, zero_sd=zero_sd), joint, priors, TICK_S)
    values = {name: float(value) for name, value in layout.natural(layout.mean).items()}
    floor = recipe.fit.cut.priors.friction_sd_floor_Nm
    known = KnownFriction(
        law=FrictionLaw.of_fit(values, centre),
        offset=float(values.get("offset", 0.0)),
        inertia=values["inertia"],
        cogging=(0.0, 0.0, 0.0),
        noise=noise,
        closing_sd=floor,
        opening_sd=floor,
        stroke_sd=floor,
    )
    knowledge = Knowledge(
        layout,
        layout.mean,
        friction_precision(layout),
        usual_scatter=settings.between_recordings,
    )
    return FrictionState(knowledge, structure, noise, floor, zero_sd, known)


def expected_cut(
    recipe: Recipe, friction: FrictionState, edge: EdgeDistribution | None = None
) -> CutState:
    """Response and fracture before any data: the recipe's priors at their centres.

    The law is the first that the recipe allows with the richest fracture and, where that is left
    open, with friction by load: both widen the band.
    """
    fractures = ("none", "smooth", "rippled")
    laws = allowed_laws(recipe)
    law = max(laws, key=lambda candidate: (fractures.index(candidate.fracture), candidate.loaded))
    basis = CutBasis.of(recipe, friction.known, edge)
    layout, prior = cut_prior(basis, law)
    geometry = basis.geometry
    structure = {**law.key, **geometry_of(recipe, geometry.edge_prior.edge)}
    share = 0.01 * recipe.fit.cut.lack_of_fit_percent
    kinds = (
        "loading",
        "unloading",
        "loading, by its torque",
        "unloading, by its torque",
        "running",
    )
    shares = dict.fromkeys(kinds, share)
    knowledge = Knowledge(
        layout,
        layout.mean,
        prior,
        error_shares=shares,
        usual_scatter=recipe.fit.cut.between_recordings,
    )
    return CutState(knowledge, structure, law, geometry)


def sharing_of(recipe: Recipe, friction: FrictionState, cut: CutState) -> Sharing:
    """How friction's uncertainty enters the cut's offsets.

    What the offsets' priors have beyond friction's own uncertainty now is that of the zeros, which
    stays.
    """
    layout, centre = friction.knowledge.layout, float(friction.structure["angle_center"])

    def levels(u: Array) -> Array:
        values = layout.natural(u)
        law = FrictionLaw.of_fit(values, centre)
        torques = [float(friction_torque(law, centre, sign * USUAL_RATE)) for sign in (-1, 1)]
        return np.array(torques) + float(values.get("offset", np.asarray(0.0)))

    slopes = gradient(levels, friction.knowledge.point, 1e-3 * layout.sd)
    names = cut.knowledge.layout.names
    places = (names.index("offset_closing"), names.index("offset_opening"))
    floor = recipe.fit.cut.priors.friction_sd_floor_Nm
    if cut.knowledge.recordings:
        variances = np.einsum("ij,jk,ik->i", slopes, friction.knowledge.covariance, slopes)
        stated = 1.0 / np.diag(cut.knowledge.prior)[list(places)]
        rest = np.sqrt(np.maximum(stated - np.maximum(variances, floor**2), 0.0))
    else:
        rest = np.full(2, np.sqrt(2.0) * (friction.zero_sd or 0.0))
    return Sharing(slopes, places, floor, rest)


def _cut_state(
    design: CutExperiment, point: Array, recipe: Recipe, between: Array | None
) -> CutState:
    information = cut_information(design, point)
    owners = {int(s): int(r) for s, r in zip(design.strokes, design.bins.recording, strict=True)}
    knowledge = Knowledge(
        design.layout,
        point,
        design.prior_precision,
        _by_recording(information, owners, len(point)),
        line_information(design, point),
        error_shares(design, point, 0.01 * recipe.fit.cut.lack_of_fit_percent),
        between=between,
        usual_scatter=recipe.fit.cut.between_recordings,
    )
    return CutState(knowledge, design.key, design.law, design.likelihood.geometry)


def _by_recording(
    information: Mapping[int, Information], owners: Mapping[int, int], parameters: int
) -> tuple[Information, ...]:
    """Sums of the strokes' information over each recording."""
    sums: dict[int, Information] = {}
    for stroke, one in information.items():
        before = sums.get(owners[stroke], Information.none(parameters))
        sums[owners[stroke]] = before + one
    return tuple(sums[recording] for recording in sorted(sums))


def _between(layout: Layout, fit: FitResult) -> Array | None:
    """Standard deviations between recordings (p,) as the fit states them."""
    stated = fit.diagnostics.get("between_recordings_sd")
    if not stated:
        return None
    return np.array([float(stated.get(name, 0.0)) for name in layout.names])


def _number(value: Any) -> float:
    return float(value) if value is not None and np.isfinite(value) else 0.0


QUIET = TorqueNoise(0.0, 0.0, 0.01)


@dataclass(frozen=True)
class PlannedMotion:
    """A planned motion without a pause, by tick (n,): rad, m, stroke's index and sheet (-1: none).

    ``opening_step`` (rad) and ``advance_step`` (m) are the encoders'.
    """

    opening: Array
    advance: Array
    stroke: Integers
    sheet: Integers
    strokes: tuple[Stroke, ...]
    tick_s: float
    opening_step: float
    advance_step: float


def planned_friction(
    motion: PlannedMotion,
    settings: FitFriction,
    structure: Mapping[str, Any],
    layout: Layout,
    point: Array,
    zero_sd: float | None,
) -> FrictionExperiment:
    """The design of a fit to empty strokes that move as planned; its law is ``structure``'s.

    ``point`` (p,) are unconstrained parameters of ``layout``, which the fit's design has too;
    ``zero_sd`` (N m) is how well the sensors' zeros will be known.
    """
    values = {name: float(value) for name, value in layout.natural(point).items()}
    truth = friction_truth(values, structure, QUIET)
    recordings = simulate_friction((_motion(motion, "friction"),), truth, np.random.default_rng(0))
    whole = weigh(recordings, settings.cutoff_Hz)
    windows = whole.where(whole.bins.moving & (whole.bins.stroke >= 0))
    strokes, choice = windows.bins.stroke.astype(np.int64), LawChoice.of(structure, zero_sd)
    law = design(windows, strokes, choice, Joint("rotary"), settings.priors)
    return replace(law, layout=layout, key={**law.key, "angle_center": structure["angle_center"]})


def planned_cut(
    motion: PlannedMotion,
    basis: CutBasis,
    law: CutLaw,
    structure: Mapping[str, Any],
    layout: Layout,
    point: Array,
) -> CutExperiment | None:
    """The design of a fit to strokes through material that move as planned.

    The crack is walked exactly along the motion with the parameters ``point`` (p,), through even
    sheets. None where the fit would find no stroke that unloads the material.
    """
    values = {name: float(value) for name, value in layout.natural(point).items()}
    even = {**values, "variation": 0.0, "sheet_variation": 0.0}
    known = basis.friction
    truth = cut_truth(even, structure, replace(known, noise=QUIET, stroke_sd=0.0), motion.tick_s)
    recordings = simulate_cut((_motion(motion, "cut"),), truth, np.random.default_rng(0))
    motions = path_motion(recordings, known.inertia)
    guess, cuts = guess_at(structure, values), basis.recipe.scene.cut
    segments = cut_into_segments(basis.data(motions), basis.geometry, guess, cuts)
    if not segments.pieces:
        return None
    return make_experiment(segments, basis, law, values)


def _motion(planned: PlannedMotion, kind: str) -> Motion:
    """The motion as the simulation of recordings takes it, over samples without a torque yet."""
    count = len(planned.opening)
    samples = np.zeros(count, SAMPLE_DTYPE)
    samples["sequence"] = np.arange(count)
    samples["device_time_us"] = np.rint(1e6 * planned.tick_s * np.arange(count))
    samples["opening"], samples["advance"] = planned.opening, planned.advance
    samples["torque_command"] = 1e-3 * np.sign(np.arange(count) % 2 - 0.5)
    samples["stroke"] = planned.stroke
    recording = Recording(
        kind="cut" if kind == "cut" else "friction",
        samples=samples,
        strokes=planned.strokes,
        joint=Joint("rotary"),
        source="planned capture",
    )
    piece = SmoothPiece(
        start=0,
        opening=planned.opening,
        advance=planned.advance,
        load=np.zeros(count),
        stroke=np.zeros(count, dtype=np.int64),
        sheet=planned.sheet,
        tick_s=planned.tick_s,
        error=0.0,
        held=True,
    )
    recorded = np.ones(count, dtype=bool)
    steps = planned.opening_step, planned.advance_step, float("nan")
    return Motion(recording, recorded, (piece,), *steps)
