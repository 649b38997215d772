"""Which samples of a fit belong to which stroke, and the words and units of its channels."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.recording.recording import Recording, Stroke, StrokeKind
from scissorcal.report.numbers import Number, finite, short
from scissorcal.report.panel import Look

KINDS: dict[str, StrokeKind] = {
    "closing": "closing",
    "opening": "opening",
    "excitation": "excitation",
    "press": "press",
    "forward": "forward",
    "backward": "backward",
}
LOOKS: dict[str, Look] = {
    "closing": "closing",
    "opening": "opening",
    "excitation": "excitation",
    "press": "press",
    "forward": "opening",
    "backward": "closing",
}
"""Each kind of stroke has colour and mark of a name (doi:10.1038/nmeth.1618)."""
BETWEEN = "between strokes"
SAME_SPEED = 0.05

Against = Literal["opening", "time"]


@dataclass(frozen=True)
class Channels:
    """How a fit's channels are shown: an opening in degrees, what slides in metres.

    ``scale`` takes the fit's position to ``unit``; rates stay in the fit's unit, as the recipe
    has them.
    """

    position: str
    unit: str
    scale: float
    effort: str
    effort_unit: str
    rate_unit: str


def channels_of(fit: FitResult) -> Channels:
    """Words and units of a fit's channels."""
    turns = fit.position_unit != "m"
    return Channels(
        "opening" if turns else "position",
        "°" if fit.position_unit == "rad" else fit.position_unit,
        float(np.degrees(1.0)) if fit.position_unit == "rad" else 1.0,
        "force" if fit.effort_unit == "N" else "torque",
        fit.effort_unit,
        f"{fit.position_unit}/s",
    )


def look_of(kind: str) -> Look:
    """Colour and mark of a kind of stroke."""
    return LOOKS.get(kind, "orange")


@dataclass(frozen=True)
class FittedStroke:
    """A stroke of a fit, with its ``places`` in the fit's series, (n,), in order of time.

    ``anchor`` is its address on the page, ``label`` its name in words, ``recording`` the file that
    the fit names, ``stroke`` the number that the fit gives, which counts on over its recordings;
    ``speed`` is the planned rate's magnitude in the fit's position unit per second, None where the
    stroke has no planned or no single speed.
    """

    anchor: str
    label: str
    recording: str
    stroke: int
    kind: str
    speed: Number
    sheet: int
    places: NDArray[np.int64]

    @property
    def against(self) -> Against:
        """What it is shown over: a movement with a direction over opening, any other over time."""
        between = self.label.startswith(BETWEEN) or self.kind == "excitation"
        return "time" if between else "opening"


@dataclass(frozen=True)
class TorqueGroup:
    """Strokes that are shown together: all closing and opening at one speed, say."""

    title: str
    strokes: tuple[FittedStroke, ...]

    @property
    def against(self) -> Against:
        """What its strokes are shown over."""
        return self.strokes[0].against

    @property
    def places(self) -> NDArray[np.int64]:
        """Places of all its strokes in the fit's series."""
        return np.concatenate([stroke.places for stroke in self.strokes])


def strokes_of(
    fit: FitResult, fit_anchor: str, recordings: Sequence[Recording]
) -> tuple[FittedStroke, ...]:
    """Part a fit's series into strokes, in order of recording and stroke."""
    series = fit.series
    if len(series.stroke) == 0:
        return ()
    keys = np.unique(np.stack([series.recording, series.stroke]), axis=1).T
    planned = _planned_strokes(fit, recordings)
    several = len({int(recording) for recording, _ in keys}) > 1
    strokes = []
    for recording, label in keys:
        places = np.flatnonzero((series.recording == recording) & (series.stroke == label))
        places = places[np.argsort(series.time_s[places], kind="stable")]
        stroke = planned.get(int(label)) or _unplanned(fit, int(label), places)
        words = stroke_label(stroke, int(label), fit.position_unit)
        if several:
            words += f", recording {recording + 1}"
        strokes.append(
            FittedStroke(
                f"{fit_anchor}-r{recording}-s{label if label >= 0 else 'between'}",
                words,
                _source_of(fit, int(recording)),
                int(label),
                stroke.kind,
                finite(stroke.speed),
                stroke.sheet,
                places,
            )
        )
    return tuple(strokes)


def group_strokes(fit: FitResult, strokes: Sequence[FittedStroke]) -> tuple[TorqueGroup, ...]:
    """Group strokes by speed (those of a cut also by kind); an excitation stands alone."""
    grouped: dict[tuple[str, float], list[FittedStroke]] = {}
    pace = _common_speeds([stroke.speed for stroke in strokes])
    for stroke in strokes:
        grouped.setdefault(_key(fit, stroke, pace), []).append(stroke)
    return tuple(
        TorqueGroup(_title(fit, members), tuple(members)) for _, members in sorted(grouped.items())
    )


def _source_of(fit: FitResult, recording: int) -> str:
    """The file that a recording's index in the series stands for."""
    if 0 <= recording < len(fit.sources):
        return split_source(fit.sources[recording])[0]
    return f"recording {recording + 1}"


def split_source(source: str) -> tuple[str, str]:
    """Part what a fit names as its source into file and hash, empty where it states none.

    >>> split_source("captures/cut.mcap sha256:9f86")
    ('captures/cut.mcap', '9f86')
    """
    path, mark, digest = source.rpartition(" sha256:")
    return (path, digest) if mark else (source, "")


def stroke_label(stroke: Stroke, number: int, position_unit: str) -> str:
    """Name a stroke in words, with the number that the fit gives it.

    >>> stroke_label(Stroke(3, "closing", 0.25), 3, "rad")
    'stroke 3, closing at 0.25 rad/s'
    """
    if number < 0:
        return BETWEEN
    speed = finite(stroke.speed)
    pace = f" at {short(speed)} {position_unit}/s" if speed is not None else ""
    return f"stroke {number}, {kind_word(stroke.kind, position_unit)}{pace}"


def kind_word(kind: str, position_unit: str) -> str:
    """A stroke's kind in words: what slides moves forward and backward."""
    if position_unit == "m":
        return {"opening": "forward", "closing": "backward"}.get(kind, kind)
    return kind


def recording_of(source: str, recordings: Sequence[Recording]) -> Recording | None:
    """Find the recording that a fit names: by hash where both state one, else by file."""
    path, digest = split_source(source)
    for recording in recordings:
        if digest and recording.content_hash == digest:
            return recording
    for recording in recordings:
        if not digest and recording.source and recording.source == path:
            return recording
    for recording in recordings:
        if (
            not digest
            and recording.source
            and PurePath(recording.source).name == PurePath(path).name
        ):
            return recording
    return None


def _key(fit: FitResult, stroke: FittedStroke, pace: Mapping[float, float]) -> tuple[str, float]:
    if stroke.against == "time":
        return f"z {stroke.anchor}", 0.0
    kind = stroke.kind if fit.what == "cut" else ""
    return kind, np.inf if stroke.speed is None else pace[stroke.speed]


def _common_speeds(speeds: Iterable[Number]) -> dict[float, float]:
    """Each speed with the slowest of those that are nearly the same, within ``SAME_SPEED``."""
    common: dict[float, float] = {}
    slowest = -np.inf
    for speed in sorted({speed for speed in speeds if speed is not None}):
        if speed > (1.0 + SAME_SPEED) * slowest:
            slowest = speed
        common[speed] = slowest
    return common


def _title(fit: FitResult, members: Sequence[FittedStroke]) -> str:
    first = members[0]
    if first.against == "time":
        return first.label
    kinds = " and ".join(sorted({kind_word(m.kind, fit.position_unit) for m in members}))
    if first.speed is None:
        return f"{kinds}, no planned speed"
    speed = median(np.array([member.speed or np.nan for member in members]))
    return f"{kinds} at {short(speed)} {fit.position_unit}/s"


def _planned_strokes(fit: FitResult, recordings: Sequence[Recording]) -> dict[int, Stroke]:
    """Planned strokes by the number the fit gives them: they count on over its recordings."""
    planned: list[Stroke] = []
    for source in fit.sources:
        recording = recording_of(source, recordings)
        if recording is None:
            break
        planned += recording.strokes
    return dict(enumerate(planned))


def _unplanned(fit: FitResult, label: int, places: NDArray[np.int64]) -> Stroke:
    """A stroke that no plan names: its kind as the fit states it, else by its direction."""
    for error in fit.held_out:
        if error.stroke == label and error.kind in KINDS:
            return Stroke(label, KINDS[error.kind])
    rate = median(fit.series.opening_rate[places])
    return Stroke(label, "closing" if rate < 0 else "opening" if rate > 0 else "excitation")


def rms(values: Array) -> float:
    """Root mean square of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else float("nan")


def mean(values: Array) -> float:
    """Mean of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.mean(kept)) if len(kept) else float("nan")


def median(values: Array) -> float:
    """Median of the finite values; NaN where there are none."""
    kept = values[np.isfinite(values)]
    return float(np.median(kept)) if len(kept) else float("nan")


def block_means(values: Array, blocks: int) -> Array:
    """Means of what is finite over consecutive blocks of nearly equal length.

    Shape (min(blocks, n),); NaN for a block without a finite value.
    """
    count = min(blocks, len(values))
    if count == 0:
        return np.zeros(0)
    starts = np.arange(count) * len(values) // count
    known = np.isfinite(values)
    sums = np.add.reduceat(np.where(known, values, 0.0), starts)
    counts = np.add.reduceat(known.astype(np.float64), starts)
    means = np.full(count, np.nan)
    np.divide(sums, counts, out=means, where=counts > 0)
    return means


def thinned(places: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most ``most`` of the places, evenly spread."""
    if len(places) <= most:
        return places
    return places[np.linspace(0, len(places) - 1, most).round().astype(np.int64)]


def limits_of(*values: Array, margin: float = 0.06) -> tuple[float, float] | None:
    """Limits of an axis that holds all finite values; None where there are none."""
    joined = np.concatenate([np.ravel(value) for value in values]) if values else np.zeros(0)
    kept = joined[np.isfinite(joined)]
    if len(kept) == 0:
        return None
    low, high = float(kept.min()), float(kept.max())
    room = margin * (high - low) or 0.1 * abs(high) or 1.0
    return low - room, high + room
