"""Both blades of open scissors: measured in one plane, with the lengths against each other."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.photograph_priors import BladePriors
from scissorcal.vision.blade.borders import find_border
from scissorcal.vision.blade.measure import BladeMeasurement, measure_blade
from scissorcal.vision.blade.parts import BACK_FIRST, FIRST, BladeParts
from scissorcal.vision.blade.plain_view import PlainView
from scissorcal.vision.blade.profile import Light
from scissorcal.vision.blade.tip import BEFORE_TIP, metal_end
from scissorcal.vision.blade.view import View

SEARCH = 0.1
"""Largest distance, in blade lengths, of the outline of scissors from the metal, by shadows."""

_STEP = 1e-4


@dataclass(frozen=True)
class PairLengths:
    """The lengths of a pair's blades, in the order of its measurements, and how unlike they are.

    ``seen`` are lengths in the picture (pixels of the sheet without tilt), or on the mat.
    ``log_ratio`` is the logarithm of their ratio, ``sd`` what a pair of one length shows by its
    tips, by the real difference of a pair, and by the camera's tilt where no mat shows it.
    ``tilt_deg`` is the least tilt that would make them equal, 0 on the mat.
    """

    seen: tuple[float, float]
    log_ratio: float
    sd: float
    tilt_deg: float


def measure_pair(
    light: Light,
    view: View,
    blades: Sequence[BladeParts],
    source: str,
    priors: BladePriors,
) -> tuple[View, tuple[BladeMeasurement, ...], PairLengths]:
    """Measure both blades in one plane of one scale.

    Tips are those of the metal. Without a mat the ratio of the blades' lengths tells part of the
    camera's tilt, which has a prior: its estimate becomes the view's, its remaining covariance
    moves both edges. The length of the pair, the mean of both, is one for both blades, with the
    error of tips and pivot; a stated length is that one. Raises InputError as `measure_blade` does.
    """
    tips = [_of_metal(light, view, parts, source) for parts in blades]
    ends = [parts.points(np.array([parts.length]), np.zeros(1))[0] for parts in tips]
    pixels = view.to_pixels(np.array([tips[0].pivot, *ends]))
    sds = [parts.tip_sd / parts.length for parts in tips]
    real = 0.01 * priors.pair_length_sd_percent
    own = hypot(*sds, real)
    ratio = _log_ratio(view, pixels, view.values)
    sd, tilt = own, 0.0
    leant = view
    if isinstance(view, PlainView) and view.lean_covariance is not None:
        slope = _slope(view, pixels)
        carried = view.lean_covariance @ slope
        sd = float(np.sqrt(own**2 + slope @ carried))
        tilt = float(np.degrees(abs(ratio) / max(float(np.linalg.norm(slope[:2])), 1e-12)))
        gain = carried / sd**2
        leant = view.leaning(-gain * ratio, view.lean_covariance - np.outer(gain, carried))
        tips = [_in_view(parts, view, leant) for parts in tips]
    measured = [measure_blade(light, leant, parts, source, priors, search=SEARCH) for parts in tips]
    lengths = [one.length for one in measured]
    pair = float(np.exp(np.mean(np.log(lengths))))
    middle = float(np.linalg.norm(measured[0].parts.axis + measured[1].parts.axis)) / 2.0
    share = hypot(0.5 * hypot(*sds), 0.5 * real, tips[0].pivot_sd * middle / pair)
    sized = tuple(replace(one, unit_length=pair, unit_length_sd=share) for one in measured)
    seen = (
        (float(tips[0].length), float(tips[1].length)) if leant is view else _lengths(view, pixels)
    )
    return leant, sized, PairLengths(seen, ratio, sd, tilt)


def _of_metal(light: Light, view: View, parts: BladeParts, source: str) -> BladeParts:
    """The parts with the tip of the metal in place of the outline's, which may be a shadow's."""
    sides = [
        find_border(light, view, parts, side, first, BEFORE_TIP, source, what, SEARCH)
        for side, first, what in ((parts.edge, FIRST, "edge"), (parts.back, BACK_FIRST, "back"))
    ]
    edge, back = (view.to_sheet(side.pixels) for side in sides)
    tip = metal_end(light, view, parts, edge, back, max(side.blur_px for side in sides))
    return replace(parts, length=tip.station, tip_sd=tip.sd, end=tip.border)


def _lengths(view: View, pixels: Array, values: Array | None = None) -> tuple[float, float]:
    """Distances of both tips from the pivot; ``pixels`` (3, 2) are pivot and tips."""
    pivot, *tips = view.to_sheet(pixels, values)
    first, second = (float(np.linalg.norm(tip - pivot)) for tip in tips)
    return first, second


def _log_ratio(view: View, pixels: Array, values: Array) -> float:
    first, second = _lengths(view, pixels, values)
    return float(np.log(first / second))


def _slope(view: PlainView, pixels: Array) -> Array:
    """Derivatives (4,) of the lengths' log ratio by the tilt's components."""
    moved = view.values + _STEP * np.eye(5)[:4]
    here = _log_ratio(view, pixels, view.values)
    return np.array([_log_ratio(view, pixels, values) - here for values in moved]) / _STEP


def _in_view(parts: BladeParts, old: View, new: View) -> BladeParts:
    """The same parts in another view of the same picture."""

    def over(points: Array) -> Array:
        return new.to_sheet(old.to_pixels(points)) if len(points) else points

    ends = parts.points(np.array([0.0, parts.length, 0.0]), np.array([0.0, 0.0, parts.length]))
    pivot, tip, aside = over(ends)
    axis = (tip - pivot) / np.linalg.norm(tip - pivot)
    up = np.array([-axis[1], axis[0]])
    up *= np.sign(up @ (aside - pivot))
    size = float(np.linalg.norm(tip - pivot)) / parts.length
    return replace(
        parts,
        pivot=pivot,
        axis=axis,
        up=up,
        edge=over(parts.edge),
        back=over(parts.back),
        length=parts.length * size,
        pivot_sd=parts.pivot_sd * size,
        tip_sd=parts.tip_sd * size,
        end=None if parts.end is None else over(parts.end),
    )
