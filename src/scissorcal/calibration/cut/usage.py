"""Which samples of a cut's recordings the fit uses, by stroke and speed, and why not the others."""

from collections.abc import Sequence

import numpy as np

from scissorcal.aliases import Mask
from scissorcal.calibration.cut.path_motion import PathMotion
from scissorcal.calibration.cut.segments import Segments
from scissorcal.calibration.signals.usage import GAP, INVALID, Usage, count_usage
from scissorcal.recording.recording import Recording

STARTING = "crack about to start"
FREE = "blades free of the material"


def usage_of_segments(recordings: tuple[Recording, ...], segments: Segments) -> Usage:
    """Count the samples that elastic and running segments span.

    Between the end of loading and the first running segment the crack starts at an unknown sample.
    In the rest of a stroke the blades are free of the material, or turn.
    """
    sizes = [len(recording.samples) for recording in recordings]
    masks = {
        name: tuple(np.zeros(size, dtype=bool) for size in sizes)
        for name in ("used", "inside", INVALID, STARTING)
    }
    for motion in segments.motions:
        masks["inside"][motion.recording][motion.source] = True
        masks[INVALID][motion.recording][motion.source[~motion.usable]] = True
    loaded: dict[int, list[int]] = {}
    for piece in segments.pieces:
        _mark(masks["used"], segments, piece.motion, int(piece.ends[0]), int(piece.ends[-1]))
        if piece.kind != "unloading":
            loaded.setdefault(piece.motion, []).append(int(piece.ends[-1]))
    for run in segments.stretches:
        low = int(run.ends[0])
        _mark(masks["used"], segments, run.motion, low, int(run.ends[-1]))
        motion = segments.motions[run.motion]
        before = max((end for end in loaded.get(run.motion, []) if end <= low), default=low)
        if motion.stroke[before] == motion.stroke[low]:
            _mark(masks[STARTING], segments, run.motion, before, low)
    reasons = {
        GAP: tuple(~inside for inside in masks["inside"]),
        INVALID: masks[INVALID],
        STARTING: masks[STARTING],
        FREE: masks["inside"],
    }
    return count_usage(recordings, masks["used"], reasons)


def usage_sentence(recordings: tuple[Recording, ...], usage: Usage) -> str:
    """How much of the closing strokes is used, and of which speed least."""
    kinds = [stroke.kind for recording in recordings for stroke in recording.strokes]
    closing = [row for row in usage.rows if row.stroke >= 0 and kinds[row.stroke] != "opening"]
    if not closing:
        return usage.sentence
    return Usage(tuple(closing)).sentence.replace("in strokes", "in closing strokes", 1)


def _mark(masks: tuple[Mask, ...], segments: Segments, index: int, low: int, high: int) -> None:
    motion = segments.motions[index]
    masks[motion.recording][motion.source[low : high + 1]] = True


def counted(
    recordings: tuple[Recording, ...], usable: tuple[Mask, ...], motions: Sequence[PathMotion]
) -> str:
    """What is left of the recordings after each filter of a fit of cuts, in seconds."""
    ticks = [recording.duration_s / max(len(recording.samples) - 1, 1) for recording in recordings]
    recorded = sum(tick * len(good) for tick, good in zip(ticks, usable, strict=True))
    sound = sum(tick * np.count_nonzero(good) for tick, good in zip(ticks, usable, strict=True))
    kept = under = moving = 0.0
    for motion in motions:
        own = motion.usable & (np.diff(motion.source, prepend=-1) > 0)
        below = own & (motion.sheet >= 0)
        kept += motion.tick_s * np.count_nonzero(own)
        under += motion.tick_s * np.count_nonzero(below)
        moving += motion.tick_s * np.count_nonzero(below & ~motion.standing)
    return (
        f"Of {recorded:.3g} s recorded, {sound:.3g} s are sound, {kept:.3g} s of these lie in "
        f"stretches long enough, {under:.3g} s of these have a sheet in place, and in {moving:.3g} "
        "s of these the blades move."
    )
