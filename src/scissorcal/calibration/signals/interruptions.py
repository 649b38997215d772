"""Strokes in which a device let go of its motors: how many, and why."""

from dataclasses import dataclass

import numpy as np

from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict, judge, not_evaluated

FAULT_LATCHED, COMMANDS_LOST = 2, 4
SOME_WHOLE = float(np.nextafter(1.0, 0.0))
"""Share of the strokes of one speed that may be interrupted: one whole stroke shows that speed."""


@dataclass(frozen=True)
class Interruptions:
    """``interrupted`` of ``strokes`` were, ``worst`` is the largest share of those of one speed.

    ``late``: each time because no command came in time.
    """

    strokes: int
    interrupted: int
    worst: float
    late: bool

    @property
    def sentence(self) -> str:
        """What happened and what to do; empty where no stroke was interrupted."""
        if not self.interrupted:
            return ""
        why, remedy = "a fault latched", "Look up the faults with 'scissorcal recording show'"
        if self.late:
            why = "commands came late"
            remedy = "Close programs that load this computer, or give it a faster port"
        return (
            f"The device let go of its motors in {self.interrupted} of {self.strokes} strokes, "
            f"since {why}. {remedy}, and record again."
        )

    def verdict(self, scope: str) -> Verdict:
        """Fails where every stroke of some speed was interrupted; some are *not evaluated*."""
        check = "interrupted strokes"
        if self.worst > SOME_WHOLE:
            return judge(scope, check, self.worst, SOME_WHOLE, self.sentence)
        return not_evaluated(scope, check, self.sentence, value=self.worst)


def interruptions(recordings: tuple[Recording, ...]) -> Interruptions:
    """Count the strokes of captures during which a fault latched."""
    shares, strokes, interrupted, late = [], 0, 0, True
    for recording in recordings:
        if not recording.device:
            continue
        label = np.asarray(recording.samples["stroke"])
        flags = np.asarray(recording.samples["flags"])
        planned = np.flatnonzero(label >= 0)
        faulty = (flags & FAULT_LATCHED) != 0
        latched = np.flatnonzero(faulty[1:] & ~faulty[:-1]) + 1
        after = np.searchsorted(planned, latched)
        within = (after > 0) & (after < len(planned))
        before, later = label[planned[after[within] - 1]], label[planned[after[within]]]
        cut_short = latched[within][before == later]
        late &= bool(np.all(flags[cut_short] & COMMANDS_LOST))
        hit = {int(number) for number in label[planned[np.searchsorted(planned, cut_short)]]}
        kinds: dict[tuple[str, float], list[bool]] = {}
        for stroke in recording.strokes:
            if np.isfinite(stroke.speed):
                kinds.setdefault((stroke.kind, stroke.speed), []).append(stroke.index in hit)
        shares += [float(np.mean(found)) for found in kinds.values()]
        strokes += len(recording.strokes)
        interrupted += len(hit)
    return Interruptions(strokes, interrupted, max(shares, default=0.0), late)
