"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.between import widened
from scissorcal.calibration.comparison import choose
from scissorcal.calibration.cut.averaging import (
    AveragedLaw,
    Inferred,
    average,
    by_load,
    load_note,
)
from scissorcal.calibration.cut.between import between_notes, compare_cuts
from scissorcal.calibration.cut.checks import (
    cut_diagnostics,
    cut_verdicts,
    line_notes,
    scatter_verdict,
)
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.guess import CoarseEncoderError, NoUnloadingError
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.lack_of_fit import budget_of
from scissorcal.calibration.cut.laws import NUISANCE, CutLaw, allowed_laws, usual_law
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.path import PathMotion, path_motion
from scissorcal.calibration.cut.scout import (
    MisfitError,
    Scouted,
    belief_geometry,
    make_experiment,
    scout,
)
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.cut.toughness import with_toughness
from scissorcal.calibration.cut.unknowns import with_unknowns
from scissorcal.calibration.cut.usage import counted, usage_of_segments, usage_sentence
from scissorcal.calibration.effort import candidates_for, draft_note
from scissorcal.calibration.fit_candidate import FittedCandidate, fit_candidate
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.signals.interruptions import Interruptions, interruptions
from scissorcal.calibration.signals.sensors import Sensors, inspect_sensors
from scissorcal.calibration.signals.soundness import farthest_torque, refuse_unsound
from scissorcal.calibration.signals.zeros import DriveZero, without_zeros
from scissorcal.calibration.stated_prior import StatedPrior
from scissorcal.errors import InputError
from scissorcal.inference import Stop, infer
from scissorcal.model import EdgeBelief
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict

DRAWS = 2000
FELT_SDS = 5.0
FEWEST_FELT_RAD = 0.02
KNOTS, SPAN, DEEPEST = 5, 8.0, 0.99


@dataclass(frozen=True)
class _Data:
    """What a fit is made of: recordings with their sensors and motions, geometry, friction."""

    recordings: tuple[Recording, ...]
    recipe: Recipe
    friction: FitResult
    geometry: Geometry
    known: KnownFriction
    sensors: Sensors
    motions: tuple[PathMotion, ...]
    broken: Interruptions

    @classmethod
    def of(
        cls,
        recordings: tuple[Recording, ...],
        recipe: Recipe,
        friction: FitResult,
        edge: EdgeBelief | None,
        prior: StatedPrior | None = None,
    ) -> "_Data":
        geometry = belief_geometry(recipe, edge or edge_of(recipe))
        known = replace(KnownFriction.of(friction, recipe.fit.cut.priors), prior=prior)
        sensors = inspect_sensors(recordings, "fit.cut")
        cleaned, known = _cleaned(recordings, recipe, friction, known)
        motions = path_motion(cleaned, known.inertia, sensors.usable)
        broken = interruptions(recordings)
        return cls(recordings, recipe, friction, geometry, known, sensors, motions, broken)

    @property
    def names(self) -> str:
        """The recordings' files, for messages."""
        return ", ".join(recording.source or "the recording" for recording in self.recordings)

    @property
    def counted(self) -> str:
        """What each filter leaves of the recordings."""
        return counted(self.recordings, self.sensors.usable, self.motions)

    @property
    def cause(self) -> str:
        """What comes before what follows from it: sensors, interruptions; empty without any."""
        verdict = self.sensors.verdict
        said = (
            verdict.why if verdict.status == "fail" else "",
            self.broken.sentence if self.broken.decide else "",
        )
        return "".join(f"{why} Besides, " for why in said if why)


def fit_cut(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    *,
    effort: Effort,
    rng: np.random.Generator,
    progress: Progress | None = None,
    edge: EdgeBelief | None = None,
    edge_verdicts: tuple[Verdict, ...] = (),
    checkpoint: Path | None = None,
    last_chosen: str | None = None,
    stop: Stop | None = None,
    prior: StatedPrior | None = None,
) -> FitResult:
    """Identify response, fracture energy and ripple from cuts (or presses), over their path.

    Crack laws are rate-independent, so the fit compares the material's mean torque between
    openings: of cracks at rest that the blades load and unload, of running cracks, and of the
    spectral line of the teeth in a running crack's own phase (docs/model.md). Friction, inertia,
    cogging and noise are those of ``friction``; its uncertainty widens the material's intervals.

    ``edge_verdicts`` are those on the fit that gave ``edge``: where one of them failed, or one on
    friction, this fit fails too. ``checkpoint`` is a file from which an interrupted thorough fit
    continues. ``last_chosen`` is the law that draft effort fits where the recipe allows several,
    ``stop`` says whether the time limit is reached. ``prior`` replaces the recipe's in a study of
    simulated data, which goes without the verdicts of this fit alone and without a budget of lack
    of fit. Raises InputError where the blades hardly touched the material, a value is no
    measurement, or a stroke is a copy of another.
    """
    tell = progress or (lambda done, sentence: None)
    refuse_unsound(recordings)
    data = _Data.of(recordings, recipe, friction, edge, prior)
    _refuse_no_contact(data)
    allowed = allowed_laws(recipe)
    laws = candidates_for(effort, allowed, usual_law, last_chosen, prior.laws if prior else ())
    tell(0.05, "cut: finding where cracks rest and run")
    scouted = _scouted(data, laws)
    compared = _fit_laws(scouted, data, laws, tell, stop)
    laws_used = by_load(choose([one for one, _ in compared]), compared)

    def infer_one(law: AveragedLaw) -> Inferred:
        tell(0.5, f"cut: inferring {law.fitted.candidate.name}")
        first = law is laws_used[0]
        share = None if prior else 0.01 * recipe.fit.cut.lack_of_fit_percent
        return _infer(law, share, effort, rng, tell, checkpoint if first else None, stop)

    inferred = average(laws_used, infer_one, rng)
    notes = (*load_note(laws_used), *draft_note(effort, allowed, laws))
    fit = _assembled(data, scouted, compared, inferred, effort, edge_verdicts, notes, rng)
    return with_unknowns(with_toughness(fit, recipe, rng), recipe, friction, recordings)


def cut_experiment(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    edge: EdgeBelief | None = None,
) -> CutExperiment:
    """Give the design of a finished fit: its law and priors over its segments.

    All but ``fit`` are what the fit was made of; its law is taken from ``fit.structure``. A search
    over other outcomes begins where the fit ended.
    """
    data = _Data.of(recordings, recipe, friction, edge)
    law = CutLaw.of(fit.structure)
    scouted = _scouted(data, [law])
    ended = {p.name: float(v) for p, v in zip(fit.parameters, fit.map_point, strict=True)}
    ended |= {p.name: p.mean for p in fit.nuisance}
    return make_experiment(
        scouted.segments, data.geometry, recipe, law, data.known, ended, scouted.accepted_line
    )


def cut_optimum(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    edge: EdgeBelief | None = None,
    last_chosen: str | None = None,
) -> tuple[CutExperiment, Array]:
    """Design and MAP point (p,) of the law that draft effort fits, without a posterior.

    For a capture that goes on meanwhile. Arguments and errors as in :func:`fit_cut`.
    """
    data = _Data.of(recordings, recipe, friction, edge)
    _refuse_no_contact(data)
    laws = candidates_for("draft", allowed_laws(recipe), usual_law, last_chosen)
    scouted = _scouted(data, laws)
    ((fitted, design),) = _fit_laws(scouted, data, laws, lambda done, sentence: None, None)
    return design, fitted.optimum.point


def _cleaned(
    recordings: tuple[Recording, ...], recipe: Recipe, friction: FitResult, known: KnownFriction
) -> tuple[tuple[Recording, ...], KnownFriction]:
    """The recordings without their sensors' zeros, if friction was fitted without them.

    Recordings of a study of simulated data have none.
    """
    before = DriveZero.from_dict(friction.diagnostics)
    if before is None:
        return recordings, known
    kind = recordings[0].joint.kind
    unmeasured_sd = recipe.fit.friction.priors.of(kind).zero(kind)
    cleaned, own = without_zeros(recordings, unmeasured_sd, before)
    simulated = known.prior is not None
    return (recordings if simulated else cleaned), known.with_zero(own, before)


def _scouted(data: _Data, laws: Sequence[CutLaw]) -> Scouted:
    fractures = ("none", "smooth", "rippled")
    richest = max((law.fracture for law in laws), key=fractures.index)
    try:
        return scout(data.motions, data.known, data.recipe, data.geometry, richest)
    except NoUnloadingError as error:
        raise InputError(
            f"{data.names}: {data.cause}no stroke shows the blades unloading the material, so its "
            "response cannot be separated from friction. Check rig.edge and the sheet's place, and "
            f"open the blades wide in every stroke. {data.counted}"
        ) from error
    except CoarseEncoderError as error:
        raise InputError(f"{data.names}: {data.cause}{error}") from error
    except MisfitError as error:
        raise InputError(
            f"{data.names}: no law comes near the recorded torques ({error}). Look for a torque "
            f"far from the others ({farthest_torque(data.recordings)}), and check that torques are "
            "in N m; then remove those samples or record again."
        ) from error


def _fit_laws(
    scouted: Scouted,
    data: _Data,
    laws: Sequence[CutLaw],
    tell: Progress,
    stop: Stop | None,
) -> list[tuple[FittedCandidate, CutExperiment]]:
    """Fit every law to the same segments; each begins where the scouting ended."""
    found: list[tuple[FittedCandidate, CutExperiment]] = []
    values = dict(scouted.values)
    for index, law in enumerate(laws):
        tell(0.1 + 0.4 * index / len(laws), f"cut: trying {law.name}")
        begin = dict(values)
        if law.response != "power":
            begin.pop("response_exponent", None)
        if law.response == "spline":
            law = replace(law, knots_m=_knots(scouted, data.geometry))
            begin["response_exponent"] = values["response_exponent"]
        if law.fracture == "smooth":
            begin["fracture_energy"] *= 0.5 * (1.0 + begin.get("kappa", 1.0))
        design = make_experiment(
            scouted.segments,
            data.geometry,
            data.recipe,
            law,
            data.known,
            begin,
            scouted.accepted_line,
        )
        candidate = design.candidate(design.observed)
        found.append((fit_candidate(candidate, design.series, design.strokes, stop), design))
    return found


def _infer(
    law: AveragedLaw,
    share: float | None,
    effort: Effort,
    rng: np.random.Generator,
    tell: Progress,
    checkpoint: Path | None,
    stop: Stop | None,
) -> Inferred:
    """The posterior of a law, widened by ``share`` of lack of fit; a study has none to state."""
    fitted, design = law.fitted, law.design
    posterior = infer(
        fitted.candidate.problem(design.series),
        effort,
        rng,
        count=DRAWS,
        optimum=fitted.optimum,
        checkpoint=checkpoint,
        stop=stop,
        progress=lambda done, sentence: tell(0.5 + 0.5 * done, f"cut: {sentence}"),
    )
    if share is None:
        return Inferred(law, posterior, None)
    budget = budget_of(design, fitted.optimum.point, posterior.covariance, share)
    return Inferred(law, replace(posterior, draws=budget.widen(posterior.draws, rng)), budget)


def _assembled(
    data: _Data,
    scouted: Scouted,
    compared: list[tuple[FittedCandidate, CutExperiment]],
    inferred: Inferred,
    effort: Effort,
    edge_verdicts: tuple[Verdict, ...],
    notes: tuple[str, ...],
    rng: np.random.Generator,
) -> FitResult:
    """The result, with the differences between recordings in its posterior."""
    chosen, design = inferred.law.fitted, inferred.law.design
    recordings, point = data.recordings, chosen.optimum.point
    usual = data.recipe.fit.cut.between_recordings
    between = compare_cuts(design, point, recordings, usual, rng)
    usage = usage_of_segments(recordings, scouted.segments)
    verdicts: tuple[Verdict, ...] = ()
    if data.known.prior is None:
        verdicts = (
            *cut_verdicts(data.friction, edge_verdicts, scouted, data.sensors, recordings),
            scatter_verdict(design, point, data.recipe.fit.cut.priors.noise_scale),
            *((data.broken.verdict("fit.cut"),) if data.broken.interrupted else ()),
            *((between.verdict(),) if between else ()),
        )
    return assemble(
        what="cut",
        effort=effort,
        posterior=widened(inferred.posterior, between, rng),
        compared=[one for one, _ in compared],
        chosen=chosen,
        structure=design.key,
        bins=design.bins,
        strokes=design.strokes,
        measured=design.observed,
        contact=design.contact(point),
        recordings=recordings,
        joint=recordings[0].joint,
        nuisance=NUISANCE,
        rng=rng,
        critic=data.recipe.fit.cut.critic and effort != "draft",
        usage=usage,
        brief=data.known.prior is not None,
        extra_verdicts=verdicts,
        extra_notes=(
            *data.sensors.notes,
            *line_notes(scouted, design, inferred.budget),
            *notes,
            usage_sentence(recordings, usage),
            *between_notes(between, NUISANCE),
        ),
        extra_diagnostics={
            **cut_diagnostics(scouted, design),
            **(between.diagnostics() if between else {}),
        },
    )


def _knots(scouted: Scouted, geometry: Geometry) -> tuple[float, ...]:
    """Knots (m) of a spline over the indentations that data reach, evenly in the logarithm.

    From an eighth of the deepest (the 99 % quantile of elastic segments) up to it: below, the force
    is too small to be felt.
    """
    segments = scouted.segments
    depths = []
    for piece in segments.pieces:
        motion = segments.motions[piece.motion]
        opening = motion.opening[piece.ends]
        contact = segments.rests[piece.rest].place - motion.advance[piece.ends]
        depths.append(geometry.depth_and_lever(geometry.edge, opening, contact)[0])
    every = np.concatenate(depths)
    pressed = every[every > 0.0]
    deepest = float(np.quantile(pressed, DEEPEST)) if len(pressed) else geometry.reference_m
    return tuple(float(f"{knot:.4g}") for knot in np.geomspace(deepest / SPAN, deepest, KNOTS))


def _refuse_no_contact(data: _Data) -> None:
    """Refuse recordings without marked sheets, or with hardly any torque from the material."""
    if not any(np.any(motion.sheet >= 0) for motion in data.motions):
        raise InputError(
            f"{data.names}: no stroke through material is marked. Capture cuts with "
            f"'scissorcal capture cut', or mark strokes and sheets when importing. {data.counted}"
        )
    least = FELT_SDS * float(np.hypot(data.known.noise.white_Nm, data.known.noise.slow_Nm))
    felt = 0.0
    for motion in data.motions:
        material = data.known.material(motion)
        stride = max(1, round(0.02 / motion.tick_s))
        path = np.diff(motion.opening[::stride])
        moved = np.abs(path) > 1e-3
        torque = np.diff(material.work[::stride])[moved] / path[moved]
        felt += float(np.abs(path[moved][torque > least]).sum())
    if felt < FEWEST_FELT_RAD:
        raise InputError(
            f"{data.names}: {data.cause}the blades hardly touched the material (torque beyond "
            f"friction over {felt:.2g} rad of closing). Check that the sheet lay between the "
            "blades and that advance was zero at its near edge, then capture again. "
            f"{data.counted}"
        )
