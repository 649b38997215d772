"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.assemble import Particulars, assemble
from scissorcal.calibration.between import BetweenRecordings, widened
from scissorcal.calibration.comparison import choose
from scissorcal.calibration.cut.checks import (
    counted,
    cut_diagnostics,
    cut_verdicts,
    line_notes,
    scatter_verdict,
    usage_of_segments,
    usage_sentence,
)
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.guess import CoarseEncoderError, NoUnloadingError
from scissorcal.calibration.cut.known import CutBasis, KnownFriction
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.own_law import as_spline_fit, refuse_unusable
from scissorcal.calibration.cut.path_motion import PathMotion, path_motion
from scissorcal.calibration.cut.scout import (
    MisfitError,
    Scouted,
    make_experiment,
    scout,
)
from scissorcal.calibration.cut.structure import (
    NUISANCE,
    CutLaw,
    allowed_laws,
    own_laws,
    usual_law,
)
from scissorcal.calibration.cut.unknowns import with_toughness, with_unknowns
from scissorcal.calibration.cut.widening import (
    AveragedLaw,
    Inferred,
    average,
    between_notes,
    budget_of,
    by_load,
    compare_cuts,
    load_note,
)
from scissorcal.calibration.fit_candidate import FittedCandidate, fit_candidate
from scissorcal.calibration.fit_model import CutRun, Outcome, candidates_for, draft_note
from scissorcal.calibration.parameters import StatedPrior
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.signals.sensors import Sensors, inspect_sensors
from scissorcal.calibration.signals.soundness import (
    Interruptions,
    farthest_torque,
    interruptions,
    refuse_unsound,
)
from scissorcal.calibration.signals.zeros import DriveZero, without_zeros
from scissorcal.errors import InputError
from scissorcal.inference import InferOptions, infer
from scissorcal.model import EdgeDistribution
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict

DRAWS = 2000
FELT_SDS = 5.0
FEWEST_FELT_RAD = 0.02
KNOTS, SPAN, DEEPEST = 5, 8.0, 0.99


@dataclass(frozen=True)
class _Data:
    """What a fit is made of: recordings with their sensors and motions, and what is given."""

    recordings: tuple[Recording, ...]
    friction: FitResult
    basis: CutBasis
    sensors: Sensors
    motions: tuple[PathMotion, ...]
    broken: Interruptions

    @classmethod
    def of(
        cls,
        recordings: tuple[Recording, ...],
        recipe: Recipe,
        friction: FitResult,
        edge: EdgeDistribution | None,
        prior: StatedPrior | None = None,
    ) -> "_Data":
        known = replace(KnownFriction.of(friction, recipe.fit.cut.priors), prior=prior)
        sensors = inspect_sensors(recordings, "fit.cut")
        cleaned, known = _cleaned(recordings, recipe, friction, known)
        motions = path_motion(cleaned, known.inertia, sensors.usable)
        basis = CutBasis.of(recipe, known, edge)
        return cls(recordings, friction, basis, sensors, motions, interruptions(recordings))

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
    run: CutRun = CutRun(),
) -> FitResult:
    """Identify response, fracture energy and ripple from cuts (or presses), over their path.

    Crack laws are rate-independent, so the fit compares the material's mean torque between
    openings: of cracks at rest that the blades load and unload, of running cracks, and of the
    spectral line of the teeth in a running crack's own phase
    (docs/explanation/likelihood.md). Friction, inertia, cogging and noise are those of
    ``friction``; its uncertainty widens the material's intervals.

    Where a verdict on friction failed, this fit fails too. A study of simulated data goes without
    a budget of lack of fit. Raises InputError where the blades hardly touched the material, a value
    is no measurement, or a stroke is a copy of another.
    """
    refuse_unsound(recordings)
    prior = run.prior
    data = _Data.of(recordings, recipe, friction, run.edge, prior)
    _refuse_no_contact(data)
    allowed = allowed_laws(recipe)
    if run.own_law is not None:
        refuse_unusable(run.own_law, recipe.fit.cut.reference_indentation_mm * 1e-3)
        allowed = own_laws(recipe, run.own_law)
    near = prior.laws if prior else ()
    laws = candidates_for(effort, allowed, usual_law, run.last_chosen, near)
    run.tell(0.05, "cut: finding where cracks rest and run")
    scouted = _scouted(data, laws)
    compared = _fit_laws(scouted, data, laws, run)
    laws_used = by_load(choose([fitted for fitted, _ in compared]), compared)

    def infer_law(law: AveragedLaw) -> Inferred:
        run.tell(0.5, f"cut: inferring {law.fitted.candidate.name}")
        share = None if prior else 0.01 * recipe.fit.cut.lack_of_fit_percent
        own = run if law is laws_used[0] else replace(run, checkpoint=None)
        return _infer(law, share, effort, rng, own)

    inferred = average(laws_used, infer_law, rng)
    chosen, design = inferred.law.fitted, inferred.law.design
    usual = recipe.fit.cut.between_recordings
    between = compare_cuts(design, chosen.optimum.point, recordings, usual, rng)
    posterior = widened(inferred.posterior, between, rng)
    candidates = [fitted for fitted, _ in compared]
    usage = usage_of_segments(recordings, scouted.segments)
    notes = (
        *data.sensors.notes,
        *line_notes(scouted, design, inferred.budget),
        *load_note(laws_used),
        *draft_note(effort, allowed, laws),
        usage_sentence(recordings, usage),
        *between_notes(between, NUISANCE),
    )
    diagnostics = {
        **cut_diagnostics(scouted, design),
        **(between.diagnostics() if between else {}),
    }
    verdicts = () if prior else _verdicts(data, scouted, inferred.law, between, run)
    fit = assemble(
        Outcome(
            design, effort, candidates, chosen, posterior, design.key, simulated=prior is not None
        ),
        recordings,
        usage,
        Particulars(verdicts, notes, diagnostics, recipe.fit.cut.critic and effort != "draft"),
        rng,
    )
    fit = with_toughness(fit, recipe, rng)
    if run.own_law is not None:
        fit = as_spline_fit(fit, run.own_law)
    return with_unknowns(fit, recipe, friction, recordings)


def cut_experiment(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    edge: EdgeDistribution | None = None,
) -> CutExperiment:
    """Give the design of a finished fit: its law and priors over its segments.

    All but ``fit`` are what the fit was made of; its law is taken from ``fit.structure``. A search
    over other outcomes begins where the fit ended.
    """
    data = _Data.of(recordings, recipe, friction, edge)
    law = CutLaw.of(fit.structure)
    scouted = _scouted(data, [law])
    return make_experiment(scouted.segments, data.basis, law, fit.best, scouted.accepted_line)


def cut_optimum(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    edge: EdgeDistribution | None = None,
    last_chosen: str | None = None,
) -> tuple[CutExperiment, Array]:
    """Design and MAP point (p,) of the law that draft effort fits, without a posterior.

    For a capture that goes on meanwhile. Arguments and errors as in :func:`fit_cut`.
    """
    data = _Data.of(recordings, recipe, friction, edge)
    _refuse_no_contact(data)
    laws = candidates_for("draft", allowed_laws(recipe), usual_law, last_chosen)
    scouted = _scouted(data, laws)
    ((fitted, design),) = _fit_laws(scouted, data, laws, CutRun())
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
        return scout(data.motions, data.basis, richest)
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
    scouted: Scouted, data: _Data, laws: Sequence[CutLaw], run: CutRun
) -> list[tuple[FittedCandidate, CutExperiment]]:
    """Fit every law to the same segments; each begins where the scouting ended."""
    fitted: list[tuple[FittedCandidate, CutExperiment]] = []
    values = dict(scouted.values)
    for index, law in enumerate(laws):
        run.tell(0.1 + 0.4 * index / len(laws), f"cut: trying {law.name}")
        begin = dict(values)
        if law.response != "power":
            begin.pop("response_exponent", None)
        if law.response == "spline":
            law = replace(law, knots_m=_knots(scouted, data.basis.geometry))
            begin["response_exponent"] = values["response_exponent"]
        if law.fracture == "smooth":
            begin["fracture_energy"] *= 0.5 * (1.0 + begin.get("kappa", 1.0))
        design = make_experiment(scouted.segments, data.basis, law, begin, scouted.accepted_line)
        candidate = design.candidate(design.observed)
        fitted.append((fit_candidate(candidate, design.series, design.strokes, run.stop), design))
    return fitted


def _infer(
    law: AveragedLaw,
    share: float | None,
    effort: Effort,
    rng: np.random.Generator,
    run: CutRun,
) -> Inferred:
    """The posterior of a law, widened by ``share`` of lack of fit; a study has none to state."""
    fitted, design = law.fitted, law.design
    posterior = infer(
        fitted.candidate.problem(design.series),
        effort,
        rng,
        count=DRAWS,
        optimum=fitted.optimum,
        options=InferOptions(
            checkpoint=run.checkpoint,
            stop=run.stop,
            progress=lambda done, sentence: run.tell(0.5 + 0.5 * done, f"cut: {sentence}"),
        ),
    )
    if share is None:
        return Inferred(law, posterior, None)
    budget = budget_of(design, fitted.optimum.point, posterior.covariance, share)
    return Inferred(law, replace(posterior, draws=budget.widen(posterior.draws, rng)), budget)


def _verdicts(
    data: _Data,
    scouted: Scouted,
    law: AveragedLaw,
    between: BetweenRecordings | None,
    run: CutRun,
) -> tuple[Verdict, ...]:
    """Verdicts that only a fit of cuts has."""
    recordings, noise_scale = data.recordings, data.basis.recipe.fit.cut.priors.noise_scale
    return (
        *cut_verdicts(data.friction, run.edge_verdicts, scouted, data.sensors, recordings),
        scatter_verdict(law.design, law.fitted.optimum.point, noise_scale),
        *((data.broken.verdict("fit.cut"),) if data.broken.interrupted else ()),
        *((between.verdict(),) if between else ()),
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
    all_depths = np.concatenate(depths)
    pressed = all_depths[all_depths > 0.0]
    deepest = float(np.quantile(pressed, DEEPEST)) if len(pressed) else geometry.reference_m
    return tuple(float(f"{knot:.4g}") for knot in np.geomspace(deepest / SPAN, deepest, KNOTS))


def _refuse_no_contact(data: _Data) -> None:
    """Refuse recordings without marked sheets, or with hardly any torque from the material."""
    if not any(np.any(motion.sheet >= 0) for motion in data.motions):
        raise InputError(
            f"{data.names}: no stroke through material is marked. Capture cuts with 'scissorcal "
            "capture cut', or say which sheet each sample is of when importing (-c sheet=COLUMN; "
            f"sheet= of Recording.from_arrays). {data.counted}"
        )
    least = FELT_SDS * float(
        np.hypot(data.basis.friction.noise.white_Nm, data.basis.friction.noise.slow_Nm)
    )
    felt = 0.0
    for motion in data.motions:
        material = data.basis.friction.material(motion)
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
