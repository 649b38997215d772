"""Fit mass and friction of the sledge to empty motion along the cut."""

from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.aliases import Integers
from scissorcal.calibration.fit_run import FrictionRun
from scissorcal.calibration.friction.commanded import (
    Actuation,
    as_sliding_joint,
    driven,
    find_actuation,
)
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.calibration.result import Effort, FitResult, Proposal
from scissorcal.errors import InputError
from scissorcal.recipe.friction import AdvanceSettings
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict

NO_SENSOR = ("sensor zeros", "zero drift")
"""Checks of sensors that the force along the cut has none of."""


def fit_friction_advance(
    recordings: tuple[Recording, ...],
    settings: AdvanceSettings,
    *,
    effort: Effort,
    rng: np.random.Generator,
    run: FrictionRun = FrictionRun(),
) -> FitResult:
    """Identify mass, friction and offset of the sledge from empty motion of it.

    As :func:`~.fit.fit_friction`, with the commanded force for the drive, which no sensor measures:
    how late it acts is found first (:func:`~.commanded.find_actuation`). Newtons are those of the
    command: a motor that gives p percent less makes mass and levels p percent too large.
    """
    if not any(np.any(driven(recording)) for recording in recordings):
        names = ", ".join(recording.source or "the recording" for recording in recordings)
        raise InputError(
            f"{names or 'Nothing'}: no sample has the motors on, so no force moved the sledge: run "
            "'scissorcal capture friction --axis advance' again."
        )
    try:
        actuation = find_actuation(recordings, settings.cutoff_Hz)
        sliding = sliding_joints(recordings, actuation, settings.lack_of_fit)
        fit = fit_friction(sliding, settings, effort=effort, rng=rng, run=run)
    except InputError as error:
        raise InputError(_renamed(str(error))) from error
    return _of_advance(fit, recordings, actuation)


def sliding_joints(
    recordings: tuple[Recording, ...], actuation: Actuation, lack_of_fit: float
) -> tuple[Recording, ...]:
    """Recordings of the sledge as those of a sliding joint that the acting force drives.

    White noise of the share ``lack_of_fit`` of the force is added, the same one each time: without
    noise a likelihood has widths that no search and no sampler can follow, far below what the law
    can be trusted to (the nugget of a deterministic experiment, Gramacy and Lee 2012,
    doi:10.1007/s11222-010-9224-x).
    """
    return tuple(
        _with_noise(as_sliding_joint(recording, actuation), lack_of_fit, number)
        for number, recording in enumerate(recordings)
    )


def actuation_of(fit: FitResult) -> Actuation:
    """How the commands acted, as a finished fit found it."""
    return Actuation(float(fit.structure["delay_ticks"]), float(fit.structure["lag_ticks"]))


def _of_advance(
    fit: FitResult, recordings: tuple[Recording, ...], actuation: Actuation
) -> FitResult:
    """The fit of a sliding joint as one of the sledge: its name, keys, and samples used."""
    tick_ms = 1e3 * _tick_s(recordings[0])
    late = (
        f"A commanded force acts {tick_ms * actuation.late_ticks:.2f} ms late (a delay of "
        f"{tick_ms * actuation.delay_ticks:.2f} ms and a lag of "
        f"{tick_ms * actuation.lag_ticks:.2f} ms; only their sum is certain), beside being held "
        "from tick to tick; the fit corrects for it."
    )
    scale = (
        "No sensor measures the force along the cut: mass and friction rest on the commanded "
        "force, and a motor that gives 1 % less makes all of them 1 % too large."
    )
    kept = [note for note in fit.notes if not note.startswith("The torque is measured ")]
    return replace(
        fit,
        what="friction-advance",
        structure={
            **fit.structure,
            "delay_ticks": actuation.delay_ticks,
            "lag_ticks": actuation.lag_ticks,
        },
        verdicts=tuple(_scoped(one) for one in fit.verdicts if one.check not in NO_SENSOR),
        notes=(*(_renamed(note) for note in kept), late, scale),
        diagnostics={n: v for n, v in fit.diagnostics.items() if not n.startswith("zero_")},
        critic=tuple(_adopted(proposal) for proposal in fit.critic),
        used=tuple(
            _spans(recording, spans) for recording, spans in zip(recordings, fit.used, strict=True)
        ),
    )


def _with_noise(recording: Recording, share: float, number: int) -> Recording:
    samples = recording.samples.copy()
    force = np.asarray(samples["motor_torque"], dtype=np.float64)
    moving = force[np.asarray(samples["stroke"]) >= 0]
    size = share * float(np.sqrt(np.mean(moving**2))) if len(moving) else 0.0
    samples["motor_torque"] += size * np.random.default_rng(number).standard_normal(len(samples))
    return replace(recording, samples=samples)


def _scoped(verdict: Verdict) -> Verdict:
    return replace(verdict.of("fit.friction-advance"), why=_renamed(verdict.why))


def _adopted(proposal: Proposal) -> Proposal:
    words: dict[str, Any] = {
        name: _renamed(getattr(proposal, name)) for name in ("adopted_by", "sentence")
    }
    return replace(proposal, **words)


def _renamed(text: str) -> str:
    """A sentence of a friction fit, with the keys of the sledge's table in the recipe."""
    return text.replace("fit.friction.", "fit.friction_advance.")


def _spans(recording: Recording, spans: Integers) -> Integers:
    """Spans of the samples with motors on as spans of all samples; none reaches over a gap."""
    places = np.flatnonzero(driven(recording))
    if len(spans) == 0:
        return spans
    return np.stack([places[spans[:, 0]], places[spans[:, 1] - 1] + 1], axis=1)


def _tick_s(recording: Recording) -> float:
    return float(np.median(np.diff(recording.device_time_s)))
