"""The simplest law that other programs take: Coulomb and viscous friction, and what it leaves."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.model import TERMS, FrictionLaw, friction_torque, presliding_state


@dataclass(frozen=True)
class SimpleLaw:
    """``coulomb`` sgn(w) + ``viscous`` w + ``offset``, closest to the fit over the log's motion.

    ``rms`` and ``worst`` are what it leaves of the fit's friction there (rms, and at 99 % of the
    windows), ``measured_rms`` what it leaves of the measured effort, in the effort's unit.
    ``offset`` is 0 where the target has no constant effort.
    """

    coulomb: float
    viscous: float
    offset: float
    rms: float
    worst: float
    measured_rms: float


def full_friction(fit: FitResult) -> Array:
    """Friction and offset by the fit's best point at each window of its series, (n,).

    With what builds up after reversals, along the windows of each recording.
    """
    values, series = fit.best, fit.series
    law = law_of(fit)
    state = None
    if "presliding_length" in values:
        state = np.zeros(len(series.opening))
        for label in np.unique(series.recording):
            here = series.recording == label
            state[here] = presliding_state(series.opening[here], values["presliding_length"])
    friction = friction_torque(law, series.opening, series.opening_rate, 0.0, state)
    return np.asarray(friction + values.get("offset", 0.0))


def stateless_friction(fit: FitResult) -> Array:
    """As `full_friction`, fully built up at once and without added terms, (n,)."""
    series, law = fit.series, law_of(fit)
    plain = FrictionLaw(
        {name: value for name, value in law.values.items() if name not in TERMS}, law.angle_center
    )
    friction = friction_torque(plain, series.opening, series.opening_rate)
    return np.asarray(friction + fit.best.get("offset", 0.0))


def law_of(fit: FitResult) -> FrictionLaw:
    """The fit's friction law at its best point."""
    center = fit.structure.get("angle_center")
    middle = float(center) if center is not None else float(np.median(fit.series.opening))
    return FrictionLaw.of_fit(fit.best, middle)


def simple_law(fit: FitResult, *, constant: bool) -> SimpleLaw:
    """The closest law of a target that has Coulomb and viscous friction alone.

    ``constant`` says that it has a constant effort as well. Neither level may be negative.
    """
    from scipy.optimize import lsq_linear

    wanted, rate = full_friction(fit), fit.series.opening_rate
    columns = [np.sign(rate), rate, *([np.ones_like(rate)] if constant else [])]
    scale = np.array([max(float(np.sqrt(np.mean(column**2))), 1e-300) for column in columns])
    lowest = [0.0, 0.0, *([-np.inf] if constant else [])]
    design = np.column_stack(columns) / scale
    solved = lsq_linear(design, wanted, bounds=(lowest, np.full(len(columns), np.inf))).x
    left = wanted - design @ solved
    levels = [*(solved / scale).tolist(), 0.0]
    return SimpleLaw(
        coulomb=levels[0],
        viscous=levels[1],
        offset=levels[2],
        rms=float(np.sqrt(np.mean(left**2))),
        worst=float(np.quantile(np.abs(left), 0.99)),
        measured_rms=float(
            np.sqrt(np.mean((left + fit.series.measured - fit.series.predicted) ** 2))
        ),
    )
