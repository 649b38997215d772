"""An edge through points, as one spline: the rule by which drawn blades become a curve."""

from dataclasses import replace
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.bspline import FEWEST, spline_design
from scissorcal.model.edge import Edge

FEWEST_POINTS, MOST_POINTS = 3, 200
MOST_PIECES = 16
WANTED_MISFIT_M = 5e-6
"""Of a sheet of paper, whose indentation is some 0.1 mm, 9 um cost 2 % of the torque, 4 um 1 %."""

LARGEST_MISFIT_M = 2e-5
SMOOTHING = 1e-3
"""Weight of each third difference of the spline's weights against one point."""

STEEPEST = np.tan(np.radians(80.0))


def edge_through(points_m: ArrayLike) -> tuple[Edge, float]:
    """The spline edge through points (n, 2) of station and offset, and its largest misfit (m).

    Knots are even from the first station to the last, which is the blade's length. The weights are
    least squares over the points, with ``SMOOTHING`` on their third differences, which leaves
    parabolas as they are. Of 1 to 16 pieces the fewest are taken that leave no point by more than
    0.005 mm, else those that leave them least; n points have n - 3 at most, as with more weights
    than points the misfit would say nothing. Raises ValueError, a sentence, where it is more than
    0.02 mm, or the edge is steeper than 80 deg, up or down.

    >>> edge, misfit = edge_through([[0.0, -0.008], [0.03, -0.007], [0.07, -0.005]])
    >>> len(edge.spline_m), bool(misfit < 1e-8)
    (4, True)
    """
    points = np.asarray(points_m, dtype=np.float64)
    _refuse_unfit(points)
    station, offset = points.T
    start, end = float(station[0]), float(station[-1])
    found: list[tuple[Edge, float]] = []
    most = min(MOST_PIECES, max(1, len(points) - FEWEST + 1))
    for pieces in range(1, most + 1):
        weights = _weights(station, offset, pieces + FEWEST - 1)
        edge = Edge("spline", 0.0, 0.0, end, spline_m=tuple(weights.tolist()), spline_start_m=start)
        found.append((edge, float(np.max(np.abs(edge.offset_at(station) - offset)))))
        if found[-1][1] <= WANTED_MISFIT_M:
            break
    edge, misfit = min(found, key=itemgetter(1))
    if not misfit <= LARGEST_MISFIT_M:
        raise ValueError(
            f"a smooth edge of up to {most} pieces leaves the points by {misfit * 1e3:.3g} mm, "
            f"more than {LARGEST_MISFIT_M * 1e3:g} mm: smooth corners, notches and short waves "
            "out, or give more points where it bends"
        )
    falling = replace(edge, spline_m=tuple(-weight for weight in edge.spline_m))
    if max(float(edge.steepest), float(falling.steepest)) > STEEPEST:
        raise ValueError("the edge is steeper than 80 deg on the blade: check its points")
    return edge, misfit


def _refuse_unfit(points: Array) -> None:
    """ValueError, a sentence, for points that are no edge from the pivot to a tip beyond it."""
    if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
        raise ValueError(
            f"an edge needs {FEWEST_POINTS} to {MOST_POINTS} points, and these are {len(points)}"
        )
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError("points of an edge are pairs [station, offset]")
    if not np.all(np.isfinite(points)):
        raise ValueError("points of an edge must be finite numbers")
    if np.any(np.diff(points[:, 0]) <= 0.0):
        raise ValueError("stations of an edge's points must rise strictly, from pivot to tip")
    if points[0, 0] > 0.0 or points[-1, 0] <= 0.0:
        raise ValueError("an edge's first station must be 0 (the pivot) or less, its last above 0")


def _weights(station: Array, offset: Array, count: int) -> Array:
    """Least squares of the points, with third differences held small."""
    design = spline_design(count, float(station[0]), float(station[-1]), station)
    smooth = SMOOTHING * np.diff(np.eye(count), n=FEWEST - 1, axis=0)
    rows = np.vstack([design, smooth])
    wanted = np.concatenate([offset, np.zeros(len(smooth))])
    return np.asarray(np.linalg.lstsq(rows, wanted, rcond=None)[0])
