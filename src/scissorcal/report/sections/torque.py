"""Measured torque against the model's band: over opening by speed, over time where no speed is."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite, finite_each, short
from scissorcal.report.reduce import Array, block_means, median, rms
from scissorcal.report.strokes import BETWEEN, StrokeName, StrokeSamples, kind_word

MOST_BLOCKS = 100
FEWEST_BLOCKS = 10
ALL_BLOCKS = 6000
"""Blocks of all strokes together, so that a recording of many strokes does not swell the twin."""

SAME_SPEED = 0.05


@dataclass(frozen=True)
class StrokeCurve:
    """One stroke in 10 to 100 block means; arrays share one length, units as in the section.

    ``time_s`` runs from the stroke's first sample; ``band_low`` and ``band_high`` are 5 % and 95 %
    of the posterior of the model's mean.
    """

    name: StrokeName
    samples: int
    time_s: tuple[Number, ...]
    opening: tuple[Number, ...]
    opening_rate: tuple[Number, ...]
    measured: tuple[Number, ...]
    predicted: tuple[Number, ...]
    band_low: tuple[Number, ...]
    band_high: tuple[Number, ...]


@dataclass(frozen=True)
class TorqueGroup:
    """Strokes that are shown together, with the rms of their residuals and the band's width."""

    title: str
    against: Literal["opening", "time"]
    speed: Number
    rms: Number
    median_band_width: Number
    curves: tuple[StrokeCurve, ...]


@dataclass(frozen=True)
class TorqueSection:
    """All groups of a fit; efforts in ``effort_unit``, openings in ``position_unit``."""

    effort_unit: str
    position_unit: str
    groups: tuple[TorqueGroup, ...]


def compare_torque(fit: FitResult, strokes: Sequence[StrokeSamples]) -> TorqueSection:
    """Group strokes by speed (a cut's also by kind) and reduce them to curves."""
    grouped: dict[tuple[str, float], list[StrokeSamples]] = {}
    pace = _common_speeds([stroke.name.speed for stroke in strokes])
    for stroke in strokes:
        grouped.setdefault(_key(fit, stroke.name, pace), []).append(stroke)
    blocks = min(MOST_BLOCKS, max(FEWEST_BLOCKS, ALL_BLOCKS // max(len(strokes), 1)))
    groups = tuple(_group(fit, members, blocks) for _, members in sorted(grouped.items()))
    return TorqueSection(fit.effort_unit, fit.position_unit, groups)


def effort_word(fit: FitResult) -> str:
    """What the joint feels, in a word: torque where it turns, force where it slides."""
    return "force" if fit.effort_unit == "N" else "torque"


def position_word(fit: FitResult) -> str:
    """Where the joint is, in a word: opening where it turns, position where it slides."""
    return "position" if fit.position_unit == "m" else "opening"


def along(name: StrokeName) -> Literal["opening", "time"]:
    """A movement with a direction is shown over opening, any other over time."""
    return "time" if name.label.startswith(BETWEEN) or name.kind == "excitation" else "opening"


def _key(fit: FitResult, name: StrokeName, pace: Mapping[float, float]) -> tuple[str, float]:
    against = along(name)
    if against == "time":
        return f"z {name.anchor}", 0.0
    kind = "" if fit.what == "friction" else name.kind
    return kind, np.inf if name.speed is None else pace[name.speed]


def _common_speeds(speeds: Iterable[Number]) -> dict[float, float]:
    """Each speed with the slowest of those that are nearly the same, within ``SAME_SPEED``."""
    common: dict[float, float] = {}
    slowest = -np.inf
    for speed in sorted({speed for speed in speeds if speed is not None}):
        if speed > (1.0 + SAME_SPEED) * slowest:
            slowest = speed
        common[speed] = slowest
    return common


def _group(fit: FitResult, members: list[StrokeSamples], blocks: int) -> TorqueGroup:
    first = members[0].name
    against = along(first)
    places = np.concatenate([member.places for member in members])
    series = fit.series
    unit = fit.position_unit
    kinds = " and ".join(sorted({kind_word(member.name.kind, unit) for member in members}))
    speeds = [member.name.speed or np.nan for member in members]
    if against == "time":
        title = first.label
    elif first.speed is None:
        title = f"{kinds}, no planned speed"
    else:
        title = f"{kinds} at {short(median(np.array(speeds)))} {unit}/s"
    return TorqueGroup(
        title,
        against,
        finite(median(np.array(speeds))),
        finite(rms(series.measured[places] - series.predicted[places])),
        finite(median(series.band_high[places] - series.band_low[places])),
        tuple(_curve(fit, member, blocks) for member in members),
    )


def _curve(fit: FitResult, stroke: StrokeSamples, blocks: int) -> StrokeCurve:
    series, at = fit.series, stroke.places

    def reduced(values: Array) -> tuple[Number, ...]:
        return finite_each(block_means(values, blocks), 5)

    return StrokeCurve(
        stroke.name,
        len(at),
        reduced(series.time_s[at] - series.time_s[at[0]]),
        reduced(series.opening[at]),
        reduced(series.opening_rate[at]),
        reduced(series.measured[at]),
        reduced(series.predicted[at]),
        reduced(series.band_low[at]),
        reduced(series.band_high[at]),
    )
