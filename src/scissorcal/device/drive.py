"""Run the segments of a capture on a motion, record them, and see strokes without material."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.motion import Motion, Samples
from scissorcal.device.recorder import Recorder, unloaded_sentence
from scissorcal.device.session import ShowProgress
from scissorcal.device.trajectory import Segment
from scissorcal.kernel import StateFlag
from scissorcal.recording import Stroke

IDLE_S = 1.5
"""Time with the motors off at the beginning and end of a capture: it shows the sensors' zeros."""


class Drive:
    """Runs segments of a capture, records them and reports progress.

    ``strokes`` are those of the recording; a list may grow while the capture runs. ``total`` are
    the ticks of all segments, as far as they are known: see :meth:`expect`.
    """

    def __init__(
        self,
        motion: Motion,
        recorder: Recorder,
        strokes: Sequence[Stroke],
        progress: ShowProgress,
        total: int,
        *,
        cuts: bool | None = None,
    ) -> None:
        self._motion = motion
        self._recorder = recorder
        self._strokes = strokes
        self._tell = progress
        self._total = total
        self._done = 0
        loaded = any(stroke.sheet >= 0 for stroke in strokes) if cuts is None else cuts
        radius = motion.identity.handle_radius
        self._load = LoadWatch(strokes, radius) if loaded else None
        self._warned = 0

    def expect(self, ticks: int) -> None:
        """Say how many ticks of segments are expected still, where nobody knows all of them."""
        self._total = self._done + max(ticks, 1)

    def warning(self) -> str:
        """What to tell the person who loads the next piece about the last; empty if it was cut."""
        empty, self._warned = self._recorder.empty[self._warned :], len(self._recorder.empty)
        return f"{unloaded_sentence(empty[-1])} " if empty else ""

    def go_to_start(self, segment: Segment) -> None:
        """Bring the rig to where a segment starts, so that material can be loaded there."""
        for samples in self._motion.track(segment.reference.head()):
            self._take(samples, "moving to where the next piece is loaded")

    def follow(self, segment: Segment) -> None:
        """Run a segment and record it."""
        begun = self._done
        for samples in self._motion.track(segment.reference):
            passed = self._motion.track_index - self._motion.approach_ticks
            self._done = max(self._done, begun + min(passed, len(segment.reference)))
            self._take(samples, self._doing(samples))
        self._done = begun + len(segment.reference)

    def idle(
        self, seconds: float = IDLE_S, doing: str = "motors off, measuring sensor zeros"
    ) -> None:
        """Record with the motors off, which shows the sensor zeros."""
        for samples in self._motion.idle(seconds):
            if self._load and self._done == 0:
                self._load.rest(samples)
            self._take(samples, doing)

    def _take(self, samples: Samples, sentence: str) -> None:
        self._recorder.take(samples, self._motion.garbled, self._motion.fault_cause)
        for stroke in self._load.take(samples) if self._load and len(samples) else ():
            self._recorder.unloaded(stroke)
            self._tell(self._done / self._total, unloaded_sentence(stroke), self._recorder)
        self._tell(self._done / self._total, sentence, self._recorder)

    def _doing(self, samples: Samples) -> str:
        labels = samples["stroke"]
        if len(labels) == 0 or labels[-1] < 0:
            return "between strokes"
        stroke = self._strokes[int(labels[-1])]
        sheet = f", piece {stroke.sheet + 1}" if stroke.sheet >= 0 else ""
        of = f"stroke {stroke.index + 1} of {len(self._strokes)}{sheet}"
        return f"{self._recorder.axis.motion(stroke.kind, stroke.speed)} ({of})"


LEAST_SHARE = 0.1
"""Of the friction of the return stroke, or of the largest load so far: less cuts nothing. The fit
judges a stroke by the same share (calibration.cut.checks)."""
CUTTING = 0.5
"""Share of a closing stroke, from its end, in which the blades are in the material."""


class LoadWatch:
    """Compares each closing stroke of a cut with the return stroke that follows it.

    A stroke cuts where closing takes more torque than friction alone. Friction is what the blades
    take to open again, over the later half of the return, where they are free of the material.
    Nothing of the rig has to be known: the zeros of its sensors are taken from samples at rest.
    """

    def __init__(self, strokes: Sequence[Stroke], handle_radius_m: float) -> None:
        self._strokes = strokes
        self._radius = handle_radius_m
        self._at = -1
        self._rests: list[NDArray[np.float64]] = []
        self._zero = 0.0
        self._drives: list[NDArray[np.float64]] = []
        self._closing: tuple[Stroke, float] | None = None
        self._largest = 0.0

    def rest(self, samples: NDArray[np.void]) -> None:
        """Take samples with the motors off and nobody at the handles: what they show is zero."""
        off = (samples["flags"] & StateFlag.MOTOR_ENABLED) == 0
        drive = self._drive(samples[off])
        self._rests.append(drive[np.isfinite(drive)])
        known = np.concatenate(self._rests)
        self._zero = float(np.mean(known)) if len(known) else 0.0

    def take(self, samples: NDArray[np.void]) -> list[Stroke]:
        """Take a block of samples; returns closing strokes that turn out to have cut nothing."""
        found = []
        labels = samples["stroke"]
        drive = self._drive(samples) - self._zero
        for part in np.split(np.arange(len(labels)), np.flatnonzero(np.diff(labels)) + 1):
            if len(part) == 0:
                continue
            label = int(labels[part[0]])
            if label != self._at:
                found += self._end()
                self._at = label
            self._drives.append(drive[part])
        return found

    def _drive(self, samples: NDArray[np.void]) -> NDArray[np.float64]:
        drive = samples["motor_torque"] - self._radius * samples["handle_force"]
        return np.asarray(drive, dtype=np.float64)

    def _end(self) -> list[Stroke]:
        """The stroke that was running is over."""
        drives, self._drives = self._drives, []
        if self._at < 0 or not drives:
            return []
        stroke, drive = self._strokes[self._at], np.concatenate(drives)
        later = drive[round((1.0 - CUTTING) * len(drive)) :]
        level = float(np.mean(later)) if len(later) else float("nan")
        if stroke.kind == "closing":
            self._closing = (stroke, -level)
            return []
        if stroke.kind != "opening" or self._closing is None:
            return []
        (closing, resisted), self._closing = self._closing, None
        load = resisted - level
        self._largest = max(self._largest, load)
        return [closing] if load < LEAST_SHARE * max(abs(level), self._largest) else []
