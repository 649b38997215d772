"""From a motion into a recording: appends samples, counts coverage, notes gaps and faults."""

import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.coverage import CoverageGrid, CoveredAxis
from scissorcal.device.faults import fault_sentence
from scissorcal.kernel import StateFlag
from scissorcal.recording import RecordingWriter, Stroke
from scissorcal.recording.recording import UNLOADED_MARK, missing_frames

NOTES_OF_A_KIND = 3
COUNTED_AT_ONCE = 5
"""Blocks. To count one costs half of all work on it, nearly the same for five; the servo's ticks
are late more often the longer this process works."""


@dataclass
class Tally:
    """Gaps of a capture and the frames lost in them, faults, and garbled frames."""

    gaps: int = 0
    lost: int = 0
    faults: int = 0
    garbled: int = 0


class Recorder:
    """Appends blocks of samples to the recording as they arrive.

    The first gaps, faults and garbled frames become notes at once, so that they survive a killed
    capture; of later ones only the total is noted, at the end.
    """

    def __init__(self, writer: RecordingWriter, coverage: CoverageGrid) -> None:
        self.writer = writer
        self._coverage = coverage
        self._uncounted: list[NDArray[np.void]] = []
        self.tally = Tally()
        self.last: NDArray[np.void] | None = None
        self.empty: list[Stroke] = []
        self._faulty = False
        self._enabled_once = False
        self._noted: Counter[str] = Counter()

    @property
    def sample_count(self) -> int:
        """Samples recorded so far."""
        return self.writer.sample_count

    @property
    def axis(self) -> CoveredAxis:
        """The axis that the capture moves."""
        return self._coverage.axis

    @property
    def coverage(self) -> CoverageGrid:
        """The coverage of all samples so far."""
        self._count()
        return self._coverage

    def take(self, samples: NDArray[np.void], garbled: int = 0, cause: int = 0) -> None:
        """Record a block.

        ``garbled`` is the number of frames discarded since the start, ``cause`` that of the last
        fault, where the device states it.
        """
        if len(samples) == 0:
            self.writer.poll(time.time_ns())
        else:
            self._note_gaps(samples)
            self._note_faults(samples, cause)
            self.writer.append(samples)
            self._uncounted.append(samples)
            if len(self._uncounted) >= COUNTED_AT_ONCE:
                self._count()
            self.last = samples[-1:].copy()
        if garbled > self.tally.garbled:
            self.tally.garbled = garbled
            self._note("garbled", f"{_frames(garbled)} were garbled until {self._when()}.")

    def resume(self, sentence: str) -> None:
        """Continue after a pause in which nothing was recorded, which is no gap."""
        if self.last is not None:
            self.writer.note(f"Paused at {self._when()}: {sentence}")
        self.last = None

    def unloaded(self, stroke: Stroke) -> None:
        """Note that a stroke cut nothing, and mark it."""
        self.empty.append(stroke)
        self.writer.mark(UNLOADED_MARK, str(stroke.index))
        self.writer.note(unloaded_sentence(stroke))

    def finish(self, overrun: int = 0) -> None:
        """Note the totals; ``overrun`` counts samples that were not read from the loop in time."""
        tally = self.tally
        totals = {
            "gap": f"{_frames(tally.lost)} lost in {tally.gaps} gaps in total.",
            "garbled": f"{_frames(tally.garbled)} garbled in total.",
            "fault": f"The device latched a fault {tally.faults} times in total.",
        }
        for kind, sentence in totals.items():
            if self._noted[kind] > NOTES_OF_A_KIND:
                self.writer.note(sentence)
        if overrun:
            self.writer.note(f"{overrun} samples were lost because the disk was too slow.")

    def _count(self) -> None:
        if self._uncounted:
            self._coverage.add(np.concatenate(self._uncounted))
            self._uncounted.clear()

    def _note_gaps(self, samples: NDArray[np.void]) -> None:
        sequence = samples["sequence"].astype(np.int64)
        first = sequence[0] if self.last is None else int(self.last["sequence"][0])
        lost = missing_frames(np.concatenate([[first], sequence]))
        for index in np.flatnonzero(lost):
            missing = int(lost[index])
            self.tally.gaps += 1
            self.tally.lost += missing
            at = f"frame {sequence[index]} ({self._sample_time(samples[index]):.3f} s)"
            self._note("gap", f"{_frames(missing)} missing before {at}.")

    def _note_faults(self, samples: NDArray[np.void], cause: int) -> None:
        """Note each time a fault latches after the motors were first enabled."""
        faulty = (samples["flags"] & int(StateFlag.FAULT_LATCHED)) != 0
        enabled = (samples["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0
        since = np.logical_or.accumulate(enabled | self._enabled_once)
        before = np.concatenate([[self._faulty], faulty[:-1]])
        for index in np.flatnonzero(faulty & ~before & since):
            self.tally.faults += 1
            flags = StateFlag(int(samples["flags"][index]) & 0xFFFF)
            names = ", ".join(flag.name or "" for flag in flags)
            at = f"{self._sample_time(samples[index]):.3f} s"
            late = StateFlag.COMMANDS_LOST in flags
            why = "Close programs that load this computer." if late else ""
            why = fault_sentence(cause) or why
            self._note("fault", f"The device latched a fault at {at} ({names}). {why}".strip())
        self._faulty = bool(faulty[-1])
        self._enabled_once = bool(since[-1])

    def _note(self, kind: str, sentence: str) -> None:
        self._noted[kind] += 1
        if self._noted[kind] <= NOTES_OF_A_KIND:
            self.writer.note(sentence)

    def _when(self) -> str:
        return "the start" if self.last is None else f"{self._sample_time(self.last[0]):.3f} s"

    @staticmethod
    def _sample_time(sample: np.void) -> float:
        return float(sample["device_time_us"]) * 1e-6


def unloaded_sentence(stroke: Stroke) -> str:
    """Say that a stroke cut nothing, of which piece, and what to do."""
    return (
        f"Stroke {stroke.index + 1} (piece {stroke.sheet + 1}) cut nothing: the torque stayed at "
        "that of friction. The piece was cut before, or is missing: put in a fresh one."
    )


def _frames(count: int) -> str:
    return "1 frame" if count == 1 else f"{count} frames"
