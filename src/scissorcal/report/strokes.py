"""Which samples of a fit belong to which stroke, and what each stroke is called."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.result import FitResult
from scissorcal.recording.recording import Stroke, StrokeKind
from scissorcal.report.inputs import RecordingSummary
from scissorcal.report.numbers import Number, finite, short

KINDS: dict[str, StrokeKind] = {
    "closing": "closing",
    "opening": "opening",
    "excitation": "excitation",
    "press": "press",
}
BETWEEN = "between strokes"


@dataclass(frozen=True)
class StrokeName:
    """A stroke's identity: ``anchor`` is its address on the page, ``label`` its name in words.

    ``recording`` is the source that the fit names; ``speed`` the nominal rate's magnitude in the
    fit's position unit per second, None where the stroke has no single speed.
    """

    anchor: str
    label: str
    recording: str
    stroke: int
    kind: str
    speed: Number
    sheet: int


@dataclass(frozen=True)
class StrokeSamples:
    """A stroke's name and its places in the fit's series, shape (n,), in order of time."""

    name: StrokeName
    places: NDArray[np.int64]


def strokes_of(
    fit: FitResult, fit_anchor: str, recordings: Sequence[RecordingSummary]
) -> tuple[StrokeSamples, ...]:
    """Part a fit's series into strokes, in order of recording and stroke."""
    series = fit.series
    if len(series.stroke) == 0:
        return ()
    keys = np.stack([series.recording, series.stroke])
    found = []
    for recording, stroke in np.unique(keys, axis=1).T:
        places = np.flatnonzero((series.recording == recording) & (series.stroke == stroke))
        rate = float(np.nanmedian(np.append(series.opening_rate[places], 0.0)))
        source = source_of(fit, int(recording))
        planned = _planned(fit, source, int(stroke), recordings, rate)
        anchor = f"{fit_anchor}-r{recording}-s{stroke if stroke >= 0 else 'between'}"
        several = len(np.unique(series.recording)) > 1
        label = stroke_label(planned, fit.position_unit)
        if several:
            label += f", recording {recording + 1}"
        speed = finite(planned.speed)
        name = StrokeName(anchor, label, source, int(stroke), planned.kind, speed, planned.sheet)
        found.append(StrokeSamples(name, places))
    return tuple(found)


def source_of(fit: FitResult, recording: int) -> str:
    """The source that a recording's index in the series stands for."""
    if 0 <= recording < len(fit.sources):
        return fit.sources[recording]
    return f"recording {recording + 1}"


def stroke_label(stroke: Stroke, position_unit: str) -> str:
    """Name a stroke in words.

    >>> stroke_label(Stroke(3, "closing", 0.25), "rad")
    'stroke 3, closing at 0.25 rad/s'
    """
    if stroke.index < 0:
        return BETWEEN
    speed = finite(stroke.speed)
    pace = f" at {short(speed)} {position_unit}/s" if speed is not None else ""
    return f"stroke {stroke.index}, {stroke.kind}{pace}"


def summary_of(source: str, recordings: Sequence[RecordingSummary]) -> RecordingSummary | None:
    """Find the summary of a fit's source: by path, by file name, or by the hash it carries."""
    for recording in recordings:
        if recording.source and recording.source == source:
            return recording
    for recording in recordings:
        same_file = recording.source and PurePath(recording.source).name == PurePath(source).name
        same_hash = recording.content_hash and recording.content_hash in source
        if same_file or same_hash:
            return recording
    return None


def _planned(
    fit: FitResult, source: str, stroke: int, recordings: Sequence[RecordingSummary], rate: float
) -> Stroke:
    summary = summary_of(source, recordings)
    for planned in summary.strokes if summary else ():
        if planned.index == stroke:
            return planned
    for error in fit.held_out:
        same = PurePath(error.recording).name == PurePath(source).name
        if error.stroke == stroke and same and error.kind in KINDS:
            return Stroke(stroke, KINDS[error.kind], error.speed)
    if stroke < 0:
        return Stroke(stroke, "excitation")
    return Stroke(stroke, "closing" if rate < 0 else "opening" if rate > 0 else "excitation")
