"""Sheets that were cut before, or were missing: most of their strokes cut nothing."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.calibration.cut.path import Material, PathMotion
from scissorcal.calibration.cut.path.runs import find_runs
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Check, Verdict

EMPTY = 0.1
"""A closing stroke cuts nothing where the material's mean torque is below this share of what
strokes through material show (their 90 % quantile)."""
THROUGH = 0.9
STALE_SHEETS = Check(
    "fit.cut stale sheets",
    "response and fracture energy, which strokes through cut material pull down: largest "
    "share of a sheet's closing strokes that cut nothing",
    at_most=0.5,
)
"""A sheet is stale where more than this share of its closing strokes cut nothing."""


@dataclass(frozen=True)
class SheetStrokes:
    """Closing strokes on one sheet of a recording, and how many of them cut nothing."""

    recording: str
    sheet: int
    strokes: int
    empty: int

    @property
    def share(self) -> float:
        """Share of the closing strokes that cut nothing."""
        return self.empty / self.strokes


def count_empty(
    motions: tuple[PathMotion, ...],
    materials: tuple[Material, ...],
    recordings: tuple[Recording, ...],
) -> tuple[SheetStrokes, ...]:
    """Count by sheet the closing strokes, and those in which the material's torque is missing.

    The torque of a stroke is the material's work over its path.
    """
    work: dict[tuple[int, int, int], float] = {}
    path: dict[tuple[int, int, int], float] = {}
    for run in find_runs(motions):
        motion = motions[run.motion]
        if not run.closing(motion):
            continue
        labels = motion.stroke[run.low : run.high]
        label = int(np.bincount(labels[labels >= 0]).argmax()) if np.any(labels >= 0) else -1
        key = (motion.recording, run.sheet, label)
        done = materials[run.motion].work
        gone = float(motion.opening[run.low] - motion.opening[run.high])
        work[key] = work.get(key, 0.0) + float(done[run.low] - done[run.high])
        path[key] = path.get(key, 0.0) + gone
    torque = {key: work[key] / path[key] for key in work}
    if not torque:
        return ()
    least = EMPTY * float(np.quantile(list(torque.values()), THROUGH))
    rows = []
    for recording, sheet in dict.fromkeys(key[:2] for key in torque):
        own = [value for key, value in torque.items() if key[:2] == (recording, sheet)]
        name = Path(recordings[recording].source or "the recording").name
        rows.append(SheetStrokes(name, sheet, len(own), sum(value < least for value in own)))
    return tuple(rows)


def stale_verdict(rows: tuple[SheetStrokes, ...]) -> Verdict:
    """Judge whether every sheet was there, and fresh, for most of its strokes."""
    most = STALE_SHEETS.threshold
    stale = [row for row in rows if row.share > most]
    worst = max((row.share for row in rows), default=0.0)
    good = f"At most {worst:.0%} of a sheet's closing strokes cut nothing (limit {most:.0%})."
    named = "; ".join(
        f"sheet {row.sheet} of {row.recording}: {row.empty} of {row.strokes}" for row in stale
    )
    bad = (
        f"Closing strokes that cut nothing: {named}. The sheet was cut before, or had ended, and "
        "the fit takes the gap for weak material. Insert fresh material with its near edge at "
        "advance 0, and capture again."
    )
    return STALE_SHEETS.judge(worst, good, bad)
