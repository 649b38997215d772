"""Verdicts on a friction law: is it one that a joint can have, and does it hold its ground."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.parameters import Layout
from scissorcal.model.friction_terms import NUISANCE, PARAMETERS, side_of
from scissorcal.verdicts import Status, Verdict

Array = NDArray[np.float64]

SCOPE = "fit.friction"
CERTAIN = 3.0
"""Standard deviations by which a level must be negative to be called so."""
MOVED_LIMIT = 4.0
"""Posterior standard deviations by which a parameter may move with the cutoff."""
UNMOVED = 1e-9
NOTHING = 0.02
"""Share of the drive's standard deviation below which Stribeck friction counts as absent."""


def physical_verdict(experiment: FrictionExperiment, point: Array, share: float) -> Verdict:
    """Judge whether the data want a level that no joint has: below zero.

    Levels are fitted by their logarithms, which cannot become negative; data that want that
    leave them at nearly nothing, in silence. One step of least squares from the optimum
    ``point`` (p,), free of that constraint and of priors, says what they want. Laws without
    viscous friction are offered it. ``share`` is the share of bins that are independent.
    """
    values = {name: float(value) for name, value in experiment.layout.natural(point).items()}
    rows = _rated(experiment, values)
    found = [level for row in rows for level in _freed(experiment, row, share)]
    negative = sorted(level for level in found if level.sds_below > CERTAIN)
    if not negative:
        why = "No level of friction, nor the inertia, would be negative if it could."
        return Verdict(SCOPE, "physical", "pass", 0.0, CERTAIN, why)
    worst = {level.name: level for level in negative}.values()
    listed = ", ".join(f"{one.name} = {one.value:.2g} (sd {one.sd:.1g})" for one in worst)
    cures = "; ".join(dict.fromkeys(one.remedy for one in worst))
    why = f"Freed from the bounds the data want {listed}, which no joint has: {cures}."
    value = max(one.sds_below for one in worst)
    return Verdict(SCOPE, "physical", "fail", value, CERTAIN, why)


def start_verdict(experiment: FrictionExperiment, point: Array) -> Verdict:
    """Judge whether the search moved every parameter from where it began."""
    layout, starts = experiment.layout, experiment.rung(experiment.observed).starts
    apart = np.abs(starts - point) / layout.sd
    stuck = [
        name for name, far in zip(layout.names, apart.min(axis=0), strict=True) if far < UNMOVED
    ]
    value = float(apart.min())
    if stuck:
        why = (
            f"{', '.join(stuck)} ended exactly where the search began, so the data do not move it: "
            "record motion that depends on it, or choose a rung without it."
        )
        return Verdict(SCOPE, "start", "fail", value, UNMOVED, why)
    why = "Every parameter moved from where the search began."
    return Verdict(SCOPE, "start", "pass", value, UNMOVED, why)


def bandwidth_verdict(
    layout: Layout, draws: Array, here: Array, there: Array, cutoffs_Hz: tuple[float, float]
) -> Verdict:
    """Judge whether the estimate would be another one at another cutoff.

    ``here`` and ``there`` (p,) are the optima at both cutoffs, ``draws`` (k, p) the posterior at
    the first, all unconstrained. An error that is shared by both cancels; what is left is what the
    filter does, and it must be small against the width that is claimed. Nuisances (delay, noise,
    cogging) are not judged: nothing of them is rendered.
    """
    moved = np.abs(there - here) / draws.std(axis=0, ddof=1)
    judged = [i for i, name in enumerate(layout.names) if name not in NUISANCE]
    worst = max(judged, key=lambda i: moved[i])
    value, name = float(moved[worst]), layout.names[worst]
    status: Status = "pass" if value <= MOVED_LIMIT else "fail"
    why = (
        f"With windows of {cutoffs_Hz[1]:.3g} Hz in the place of {cutoffs_Hz[0]:.3g}, {name} moves "
        f"by {value:.1f} of its standard deviations, more than any other parameter."
    )
    if status == "fail":
        why += (
            " So its interval does not say how uncertain it is: the joint moves unevenly faster "
            "than the encoder can follow, or the law lacks something at that speed. Record "
            "steadier sweeps, or with a finer encoder, and compare other cutoffs."
        )
    return Verdict(SCOPE, "bandwidth", status, value, MOVED_LIMIT, why)


@dataclass(frozen=True, order=True)
class _Level:
    """What the data want of a level when it is free: sorted, the worst comes last."""

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
    """Points to look from: the optimum, and without Stribeck friction several speeds of it.

    A Stribeck level that the data want negative ends at nothing and its speed anywhere, or its
    speed below all that were recorded.
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
    names = [*(name for name in layout.names if name != "noise"), *offered]
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
