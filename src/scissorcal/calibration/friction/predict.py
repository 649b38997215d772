"""Predictions of a friction fit for new motion, with a band calibrated on hold-out data."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.friction.layout import LawChoice
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.search import search_from
from scissorcal.calibration.friction.transmission import LoadSolver, two_ended
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.weak_form import Windows, weigh
from scissorcal.calibration.signals.zeros import DriveZero, without_zeros
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import terms_of
from scissorcal.recording.recording import Recording

Unit = Literal["stroke", "recording"]


@dataclass(frozen=True)
class Band:
    """Half-width of a band about a prediction, and what it promises.

    A sample, taken at random from a new ``unit`` that is drawn as the ``count`` hold-out ones were,
    lies within ``moving`` of its prediction with probability ``level``; ``resting`` is the same
    where the direction of motion is not certain, None where nothing is predicted there. A new
    stroke is one of the fit's own recordings, or of one like them; ``new_recording`` is the
    half-width (moving) where the whole recording is new, by what ``recordings`` differ in, and None
    where there is one. Half-widths are in the effort's unit. ``calibrated`` says whether the errors
    on hold-out units alone give the width; else too few were held out, and their errors are also
    taken for normal.
    """

    level: float
    unit: Unit
    count: int
    moving: float
    resting: float | None
    calibrated: bool
    recordings: int = 1
    new_recording: float | None = None

    @property
    def sentence(self) -> str:
        """What the band promises, in one sentence."""
        ground = f"its width is from the errors on {self.count} hold-out {self.unit}s"
        if not self.calibrated:
            ground += ", widened by Student's t because these are few"
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
        judged = np.isfinite(self.low) & np.isfinite(self.measured)
        inside = (self.measured >= self.low) & (self.measured <= self.high)
        return float(np.mean(inside[judged])) if np.any(judged) else float("nan")

    @property
    def rms_error(self) -> float:
        """Root mean square of predicted minus measured, where the joint moves; NaN for none."""
        judged = self.moving & np.isfinite(self.measured)
        error = (self.predicted - self.measured)[judged]
        return float(np.sqrt(np.mean(error**2))) if len(error) else float("nan")


def effort_band(design: FrictionExperiment, fit: FitResult, level: float = 0.9) -> Band:
    """Calibrate the band of a friction fit's effort on what the law had not seen.

    ``design`` is the fit's own (:func:`scissorcal.calibration.friction.model`). Whole strokes are
    left out one at a time, or whole recordings where there are enough of them; the law is fitted to
    the others and its errors taken on the one left out. Raises InputError where there is one stroke
    only.
    """
    folds = _Folds.of(design, fit)
    return _band(
        folds,
        design.strokes,
        design.bins,
        lambda point: design.observed - design.mean(point),
        level,
        folds.freedom(),
    )


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
    solver = LoadSolver(fit, windows)
    assert windows.load is not None
    measured = windows.average(windows.load)
    folds = _Folds.of(design, fit)
    return _band(
        folds,
        _carried(design, windows),
        windows.bins,
        lambda point: solver(design.layout.natural(point)) - measured,
        level,
        float(len(folds.recordings)),
    )


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
    choice = LawChoice.of(fit.structure)
    basis = FrictionBasis(
        windows,
        float(fit.structure["angle_center"]),
        terms_of(choice.name, choice.adopt),
        cogging=choice.cogging,
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

    ``errors`` and ``units`` (n,). Each of the K units has the same mass, shared evenly by its
    samples. The half-width is the quantile of absolute errors at

        level (1 + rho / K),  rho = mean over units of (c_k - level)^2 / (level (1 - level)),

    where c_k is the share of a unit's samples within the quantile at ``level``. Where all units are
    alike, rho is 0: their samples are as many trials. Where each is held as a whole or not at all,
    rho is 1, and the quantile is that of conformal prediction, which holds for exchangeable units
    whatever their distribution (Dunn, Wasserman and Ramdas 2023,
    doi:10.1080/01621459.2022.2060112). Where K / (K + 1) is below ``level`` no quantile of so few
    need hold it: the one at ``level`` is multiplied by that of Student's t with ``freedom`` degrees
    over the normal one, and is at least that t times the units' rms error. The second result says
    which: True for the former.
    """
    from scipy.stats import norm, t

    labels, unit, counts = np.unique(units, return_inverse=True, return_counts=True)
    size = np.abs(errors)
    order = np.argsort(size, kind="stable")
    size, unit, count = size[order], unit[order], len(labels)
    mass = 1.0 / (counts[unit] * count)
    width = _quantile(size, mass, level)
    if enough(count, level):
        held = count * np.bincount(unit, mass * (size <= width), count)
        rho = min(float(np.mean((held - level) ** 2)) / (level * (1.0 - level)), 1.0)
        return _quantile(size, mass, min(level * (1.0 + rho / count), 1.0)), True
    tail = 0.5 + 0.5 * level
    student = float(t.ppf(tail, max(freedom, 1.0)))
    rms = float(np.sqrt(np.sum(mass * size**2)))
    return max(width * student / float(norm.ppf(tail)), rms * student), False


def enough(count: int, level: float) -> bool:
    """Whether so many units can show what holds ``level`` of the next one.

    >>> enough(9, 0.9), enough(8, 0.9)
    (True, False)
    """
    return count / (count + 1) >= level - 1e-12


def _quantile(ascending: Array, mass: Array, level: float) -> float:
    place = int(np.searchsorted(np.cumsum(mass), level - 1e-9))
    return float(ascending[min(place, len(ascending) - 1)])


def _band(
    folds: "_Folds",
    strokes: Integers,
    bins: Bins,
    errors: Callable[[Array], Array],
    level: float,
    freedom: float,
) -> Band:
    """The band of windows with these ``strokes`` (n,) and ``bins``; ``errors`` (n,) are by a point.

    Strokes are the units until recordings are enough; ``freedom`` is that of the recordings' mean
    squared error.
    """
    recordings, moving = bins.recording, bins.moving
    left_out = np.full(len(moving), np.nan)
    whole = np.full(len(moving), np.nan)
    labels, several = folds.strokes, folds.recordings
    for label in labels:
        here = strokes == label
        left_out[here] = errors(folds.without(np.array([label])))[here]
    for label in several if len(several) > 1 else ():
        here = recordings == label
        whole[here] = errors(folds.without(folds.of_recording(label)))[here]
    by_recording = len(several) > 1 and enough(len(several), level)
    index, found = (recordings, whole) if by_recording else (strokes, left_out)
    count = len(several) if by_recording else len(labels)
    known = np.isfinite(found)
    sure, still = known & moving, known & ~moving
    width, calibrated = half_width(found[sure], index[sure], level, float(count))
    resting = None
    if still.any():
        resting = max(width, half_width(found[still], index[still], level, float(count))[0])
    new = None
    if len(several) > 1:
        there = np.isfinite(whole) & moving
        new = half_width(whole[there], recordings[there], level, freedom)[0]
    unit: Unit = "recording" if by_recording else "stroke"
    return Band(level, unit, count, width, resting, calibrated, len(several), new)


@dataclass(frozen=True)
class _Folds:
    """A law without some of its ``strokes`` (k,), or one of its ``recordings`` (r,), at a time."""

    design: FrictionExperiment
    point: Array
    strokes: Integers
    recordings: Integers

    @classmethod
    def of(cls, design: FrictionExperiment, fit: FitResult) -> "_Folds":
        normal = replace(design, tails=np.inf)
        strokes, recordings = np.unique(design.strokes), np.unique(design.bins.recording)
        if len(strokes) < 2:
            raise InputError(
                "A band needs hold-out strokes, and there is only one stroke: record several "
                "strokes, or two recordings, and fit again."
            )
        return cls(normal, design.layout.unconstrained(fit.best), strokes, recordings)

    def of_recording(self, label: int) -> Integers:
        """The strokes of one recording."""
        return np.unique(self.design.strokes[self.design.bins.recording == label])

    def freedom(self) -> float:
        """Degrees of freedom of a recording's mean squared error (doi:10.2307/3002019).

        What a recording's own fit leaves varies from stroke to stroke; only by how much the others'
        fit is off beyond it does the recording count as one (Satterthwaite).
        """
        if len(self.recordings) < 2:
            return 1.0
        shift, residual = 0.0, 0.0
        for label in self.recordings:
            here = self.design.bins.recording == label
            strokes = self.of_recording(label)
            by_itself = self.design.mean(self.without(np.setdiff1d(self.strokes, strokes)))
            shift += float(
                np.mean((by_itself - self.design.mean(self.without(strokes)))[here] ** 2)
            )
            residual += float(np.mean((self.design.observed - by_itself)[here] ** 2))
        count = len(self.recordings)
        return (shift + residual) ** 2 / (shift**2 / count + residual**2 / len(self.strokes))

    def without(self, left_out: Integers) -> Array:
        """The optimum (p,) without some strokes."""
        candidate = self.design.candidate(self.design.observed)
        assert candidate.reduced is not None
        problem = candidate.problem(self.design.series)
        others = replace(problem, reduced=candidate.reduced.without(left_out))
        return search_from(others, self.point)[0].point


def _values(fit: FitResult) -> dict[str, Array]:
    """The fit's best point by name, nuisance parameters at their means."""
    return {name: np.asarray(value) for name, value in fit.best.items()}


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
