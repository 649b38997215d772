"""Predictions of a friction fit for new motion, with a band calibrated on hold-out data."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.search import search_from
from scissorcal.calibration.friction.transmission import LoadSolver, two_ended
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.weak_form import Windows, weigh
from scissorcal.calibration.signals.zeros import DriveZero, without_zeros
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import terms_of
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

Unit = Literal["stroke", "recording"]


@dataclass(frozen=True)
class Band:
    """Half-width of a band about a prediction, and what it promises.

    A sample, taken at random from a new ``unit`` that is drawn as the ``count`` hold-out ones were,
    lies within ``moving`` of its prediction with probability ``level``; ``resting`` is the same
    where the direction of motion is not certain, None where nothing is predicted there. Half-widths
    are in the effort's unit. ``conformal`` says whether the promise rests on exchangeable units
    alone; else it also takes their errors for normal, since too few were held out.
    """

    level: float
    unit: Unit
    count: int
    moving: float
    resting: float | None
    conformal: bool

    @property
    def sentence(self) -> str:
        """What the band promises, in one sentence."""
        ground = (
            f"its width is from the errors on {self.count} hold-out {self.unit}s"
            if self.conformal
            else f"its width is from the errors on {self.count} hold-out {self.unit}s, widened by "
            "Student's t because these are few"
        )
        return (
            f"{self.level:.0%} of the samples of a new {self.unit}, recorded like those of the "
            f"fit, lie in the band: {ground}."
        )


@dataclass(frozen=True)
class Prediction:
    """Predicted effort at every window: all arrays (n,), efforts in the joint's unit.

    ``low`` and ``high`` are NaN where nothing is promised. ``measured`` is NaN where nothing was
    measured. ``moving`` marks windows in which the direction of motion is certain.
    """

    time_s: Array
    recording: Integers
    opening: Array
    rate: Array
    moving: Mask
    measured: Array
    predicted: Array
    low: Array
    high: Array

    @property
    def share_inside(self) -> float:
        """Share of measured samples within the band, over those that it promises; NaN for none."""
        told = np.isfinite(self.low) & np.isfinite(self.measured)
        inside = (self.measured >= self.low) & (self.measured <= self.high)
        return float(np.mean(inside[told])) if np.any(told) else float("nan")

    @property
    def rms_error(self) -> float:
        """Root mean square of predicted minus measured, where the joint moves; NaN for none."""
        told = self.moving & np.isfinite(self.measured)
        error = (self.predicted - self.measured)[told]
        return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def effort_band(design: FrictionExperiment, fit: FitResult, level: float = 0.9) -> Band:
    """Calibrate the band of a friction fit's effort on what the law had not seen.

    ``design`` is the fit's own (:func:`scissorcal.calibration.friction.model`). Whole
    recordings are left out one at a time where there are two or more, else whole strokes; the law
    is fitted to the others and its errors taken on the one left out. Raises InputError where there
    is one stroke only.
    """
    folds = _Folds.of(design, fit)
    errors = np.full(len(design.observed), np.nan)
    for label in folds.labels:
        here = folds.index == label
        errors[here] = (design.observed - design.mean(folds.without(label)))[here]
    width, conformal = half_width(errors, folds.index, level, folds.freedom())
    return Band(level, folds.unit, len(folds.labels), width, None, conformal)


def load_band(
    design: FrictionExperiment,
    fit: FitResult,
    recordings: tuple[Recording, ...],
    cutoff_Hz: float,
    level: float = 0.9,
) -> Band:
    """Calibrate the band of the load at a transmission's far end, as :func:`effort_band` does.

    ``recordings`` are the fit's own. Windows at rest belong to the stroke before them, and have a
    separate half-width.
    """
    windows = two_ended(fit, recordings, cutoff_Hz)
    folds, solver = _Folds.of(design, fit), LoadSolver(fit, windows)
    assert windows.load is not None
    measured, moving = windows.average(windows.load), windows.bins.moving
    index = windows.bins.recording if folds.unit == "recording" else _carried(design, windows)
    errors = np.full(len(measured), np.nan)
    for label in folds.labels:
        here = index == label
        errors[here] = (solver(design.layout.natural(folds.without(label))) - measured)[here]
    known = np.isfinite(errors)
    freedom = float(len(folds.labels))
    width, conformal = half_width(errors[known & moving], index[known & moving], level, freedom)
    still = known & ~moving
    resting = half_width(errors[still], index[still], level, freedom)[0] if still.any() else width
    return Band(level, folds.unit, len(folds.labels), width, max(resting, width), conformal)


def predict_effort(
    fit: FitResult, band: Band, recordings: tuple[Recording, ...], cutoff_Hz: float
) -> Prediction:
    """Predict the drive effort of recordings of empty motion from their motion alone.

    Effort = inertia * acceleration + friction + offset, by the fit's best point, weighed over
    windows as the fit's data were; what was measured is only compared. Recordings without any
    effort (all zero) have ``measured`` NaN. At rest friction may be anything up to its level: no
    band is given there.
    """
    known = DriveZero.from_dict(fit.diagnostics)
    cleaned = recordings if known is None else without_zeros(recordings, known.sd, known)[0]
    windows = weigh(cleaned, cutoff_Hz)
    bins = windows.bins
    adopt = tuple(fit.structure.get("adopt", ()))
    basis = FrictionBasis(
        windows,
        float(fit.structure["angle_center"]),
        terms_of(str(fit.structure["law"]), adopt),
        cogging=float(fit.structure.get("cogging_periods_per_turn", 0.0)),
    )
    values = _values(fit)
    values.pop("delay", None)
    predicted = basis.drive(values)
    silent = [i for i, one in enumerate(recordings) if not np.any(one.drive_effort)]
    return _banded(
        windows, np.where(np.isin(bins.recording, silent), np.nan, bins.drive), predicted, band
    )


def predict_far_load(
    fit: FitResult, band: Band, recordings: tuple[Recording, ...], cutoff_Hz: float
) -> Prediction:
    """Predict the load at the passive end from torque and motion at the driven one.

    See :mod:`scissorcal.calibration.friction.transmission` for the law.
    """
    windows = two_ended(fit, recordings, cutoff_Hz)
    assert windows.load is not None
    predicted = LoadSolver(fit, windows)(_values(fit))
    return _banded(windows, windows.average(windows.load), predicted, band)


def half_width(errors: Array, units: Integers, level: float, freedom: float) -> tuple[float, bool]:
    """Half-width that holds a random sample of a new unit with probability ``level``.

    ``errors`` and ``units`` (n,). Every unit has a mass of 1 / (K + 1), shared evenly by its
    samples, and as much lies at infinity; the quantile of absolute errors under that mass holds for
    exchangeable units whatever their distribution (Dunn, Wasserman and Ramdas 2023,
    doi:10.1080/01621459.2022.2060112, method of pooled cumulative distributions as weighted by Lee,
    Barber and Willett, arXiv:2306.06342; for fits without the unit, Barber et al. 2021,
    doi:10.1214/20-AOS1965, if the fit hardly depends on one unit). Where K is too small for
    ``level`` the quantile of the K units is multiplied by that of Student's t with ``freedom``
    degrees over the normal one, and is at least that t times the units' rms error. The second
    result says which: True for the former.
    """
    from scipy.stats import norm, t

    labels, place, counts = np.unique(units, return_inverse=True, return_counts=True)
    size = np.abs(errors)
    order = np.argsort(size, kind="stable")
    mass = np.cumsum(1.0 / counts[place][order]) / len(labels)
    conformal = len(labels) / (len(labels) + 1) >= level - 1e-12
    wanted = level * (len(labels) + 1) / len(labels) if conformal else level
    place_of = min(int(np.searchsorted(mass, wanted - 1e-9)), len(size) - 1)
    found = float(size[order][place_of])
    if conformal:
        return found, True
    tail = 0.5 + 0.5 * level
    student = float(t.ppf(tail, max(freedom, 1.0)))
    rms = float(np.sqrt(np.mean(np.bincount(place, size**2) / counts)))
    return max(found * student / float(norm.ppf(tail)), rms * student), False


@dataclass(frozen=True)
class _Folds:
    """A law without one unit at a time; ``index`` (n,) is the unit of each moving window."""

    design: FrictionExperiment
    point: Array
    unit: Unit
    index: Integers
    labels: Integers

    @classmethod
    def of(cls, design: FrictionExperiment, fit: FitResult) -> "_Folds":
        normal = replace(design, tails=np.inf)
        recordings = np.unique(design.bins.recording)
        unit: Unit = "recording" if len(recordings) > 1 else "stroke"
        index = design.bins.recording if unit == "recording" else design.strokes
        labels = np.unique(index)
        if len(labels) < 2:
            raise InputError(
                "A band needs hold-out strokes, and there is only one stroke: record several "
                "strokes, or two recordings, and fit again."
            )
        values = {name: float(value) for name, value in _values(fit).items()}
        return cls(normal, design.layout.unconstrained(values), unit, index, labels)

    def without(self, label: int) -> Array:
        """The optimum (p,) without one unit."""
        return self._reached(np.unique(self.design.strokes[self.index == label]))

    def only(self, label: int) -> Array:
        """The optimum (p,) of one unit by itself."""
        return self._reached(np.unique(self.design.strokes[self.index != label]))

    def freedom(self) -> float:
        """Degrees of freedom of the mean squared error (Satterthwaite, doi:10.2307/3002019).

        What a recording's own fit leaves varies from stroke to stroke; only by how much the others'
        fit is off beyond it does the recording count as one.
        """
        if self.unit == "stroke":
            return float(len(self.labels))
        shift, own = 0.0, 0.0
        for label in self.labels:
            here = self.index == label
            by_itself = self.design.mean(self.only(label))
            shift += float(np.mean((by_itself - self.design.mean(self.without(label)))[here] ** 2))
            own += float(np.mean((self.design.observed - by_itself)[here] ** 2))
        strokes = len(np.unique(self.design.strokes))
        return (shift + own) ** 2 / (shift**2 / len(self.labels) + own**2 / strokes)

    def _reached(self, left_out: Integers) -> Array:
        rung = self.design.candidate(self.design.observed)
        assert rung.reduced is not None
        problem = rung.problem(self.design.series)
        return search_from(
            replace(problem, reduced=rung.reduced.without(left_out)), self.point
        ).point


def _values(fit: FitResult) -> dict[str, Array]:
    """The fit's best point by name, nuisance parameters at their means."""
    values = {p.name: np.asarray(v) for p, v in zip(fit.parameters, fit.map_point, strict=True)}
    return values | {p.name: np.asarray(p.mean) for p in fit.nuisance}


def _carried(design: FrictionExperiment, windows: Windows) -> Integers:
    """Stroke of every window (n,): its own where it moves, else that of the one before it."""
    moving = windows.bins.moving
    strokes = np.full(len(moving), -1)
    strokes[moving] = design.strokes
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moving)), 0))
    return np.asarray(strokes[last])


def _banded(windows: Windows, measured: Array, predicted: Array, band: Band) -> Prediction:
    bins = windows.bins
    resting = np.nan if band.resting is None else band.resting
    width = np.where(bins.moving, band.moving, resting)
    return Prediction(
        time_s=bins.time_s,
        recording=bins.recording,
        opening=bins.opening,
        rate=bins.rate,
        moving=bins.moving,
        measured=measured,
        predicted=predicted,
        low=predicted - width,
        high=predicted + width,
    )
