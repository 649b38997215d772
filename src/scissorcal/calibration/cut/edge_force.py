"""Force along the blade: where along the edge the pair cuts harder or lighter than the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.cut.structure import fitted_cutting
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.model import edge_height

Places = NDArray[np.int64]

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


def force_along_edge(fit: FitResult, strokes: Sequence[Places]) -> tuple[EdgePlace, ...]:
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
    found = []
    for first, last in pairwise(np.linspace(low, high, count + 1)):
        here = kept & (view.station >= first) & (view.station <= last)
        found.append((float(first), float(last), *_ratios(fit, strokes, here)))
    tests = max(1, sum(len(ratios) >= FEWEST_STROKES for _, _, ratios, _ in found))
    return tuple(_place(*one, tests) for one in found if len(one[2]))


def _ratios(
    fit: FitResult, strokes: Sequence[Places], here: NDArray[np.bool_]
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
