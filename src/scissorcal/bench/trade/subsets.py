"""Parts of a recording, as a shorter capture would have left them."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.recording.header import Stroke
from scissorcal.recording.recording import UNLOADED_MARK, Recording


@dataclass(frozen=True)
class Movement:
    """A stroke with the opening that follows it: what a capture adds at a time.

    ``number`` counts the movements of one sheet, of one speed where no sheet is loaded.
    """

    strokes: tuple[int, ...]
    kind: str
    speed: float
    sheet: int
    number: int


def movements(recording: Recording) -> tuple[Movement, ...]:
    """The movements of a recording, in order."""
    found: list[list[Stroke]] = []
    for stroke in recording.strokes:
        if stroke.kind == "opening" and found and len(found[-1]) == 1 and _goes_on(found[-1][0]):
            found[-1].append(stroke)
        else:
            found.append([stroke])
    count: Counter[object] = Counter()
    made = []
    for own in found:
        first = own[0]
        key = first.sheet if first.sheet >= 0 else round(first.speed, 3)
        numbers = tuple(stroke.index for stroke in own)
        made.append(Movement(numbers, first.kind, first.speed, first.sheet, count[key]))
        count[key] += 1
    return tuple(made)


def kept(recording: Recording, keep: Callable[[Movement], bool]) -> Recording:
    """The recording without the movements that are not kept, and without the rest after those.

    What stood before a left-out movement and what stood after it are then separate pieces. Strokes
    are numbered anew.
    """
    stays = {index for one in movements(recording) if keep(one) for index in one.strokes}
    owner = _owner(recording)
    samples = recording.samples[np.isin(owner, sorted(stays))].copy()
    strokes = [stroke for stroke in recording.strokes if stroke.index in stays]
    number = {stroke.index: place for place, stroke in enumerate(strokes)}
    within = samples["stroke"] >= 0
    samples["stroke"][within] = [number[index] for index in samples["stroke"][within]]
    marks = tuple(
        (name, str(number[int(value)]) if name == UNLOADED_MARK else value)
        for name, value in recording.marks
        if name != UNLOADED_MARK or int(value) in number
    )
    renumbered = tuple(replace(stroke, index=number[stroke.index]) for stroke in strokes)
    return replace(recording, samples=samples, strokes=renumbered, marks=marks)


def shortened(recording: Recording, kind: str, share: float) -> Recording:
    """The recording with only the first ``share`` of the time of each stroke of one kind."""
    drop = np.zeros(len(recording.samples), dtype=bool)
    time = recording.device_time_s
    owner = _owner(recording)
    for stroke in recording.strokes:
        if stroke.kind == kind:
            own = np.flatnonzero(owner == stroke.index)
            begin, end = time[own[[0, -1]]] if len(own) else (0.0, 0.0)
            drop[own[time[own] > begin + share * (end - begin)]] = True
    return replace(recording, samples=recording.samples[~drop])


def _goes_on(stroke: Stroke) -> bool:
    return stroke.kind in ("closing", "press")


def _owner(recording: Recording) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """The stroke of each sample; between strokes the one before, or the first one of all."""
    label = recording.samples["stroke"].astype(np.int64)
    place = np.where(label >= 0, np.arange(len(label)), 0)
    before = label[np.maximum.accumulate(place)]
    first = recording.strokes[0].index if recording.strokes else -1
    return np.where(before >= 0, before, first)
