"""What probed points and the surface through them must be: each refusal a sentence."""

import math
from collections.abc import Sequence

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.model.surface.height_field import HeightField
from scissorcal.model.surface.protocol import curvatures

FEWEST_POINTS = 25
MOST_POINTS = 20_000

LARGEST_TILT_RAD = math.radians(10.0)
"""A surface tilted by more at the origin was probed in another frame than the plate's."""

LARGEST_HEIGHT_M = 1e-3
"""So was one that is farther from the origin: the plate's frame has its origin on the surface."""

SMALLEST_RADIUS_M = 2e-3
"""A radius of curvature below this counts as a kink: contact is no longer at one point there."""

STEEPEST_RAD = math.radians(75.0)
"""Heights are no measure of a surface that is steeper."""

LARGEST_RESIDUAL = 5.0
"""Standard deviations: of 20,000 points one is farther off by chance in 1 of 90 surfaces."""

_LARGEST_M = 10.0
_APART_M = 1e-6
_HOLE = 3.0
"""Gaps between points: with points at random, the largest empty circle has a radius of 1 to 2."""


def checked_points(points: Array, noise_m: float, labels: Sequence[str]) -> Array:
    """The points (n, 3), if a height field can be fitted to them; else raises InputError."""
    if points.size == 0:
        points = points.reshape(0, 3)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"Probed points need three columns x, y, z, not the shape {points.shape}.")
    if not (math.isfinite(noise_m) and noise_m > 0.0):
        raise InputError(
            f"The noise of probed points is {noise_m * 1e3:g} mm, but must be above 0."
        )
    for label, point in zip(labels, points, strict=True):
        if not np.isfinite(point).all() or np.abs(point).max() > _LARGEST_M:
            raise InputError(
                f"{_first_up(label)}: {_mm(point)} is no probed point; its coordinates must be "
                f"finite and at most {_LARGEST_M * 1e3:g} mm."
            )
    if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
        raise InputError(
            f"There are {len(points)} probed points, but a height field needs "
            f"{FEWEST_POINTS} (5 by 5) to {MOST_POINTS}."
        )
    _refuse_line(points)
    _refuse_neighbours(points, noise_m, labels)
    _refuse_holes(points)
    return points


def point_spacing(points: Array) -> float:
    """Gap between points [m] if they were a square grid over the same area."""
    from scipy.spatial import ConvexHull

    return math.sqrt(float(ConvexHull(points[:, :2]).volume)) / (math.sqrt(len(points)) - 1.0)


def hull(points: Array) -> Array:
    """Outline (k, 3) of the points in the x-y plane: a x + b y + c <= 0 inside."""
    from scipy.spatial import ConvexHull

    equations = ConvexHull(points[:, :2]).equations.copy()
    equations[:, 2] -= 1e-9  # rounding: the outermost points are inside
    return np.asarray(equations)


def refuse_kinks(
    points: Array, residuals: Array, weights: int, noise_m: float, labels: Sequence[str]
) -> None:
    """Refuse a surface that the spline does not follow; residuals (n,) in standard deviations."""
    worst = int(np.abs(residuals).argmax())
    free = len(points) - weights
    ratio = float((residuals**2).sum()) / free
    if abs(residuals[worst]) <= LARGEST_RESIDUAL and ratio <= 1.0 + 4.0 * math.sqrt(2.0 / free):
        return
    raise InputError(
        f"{_first_up(labels[worst])}, {_mm(points[worst, :2])}: the probed point is "
        f"{abs(residuals[worst]) * noise_m * 1e3:.3g} mm from the smooth surface through all "
        f"points, with a noise of {noise_m * 1e3:.3g} mm (all points: "
        f"{math.sqrt(ratio) * noise_m * 1e3:.3g} mm rms). The "
        "surface has a kink or a step there, a probed point is wrong, or the noise is larger than "
        "stated: leave out the points beyond the kink, probe again, or state the noise."
    )


def refuse_frame(surface: HeightField) -> None:
    """Refuse a surface that does not pass nearly level through the origin."""
    level, gradient, _ = surface.at(np.zeros(3))
    tilt = math.atan(math.hypot(gradient[0], gradient[1]))
    if tilt > LARGEST_TILT_RAD:
        raise InputError(
            f"The probed surface is tilted by {math.degrees(tilt):.1f} deg at (0, 0) mm, but the "
            "plate's z axis is its normal there. Turn the points into the plate's frame: x along "
            "the cut, y to the left of it, z out of the upper face."
        )
    if abs(level) > LARGEST_HEIGHT_M:
        raise InputError(
            f"The probed surface has the height {-level * 1e3:.3f} mm at (0, 0) mm, but the "
            "plate's frame has its origin on the surface: subtract "
            f"{-level * 1e3:.3f} from all heights."
        )


def refuse_shape(surface: HeightField) -> float:
    """Smallest radius of curvature [m]; refuses slopes too steep and bends too tight."""
    places = _places(surface)
    slopes = np.linalg.norm(surface.gradient(places)[:, :2], axis=-1)
    steepest = int(slopes.argmax())
    if slopes[steepest] > math.tan(STEEPEST_RAD):
        raise InputError(
            f"The probed surface is steeper than {math.degrees(STEEPEST_RAD):g} deg at "
            f"{_mm(places[steepest, :2])}: it is no height field over the plate's x-y plane. Leave "
            "out the points on its sides."
        )
    places = _away_from_the_border(surface, places)
    bends = np.abs(curvatures(surface, places)).max(axis=-1)
    tightest = int(bends.argmax())
    radius = 1.0 / float(bends[tightest]) if bends[tightest] > 0.0 else math.inf
    if radius < SMALLEST_RADIUS_M:
        raise InputError(
            f"The probed surface bends with a radius of {radius * 1e3:.2g} mm at "
            f"{_mm(places[tightest, :2])}: below {SMALLEST_RADIUS_M * 1e3:g} mm that is a kink. "
            "Leave out the points beyond it, or state the noise of the points if it is larger."
        )
    return radius


def _places(surface: HeightField) -> Array:
    """Places on the surface (n, 3), four per interval, where points were probed."""
    axes = [
        np.linspace(start, end, 4 * count + 1)
        for (start, end), count in zip((surface.x_m, surface.y_m), surface.intervals, strict=True)
    ]
    x, y = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    places = np.stack((x, y, np.zeros_like(x)), axis=-1)
    places = places[surface.inside(places)]
    places[:, 2] = -surface.level(places)
    return places


def _away_from_the_border(surface: HeightField, places: Array) -> Array:
    """Places at least an interval within the points: at their border noise bends the spline most.

    All places where the intervals are so wide that none is left; noise bends those little.
    """
    edges = surface.outline
    if edges is None:
        return places
    depth = -(places[:, :2] @ edges[:, :2].T + edges[:, 2]).max(axis=-1)
    within = places[depth >= max(surface.interval_m)]
    return within if len(within) else places


def _refuse_line(points: Array) -> None:
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    long, short = np.linalg.svd(flat, compute_uv=False) / math.sqrt(len(points))
    if short <= max(_APART_M, 1e-3 * long):
        raise InputError(
            "The probed points lie on one line of the x-y plane: a surface needs points on both "
            "sides of it."
        )


def _refuse_neighbours(points: Array, noise_m: float, labels: Sequence[str]) -> None:
    from scipy.spatial import KDTree

    neighbours = KDTree(points[:, :2]).query(points[:, :2], k=2)
    gaps, near = np.asarray(neighbours[0]), np.asarray(neighbours[1])
    # which of two equal places comes first is not defined: take the other one
    rows = np.arange(len(points))
    other = np.where(near[:, 1] == rows, near[:, 0], near[:, 1])
    gap, rise = gaps[:, 1], np.abs(points[:, 2] - points[other, 2])
    for wrong, reason in (
        (
            rise - 6.0 * math.sqrt(2.0) * noise_m > math.tan(STEEPEST_RAD) * gap,
            "no height field has both: leave out the points on the sides of the plate and below it",
        ),
        (gap < _APART_M, "the point is repeated: keep one of the two, or their mean"),
    ):
        if wrong.any():
            worst = int(wrong.argmax())
            first, second = sorted((worst, int(other[worst])))
            raise InputError(
                f"{_first_up(labels[first])} and {labels[second]} are {gap[worst] * 1e3:.2g} mm "
                f"apart in the x-y plane at {_mm(points[first, :2])}, and their heights differ by "
                f"{rise[worst] * 1e3:.3g} mm: {reason}."
            )


def _refuse_holes(points: Array) -> None:
    from scipy.spatial import KDTree, Voronoi

    spacing, edges = point_spacing(points), hull(points)
    if edges[:, 2].max() > 2.0 * spacing:
        raise InputError(
            f"The origin of the plate's frame is {edges[:, 2].max() * 1e3:.3g} mm outside the "
            "probed points: x counts from the near edge and y from the cut. Probe there too, or "
            "move the points into the plate's frame."
        )
    places = Voronoi(points[:, :2]).vertices  # where the distance to the points is largest
    places = places[(places @ edges[:, :2].T + edges[:, 2] <= 0.0).all(axis=-1)]
    gaps = np.asarray(KDTree(points[:, :2]).query(places)[0])
    worst = int(gaps.argmax()) if len(gaps) else 0
    if len(gaps) and gaps[worst] > _HOLE * spacing:
        raise InputError(
            f"No point was probed within {gaps[worst] * 1e3:.3g} mm of {_mm(places[worst])}, where "
            f"the points are {spacing * 1e3:.2g} mm apart on average: probe this hole too."
        )


def _mm(point: Array) -> str:
    return f"({', '.join(f'{1e3 * value:.4g}' for value in point)}) mm"


def _first_up(label: str) -> str:
    return label[:1].upper() + label[1:]
