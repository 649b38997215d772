"""Strokes in which a device let go of its motors: how many, and why."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import StateFlag
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Check, Verdict

INTERRUPTED = Check(
    "fit interrupted strokes",
    "that strokes are as planned: share of those of one speed in which motors were let go",
    at_most=0.999,
)
"""Share of the strokes of one speed that may be interrupted: one whole stroke shows that speed, and
no plan has a thousand of one."""


@dataclass(frozen=True)
class Interruptions:
    """``interrupted`` of ``strokes`` were, ``worst`` is the largest share of those of one speed.

    ``late`` of them were interrupted because no command came in time.
    """

    strokes: int
    interrupted: int
    worst: float
    late: int

    @property
    def sentence(self) -> str:
        """What happened and what to do; empty where no stroke was interrupted."""
        if not self.interrupted:
            return ""
        remedies = []
        if self.late:
            remedies.append("close programs that load this computer, or give it a faster port")
        if self.late < self.interrupted:
            remedies.append("look up the faults with 'scissorcal recording show'")
        remedy = "; ".join(remedies)
        return (
            f"The device let go of its motors in {self.interrupted} of {self.strokes} strokes, in "
            f"{self.late} of them since commands came late: {remedy}, and record those speeds "
            "again."
        )

    @property
    def decide(self) -> bool:
        """Whether some speed was never recorded as planned."""
        return self.worst > INTERRUPTED.threshold

    def verdict(self, scope: str) -> Verdict:
        """Fails where every stroke of some speed was interrupted; some are *not evaluated*."""
        if self.decide:
            return INTERRUPTED.judge(self.worst, self.sentence).of(scope)
        return INTERRUPTED.not_evaluated(self.sentence, self.worst).of(scope)


def interruptions(recordings: tuple[Recording, ...]) -> Interruptions:
    """Count the strokes of captures during which a fault latched."""
    kinds: dict[tuple[str, float], list[bool]] = {}
    strokes = interrupted = late = 0
    for recording in recordings:
        if not recording.device:
            continue
        hit = _interrupted(recording)
        for stroke in recording.strokes:
            if np.isfinite(stroke.speed):
                kinds.setdefault((stroke.kind, stroke.speed), []).append(stroke.index in hit)
        strokes += len(recording.strokes)
        interrupted += len(hit)
        late += sum(hit.values())
    worst = max((float(np.mean(found)) for found in kinds.values()), default=0.0)
    return Interruptions(strokes, interrupted, worst, late)


def _interrupted(recording: Recording) -> dict[int, bool]:
    """Numbers of the strokes in which a fault latched, and whether for want of commands.

    A fault latches in the stroke that goes on after it, or whose sample came last before it.
    """
    label = np.asarray(recording.samples["stroke"], dtype=np.int64)
    flags = np.asarray(recording.samples["flags"], dtype=np.int64)
    faulty = (flags & int(StateFlag.FAULT_LATCHED)) != 0
    latched: NDArray[np.intp] = np.flatnonzero(faulty[1:] & ~faulty[:-1]) + 1
    planned = np.flatnonzero(label >= 0)
    found: dict[int, bool] = {}
    for at in latched:
        place = int(np.searchsorted(planned, at))
        before = int(label[planned[place - 1]]) if place else -1
        later = int(label[planned[place]]) if place < len(planned) else -1
        if before >= 0 and (before == later or label[at - 1] == before):
            late = bool(flags[at] & int(StateFlag.COMMANDS_LOST))
            found[before] = found.get(before, True) and late
    return found
