"""Fit friction, inertia and offset to empty motion."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import Particulars, assemble
from scissorcal.calibration.between import (
    NOT_KNOWN,
    BetweenRecordings,
    compare_recordings,
    jackknife,
    widened,
)
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.fit_model import FrictionRun, Outcome, candidates_for, draft_note
from scissorcal.calibration.friction.checks import (
    BANDWIDTH,
    bandwidth_verdict,
    near_rest_verdict,
    physical_verdict,
    start_verdict,
)
from scissorcal.calibration.friction.choice import (
    choose_law,
    usual_law,
    with_encoder_error,
    with_lack_of_fit,
)
from scissorcal.calibration.friction.layout import LawChoice
from scissorcal.calibration.friction.model import FrictionExperiment, design
from scissorcal.calibration.friction.noise import (
    NO_COGGING,
    Cogging,
    cogging_notes,
    find_cogging,
    noise_diagnostics,
    sample_noise,
    stroke_offsets,
)
from scissorcal.calibration.friction.probed import (
    SlowFriction,
    hidden_from_sweeps,
    inertia_verdict,
    opened,
    with_probed,
    with_pushed_inertia,
)
from scissorcal.calibration.friction.refusals import FEWEST_BINS, refuse_friction
from scissorcal.calibration.parameters import FittedParameter, StatedPrior, in_words
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.signals.filtering import HALF_AT, Bins
from scissorcal.calibration.signals.sensors import inspect_sensors
from scissorcal.calibration.signals.soundness import (
    Steadiness,
    interruptions,
    refuse_unsound,
    steadiness,
)
from scissorcal.calibration.signals.usage import usage_of_windows
from scissorcal.calibration.signals.weak_form import Windows, next_cutoff, weigh
from scissorcal.calibration.signals.zeros import DriveZero, idle_noise, without_zeros, zero_verdicts
from scissorcal.inference import InferOptions, Posterior, infer
from scissorcal.model.friction_terms import NUISANCE, needs_load
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.probe import newest_probe
from scissorcal.recording.recording import Joint, Recording
from scissorcal.verdicts import Verdict

PRESLIDING = "presliding_fine_rad"
"""Fact of a probe: the shortest way over which friction builds up after a turn, which a fit of cuts
takes. A longer one shows in sweeps, and is a term of the law."""


def fit_friction(
    recordings: tuple[Recording, ...],
    settings: FitFriction,
    *,
    effort: Effort,
    rng: np.random.Generator,
    run: FrictionRun = FrictionRun(),
) -> FitResult:
    """Identify friction, inertia and offset from recordings of empty motion.

    drive = inertia * acceleration + F(opening, rate) + offset + noise. The simplest candidate law
    is taken whose error on hold-out strokes is not distinguishable from the best, unless
    ``settings`` name one. Units follow the recordings' joint. Two or more recordings are also
    fitted each by itself, and draws widened by what they differ in.

    Raises InputError where there is too little motion, a value is no measurement, or a stroke is a
    copy of another.
    """
    prior = run.prior
    refuse_unsound(recordings)
    joint = recordings[0].joint if recordings else Joint()
    sensors = inspect_sensors(recordings)
    steady, broken = steadiness(recordings), interruptions(recordings)

    def weighed(window_Hz: float | None = None) -> tuple[Windows, DriveZero | None]:
        # Made again for other windows: the cleaned samples take as much memory as the recorded.
        cleaned, zero = _cleaned(recordings, settings, simulated=prior is not None)
        usable, cutoff_Hz = sensors.usable, settings.cutoff_Hz
        return _slid(steady, cleaned, cutoff_Hz, usable, window_Hz=window_Hz), zero

    whole, zero = weighed()
    windows = whole.where(whole.bins.moving)
    usage = usage_of_windows(recordings, whole, sensors.usable)
    refuse_friction(recordings, settings, whole, windows, sensors, usage)
    left_out = 1.0 - len(windows.first) / len(whole.first)
    del whole  # half of what a long recording's windows take
    slow = SlowFriction.of(recordings, windows.bins, settings)
    settings = with_probed(settings, slow)
    every_law, cogging = _laws(windows, settings, joint, prior, zero)
    near = prior.laws if prior else ()
    laws = every_law
    if not run.all_laws:
        laws = list(candidates_for(effort, every_law, usual_law, run.last_chosen, near))
    compared, chosen, law, passed = choose_law(laws, settings.lack_of_fit, run.stop, run.tell)
    options = InferOptions(
        checkpoint=run.checkpoint,
        stop=run.stop,
        progress=lambda done, sentence: run.tell(0.6 + 0.4 * done, f"friction: {sentence}"),
    )
    problem = chosen.candidate.problem(law.series)
    posterior = infer(problem, effort, rng, optimum=chosen.optimum, options=options)
    if prior is None:  # a study simulates the law itself
        posterior = with_lack_of_fit(posterior, law, settings.lack_of_fit, rng)
        posterior = opened(posterior, law, slow, chosen.held_out_rms, rng)
        posterior = with_encoder_error(posterior, law, rng)
    usual = settings.between_recordings
    between = compare_recordings(law, chosen.optimum.point, recordings, usual, rng)
    posterior = widened(posterior, between, rng)
    unshown = ("inertia",) if hidden_from_sweeps(law, recordings) else ()
    verdicts: tuple[Verdict, ...] = ()
    if prior is None:
        swung = inertia_verdict(law, posterior.draws, recordings)
        drive = float(np.sqrt(np.mean(law.observed**2)))
        verdicts = (
            physical_verdict(law, chosen.optimum.point, chosen.share),
            start_verdict(law, chosen.optimum.point),
            near_rest_verdict(law, posterior.draws),
            *((swung,) if swung else ()),
            _bandwidth(lambda other_Hz: weighed(other_Hz)[0], law, chosen, posterior, effort),
            sensors.verdict,
            *((broken.verdict("fit.friction"),) if broken.interrupted else ()),
            *((steady.verdict(),) if steady.rows else ()),
            *(v.of("fit.friction") for v in zero_verdicts(zero, recordings, drive)),
            *((between.verdict(),) if between else ()),
        )
    notes = (
        *sensors.notes,
        *_notes(left_out, windows, posterior, joint, cogging),
        *_symmetry_note(law, chosen),
        *passed,
        *draft_note(effort, every_law, laws),
        usage.sentence,
        *(between.notes((*NUISANCE, *unshown)) if between else (NOT_KNOWN,)),
    )
    diagnostics = {} if prior else _diagnostics(law, chosen, between, recordings)
    structure = {**chosen.candidate.key, "joint": joint.kind, **_tails_if_heavy(chosen)}
    fit = assemble(
        Outcome(law, effort, compared, chosen, posterior, structure, simulated=prior is not None),
        recordings,
        usage,
        Particulars(
            verdicts,
            notes,
            diagnostics | (zero.as_dict() if zero else {}),
            run.critic or (settings.critic and effort != "draft"),
            tolerance=None if prior else run.tolerance,
            known=("time",) if zero and np.isfinite(zero.drift) else (),
        ),
        rng,
    )
    # A study of simulated data asks what sweeps tell: its recordings hold the rig's own probe.
    return fit if prior else with_pushed_inertia(fit, law, recordings, rng)


def friction_experiment(
    recordings: tuple[Recording, ...], settings: FitFriction, fit: FitResult
) -> FrictionExperiment:
    """Give the design of a finished fit: its law and priors over its own motion.

    ``recordings`` and ``settings`` are those that the fit was made of; its law is taken from
    ``fit.structure``.
    """
    joint = recordings[0].joint
    cleaned, zero = _cleaned(recordings, settings, simulated=False)
    usable = inspect_sensors(recordings).usable
    whole = _slid(steadiness(recordings), cleaned, settings.cutoff_Hz, usable)
    windows = whole.where(whole.bins.moving)
    settings = with_probed(settings, SlowFriction.of(recordings, windows.bins, settings))
    zero_sd = zero.sd if zero and _has_offset(fit) else None
    choice = LawChoice.of(fit.structure, zero_sd)
    law = design(windows, _strokes(windows.bins), choice, joint, settings.priors)
    tails = float(fit.structure.get("tails", np.inf))
    return replace(law, tails=tails, share=float(fit.diagnostics["independent_share"]))


def _slid(
    steady: Steadiness,
    recordings: tuple[Recording, ...],
    cutoff_Hz: float,
    usable: tuple[NDArray[np.bool_], ...],
    *,
    window_Hz: float | None = None,
) -> Windows:
    """Windows over the motion of recordings, without the slips of strokes that stuck."""
    return steady.kept(weigh(recordings, cutoff_Hz, usable, window_Hz=window_Hz))


def _cleaned(
    recordings: tuple[Recording, ...], settings: FitFriction, *, simulated: bool
) -> tuple[tuple[Recording, ...], DriveZero | None]:
    """The recordings without the zeros of their sensors; those of a study have none."""
    kind = recordings[0].joint.kind if recordings else "rotary"
    cleaned, zero = without_zeros(recordings, settings.priors.of(kind).zero(kind))
    return (recordings if simulated else cleaned), zero


def _has_offset(fit: FitResult) -> bool:
    return any(parameter.name == "offset" for parameter in fit.parameters)


def _diagnostics(
    law: FrictionExperiment,
    chosen: FittedCandidate,
    between: BetweenRecordings | None,
    recordings: tuple[Recording, ...],
) -> dict[str, Any]:
    """What a fit stores beside its parameters: noise, scatter of strokes and of recordings."""
    point = chosen.optimum.point
    noise = sample_noise(law, point, idle_noise(recordings))
    probe = newest_probe(recording.device for recording in recordings)
    facts = probe.facts if probe else {}
    residuals = chosen.candidate.likelihood.residuals(point)
    return {
        "window_lengthening": law.windows.lengthening,
        "jackknife_sd": jackknife(law, point, NUISANCE),
        **({PRESLIDING: facts[PRESLIDING]} if PRESLIDING in facts else {}),
        **(between.diagnostics() if between else {}),
        **noise_diagnostics(noise),
        "stroke_offset_sd_Nm": stroke_offsets(residuals, law.strokes, law.windows, noise),
    }


def _bandwidth(
    weighed: Callable[[float], Windows],
    law: FrictionExperiment,
    chosen: FittedCandidate,
    posterior: Posterior,
    effort: Effort,
) -> Verdict:
    """Fit the same law over shorter windows, starting from the optimum.

    ``weighed`` (window_Hz) weighs the recordings over windows that pass half there.
    """
    if effort == "draft":
        why = "Draft effort does not compare cutoffs; use --effort standard."
        return BANDWIDTH.not_evaluated(why)
    other_Hz = next_cutoff(law.windows)
    if other_Hz is None:
        longer_Hz = HALF_AT / (2.0 * law.windows.tick_s)
        why = (
            "No window is shorter than those of this cutoff at this sampling rate: set "
            f"fit.friction.cutoff_Hz to {longer_Hz:.3g} or less, or log at a higher rate."
        )
        return BANDWIDTH.verdict("fail", None, why)
    whole = weighed(other_Hz)
    windows = whole.where(whole.bins.moving)
    if len(windows.first) < FEWEST_BINS:
        why = f"At {other_Hz:.3g} Hz too little motion is left to compare cutoffs."
        return BANDWIDTH.not_evaluated(why)
    there = replace(
        law,
        windows=windows,
        strokes=_strokes(windows.bins),
        tails=chosen.candidate.likelihood.tails,
        shared=None,
    )
    here = chosen.optimum.point
    candidate = replace(there.candidate(there.observed), starts=here[None, :])
    optimum = candidate.optimum(there.series)
    cutoffs = (law.windows.half_at, other_Hz)
    shares = (law.windows.encoder_share, windows.encoder_share)
    return bandwidth_verdict(law.layout, posterior.draws, here, optimum.point, cutoffs, shares)


def _notes(
    left: float, windows: Windows, posterior: Posterior, joint: Joint, cogging: Cogging
) -> tuple[str, ...]:
    """Notes on the share of time that is left out, window length, delay of torque and cogging."""
    notes = [
        f"{left:.1%} of the time is left out: the joint rests, turns or moves by less than "
        f"{windows.bins.rate_floor:.2g} {joint.position_unit}/s (below that the encoder does not "
        "show the direction), samples are missing, or a sensor is faulty."
    ]
    if windows.lengthening > 1.0:
        notes.append(
            f"The encoder's steps are coarse: windows pass half at {windows.half_at:.3g} Hz, "
            "below fit.friction.cutoff_Hz, to keep the steps from biasing the inertia."
        )
    if "delay" in posterior.names:
        delays = 1e3 * posterior.draws[:, posterior.names.index("delay")]
        notes.append(
            "The torque is measured after the opening, by "
            f"{in_words(**FittedParameter.summary_of(delays))} ms; the fit corrects for it."
        )
    return (*notes, *cogging_notes(cogging, posterior, joint))


def _symmetry_note(law: FrictionExperiment, chosen: FittedCandidate) -> tuple[str, ...]:
    """Why an asymmetric law is used where a symmetric one is equivalent."""
    other = law.name.replace("asymmetric", "symmetric")
    if other == law.name or other not in chosen.equivalent:
        return ()
    return (
        "Friction of scissors keeps a level for each direction unless hold-out strokes exclude it: "
        "unequal levels are felt at the handles, and the symmetric law has an offset of the sensor "
        "in their place.",
    )


def _tails_if_heavy(chosen: FittedCandidate) -> dict[str, float]:
    tails = chosen.candidate.likelihood.tails
    return {"tails": tails} if np.isfinite(tails) else {}


def _strokes(bins: Bins) -> NDArray[np.int64]:
    """Planned strokes where the recording has them, else runs of one direction."""
    if np.all(bins.stroke >= 0) and len(np.unique(bins.stroke)) > 1:
        return bins.stroke
    turns = (np.sign(bins.rate[1:]) != np.sign(bins.rate[:-1])) | (np.diff(bins.series) != 0)
    runs = np.concatenate([[0], np.cumsum(turns)])
    planned = bins.stroke.max(initial=-1) + 1
    return np.where(bins.stroke >= 0, bins.stroke, planned + runs).astype(np.int64)


def _laws(
    windows: Windows,
    settings: FitFriction,
    joint: Joint,
    prior: StatedPrior | None,
    zero: DriveZero | None,
) -> tuple[list[FrictionExperiment], Cogging]:
    """The candidate laws, simplest first, over columns that they share, and the cogging found.

    Laws of the load only where one was measured; each symmetric or not. The offset of an asymmetric
    law is what is left of the sensors' zeros: unequal Coulomb levels contain any other. Where both
    explain the data alike, a linear joint gets the offset, and scissors the unequal levels: those
    are felt through the handles, and an offset of a sensor is not.
    """
    names = [law for law in settings.candidates if windows.bears_load or not needs_load(law)]
    names = names if settings.law == "auto" else [settings.law]
    either = (True, False) if joint.kind == "linear" else (False, True)
    both = {"auto": either, "symmetric": (True,), "asymmetric": (False,)}
    strokes = _strokes(windows.bins)

    def over(law: str, symmetric: bool, periods: float = 0.0) -> FrictionExperiment:
        zero_sd = zero.sd if zero else None
        choice = LawChoice(law, symmetric, settings.adopt, periods, zero_sd)
        return design(windows, strokes, choice, joint, settings.priors, prior)

    plain = over(names[0], False)
    cogging = NO_COGGING if joint.kind == "linear" else find_cogging(plain.moments)
    periods = cogging.periods_per_turn if cogging.found else 0.0
    laws = [over(law, symmetric, periods) for law in names for symmetric in both[settings.symmetry]]
    shared = laws[0].moments if periods else plain.moments
    return [replace(law, shared=shared) for law in laws], cogging
