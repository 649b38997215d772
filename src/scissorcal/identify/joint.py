"""Identify a joint from its logs, and predict another log."""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import fit_friction, friction_experiment
from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.calibration.friction.predict import Band, Prediction, effort_band, predict_effort
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.errors import InputError
from scissorcal.identify.gaps import Gap, gaps_of
from scissorcal.identify.ripple import Ripple, ripples_of
from scissorcal.identify.sensors import (
    Delay,
    Sensors,
    corrected,
    estimate_delay,
    mean_square,
)
from scissorcal.identify.words import as_of_a_joint, plain
from scissorcal.model.friction_terms import CANDIDATES, PARAMETERS, TERMS, parts_of
from scissorcal.recipe.friction import FitFriction
from scissorcal.recipe.priors import JointPriors, LogNormalPrior, NormalPrior
from scissorcal.recording import Recording

USUAL_EFFORT = {"rotary": 0.05, "linear": 50.0}
"""Drive (rms; N m, N) of the joints that the priors of a friction fit are stated for."""
FEWEST_STROKES = 3
"""Strokes from which their scatter shows."""
LAWS = tuple(law for law in CANDIDATES if "viscous" in parts_of(law))
"""All have viscous friction: where one speed alone was recorded it keeps its prior's width, and
what Coulomb friction loses to it stands in the intervals of both."""


class _Settings(FitFriction):
    """Settings of a fit whose laws all have viscous friction."""

    @property
    def candidates(self) -> tuple[str, ...]:
        """Laws that are compared, cheapest first."""
        return LAWS


@dataclass(frozen=True)
class Identified:
    """A joint: its ``fit``, what the logs do not tell, and what was done before the fit.

    ``rms`` and ``relative_rms`` are what the law leaves of the effort that it was fitted to.
    """

    fit: FitResult
    settings: FitFriction
    recordings: tuple[Recording, ...]
    sensors: Sensors
    delay: Delay | None
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]

    @cached_property
    def ripples(self) -> tuple[Ripple, ...]:
        """What repeats over the position in the residuals."""
        series = self.fit.series
        left = series.measured - series.predicted
        return ripples_of(series.opening, np.sign(series.opening_rate), left)

    @property
    def rms(self) -> float:
        """Rms of measured minus modelled effort over the windows of the fit."""
        series = self.fit.series
        return float(np.sqrt(mean_square(series.measured - series.predicted)))

    @property
    def relative_rms(self) -> float:
        """`rms` over the rms of the measured effort."""
        return self.rms / float(np.sqrt(mean_square(self.fit.series.measured)))


@dataclass(frozen=True)
class Held:
    """A log that the fit did not see, predicted from its motion alone.

    ``beyond`` is the share of its motion that is faster than all of the fitted logs, or outside
    their positions or loads: the prediction there rests on the form of the law. The band is that of
    a new recording where several were fitted, else that of a new stroke; ``promise`` has it in
    words. ``differs`` says that it holds fewer samples than promised, beyond chance.
    """

    source: str
    rms: float
    relative_rms: float
    share_inside: float
    beyond: float
    differs: bool
    promise: str
    prediction: Prediction


def identify(
    recordings: Sequence[Recording],
    *,
    effort: Effort = "draft",
    sensors: Sensors = Sensors(),
    fit_delay: bool = False,
    adopt: tuple[str, ...] = (),
    cutoff_Hz: float = 75.0,
    seed: int = 0,
) -> Identified:
    """Fit inertia and friction to one or several logs of one joint.

    All laws are compared at every effort. ``effort`` "draft" takes intervals from the posterior's
    curvature, widened for autocorrelated residuals; "standard" samples the posterior, and searches
    the residuals for terms that the law lacks. ``adopt`` adds terms to the law by name, such as
    "sin(position)" for weight. ``fit_delay`` estimates by how much the effort is read late.

    Raises InputError where the logs cannot determine friction, with what to record instead.
    """
    first = recordings[0].joint
    if any(recording.joint != first for recording in recordings):
        raise InputError("The logs are of a turning and of a sliding joint: fit logs of one joint.")
    as_read = tuple(corrected(recording, sensors) for recording in recordings)
    priors = _scaled_priors(as_read)
    settings = _Settings(
        adopt=_terms(adopt), cutoff_Hz=cutoff_Hz, critic=effort != "draft", priors=priors
    )

    def fitted(logs: tuple[Recording, ...], law: FitFriction, how: Effort) -> FitResult:
        with as_of_a_joint():
            rng = np.random.default_rng(seed)
            return fit_friction(logs, law, effort=how, rng=rng, run=FrictionRun(all_laws=True))

    delay = None
    if fit_delay:
        draft = fitted(as_read, settings, "draft")
        delay = _delay(as_read, draft, settings, partial(fitted, how="draft"))
        as_read = tuple(_shifted(recording, delay.value_s) for recording in as_read)
    fit = fitted(as_read, settings, effort)
    said = (plain(note) for note in fit.notes)
    fit = replace(fit, candidate=plain(fit.candidate), notes=tuple(note for note in said if note))
    notes = (delay.sentence,) if delay else ()
    return Identified(fit, settings, as_read, sensors, delay, gaps_of(fit), (*notes, *fit.notes))


def compare(joint: Identified, recording: Recording) -> Held:
    """Predict a log that the fit did not see, with the band of its hold-out strokes.

    The sensors' corrections are those of the fit's own logs.
    """
    if recording.joint != joint.recordings[0].joint:
        raise InputError(f"{recording.source} is of another kind of joint than the fitted logs.")
    seen = corrected(recording, joint.sensors)
    if joint.delay:
        seen = _shifted(seen, joint.delay.value_s)
    with as_of_a_joint():
        design = friction_experiment(joint.recordings, joint.settings, joint.fit)
        band = effort_band(design, joint.fit)
        if band.new_recording is not None:
            band = replace(band, moving=band.new_recording)
        found = predict_effort(joint.fit, band, (seen,), joint.settings.cutoff_Hz)
    measured = found.measured[found.moving & np.isfinite(found.measured)]
    if not len(measured):
        raise InputError(f"{recording.source} has no effort while the joint moves.")
    return Held(
        source=recording.source,
        rms=found.rms_error,
        relative_rms=found.rms_error / float(np.sqrt(mean_square(measured))),
        share_inside=found.share_inside,
        beyond=_beyond(joint, found, seen),
        differs=_differs(found, band.level),
        promise=_promise(band),
        prediction=found,
    )


def _terms(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names that a fit has for added terms; InputError for one that is none."""
    known = tuple(name for name, term in TERMS.items() if term.adoptable)
    terms = tuple(name.replace("position", "opening") for name in names)
    for stated, term in zip(names, terms, strict=True):
        if term not in known:
            listed = ", ".join(plain(name) for name in known)
            near = difflib.get_close_matches(plain(term), [plain(name) for name in known], 1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            raise InputError(f"--term {stated}: there is no such term.{hint} Terms are {listed}.")
    return terms


def _differs(found: Prediction, level: float) -> bool:
    """Whether fewer samples than promised are in the band, by more than strokes scatter.

    Each run of one direction is a stroke; the 97.5 % upper limit of their mean share, by Student's
    t, is below the promised one.
    """
    from scipy.special import stdtrit

    known = found.moving & np.isfinite(found.low) & np.isfinite(found.measured)
    inside = ((found.measured >= found.low) & (found.measured <= found.high))[known]
    way = np.sign(found.rate[known])
    strokes = np.cumsum(np.diff(way, prepend=way[:1]) != 0)
    counts = np.bincount(strokes)
    if len(counts) < FEWEST_STROKES:
        return False
    shares = np.bincount(strokes, inside) / counts
    reach = float(stdtrit(len(shares) - 1, 0.975)) * float(np.std(shares, ddof=1))
    return float(np.mean(shares)) + reach / float(np.sqrt(len(shares))) < level


def _promise(band: Band) -> str:
    """What the band of a log that was not fitted promises."""
    if band.new_recording is None:
        return plain(band.sentence)
    return (
        f"{band.level:.0%} of the samples of a new recording, made like the {band.recordings} of "
        "the fit, lie in the band: its width is from the errors on each of them without it."
    )


def _beyond(joint: Identified, found: Prediction, seen: Recording) -> float:
    """Share of a prediction's motion outside the speeds, positions and loads of the fit."""
    series, moving = joint.fit.series, found.moving
    place, speed = found.opening[moving], np.abs(found.rate[moving])
    outside = (place < series.opening.min()) | (place > series.opening.max())
    outside |= speed > np.abs(series.opening_rate).max()
    known = np.concatenate([_load(recording) for recording in joint.recordings])
    load = np.interp(found.time_s[moving], seen.device_time_s, _load(seen))
    outside |= (load < known.min()) | (load > known.max())
    return float(np.mean(outside))


def _load(recording: Recording) -> Array:
    return np.asarray(recording.samples["handle_force"], dtype=np.float64)


def _shifted(recording: Recording, delay_s: float) -> Recording:
    return corrected(recording, Sensors(delay_s={"effort": delay_s}))


def _delay(
    recordings: tuple[Recording, ...],
    draft: FitResult,
    settings: FitFriction,
    fitted: Callable[[tuple[Recording, ...], FitFriction], FitResult],
) -> Delay:
    """Estimate the effort's delay by fits of the drafted law alone."""
    structure = draft.structure
    law = settings.model_copy(
        update={
            "law": structure["law"],
            "symmetry": "symmetric" if structure["symmetric"] else "asymmetric",
        }
    )
    tick_s = float(np.median(np.diff(recordings[0].device_time_s)))
    worth = float(draft.diagnostics["independent_share"]) * len(draft.series.measured)

    def squares(delay_s: float) -> float:
        shifted = tuple(_shifted(recording, delay_s) for recording in recordings)
        series = fitted(shifted, law).series
        return mean_square(series.measured - series.predicted)

    return estimate_delay(squares, worth, tick_s)


def _scaled_priors(recordings: Sequence[Recording]) -> JointPriors:
    """Priors of efforts at the logs' own size, by powers of ten.

    The recipe's are for scissors and small slides; those of a crane would lie far outside.
    """
    kind = recordings[0].joint.kind
    drive = np.sqrt(np.mean([mean_square(r.drive_effort) for r in recordings]))
    factor = float(10.0 ** np.round(np.log10(max(float(drive), 1e-12) / USUAL_EFFORT[kind])))
    usual = JointPriors()
    if factor == 1.0:
        return usual
    priors = usual.of(kind)
    changed = {
        key: _times(getattr(priors, key), factor)
        for key in type(priors).model_fields
        if key in _effort_keys(kind)
    }
    return usual.model_copy(update={kind: priors.model_copy(update=changed)})


def _effort_keys(kind: str) -> set[str]:
    """Keys of priors that are efforts, or efforts per something."""
    keys = {"adopted_Nm", "adopted_N", "zero_Nm", "zero_N"}
    for term in PARAMETERS.values():
        if term.prior is not None and term.powers[0] == 1:
            keys.add(term.prior_key("rotary" if kind == "rotary" else "linear"))
    return keys


def _times(prior: object, factor: float) -> object:
    """A prior of a quantity that is ``factor`` times as large."""
    if isinstance(prior, LogNormalPrior):
        median = float(np.clip(prior.median * factor, 1e-9, 1e9))
        return LogNormalPrior(median=median, factor_90=prior.factor_90)
    assert isinstance(prior, NormalPrior)
    return NormalPrior(mean=prior.mean * factor, sd=prior.sd * factor)
