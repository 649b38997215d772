"""The verification as a whole: the fits that it needs, their summary and assessment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import (
    FORMAT,
    Calibration,
    CheckKind,
    Coverage,
    Halves,
    HalvesRow,
    PriorKind,
    RankedQuantity,
    Sensitivity,
    SensitivityRow,
    VerifyResult,
)
from scissorcal.calibration.verify.simulator import Simulator
from scissorcal.calibration.verify.statistics import (
    SENSITIVE,
    HalfFit,
    StrokeFacts,
    acceptance,
    chi_square_p_value,
    compare,
    diagnose,
    ecdf_band,
    ecdf_p_value,
    effort_difference,
    split_strokes,
)
from scissorcal.calibration.verify.study import (
    LEVELS,
    Record,
    Study,
    Task,
    generating_prior,
    unconstrained_draws,
)
from scissorcal.calibration.verify.verdicts import FALSE_ALARM, RANKS_SHARE, verify_verdicts
from scissorcal.inference import gradient

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
        calibration = _summarise_simulated(
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
            halves = _summarise_halves(study, by_kind["half"], rng)
    if "prior" in checks:
        broken = _broken(by_kind["whole"], "The fit could not be repeated")
        not_done += broken
        sensitivity = None if broken else _summarise_sensitivity(study, by_kind["whole"][0])
    return VerifyResult(
        format=FORMAT,
        what=fit.what,
        fit_hash=fit.inputs_hash,
        candidate=fit.candidate,
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


COVERAGE_LEVELS = (0.5, 0.9)
EFFORTS = ("draft", "standard", "thorough")
SLOPE_STEP = 1e-3
"""Step of the effort's derivatives, in standard deviations of the difference of halves."""


def _summarise_simulated(
    study: Study, records: Sequence[Record], units: Sequence[str], alpha: float
) -> Calibration | None:
    """Summarise the ranks of simulated fits; None where all of them failed.

    ``alpha`` is the probability that any calibrated quantity leaves the band, or any coverage its
    limits, divided evenly (Bonferroni).
    """
    sound = [record for record in records if "broken" not in record]
    if not sound:
        return None
    ranks = np.array([record["ranks"] for record in sound], dtype=np.float64)  # NaN for None
    truths = np.array([record["truths"] for record in sound])
    ranked = np.isfinite(ranks)
    names = study.quantities
    each = alpha / len(names)
    quantities = tuple(
        _ranked(name, unit, ranks[ranked[:, i], i].astype(np.int64), truths[ranked[:, i], i], each)
        for i, (name, unit) in enumerate(zip(names, units, strict=True))
        if ranked[:, i].any()
    )
    higher = EFFORTS.index(study.effort)
    reached = [EFFORTS.index(record["effort"]) for record in sound]
    return Calibration(
        fits=len(sound),
        levels=LEVELS,
        prior=study.generating.kind,
        spread=study.generating.spread,
        generating=study.generating.words,
        noise=study.simulator.noise,
        quantities=quantities,
        band=ecdf_band(len(sound), each),
        escalated=float(np.mean([effort > higher for effort in reached])),
        other_law=float(np.mean([record["law"] != study.law for record in sound])),
        unreliable=float(np.mean([_unreliable(record) for record in sound])),
        broken=tuple(record["broken"] for record in records if "broken" in record),
        effective=float(np.median([record["effective"] for record in sound])),
        seconds=float(np.median([record["seconds"] for record in sound])),
    )


def _summarise_halves(study: Study, records: Sequence[Record], rng: np.random.Generator) -> Halves:
    """Compare the two halves' fits, in their parameters and their predicted effort."""
    experiment, layout = study.experiment, study.experiment.layout
    assert study.split is not None
    first, second = (
        HalfFit(
            np.array(r["mean"]), np.array(r["covariance"]) + _scatter(study, half), r["independent"]
        )
        for half, r in enumerate(records)
    )
    prior = experiment.candidate(experiment.observed).prior_precision
    found = compare(first, second, prior)
    centre = 0.5 * (first.mean + second.mean)
    step = SLOPE_STEP * np.sqrt(np.diag(first.covariance + second.covariance))
    slopes = gradient(experiment.mean, centre, step)
    difference, expected, probability = effort_difference(found, slopes, rng)
    size = float(np.sqrt(np.mean(experiment.observed**2)))
    return Halves(
        split=study.split.words,
        first_strokes=_labels(experiment.strokes[study.split.first]),
        second_strokes=_labels(experiment.strokes[study.split.second]),
        rows=tuple(
            _halves_row(layout, i, first, second, found.covariance, found.z) for i in study.wanted
        ),
        statistic=_finite(found.statistic),
        dimensions=found.dimensions,
        independent=found.independent,
        p_value=_finite(found.p_value),
        effort_difference=difference / size,
        effort_expected=expected / size,
        effort_p_value=_finite(probability) if found.dimensions else None,
    )


def _scatter(study: Study, half: int) -> Array:
    """Covariance (p, p) of a half's mean over recordings, where the fit includes them."""
    assert study.split is not None
    p = len(study.experiment.layout.names)
    if study.between is None or study.split.recordings is None:
        return np.zeros((p, p))
    return np.diag(study.between) / study.split.recordings[half]


def _summarise_sensitivity(study: Study, record: Record) -> Sensitivity:
    """Name what the posterior owes to its prior."""
    rows = tuple(
        SensitivityRow(name, prior, likelihood, diagnose(prior, likelihood))
        for name, prior, likelihood in zip(
            study.quantities, record["prior"], record["likelihood"], strict=True
        )
    )
    return Sensitivity(SENSITIVE, rows)


def _ranked(
    name: str, unit: str, ranks: NDArray[np.int64], truths: Array, alpha: float
) -> RankedQuantity:
    from scipy.stats import norm

    scores = norm.ppf((ranks + 0.5) / LEVELS)
    chi = chi_square_p_value(ranks, LEVELS)
    return RankedQuantity(
        name=name,
        unit=unit,
        ranks=tuple(ranks.tolist()),
        truths=tuple(truths.tolist()),
        ecdf_p=ecdf_p_value(ranks, LEVELS),
        chi_square_p=_finite(chi),
        width=float(np.sqrt(np.mean((scores - scores.mean()) ** 2))),
        shift=float(scores.mean()),
        coverage=tuple(_coverage(ranks, level, alpha) for level in COVERAGE_LEVELS),
    )


def _coverage(ranks: NDArray[np.int64], level: float, alpha: float) -> Coverage:
    outside = LEVELS * (1 - level) / 2
    inside = (ranks >= outside) & (ranks < LEVELS - outside)
    low, high = acceptance(len(ranks), level, alpha / len(COVERAGE_LEVELS))
    return Coverage(level, float(inside.mean()), low, high)


def _unreliable(record: Record) -> bool:
    return not (record["trusted"] and record["settled"])


def _halves_row(
    layout: Layout, i: int, first: HalfFit, second: HalfFit, covariance: Array, z: Array
) -> HalvesRow:
    parameter = layout.parameters[i]
    natural = parameter.transform.natural
    low, high = (float(natural(half.mean[i])) for half in (first, second))
    middle, reach = 0.5 * (first.mean[i] + second.mean[i]), 0.5 * np.sqrt(covariance[i, i])
    sd = float(natural(middle + reach) - natural(middle - reach))
    return HalvesRow(parameter.name, parameter.unit, low, high, sd, _finite(z[i]))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _labels(strokes: NDArray[np.int64]) -> tuple[int, ...]:
    return tuple(int(label) for label in np.unique(strokes))
