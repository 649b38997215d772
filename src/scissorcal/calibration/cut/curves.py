"""What the report shows of a cut: response, force along the edge, work of fracture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.known import KnownFriction
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.structure import cutting_from, fitted_cutting, some_draws
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, MissingError
from scissorcal.model import Cutting, cut_torque_along, edge_height, mean_share
from scissorcal.recording.recording import Recording

POINTS = 60
SUPPORT = (0.01, 0.99)
BEYOND = 1.25
"""The curve runs to this many times the deepest indentation that data reach."""


@dataclass(frozen=True)
class OtherResponse:
    """The response (N) of another candidate at its best point, over the curve's indentations.

    ``force`` is None where the fit keeps no values of it. ``equivalent`` candidates do not differ
    from the chosen one in these data.
    """

    name: str
    equivalent: bool
    force: Array | None


@dataclass(frozen=True)
class ResponseCurve:
    """Force (N) over ``indentation`` (m), both (k,): posterior mean with 5 and 95 %.

    Data reach from ``support_low`` to ``support_high`` (m; the inner 98 % of pressed samples).
    ``data_indentation`` and ``data_force`` (n,) are the measured samples.
    """

    support_low: float
    support_high: float
    indentation: Array
    force: Array
    low: Array
    high: Array
    data_indentation: Array
    data_force: Array
    others: tuple[OtherResponse, ...]

    @property
    def half_width(self) -> float | None:
        """Half of the 90 % band over the force (median) where data press."""
        x = self.indentation
        known = (x >= self.support_low) & (x <= self.support_high) & (self.force > 0)
        if not known.any():
            return None
        return float(np.median(0.5 * (self.high - self.low)[known] / self.force[known]))


def response_curve(fit: FitResult) -> ResponseCurve:
    """The response with its band and its data. Raises MissingError with the reason for none."""
    cutting = fitted_cutting(fit)
    drawn = fitted_cutting(fit, some_draws(fit)[:, None, :]) if cutting is not None else None
    if cutting is None or drawn is None or len(fit.series.opening) == 0:
        raise MissingError("The fit holds no usable numbers to draw a response from.")
    indentation, measured = _at_edge(fit, cutting)
    pressed = indentation[indentation > 0]
    if len(pressed) < 3:
        raise MissingError("No sample pressed on the material, so its response is not known.")
    low, high = np.quantile(pressed, SUPPORT)
    x = np.linspace(0.0, BEYOND * float(high), POINTS)
    force = drawn.response.force_at(x[None, :])
    band = np.quantile(force, [0.05, 0.95], axis=0)
    others = tuple(
        OtherResponse(
            str(candidate["name"]), bool(candidate.get("equivalent")), _force_of(candidate, fit, x)
        )
        for candidate in fit.candidates
        if not candidate.get("chosen")
    )
    return ResponseCurve(
        float(low), float(high), x, force.mean(axis=0), band[0], band[1], indentation, measured,
        others,
    )  # fmt: skip


def _at_edge(fit: FitResult, cutting: Cutting) -> tuple[Array, Array]:
    """Indentation at the model's crack tip (m), and measured torque as force at the edge (N)."""
    series = fit.series
    view = edge_height(cutting.edge, series.contact, series.opening / cutting.moving_blades)
    taper = cutting.edge.slope_at(view.station)
    lever = view.lever if cutting.closure == "work" else series.contact / np.sqrt(1 + taper**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.asarray(series.measured / lever)
    return np.asarray(cutting.upper_face_m - view.height), force


def _force_of(candidate: Mapping[str, Any], fit: FitResult, x: Array) -> Array | None:
    """A candidate's response, where the fit kept the values that it ended at."""
    values, key = candidate.get("values"), candidate.get("key")
    if not isinstance(values, Mapping) or not isinstance(key, Mapping):
        return None
    named = {str(name): np.asarray(value) for name, value in values.items()}
    try:
        cutting = cutting_from({**fit.structure, **key}, named)
    except KeyError:
        return None
    return np.asarray(cutting.response.force_at(x))


MOST_PLACES = 12
SHORTEST_M = 2e-3
"""Shortest stretch of the edge that is judged alone."""
LARGE_SHARE = 0.1
"""Samples whose torque is below this share of the largest say little about the edge."""
FEWEST_SAMPLES = 5
FEWEST_STROKES = 3
FALSE_ALARM = 0.05
NOTICED = 0.07
"""A change of force that people just notice (Jones 2000, Kinesthetic sensing)."""


@dataclass(frozen=True)
class EdgePlace:
    """Measured over modelled force on one stretch of the edge, stations from the pivot in m.

    ``ratio`` is the mean over ``strokes`` strokes. ``low`` and ``high`` bound it for all places at
    once with 95 % probability; None with fewer than three strokes.
    """

    station_low: float
    station_high: float
    ratio: float
    low: float | None
    high: float | None
    strokes: int
    samples: int

    @property
    def differs(self) -> bool:
        """Whether the interval leaves out 1."""
        if self.low is None or self.high is None:
            return False
        return self.low > 1.0 or self.high < 1.0


def force_along_edge(fit: FitResult, strokes: Sequence[Integers]) -> tuple[EdgePlace, ...]:
    """Ratio of measured to modelled force by place along the edge, from the pivot outwards.

    At one place torque and force differ by the same lever on both sides, so the ratio of torques
    is one of forces. ``strokes`` are the places of each stroke in the fit's series. Strokes are
    independent, samples are not: intervals come from the spread over strokes (Student's t,
    Bonferroni over the places). Raises MissingError with the reason where nothing can be said.
    """
    cutting = fitted_cutting(fit)
    if cutting is None or not strokes:
        raise MissingError("Only a fit of the cut with its strokes shows the force along the edge.")
    series = fit.series
    largest = float(np.nanmax(np.abs(series.predicted), initial=0.0))
    view = edge_height(cutting.edge, series.contact, series.opening / cutting.moving_blades)
    kept = np.isfinite(series.measured) & (series.predicted >= LARGE_SHARE * largest)
    kept &= (largest > 0) & (view.station > 0) & (view.station < cutting.edge.length_m)
    if int(np.sum(kept)) < FEWEST_SAMPLES:
        raise MissingError("No stroke pressed hard enough on the material to judge the edge.")
    low, high = float(view.station[kept].min()), float(view.station[kept].max())
    count = max(1, min(MOST_PLACES, int((high - low) / SHORTEST_M)))
    stretches = []
    for first, last in pairwise(np.linspace(low, high, count + 1)):
        here = kept & (view.station >= first) & (view.station <= last)
        stretches.append((float(first), float(last), *_ratios(fit, strokes, here)))
    tests = max(1, sum(len(ratios) >= FEWEST_STROKES for _, _, ratios, _ in stretches))
    return tuple(_place(*stretch, tests) for stretch in stretches if len(stretch[2]))


def _ratios(
    fit: FitResult, strokes: Sequence[Integers], here: NDArray[np.bool_]
) -> tuple[Array, int]:
    """The ratio of each stroke that has enough samples in a place, and how many those are."""
    ratios, samples = [], 0
    for stroke in strokes:
        at = stroke[here[stroke]]
        if len(at) >= FEWEST_SAMPLES:
            ratios.append(fit.series.measured[at].sum() / fit.series.predicted[at].sum())
            samples += len(at)
    return np.array(ratios), samples


def _place(first: float, last: float, ratios: Array, samples: int, tests: int) -> EdgePlace:
    mean, count = float(ratios.mean()), len(ratios)
    if count < FEWEST_STROKES:
        return EdgePlace(first, last, mean, None, None, count, samples)
    from scipy.special import stdtrit

    error = float(ratios.std(ddof=1) / np.sqrt(count))
    reach = float(stdtrit(count - 1, 1.0 - 0.5 * FALSE_ALARM / tests)) * error
    return EdgePlace(first, last, mean, mean - reach, mean + reach, count, samples)


SHORTEST_CUT_M = 2e-3
"""Strokes that cut less than this have no work that can be measured."""
MOVED_SHARE = 0.05
DRAWS = 100
SURE_SD = 3.0


@dataclass(frozen=True)
class StrokeWork:
    """One stroke's balance, in J and m.

    ``total`` is the work of the torque less friction and inertia, ``stored`` what of it the
    material still holds at the end more than at the beginning, ``fracture`` the rest with its
    standard deviation ``sd`` (level of friction, noise of the drive). ``expected`` is J_c h times
    ``length``, less what a ripple does not take, with 5 and 95 %. ``pivot_moved`` says that the
    pivot moved along the cut meanwhile, whose work was not measured.
    """

    stroke: int
    length: float
    total: float
    stored: float
    fracture: float
    sd: float
    expected: float
    expected_low: float
    expected_high: float
    pivot_moved: bool

    @property
    def differs(self) -> bool:
        """Whether measured and expected work differ surely and by more than a hand notices."""
        away = abs(self.fracture - self.expected)
        return away > SURE_SD * self.sd and away > NOTICED * self.expected


def fracture_work(
    fit: FitResult,
    friction: FitResult | None,
    recordings: Sequence[Recording],
    strokes: Sequence[int],
) -> tuple[StrokeWork, ...]:
    """Balance each of ``strokes`` (labels of the fit) over all of its samples, those at rest too.

    Recordings are matched to the fit by content hash. Raises MissingError with the reason where
    there is no balance, InputError where no motion has material in place.
    """
    cutting = fitted_cutting(fit)
    if friction is None or cutting is None:
        raise MissingError("The work needs fits of friction and of the cut: `scissorcal fit`.")
    if cutting.fracture_energy is None:
        raise MissingError("Nothing is cut in this scene, so there is no fracture work.")
    hashes = [source.rpartition(" sha256:")[2] for source in fit.sources]
    known = {
        recording.content_hash: recording for recording in recordings if recording.content_hash
    }
    chosen = tuple(known[digest] for digest in hashes if digest in known)
    if not chosen or len(chosen) < len(hashes):
        raise MissingError(
            "The work is computed from the recordings, which this report was made without: run "
            "`scissorcal report` in their workspace."
        )
    balance = _Balance(fit, friction, cutting, _path_of(chosen, friction, cutting))
    kept = [balance.of(label) for label in strokes if label >= 0]
    rows = tuple(row for row in kept if row is not None)
    if not rows:
        raise MissingError("No stroke cut the material.")
    return rows


@dataclass(frozen=True)
class _Path:
    """Samples of all motions with material in place, (n,) each, in order of time.

    ``spent`` (J) is what the blades put into the material from the sample before to this one,
    ``cut`` (m) by how much the crack grew meanwhile; both are 0 at the first sample of a motion.
    """

    opening: Array
    advance: Array
    stroke: Integers
    tip: Array
    spent: Array
    cut: Array
    tick_s: float


class _Balance:
    """Energies of a cut's strokes, from the work between openings."""

    def __init__(self, fit: FitResult, friction: FitResult, cutting: Cutting, path: _Path) -> None:
        self.path, self.cutting = path, cutting
        self.known = KnownFriction.of(friction)
        self.drawn = fitted_cutting(fit, some_draws(fit, DRAWS)[:, None, :])
        contact = path.tip - path.advance
        view = edge_height(cutting.edge, contact, path.opening / cutting.moving_blades)
        self.slope = view.slope
        self.stored = cutting.moving_blades * cutting.response.energy_at(
            cutting.upper_face_m - view.height
        )

    def of(self, label: int) -> StrokeWork | None:
        """The balance of one stroke; None where it did not cut."""
        path = self.path
        at = np.flatnonzero(path.stroke == label)
        if len(at) < 2:
            return None
        moved = path.cut[at[1:]]
        length = float(moved.sum())
        if length < SHORTEST_CUT_M:
            return None
        work = float(path.spent[at[1:]].sum())
        stored = float(self.stored[at[-1]] - self.stored[at[0]])
        expected = self._expected(at, moved) * length
        low, high = np.quantile(expected, [0.05, 0.95])
        span = float(path.advance[at].max() - path.advance[at].min())
        return StrokeWork(
            label, length, work, stored, work - stored, self._sd(at), float(expected.mean()),
            float(low), float(high), span > MOVED_SHARE * length,
        )  # fmt: skip

    def _sd(self, at: Integers) -> float:
        """Standard deviation (J): friction's level, what strokes differ by, the drive's noise."""
        gone = float(np.abs(np.diff(self.path.opening[at])).sum())
        noise = self.known.noise.variance_of_mean(len(at), self.path.tick_s)
        return gone * float(np.sqrt(self.known.closing_sd**2 + self.known.stroke_sd**2 + noise))

    def _expected(self, at: Integers, moved: Array) -> Array:
        """Energy that a metre of cut takes on average, by draws (k,), in J/m."""
        assert self.drawn is not None
        energy = np.asarray(self.drawn.fracture_energy)
        weight = moved / moved.sum()
        slope = float(np.sum(weight * self.slope[at[1:]]))
        peak = energy / (self.drawn.moving_blades * max(slope, 1e-9))
        return np.ravel(energy * mean_share(self.drawn, peak))


def _path_of(recordings: tuple[Recording, ...], friction: FitResult, cutting: Cutting) -> _Path:
    """Follow the crack and the material's work through all motions, sheet by sheet."""
    known = KnownFriction.of(friction)
    cracks: dict[tuple[int, int], float] = {}
    rows = []
    motions = path_motion(recordings, known.inertia)
    for motion in motions:
        work = known.material(motion).work
        for run in _runs(motion.sheet):
            sheet = (motion.recording, int(motion.sheet[run.start]))
            if sheet[1] < 0:
                continue
            opening, advance = motion.opening[run], motion.advance[run]
            _, tip = cut_torque_along(cutting, opening, advance, cracks.get(sheet, 0.0))
            cracks[sheet] = float(tip[-1])
            spent, cut = np.diff(work[run], prepend=work[run][:1]), np.diff(tip, prepend=tip[:1])
            rows.append((opening, advance, motion.stroke[run], tip, -spent, cut))
    if not rows:
        raise InputError("No stroke of these recordings has material in place.")
    columns = (np.concatenate(column) for column in zip(*rows, strict=True))
    opening, advance, stroke, tip, spent, cut = columns
    return _Path(opening, advance, stroke, tip, spent, cut, motions[0].tick_s)


def _runs(sheet: Integers) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(sheet)) + 1).tolist(), len(sheet)]
    return [slice(a, b) for a, b in pairwise(ends) if b > a]
