"""Verdicts on a friction law: physical levels, a search that moved, rates near rest, the cutoff."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.checks import SEARCH
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.parameters import Layout
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.model.friction_terms import NUISANCE, PARAMETERS, side_of
from scissorcal.model.terms import LOG
from scissorcal.verdicts import INTERVALS, Check, Verdict

MOST_STEPS = 30
LOGS = (-60.0, 60.0)
SLOWER = 2.0
"""From twice the rate that the encoder can tell, a sweep at half the speed is worth while."""
NOTHING = 0.02
"""Share of the drive's standard deviation below which friction counts as absent: a level, or what
its sign changes."""
PHYSICAL = Check(
    "fit.friction physical", "signs of levels: sds by which one is below zero", at_most=3.0
)
"""Standard deviations by which a level must be negative to be called so."""
START = Check(
    "fit.friction start", f"{SEARCH}: least way from its start, in prior sds", at_least=1e-9
)
KNOWN_NEAR_REST = Check(
    "fit.friction near rest",
    "friction at half of the slowest swept rate: half width of its interval, share of it",
    at_most=0.05,
)
"""Half width of an interval, share of friction: with as much from the rest, a recipe's tolerance of
7 % of the torque is kept."""
BANDWIDTH = Check(
    "fit.friction bandwidth", f"{INTERVALS}: sds a parameter moves with the cutoff", at_most=4.0
)
"""Posterior standard deviations by which a parameter may change with the cutoff."""


def physical_verdict(experiment: FrictionExperiment, point: Array, share: float) -> Verdict:
    """Judge whether an unconstrained fit has a negative level, which no joint has.

    Levels are fitted by their logarithms, so data that call for a negative one leave it near zero
    without a sign of trouble. One step of least squares from the optimum ``point`` (p,), without
    that constraint and without priors, suspects it. Far from the optimum such a step is none of
    the law any more, so two searches that settle decide, with free signs and without: a level is
    negative where the first explains the data better by 3 standard deviations, and asks for a
    torque that differs by NOTHING of the drive or more. Laws without viscous friction get it for
    both. ``share`` is the share of bins that are independent.
    """
    values = {name: float(value) for name, value in experiment.layout.natural(point).items()}
    rows = _rated(experiment, values)
    levels = [level for row in rows for level in _freed(experiment, row, share)]
    suspected = [level for level in levels if level.sds_below > PHYSICAL.threshold]
    settled, felt = _settled(experiment, rows, share) if suspected else ([], 0.0)
    negative = sorted(settled) if felt >= NOTHING else []
    good = "No friction level is negative in an unconstrained fit, and the inertia is not."
    if settled and not negative:
        good = (
            f"An unconstrained fit has negative levels, but its torque differs by only {felt:.1%} "
            "of the drive: any freedom explains a part of what a law lacks."
        )
    worst = {level.name: level for level in negative}.values()
    listed = ", ".join(f"{entry.name} = {entry.value:.2g} (sd {entry.sd:.1g})" for entry in worst)
    remedies = "; ".join(dict.fromkeys(entry.remedy for entry in worst))
    bad = f"An unconstrained fit gives {listed}, and no joint has a negative level: {remedies}."
    value = max((entry.sds_below for entry in worst), default=0.0)
    return PHYSICAL.judge(value, good, bad)


def start_verdict(experiment: FrictionExperiment, point: Array) -> Verdict:
    """Judge whether the search moved every parameter from where it began.

    What is left of the sensors' zeros is known from idle seconds: data in motion need not move it.
    """
    layout, starts = experiment.layout, experiment.candidate(experiment.observed).starts
    apart = np.abs(starts - point) / layout.sd
    judged = [not parameter.measured_prior for parameter in layout.parameters]
    names = [name for name, counts in zip(layout.names, judged, strict=True) if counts]
    least = apart.min(axis=0)[judged]
    stuck = [name for name, far in zip(names, least, strict=True) if far < START.threshold]
    value = float(least.min())
    bad = (
        f"The search did not move {', '.join(stuck)}, so the data hold no information on it: "
        "record motion that depends on it, or choose a law without it."
    )
    good = "Every parameter moved from where the search began."
    return START.judge(value, good, bad)


def near_rest_verdict(experiment: FrictionExperiment, draws: Array) -> Verdict:
    """Judge whether friction is known below the rates that were swept.

    There a law extrapolates: Stribeck's level and rate keep what the prior or the rig's probe says
    of them where no sweep was slow enough. ``draws`` (k, p) are the posterior's, unconstrained. A
    wide interval is no fault of the fit, so the check never fails.
    """
    slowest = experiment.bins.slowest_rate
    centre, unit = float(experiment.key["angle_center"]), f"{experiment.joint.position_unit}/s"
    named = {name: value[:, None] for name, value in experiment.layout.natural(draws).items()}
    wanted = 0.5 * slowest * np.array([-1.0, 1.0])
    levels = friction_torque(FrictionLaw.of_fit(named, centre), centre, wanted)
    low, middle, high = np.quantile(levels, [0.05, 0.5, 0.95], axis=0)
    share = float(np.max(0.5 * (high - low) / np.maximum(np.abs(middle), 1e-300)))
    said = (
        f"Friction at {0.5 * slowest:.2g} {unit}, half of the slowest rate that was swept, is "
        f"known to {share:.1%} (90 %)"
    )
    if share <= KNOWN_NEAR_REST.threshold:
        return KNOWN_NEAR_REST.judge(share, f"{said}.")
    floor = experiment.bins.rate_floor
    cure = (
        f"sweep more slowly: the encoder tells the sense of motion from {floor:.2g} {unit} on"
        if slowest > SLOWER * floor
        else f"a finer encoder or a longer tick would show slower sweeps than {floor:.2g} {unit}"
    )
    why = f"{said}. Slower friction is extrapolated, and bands are as wide; to measure it, {cure}."
    return KNOWN_NEAR_REST.not_evaluated(why, share)


def bandwidth_verdict(
    layout: Layout,
    draws: Array,
    here: Array,
    there: Array,
    cutoffs_Hz: tuple[float, float],
    encoder_shares: tuple[float, float] = (0.0, 0.0),
) -> Verdict:
    """Judge whether the estimate depends on the cutoff.

    ``here`` and ``there`` (p,) are the optima at both cutoffs, ``draws`` (k, p) the posterior at
    the first, all unconstrained. An error that both share cancels; the rest is the filter's, and
    must be small against the posterior's width. Nuisance parameters (delay, noise, cogging) are not
    judged: nothing of them is rendered. The inertia is expected to fall by what the encoder's share
    of the acceleration grows (:func:`~.choice.with_encoder_error`), give or take as much.
    """
    grown = encoder_shares[1] - encoder_shares[0]
    expected = np.array([-grown if name == "inertia" else 0.0 for name in layout.names])
    moved = np.abs(there - here - expected) / np.hypot(draws.std(axis=0, ddof=1), expected)
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
    return BANDWIDTH.judge(value, why, why + remedy)


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
    names = _names(experiment, values)
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


def _names(experiment: FrictionExperiment, values: Mapping[str, float]) -> list[str]:
    """Parameters of an unconstrained fit: what is fitted, and viscous friction in any case."""
    layout, offered = experiment.layout, []
    if side_of("viscous_pos", values) is None:
        sides = ("",) if experiment.key["symmetric"] else ("_pos", "_neg")
        offered = [f"viscous{side}" for side in sides]
    fixed = (
        "noise",
        *(parameter.name for parameter in layout.parameters if parameter.measured_prior),
    )
    return [*(name for name in layout.names if name not in fixed), *offered]


def _settled(
    experiment: FrictionExperiment, rows: list[dict[str, float]], share: float
) -> tuple[list[_Level], float]:
    """Negative levels of the best fit with free signs, and by how much its torque differs.

    The latter is a share of the drive's sd. There are none where a fit without is as good.
    """
    weights = _student_weights(experiment, rows[0])
    held, free = (
        min(
            (_searched(experiment, row, weights, free=free) for row in rows),
            key=lambda searched: searched[0],
        )
        for free in (False, True)
    )
    # Twice the gain of a likelihood whose noise is known from what the better fit leaves.
    count = share * len(experiment.observed)
    away = float(np.sqrt(max(count * np.log(held[0] / max(free[0], 1e-300)), 0.0)))
    if away <= PHYSICAL.threshold:
        return [], 0.0
    torques = [experiment.mean_at(_arrays(values)) for _, values in (held, free)]
    felt = float(np.std(torques[1] - torques[0])) / float(np.std(experiment.observed))
    below = [_Level(away, n, v, abs(v) / away) for n, v in free[1].items() if v < 0.0]
    return [level for level in below if level.remedy], felt


def _student_weights(experiment: FrictionExperiment, values: Mapping[str, float]) -> Array:
    """Square roots of the weights (n,) that the law's noise gives at its optimum ``values``."""
    residuals = experiment.observed - experiment.mean_at(_arrays(values))
    tails = experiment.tails
    if np.isinf(tails):
        return np.ones_like(residuals)
    away = residuals / values["noise"]
    return np.asarray(np.sqrt((tails + 1.0) / (tails + away**2)))


def _searched(
    experiment: FrictionExperiment, values: dict[str, float], weights: Array, *, free: bool
) -> tuple[float, dict[str, float]]:
    """Sum of squares and parameters of a least-squares fit that begins at ``values``.

    Parameters that may be negative nowhere are searched by their logarithm: Stribeck's rate,
    lengths, and levels where signs are not ``free``.
    """
    from scipy.optimize import least_squares

    names = _names(experiment, values)
    unit = float(np.std(experiment.observed))
    floor = 1e-6 * unit
    begin = {name: values.get(name, 0.0) for name in names}
    kinds = {parameter.name: parameter.transform for parameter in experiment.layout.parameters}
    logs = [name for name in names if kinds.get(name, LOG) == LOG and not (free and _signed(name))]
    begin |= {name: max(begin[name], floor) for name in logs}
    scale = {name: max(abs(begin[name]), floor) for name in names}

    def named(x: Array) -> dict[str, float]:
        point = dict(values)
        for name, at in zip(names, x, strict=True):
            point[name] = float(np.exp(np.clip(at, *LOGS)) if name in logs else at * scale[name])
        return point

    def left(x: Array) -> Array:
        return (experiment.observed - experiment.mean_at(_arrays(named(x)))) * weights / unit

    start = [np.log(begin[n]) if n in logs else begin[n] / scale[n] for n in names]
    fit = least_squares(left, np.array(start), max_nfev=MOST_STEPS)
    return 2.0 * float(fit.cost), named(fit.x)


def _signed(name: str) -> bool:
    """Whether a parameter is a level, whose sign is judged."""
    row = side_of(name, PARAMETERS)
    return row is not None and bool(PARAMETERS[row].remedy)


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
