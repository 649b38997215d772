"""The motion of cuts, ready for any material: bins, places where torque is asked for, rests."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_rests import Rests, find_rests
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.model import Edge, Turned, take_stance

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

REACH = 6.0
"""Blades may still press, or press again, within this many reference indentations of where the
edge crosses the sheet's upper face; further off they are in air, or surely cut."""

STEADY_M = 2e-5
"""Blades that are less than this behind where they had reached are cutting on."""


@dataclass(frozen=True)
class Nodes:
    """Openings at which torque is asked for, in order of time; all arrays (N,).

    ``bin`` is the used bin that a node belongs to, -1 for those that only move the crack on;
    ``weight`` its share of it. ``rest`` is the rest that the node comes after or belongs to, -1
    before a sheet's first one, ``leaving`` whether the blades withdraw. ``soft`` (k,) indexes the
    nodes at which the crack may still wait where it rested, or at the sheet's edge.
    """

    turned: Turned
    rate: Array
    advance: Array
    bin: Integers
    weight: Array
    rest: Integers
    leaving: NDArray[np.bool_]
    soft: Integers


@dataclass(frozen=True)
class CutMotion:
    """Bins of a cut and the history that the blades' geometry tells.

    ``bins`` (n,) are those that count, ``strokes`` (n,) their labels; ``runs`` (n,) their
    uninterrupted stretches, cut where a rest ends. ``travel_m`` (n,) is how far the edge's crossing
    moves on in a bin. ``spans`` are stretches of nodes over which the furthest place is taken anew:
    (first, end, rest that precedes it or -1). ``arrived`` (rests,) is the node at which each rest's
    furthest place was reached. ``bin_rest`` (n,) is each bin's rest.
    """

    bins: Bins
    runs: Integers
    travel_m: Array
    nodes: Nodes
    spans: tuple[tuple[int, int, int], ...]
    arrived: Integers
    bin_rest: Integers
    moving_blades: int

    @property
    def strokes(self) -> Integers:
        """Stroke of each bin (n,)."""
        return self.bins.stroke

    def binned(self, values: Array, index: Integers | None = None) -> Array:
        """Means over bins (n,) of values at nodes (N,), or at those that ``index`` selects."""
        bins, weight, n = self.nodes.bin, self.nodes.weight, len(self.bins.opening)
        if index is not None:
            summed = np.bincount(bins[index], weights=weight[index] * values, minlength=n)
            return np.asarray(summed, dtype=np.float64)
        used = self._used
        summed = np.bincount(bins[used], weights=(weight * values)[used], minlength=n)
        return np.asarray(summed, dtype=np.float64)

    @cached_property
    def _used(self) -> Integers:
        return np.flatnonzero(self.nodes.bin >= 0)


def cut_motion(
    every: Bins, edge: Edge, moving_blades: int, upper_face_m: float, reference_m: float
) -> CutMotion:
    """Take from conditioned bins what a cut needs, for an edge that is about right."""
    whole = every.where(every.sheet >= 0)
    used = whole.moving & (whole.stroke >= 0)
    slope, crossing = _crossing(edge, whole, moving_blades, upper_face_m)
    rests = find_rests(crossing, whole.sheet)
    reach = REACH * reference_m / np.maximum(slope, 1e-3)
    furthest = _furthest(crossing, whole.sheet)
    moves_on = np.where(rests.withdrawn > 0.0, 0.0, np.diff(furthest, prepend=0.0))
    record = _last_of_each(moves_on != 0.0, used)
    held = used & (rests.withdrawn < reach)
    steady = held & (rests.withdrawn < STEADY_M) & (_gone(crossing, rests) > reach)
    for kept in (rests.arrived, rests.turned):
        record[kept] = True
    count = np.where(held & ~steady, 2, np.where(held | record, 1, 0))
    nodes = _nodes(whole, used, held, count, rests, moving_blades)
    node_of = np.concatenate([[0], np.cumsum(count)])
    bin_rest = rests.of[used]
    runs = np.cumsum(~used)[used] + len(used) * whole.stroke[used]
    runs = runs * (len(rests.arrived) + 2) + bin_rest
    return CutMotion(
        bins=whole.where(used),
        runs=runs,
        travel_m=np.maximum(moves_on, 0.0)[used],
        nodes=nodes,
        spans=_spans(whole.sheet, rests, node_of),
        arrived=node_of[rests.arrived],
        bin_rest=bin_rest,
        moving_blades=moving_blades,
    )


def _crossing(edge: Edge, bins: Bins, moving_blades: int, upper_face_m: float) -> tuple[Array, ...]:
    """Slope of the edge where it crosses the sheet's upper face, and that place in the sheet."""
    stance = take_stance(edge, Turned.at(bins.opening, moving_blades))
    place = np.full(len(bins.opening), 0.5 * edge.length_m)
    far = 100.0 * edge.length_m
    for _ in range(1 if edge.straight else 50):
        view = stance.view(place)
        step = (upper_face_m - view.height) / np.maximum(view.slope, 1e-6)
        place = np.clip(place + step, -far, far)
    return stance.view(place).slope, place + bins.advance


def _furthest(crossing: Array, sheet: Integers) -> Array:
    """How far into its sheet the blades have reached so far, at every bin."""
    furthest = np.empty(len(crossing))
    for low, high in _stretches(sheet):
        furthest[low:high] = np.maximum.accumulate(np.maximum(crossing[low:high], 0.0))
    return furthest


def _last_of_each(record: NDArray[np.bool_], used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of records between two used bins only the last matters: it reaches furthest."""
    stretch = np.cumsum(used)
    index = np.flatnonzero(record & ~used)
    last = np.diff(stretch[index], append=-1) != 0
    kept = np.zeros_like(record)
    kept[index[last]] = True
    return kept


def _gone(crossing: Array, rests: Rests) -> Array:
    """How far the blades are beyond where the last rest began, or the sheet's edge."""
    begun = np.append(crossing[rests.arrived], 0.0)
    return np.asarray(crossing - begun[rests.of])


def _stretches(labels: Integers) -> list[tuple[int, int]]:
    if len(labels) == 0:
        return []
    ends = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
    return list(pairwise(ends))


def _nodes(
    whole: Bins,
    used: NDArray[np.bool_],
    held: NDArray[np.bool_],
    count: Integers,
    rests: Rests,
    moving_blades: int,
) -> Nodes:
    """One node in the middle of a bin, or the two Gauss-Legendre points of it.

    The response bends within a bin where the blades press or withdraw fast.
    """
    at = np.repeat(np.arange(len(count)), count)
    second = np.diff(at, prepend=-1) == 0
    side = np.where(count[at] == 2, np.where(second, 1.0, -1.0), 0.0)
    opening = whole.opening[at] + side * whole.rate[at] * whole.bin_s / np.sqrt(12.0)
    number = np.where(held, np.cumsum(used) - 1, -1)
    rest = rests.of[at]
    return Nodes(
        turned=Turned.at(opening, moving_blades),
        rate=whole.rate[at],
        advance=whole.advance[at],
        bin=number[at],
        weight=1.0 / count[at],
        rest=rest,
        leaving=rests.leaving[at],
        soft=np.flatnonzero(count[at] == 2),
    )


def _spans(sheet: Integers, rests: Rests, node_of: Integers) -> tuple[tuple[int, int, int], ...]:
    spans = []
    for low, high in _stretches(sheet):
        inside = [k for k, turned in enumerate(rests.turned.tolist()) if low <= turned < high]
        bounds = [low, *(int(rests.turned[k]) for k in inside), high]
        for rest, (first, end) in zip([-1, *inside], pairwise(bounds), strict=True):
            spans.append((int(node_of[first]), int(node_of[end]), rest))
    return tuple(spans)
