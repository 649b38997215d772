"""The trust check as a whole: the fits that it needs, and their assessment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.generating import generating_prior
from scissorcal.calibration.verify.halves import StrokeFacts, split_strokes
from scissorcal.calibration.verify.result import FORMAT, CheckKind, PriorKind, VerifyResult
from scissorcal.calibration.verify.simulator import Simulator
from scissorcal.calibration.verify.study import Record, Study, Task, unconstrained_draws
from scissorcal.calibration.verify.summary import (
    summarise_halves,
    summarise_sensitivity,
    summarise_simulated,
)
from scissorcal.calibration.verify.verdicts import FALSE_ALARM, RANKS_SHARE, verify_verdicts

FEWEST_DRAWS = 600
"""Draws of each posterior where importance weights are even; a rank takes 199 of them."""

EVEN_WEIGHTS = 0.5
"""Weights are even from this share of independent draws; below it, fits take as many draws as the
fit under test."""

_HALVES_STREAM = 11


@dataclass(frozen=True)
class StudySettings:
    """The seed of a study, and the prior that its truths are drawn from: see `generating_prior`."""

    seed: int = 0
    prior: PriorKind = "local"
    spread: float = 3.0


def make_study(
    experiment: Experiment,
    fit: FitResult,
    simulator: Simulator,
    settings: StudySettings,
    sheets: Mapping[int, int] | None = None,
) -> Study:
    """Define the simulations and the two halves for a finished fit.

    ``experiment`` is the fit's design, ``simulator`` makes raw recordings over its motion and fits
    them. ``sheets`` gives the sheet of each stroke, where there are several. Raises MissingError
    where the fit does not hold the draws it takes.
    """
    draws = unconstrained_draws(experiment, fit)
    generating = generating_prior(experiment, draws, settings.prior, settings.spread)
    return Study(
        experiment=experiment,
        simulator=simulator,
        effort=fit.effort,
        seed=settings.seed,
        generating=generating,
        start=draws.mean(axis=0),
        draws=FEWEST_DRAWS if _even(fit) else max(FEWEST_DRAWS, len(fit.draws)),
        split=split_strokes(experiment.strokes, _facts(fit, sheets or {})),
        between=_between(experiment, fit),
    )


def tasks_of(study: Study, checks: Sequence[CheckKind], fits: int) -> tuple[Task, ...]:
    """List the fits that ``checks`` need, the few decisive ones first."""
    tasks: list[Task] = []
    if "prior" in checks:
        tasks.append(Task("whole", 0))
    if "halves" in checks and study.split is not None:
        tasks += [Task("half", 0), Task("half", 1)]
    if "sbc" in checks:
        tasks += [Task("simulated", index) for index in range(fits)]
    return tuple(tasks)


def assess(
    study: Study, fit: FitResult, checks: Sequence[CheckKind], records: Sequence[Record]
) -> VerifyResult:
    """Judge a fit by the records of all tasks, in any order."""
    by_kind = {
        kind: sorted((r for r in records if r["kind"] == kind), key=lambda r: int(r["index"]))
        for kind in ("simulated", "half", "whole")
    }
    not_done: list[str] = []
    calibration = halves = sensitivity = None
    if "sbc" in checks:
        units = [fit.parameter(name).unit for name in study.quantities[:-1]]
        calibration = summarise_simulated(
            study, by_kind["simulated"], [*units, fit.effort_unit], RANKS_SHARE
        )
        if calibration is None:
            not_done += _broken(by_kind["simulated"][:1], "Every simulated fit failed")
    if "halves" in checks:
        broken = _broken(by_kind["half"], "A half could not be fitted")
        if study.split is None:
            not_done.append("Too few strokes for two halves: record more.")
        elif broken:
            not_done += broken
        else:
            rng = _stream(study.seed, _HALVES_STREAM)
            halves = summarise_halves(study, by_kind["half"], rng)
    if "prior" in checks:
        broken = _broken(by_kind["whole"], "The fit could not be repeated")
        not_done += broken
        sensitivity = None if broken else summarise_sensitivity(study, by_kind["whole"][0])
    return VerifyResult(
        format=FORMAT,
        what=fit.what,
        fit_hash=fit.inputs_hash,
        rung=fit.rung,
        effort=fit.effort,
        seed=study.seed,
        calibration=calibration,
        halves=halves,
        sensitivity=sensitivity,
        not_done=tuple(not_done),
        false_alarm=FALSE_ALARM,
        verdicts=verify_verdicts(fit.what, checks, calibration, halves, sensitivity, not_done),
    )


def _even(fit: FitResult) -> bool:
    """Whether the weights of a fit were even; those of similar fits will be too."""
    return float(fit.diagnostics["effective_samples"]) >= EVEN_WEIGHTS * len(fit.draws)


def _facts(fit: FitResult, sheets: Mapping[int, int]) -> tuple[StrokeFacts, ...]:
    labels, at = np.unique(fit.series.stroke, return_index=True)
    recordings = dict(zip(labels.tolist(), fit.series.recording[at].tolist(), strict=True))
    return tuple(
        StrokeFacts(
            error.stroke,
            error.kind,
            error.speed,
            sheets.get(error.stroke),
            recordings.get(error.stroke, 0),
        )
        for error in fit.held_out
    )


def _between(experiment: Experiment, fit: FitResult) -> Array | None:
    """Variance between recordings (p,) that the fit's draws contain; None without any."""
    found = fit.diagnostics.get("between_recordings_sd")
    if found is None:
        return None
    return np.array([float(found.get(name, 0.0)) ** 2 for name in experiment.layout.names])


def _broken(records: Sequence[Record], what: str) -> list[str]:
    return [f"{what} ({record['broken']})." for record in records if "broken" in record]


def _stream(seed: int, stream: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream,)))
