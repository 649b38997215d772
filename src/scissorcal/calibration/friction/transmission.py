"""Two-ended tools: the load at the jaws from torque and angle at the drive, by a friction law."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.weak_form import Windows, weigh
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import needs_load, terms_of
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]

BAND_DRAWS = 100
CREEP = 1e-9
"""Rate (rad/s) that stands for rest: the direction of friction stays, and no more than that."""


@dataclass(frozen=True)
class LoadPrediction:
    """Load at the passive end, predicted without having been measured: all arrays (n,).

    ``predicted`` is by the fit's best point, ``low`` and ``high`` are 5 % and 95 % of its draws,
    parameters' uncertainty alone: a measured load lies outside far more often, and
    :func:`scissorcal.calibration.friction.predict.load_band` says how far. ``measured`` is what the
    second sensor says. ``moving`` marks where the direction of motion is certain. Efforts in the
    joint's unit, positive as handle_radius * handle_force is.
    """

    time_s: Array
    recording: NDArray[np.int64]
    opening: Array
    moving: NDArray[np.bool_]
    measured: Array
    predicted: Array
    low: Array
    high: Array

    def rms_error(self, where: NDArray[np.bool_] | None = None) -> float:
        """Root mean square of predicted minus measured, over all times or those of a mask (n,)."""
        error = self.predicted - self.measured
        return float(np.sqrt(np.mean((error if where is None else error[where]) ** 2)))


def predict_load(
    fit: FitResult, recordings: tuple[Recording, ...], cutoff_Hz: float
) -> LoadPrediction:
    """Predict the load at the passive end of a two-ended tool from its driven end.

    The recordings' ``motor_torque`` T is that of the driven end, ``handle_radius`` times
    ``handle_force`` the load L. The law of ``fit`` says

        T - L = inertia * acceleration + offset + F0 + (load_gain + z A load_share sgn(L)) L

    with F0 the friction of the unloaded joint, z its direction and A its factor of place (see
    :class:`scissorcal.model.FrictionLaw`), so that L follows from T in closed form. At rest
    friction keeps the direction in which it was built up; where a recording begins, that is not
    known, and the first way of ``presliding_length`` is a guess. Raises InputError for a law
    without load, or recordings without both ends.
    """
    windows = two_ended(fit, recordings, cutoff_Hz)
    assert windows.load is not None
    solver = LoadSolver(fit, windows)
    names = [parameter.name for parameter in fit.parameters]
    every_other = max(1, len(fit.draws) // BAND_DRAWS)
    band = np.stack(
        [solver(dict(zip(names, row, strict=True))) for row in fit.draws[::every_other]]
    )
    low, high = np.quantile(band, [0.05, 0.95], axis=0)
    bins = windows.bins
    return LoadPrediction(
        time_s=bins.time_s,
        recording=bins.recording,
        opening=bins.opening,
        moving=bins.moving,
        measured=windows.average(windows.load),
        predicted=solver(dict(zip(names, fit.map_point, strict=True))),
        low=low,
        high=high,
    )


def two_ended(fit: FitResult, recordings: tuple[Recording, ...], cutoff_Hz: float) -> Windows:
    """Weigh recordings of both ends, at rest with friction as it was built up.

    Raises InputError as :func:`predict_load` does.
    """
    if not needs_load(str(fit.structure["law"])):
        raise InputError(
            f'The law "{fit.rung}" knows no load: fit one that does (fit.friction.rung with '
            '"+load") to recordings of both ends.'
        )
    every = weigh(recordings, cutoff_Hz)
    if every.load is None:
        sources = ", ".join(recording.source or "the recording" for recording in recordings)
        raise InputError(f"{sources}: there is no second end (handle_force and handle_radius).")
    return _resting_as_built_up(every)


class LoadSolver:
    """Solves a law for the load: linear in it on either side of zero."""

    def __init__(self, fit: FitResult, windows: Windows) -> None:
        terms = terms_of(str(fit.structure["law"]), tuple(fit.structure.get("adopt", ())))
        center = float(fit.structure["angle_center"])
        assert windows.load is not None
        self.bins = windows.bins
        self.driven = windows.bins.drive + windows.average(windows.load)
        self.bases = [
            FrictionBasis(replace(windows, load=np.full_like(windows.rate, load)), center, terms)
            for load in (-1.0, 0.0, 1.0)
        ]

    def __call__(self, values: dict[str, Array]) -> Array:
        """Load (n,) that goes with the driven end's torque."""
        pulled, empty, pushed = (basis(values) for basis in self.bases)
        inert = values["inertia"] * self.bins.acceleration + values.get("offset", np.asarray(0.0))
        left = self.driven - inert - empty
        return np.asarray(
            np.where(left >= 0, left / (1.0 + pushed - empty), left / (1.0 + empty - pulled))
        )


def _resting_as_built_up(windows: Windows) -> Windows:
    """Let the rate creep in the last certain direction where its own sign is not certain."""
    certain = np.abs(windows.rate) > windows.bins.rate_floor
    index = np.maximum.accumulate(np.where(certain, np.arange(len(certain)), 0))
    direction = np.sign(windows.rate[index])
    rate = np.where(np.sign(windows.rate) == direction, windows.rate, CREEP * direction)
    return replace(windows, rate=rate)
