"""Summaries of the tasks' records: calibration, difference of halves, sensitivity."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.verify.halves import HalfFit, compare, effort_difference
from scissorcal.calibration.verify.prior_sensitivity import SENSITIVE, diagnose
from scissorcal.calibration.verify.rank_tests import (
    acceptance,
    chi_square_p_value,
    ecdf_band,
    ecdf_p_value,
)
from scissorcal.calibration.verify.result import (
    Calibration,
    Coverage,
    Halves,
    HalvesRow,
    RankedQuantity,
    Sensitivity,
    SensitivityRow,
)
from scissorcal.calibration.verify.study import LEVELS, Record, Study
from scissorcal.inference import gradient

COVERAGE_LEVELS = (0.5, 0.9)
RUNGS = ("draft", "standard", "thorough")
SLOPE_STEP = 1e-3
"""Step of the effort's derivatives, in standard deviations of the difference of halves."""


def summarise_simulated(
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
    higher = RUNGS.index(study.effort)
    reached = [RUNGS.index(record["effort"]) for record in sound]
    return Calibration(
        fits=len(sound),
        levels=LEVELS,
        prior=study.generating.kind,
        spread=study.generating.spread,
        generating=study.generating.words,
        noise=study.simulator.noise,
        quantities=quantities,
        band=ecdf_band(len(sound), each),
        escalated=float(np.mean([rung > higher for rung in reached])),
        other_law=float(np.mean([record["law"] != study.law for record in sound])),
        unreliable=float(np.mean([_unreliable(record) for record in sound])),
        broken=tuple(record["broken"] for record in records if "broken" in record),
        effective=float(np.median([record["effective"] for record in sound])),
        seconds=float(np.median([record["seconds"] for record in sound])),
    )


def summarise_halves(study: Study, records: Sequence[Record], rng: np.random.Generator) -> Halves:
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


def summarise_sensitivity(study: Study, record: Record) -> Sensitivity:
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
