"""Amount of capture: fewer strokes, speeds, seconds or sheets than were recorded."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import MINUTES, capture_minutes
from scissorcal.bench.trade.knobs.effort import FitKnob
from scissorcal.bench.trade.point import Setting
from scissorcal.recording.header import Stroke
from scissorcal.recording.recording import UNLOADED_MARK, Recording


class Movement(NamedTuple):
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


FEWEST_SPEEDS, MOST_SPEEDS = 2, 8
"""Speeds below two leave friction no rate; strokes by hand all have different speeds, and are
not left out one by one."""
SHARES = (0.25, 0.5)


class Capture(FitKnob):
    """One kind of data at a time is made less; the reference is all that was recorded."""

    name = "capture"
    title = "Amount of capture"
    cost = MINUTES
    against = "the fits to all that was recorded"

    def missing(self, case: Case) -> str:
        """Every scene with recordings has it, where they can be made less."""
        if len(self.settings(case)) > 1:
            return ""
        return "The recordings have no more strokes, speeds or sheets than the fits need."

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Each kind of data at its few amounts, and everything."""
        rounds, speeds = _rounds(case.friction), _speeds(case.friction)
        sheets = {one.sheet for one in _all(case.cut)}
        strokes = max((one.number + 1 for one in _all(case.cut)), default=0)
        found: list[tuple[str, str, float]]
        found = [("friction rounds", _words(n, "round"), n) for n in _fewer(rounds)]
        if len(speeds) <= MOST_SPEEDS:
            counts = range(FEWEST_SPEEDS, len(speeds))
            found += [("friction speeds", _words(n, "speed"), n) for n in counts]
        if any(one.kind == "excitation" for one in _all(case.friction)):
            found += [("excitation", f"{share:.0%} of the excitation", share) for share in SHARES]
        found += [("sheets", _words(n, "sheet"), n) for n in _fewer(len(sheets))]
        found += [("strokes", f"{_words(n, 'stroke')} a sheet", n) for n in _fewer(strokes)]
        less = [
            Setting(label, 0.0, {"kind": kind, "amount": amount}, kind)
            for kind, label, amount in found
        ]
        sized = [replace(one, size=capture_minutes(self.applied(case, one))) for one in less]
        whole = Setting("all", capture_minutes(case), None, "all", present=True, accuracy=1)
        return (*sorted(sized, key=lambda one: one.size), whole)

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with part of its recordings."""
        if setting.value is None:
            return case
        kind, amount = setting.value["kind"], setting.value["amount"]
        if kind in ("sheets", "strokes"):
            keep = _keep_of_cuts(case, kind, amount)
            return replace(case, cut=tuple(kept(one, keep) for one in case.cut))
        if kind == "excitation":
            parts = tuple(shortened(one, "excitation", amount) for one in case.friction)
            return replace(case, friction=parts)
        keep = _keep_of_friction(case, kind, amount)
        return replace(case, friction=tuple(kept(one, keep) for one in case.friction))


def _all(recordings: tuple[Recording, ...]) -> list[Movement]:
    return [one for recording in recordings for one in movements(recording)]


def _rounds(recordings: tuple[Recording, ...]) -> int:
    """How often the capture of friction goes through its speeds."""
    numbers = [one.number for one in _all(recordings) if one.kind == "closing"]
    return max(numbers, default=-1) + 1


def _speeds(recordings: tuple[Recording, ...]) -> list[float]:
    return sorted({round(one.speed, 3) for one in _all(recordings) if one.kind == "closing"})


def _spread(speeds: list[float], count: int) -> list[float]:
    """``count`` of the speeds, both ends among them.

    >>> _spread([0.05, 0.12, 0.3, 0.7, 1.5], 3)
    [0.05, 0.3, 1.5]
    """
    last = len(speeds) - 1
    return [speeds[round(place * last / (count - 1))] for place in range(count)]


def _fewer(whole: int) -> list[int]:
    """Amounts below ``whole``, doubling from 1.

    >>> _fewer(6), _fewer(1)
    ([1, 2, 4], [])
    """
    return [2**k for k in range(whole.bit_length()) if 2**k < whole]


def _words(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"


def _keep_of_cuts(case: Case, kind: str, amount: Any) -> Callable[[Movement], bool]:
    if kind == "strokes":
        return lambda one: one.number < amount
    first = sorted({one.sheet for one in _all(case.cut)})[: int(amount)]
    return lambda one: one.sheet in first


def _keep_of_friction(case: Case, kind: str, amount: Any) -> Callable[[Movement], bool]:
    if kind == "friction rounds":
        return lambda one: one.kind == "excitation" or one.number < amount
    stay = _spread(_speeds(case.friction), int(amount))
    return lambda one: one.kind == "excitation" or round(one.speed, 3) in stay
