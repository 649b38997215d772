"""The fits of a case, made anew: what they cost, what they predict, and how far they are apart."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Error, Quantity, Sample
from scissorcal.bench.trade.torque import (
    SceneTorque,
    band_errors,
    band_widths,
    fitted_torque,
    torque_errors,
)
from scissorcal.calibration import FitResult, fit_cut, fit_friction
from scissorcal.calibration.fit_model import CutRun

PROCESSOR, EVALUATIONS, MINUTES = "processor time", "evaluations", "capture"
MEAN, SD = "posterior mean, worst parameter", "posterior sd, worst parameter"
QUANTILES = "5 and 95 % quantiles, worst parameter"

DRAFT_NOTE = (
    "Draft effort fits one law, the one that such data usually support; standard and thorough "
    "effort compare all laws that the recipe allows."
)

SECONDS_A_SAMPLE = {"draft": 2e-5, "standard": 5e-5, "thorough": 1e-3}
"""Processor seconds that both fits take for each sample of the recordings: a first guess for the
schedule of a run with a budget, of the virtual rig on one machine. Measured times replace it."""


def expected_fits_s(case: Case) -> float:
    """Seconds that `measure_fits` is expected to take, before anything was measured."""
    samples = sum(len(one.samples) for one in (*case.friction, *case.cut))
    return 0.5 + SECONDS_A_SAMPLE[case.effort] * samples


def measure_fits(case: Case, repeat: int) -> Sample:
    """Fit friction, then the cut, as the workspace would, and evaluate what they predict.

    As from the start: draft effort knows of no law that another fit chose, and a note says what it
    fits. Raises what the fits raise.
    """
    cut, friction, costs, rejected = fit_case(case, repeat)
    notes = (DRAFT_NOTE,) if case.effort == "draft" else ()
    return Sample(costs, fits_outcome(case, cut, friction), notes, rejected)


def fit_case(
    case: Case, repeat: int
) -> tuple[FitResult | None, FitResult, dict[str, Quantity], tuple[str, ...]]:
    """Both fits of a case (no cut where there are no recordings of one), costs, failed checks."""
    before = time.process_time()
    friction = fit_friction(
        case.friction,
        case.recipe.fit.friction,
        effort=case.effort,
        rng=np.random.default_rng([case.seed, repeat, 0]),
    )
    fits = [friction]
    cut = None
    if case.cut:
        cut = fit_cut(
            case.cut,
            case.recipe,
            friction,
            effort=case.effort,
            rng=np.random.default_rng([case.seed, repeat, 1]),
            run=CutRun(edge=case.edge, edge_verdicts=case.edge_verdicts),
        )
        fits.append(cut)
    spent_s = time.process_time() - before
    evaluations = sum(int(fit.diagnostics["evaluations"]) for fit in fits)
    costs = {
        PROCESSOR: Quantity(spent_s, "s"),
        EVALUATIONS: Quantity(float(evaluations), ""),
        MINUTES: Quantity(capture_minutes(case), "min"),
    }
    rejected = dict.fromkeys(verdict.check for fit in fits for verdict in fit.rejected)
    return cut, friction, costs, tuple(rejected)


def fits_outcome(case: Case, cut: FitResult | None, friction: FitResult | None) -> dict[str, Any]:
    """What errors of fits are counted from: parameters, torque over the scene, laws."""
    fits = [fit for fit in (friction, cut) if fit is not None]
    parameters = {
        f"{fit.what} {one.name}": {"mean": one.mean, "sd": one.sd, "q05": one.q05, "q95": one.q95}
        for fit in fits
        for one in fit.parameters
    }
    return {
        "parameters": parameters,
        "laws": [f"{fit.what}: {fit.candidate}" for fit in fits],
        **fitted_torque(case, cut, friction).plain(),
    }


def fits_errors(case: Case, sample: Sample, reference: Sample) -> dict[str, Error]:
    """Errors of one pair of fits against another: of parameters, of torque, and of its band.

    Parameters are compared in standard deviations of the reference, those that both have; the
    widths of the band are of the sample alone.
    """
    found, known = SceneTorque.of(sample.outcome), SceneTorque.of(reference.outcome)
    return {
        **_parameter_errors(sample.outcome["parameters"], reference.outcome["parameters"]),
        **torque_errors(case, found.torque, known.torque),
        **band_errors(case, found, known),
        **band_widths(case, found, known),
    }


def capture_minutes(case: Case) -> float:
    """Minutes of motion in a case's recordings, without the handling of sheets between."""
    return sum(_moving_s(one.device_time_s) for one in (*case.friction, *case.cut)) / 60.0


def _moving_s(time_s: NDArray[np.float64]) -> float:
    """Length of a recording without the gaps that left-out strokes make."""
    steps = np.diff(time_s)
    return float(np.sum(steps[steps < 10.0 * np.median(steps)])) if len(steps) else 0.0


def _parameter_errors(
    found: Mapping[str, Mapping[str, float]], known: Mapping[str, Mapping[str, float]]
) -> dict[str, Error]:
    shared = [name for name in known if name in found and known[name]["sd"] > 0.0]
    if not shared:
        return {}

    def worst(*keys: str) -> float:
        away = (
            abs(found[name][key] - known[name][key]) / known[name]["sd"]
            for name in shared
            for key in keys
        )
        return max(away)

    return {
        MEAN: Error(worst("mean"), "sd"),
        SD: Error(worst("sd"), "sd"),
        QUANTILES: Error(worst("q05", "q95"), "sd"),
    }
