"""Edge points made ready for a fit: nicks taken out, the rest averaged over short cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.edge.result import FoundNick
from scissorcal.errors import InputError
from scissorcal.model.bspline import FEWEST, spline_design
from scissorcal.vision.blade.measure import BladeMeasurement

Flags = NDArray[np.bool_]

MOST_CELLS = 160
"""Cells over all photographs, so that a fit of many takes no longer than one of few."""

CELLS_OF_ONE = 110

_WEIGHTS = 14
_ROUNDS = 30
_FAR_OFF = 5.0
_SHALLOWEST_M, _SHALLOWEST_SHARE = 15e-6, 2e-4
_SHORTEST_SHARE = 0.002
_FEWEST_POINTS = 3
_SOFTEST = 1.45
"""A notch's border is as sharp as the edge's; a glare's is softer."""


@dataclass(frozen=True)
class EdgeCells:
    """One photograph's edge in cells: ``station``, ``offset`` and the noise's ``sd``, all (n,).

    ``modes`` (n, k) are the measurement's, averaged alike. ``nicks`` were left out, and so was the
    share ``spoilt`` of the points, which lies outward or belongs to no nick.
    """

    source: str
    station: Array
    offset: Array
    sd: Array
    modes: Array
    mode_names: tuple[str, ...]
    nicks: tuple[FoundNick, ...]
    spoilt: float


def edge_cells(measured: BladeMeasurement, cells: int) -> EdgeCells:
    """Take nicks and stray points out of a measured edge, and average the rest.

    A flexible curve is fitted with Tukey's weights; stretches that lie beyond five robust standard
    deviations of it are left out with their neighbourhood. Inward they are nicks. What has no
    scale comes in blade lengths. Raises InputError where too few points are left of a photograph
    that is coarse or hardly shows the blade: fewer than the flexible curve has weights, or fewer
    cells than a cubic has coefficients.
    """
    points = len(measured.station)
    if points < _WEIGHTS or not measured.station[-1] > measured.station[0]:
        raise InputError(_too_few(measured, f"{points} points", f"{_WEIGHTS} points"))
    off = _away_from_smooth(measured)
    spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    limit = max(_FAR_OFF * spread, _SHALLOWEST_M if measured.metric else _SHALLOWEST_SHARE)
    stretches = _stretches(off, limit, spread)
    keep = np.ones(len(off), dtype=bool)
    nicks = []
    for start, stop in stretches:
        keep[start:stop] = False
        found = _nick(measured, off, start, stop, limit)
        if found is not None:
            nicks.append(found)
    in_nicks = sum(int(np.sum(_covers(measured.station, nick))) for nick in nicks)
    spoilt = max(float(np.sum(~keep)) - in_nicks, 0.0) / len(keep)
    return _averaged(measured, keep, max(cells, 12), tuple(nicks), spoilt)


def cells_each(photographs: int) -> int:
    """Cells per photograph that keep a joint fit small."""
    return int(np.clip(MOST_CELLS // max(photographs, 1), 24, CELLS_OF_ONE))


def merged_nicks(photographs: Sequence[EdgeCells]) -> tuple[FoundNick, ...]:
    """Nicks as all photographs show them: one row each, those of one place averaged."""
    every = sorted((n for cells in photographs for n in cells.nicks), key=lambda n: n.station_m)
    groups: list[list[FoundNick]] = []
    for nick in every:
        last = groups[-1][-1] if groups else None
        near = last is not None and nick.station_m - last.station_m < 0.5 * (
            nick.width_m + last.width_m
        )
        if near:
            groups[-1].append(nick)
        else:
            groups.append([nick])
    return tuple(
        FoundNick(
            float(np.mean([n.station_m for n in group])),
            float(np.mean([n.width_m for n in group])),
            float(np.mean([n.depth_m for n in group])),
            ", ".join(dict.fromkeys(n.source for n in group)),
        )
        for group in groups
    )


def _away_from_smooth(measured: BladeMeasurement) -> Array:
    """Residual (n,) about a flexible curve that nicks do not draw."""
    s, e = measured.station, measured.offset
    design = spline_design(_WEIGHTS, float(s[0]), float(s[-1]), s)
    stiff = np.diff(np.eye(_WEIGHTS), 2, axis=0)
    weight = np.ones_like(s)
    off = np.zeros_like(s)
    for _ in range(_ROUNDS):
        weighted = design * weight[:, None]
        load = weighted.T @ design + 1e-3 * len(s) / _WEIGHTS * stiff.T @ stiff
        solved = np.linalg.solve(load + 1e-12 * np.eye(_WEIGHTS), weighted.T @ e)
        off = e - design @ solved
        spread = 1.4826 * float(np.median(np.abs(off - np.median(off)))) + 1e-30
        weight = np.maximum(1.0 - np.minimum(np.abs(off) / (4.7 * spread), 1.0) ** 2, 0.0) ** 2
    return np.asarray(off)


def _stretches(off: Array, limit: float, spread: float) -> list[tuple[int, int]]:
    """Index ranges beyond the limit, grown to where the residual is back within two spreads."""
    far = np.abs(off) > limit
    out = []
    index = 0
    while index < len(far):
        if not far[index]:
            index += 1
            continue
        start = stop = index
        while start > 0 and abs(off[start - 1]) > 2.0 * spread:
            start -= 1
        while stop < len(far) and (far[stop] or abs(off[stop]) > 2.0 * spread):
            stop += 1
        out.append((max(start - 2, 0), min(stop + 2, len(far))))
        index = stop + 1
    return out


def _too_few(measured: BladeMeasurement, found: str, needed: str) -> str:
    return (
        f"{measured.source}: only {found} of the blade's edge could be measured, and a fit needs "
        f"{needed}: leave this photograph out, or take it again from nearer or with more pixels."
    )


def _nick(
    measured: BladeMeasurement, off: Array, start: int, stop: int, limit: float
) -> FoundNick | None:
    part = off[start:stop]
    depth = float(part.max())
    inside = np.flatnonzero(part > 0.15 * depth)
    if depth < limit or -part.min() > 0.7 * depth or len(inside) < _FEWEST_POINTS:
        return None
    deep = measured.softness[start:stop][part > 0.3 * depth]
    if float(np.median(deep)) > _SOFTEST:
        return None
    stations = measured.station[start:stop]
    low, high = float(stations[inside[0]]), float(stations[inside[-1]])
    if high - low < _SHORTEST_SHARE * measured.length:
        return None
    # a notch's rounded ends are as wide again as the blur; what is seen above 15 % is its width
    weight = np.maximum(part[inside], 0.0)
    middle = float(np.sum(weight * stations[inside]) / np.sum(weight))
    return FoundNick(middle, high - low, depth, measured.source)


def _covers(station: Array, nick: FoundNick) -> Flags:
    return np.asarray(np.abs(station - nick.station_m) < 0.75 * nick.width_m)


def _averaged(
    measured: BladeMeasurement, keep: Flags, cells: int, nicks: tuple[FoundNick, ...], spoilt: float
) -> EdgeCells:
    s = measured.station[keep]
    borders = np.linspace(measured.station[0], measured.station[-1], cells + 1)
    index = np.clip(np.digitize(s, borders) - 1, 0, cells - 1)
    weight = 1.0 / np.maximum(measured.sd[keep], 1e-12) ** 2
    total = np.bincount(index, weight, cells)
    filled = np.bincount(index, minlength=cells) >= 2
    if filled.sum() < FEWEST:
        raise InputError(
            _too_few(measured, f"{filled.sum()} stretches without nicks", f"{FEWEST} of them")
        )

    def mean(values: Array) -> Array:
        return np.bincount(index, weight * values, cells)[filled] / total[filled]

    modes = measured.modes[keep]
    return EdgeCells(
        measured.source,
        mean(s),
        mean(measured.offset[keep]),
        1.0 / np.sqrt(total[filled]),
        np.stack([mean(modes[:, k]) for k in range(modes.shape[1])], axis=1),
        measured.mode_names,
        nicks,
        spoilt,
    )
