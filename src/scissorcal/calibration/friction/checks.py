"""Verdicts on a friction law: physical levels, a search that moved, no effect of the cutoff."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.parameters import Layout
from scissorcal.model.friction_terms import NUISANCE, PARAMETERS, side_of
from scissorcal.verdicts import Verdict, judge

Array = NDArray[np.float64]

SCOPE = "fit.friction"
CERTAIN = 3.0
"""Standard deviations by which a level must be negative to be called so."""
MOVED_LIMIT = 4.0
"""Posterior standard deviations by which a parameter may change with the cutoff."""
UNMOVED = 1e-9
NOTHING = 0.02
"""Share of the drive's standard deviation below which Stribeck friction counts as absent."""


def physical_verdict(experiment: FrictionExperiment, point: Array, share: float) -> Verdict:
    """Judge whether an unconstrained fit has a negative level, which no joint has.

    Levels are fitted by their logarithms, so data that call for a negative one leave it near zero
    without a sign of trouble. One step of least squares from the optimum ``point`` (p,), without
    that constraint and without priors, shows it. Laws without viscous friction get it for this
    step. ``share`` is the share of bins that are independent.
    """
    values = {name: float(value) for name, value in experiment.layout.natural(point).items()}
    rows = _rated(experiment, values)
    found = [level for row in rows for level in _freed(experiment, row, share)]
    negative = sorted(level for level in found if level.sds_below > CERTAIN)
    good = "No friction level is negative in an unconstrained fit, and the inertia is not."
    worst = {level.name: level for level in negative}.values()
    listed = ", ".join(f"{one.name} = {one.value:.2g} (sd {one.sd:.1g})" for one in worst)
    remedies = "; ".join(dict.fromkeys(one.remedy for one in worst))
    bad = f"An unconstrained fit gives {listed}, and no joint has a negative level: {remedies}."
    value = max((one.sds_below for one in worst), default=0.0)
    return judge(SCOPE, "physical", value, CERTAIN, good, bad)


def start_verdict(experiment: FrictionExperiment, point: Array) -> Verdict:
    """Judge whether the search moved every parameter from where it began.

    What is left of the sensors' zeros is known from idle seconds: data in motion need not move it.
    """
    layout, starts = experiment.layout, experiment.candidate(experiment.observed).starts
    apart = np.abs(starts - point) / layout.sd
    judged = [not parameter.believed for parameter in layout.parameters]
    names = [name for name, own in zip(layout.names, judged, strict=True) if own]
    least = apart.min(axis=0)[judged]
    stuck = [name for name, far in zip(names, least, strict=True) if far < UNMOVED]
    value = float(least.min())
    bad = (
        f"The search did not move {', '.join(stuck)}, so the data hold no information on it: "
        "record motion that depends on it, or choose a law without it."
    )
    good = "Every parameter moved from where the search began."
    return judge(SCOPE, "start", value, UNMOVED, good, bad)


def bandwidth_verdict(
    layout: Layout, draws: Array, here: Array, there: Array, cutoffs_Hz: tuple[float, float]
) -> Verdict:
    """Judge whether the estimate depends on the cutoff.

    ``here`` and ``there`` (p,) are the optima at both cutoffs, ``draws`` (k, p) the posterior at
    the first, all unconstrained. An error that both share cancels; the rest is the filter's, and
    must be small against the posterior's width. Nuisance parameters (delay, noise, cogging) are not
    judged: nothing of them is rendered.
    """
    moved = np.abs(there - here) / draws.std(axis=0, ddof=1)
    judged = [i for i, name in enumerate(layout.names) if name not in NUISANCE]
    worst = max(judged, key=lambda i: moved[i])
    value, name = float(moved[worst]), layout.names[worst]
    why = (
        f"From windows of {cutoffs_Hz[0]:.3g} Hz to {cutoffs_Hz[1]:.3g} Hz {name} changes by "
        f"{value:.1f} standard deviations, the largest change."
    )
    remedy = (
        " Its interval is too narrow: the motion is uneven at frequencies that the encoder does "
        "not resolve, or the law lacks a term there. Record steadier sweeps or use a finer "
        "encoder, and compare other cutoffs."
    )
    return judge(SCOPE, "bandwidth", value, MOVED_LIMIT, why, why + remedy)


@dataclass(frozen=True, order=True)
class _Level:
    """A level in an unconstrained fit: sorted, the most negative comes last."""

    sds_below: float
    name: str
    value: float
    sd: float

    @property
    def remedy(self) -> str:
        """What to do where the level is negative, empty for what may be so."""
        row = side_of(self.name, PARAMETERS)
        return PARAMETERS[row].remedy if row is not None else ""


def _rated(experiment: FrictionExperiment, values: dict[str, float]) -> list[dict[str, float]]:
    """Points to start the step from: the optimum, and several Stribeck speeds if that has none.

    Where data call for a negative Stribeck level, the fit ends with a level near zero at any speed,
    or with a speed below all that were recorded.
    """
    rows = [values]
    level = values.get("stribeck", 0.0)
    if level <= 0.0:
        return rows
    felt = level * float(np.sqrt(np.mean(_slope(experiment, values, "stribeck") ** 2)))
    if felt < NOTHING * float(np.std(experiment.observed)):
        slow = experiment.slow_rate
        rows += [{**values, "stribeck_rate": factor * slow} for factor in (0.3, 1.0, 3.0)]
    return rows


def _freed(experiment: FrictionExperiment, values: dict[str, float], share: float) -> list[_Level]:
    """Levels of a free least-squares fit near a point."""
    layout = experiment.layout
    offered = []
    if side_of("viscous_pos", values) is None:
        sides = ("",) if experiment.key["symmetric"] else ("_pos", "_neg")
        offered = [f"viscous{side}" for side in sides]
    fixed = ("noise", *(one.name for one in layout.parameters if one.believed))
    names = [*(name for name in layout.names if name not in fixed), *offered]
    columns = np.stack([_slope(experiment, values, name) for name in names], axis=1)
    residuals = experiment.observed - experiment.mean_at(_arrays(values))
    size = np.sqrt(np.mean(columns**2, axis=0))
    scale = np.where(size > 0, size, np.inf)
    scaled = columns / scale
    step = np.linalg.lstsq(scaled, residuals, rcond=1e-8)[0]
    variance = float(np.var(residuals - scaled @ step)) / max(share, 1e-6)
    covariance = np.linalg.pinv(scaled.T @ scaled, rcond=1e-10, hermitian=True) * variance
    levels = []
    for name, moved, unit, sd in zip(names, step, scale, np.sqrt(np.diag(covariance)), strict=True):
        value = values.get(name, 0.0) + float(moved / unit)
        below = -value / float(sd / unit) if sd > 0 and np.isfinite(unit) else 0.0
        levels.append(_Level(below, name, value, float(sd / unit)))
    return [level for level in levels if level.remedy]


def _slope(experiment: FrictionExperiment, values: Mapping[str, float], name: str) -> Array:
    """Derivative of the expected drive (n,) by one parameter in its own unit."""
    value = values.get(name, 0.0)
    reach = 1e-3 * abs(value) if value else 1e-3
    above, below = (
        experiment.mean_at(_arrays({**values, name: value + step})) for step in (reach, -reach)
    )
    return (above - below) / (2 * reach)


def _arrays(values: Mapping[str, float]) -> dict[str, Array]:
    return {name: np.asarray(value) for name, value in values.items()}
