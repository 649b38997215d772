"""Verdicts on a friction law: is it one that a joint can have, and does it hold its ground."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.terms import NUISANCE, LawParts
from scissorcal.calibration.parameters import Layout
from scissorcal.verdicts import Verdict, judge

Array = NDArray[np.float64]

SCOPE = "fit.friction"
CERTAIN = 3.0
"""Standard deviations by which a level must be negative to be called so."""
MOVED_LIMIT = 4.0
"""Posterior standard deviations by which a parameter may move with the cutoff."""
UNMOVED = 1e-9
NOTHING = 0.02
"""Share of the drive's standard deviation below which Stribeck friction counts as absent."""

REMEDIES = {
    "inertia": "check the signs of the torque and of the opening, and record a quicker excitation",
    "coulomb": "the torque pushes with the motion: check its sign; or an offset larger than "
    "friction hides in an asymmetric law: set fit.friction.symmetry",
    "viscous": "friction falls with the speed: let candidates with Stribeck compete "
    '(rung = "auto"), check '
    "for a motor that compensates friction, and record faster sweeps",
    "stribeck": "static friction would be below Coulomb friction: record slower sweeps, or choose "
    "a model without Stribeck",
    "load_share": "friction would fall with the load: check the sign of the handle force",
}


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
    good = "No level of friction, nor the inertia, is negative in a fit without bounds."
    worst = {level.name: level for level in negative}.values()
    listed = ", ".join(f"{one.name} = {one.value:.2g} (sd {one.sd:.1g})" for one in worst)
    remedies = "; ".join(dict.fromkeys(REMEDIES[one.stem] for one in worst))
    bad = f"Without bounds the data give {listed}, which no joint has: {remedies}."
    value = max((one.sds_below for one in worst), default=0.0)
    return judge(SCOPE, "physical", value, CERTAIN, good, bad)


def start_verdict(experiment: FrictionExperiment, point: Array) -> Verdict:
    """Judge whether the search moved every parameter from where it began."""
    layout, starts = experiment.layout, experiment.candidate(experiment.observed).starts
    apart = np.abs(starts - point) / layout.sd
    stuck = [
        name for name, far in zip(layout.names, apart.min(axis=0), strict=True) if far < UNMOVED
    ]
    value = float(apart.min())
    bad = (
        f"{', '.join(stuck)} ended exactly where the search began, so the data do not move it: "
        "record motion that depends on it, or choose a model without it."
    )
    good = "Every parameter moved from where the search began."
    return judge(SCOPE, "start", value, UNMOVED, good, bad)


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
    why = (
        f"With windows of {cutoffs_Hz[1]:.3g} Hz instead of {cutoffs_Hz[0]:.3g} Hz, {name} moves "
        f"by {value:.1f} of its standard deviations, more than any other parameter."
    )
    remedy = (
        " So its interval does not say how uncertain it is: the joint moves unevenly faster than "
        "the encoder can follow, or the model lacks something at that speed. Record steadier "
        "sweeps, or with a finer encoder, and compare other cutoffs."
    )
    return judge(SCOPE, "bandwidth", value, MOVED_LIMIT, why, why + remedy)


@dataclass(frozen=True, order=True)
class _Level:
    """What the data want of a level when it is free: sorted, the worst comes last."""

    sds_below: float
    name: str
    value: float
    sd: float

    @property
    def stem(self) -> str:
        return self.name.removesuffix("_pos").removesuffix("_neg")


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
        names = experiment.layout.names
        slow = float(np.exp(experiment.layout.mean[names.index("stribeck_rate")]))
        rows += [{**values, "stribeck_rate": factor * slow} for factor in (0.3, 1.0, 3.0)]
    return rows


def _freed(experiment: FrictionExperiment, values: dict[str, float], share: float) -> list[_Level]:
    """Levels of a free least-squares fit near a point."""
    layout = experiment.layout
    offered = []
    if LawParts.of(str(experiment.key["law"])).base == "coulomb":
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
    return [level for level in levels if level.stem in REMEDIES]


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
