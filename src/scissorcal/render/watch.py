"""What the supervisor does with a rendering's samples: record them, count strokes, see the end."""

import time
from collections import deque

import numpy as np

from scissorcal.device.motion import Samples
from scissorcal.device.session import ShowProgress
from scissorcal.device.timing import Percentiles, TimeHistogram
from scissorcal.kernel import SampleFlag, StateFlag
from scissorcal.recording import RecordingWriter, TurningPoints

LOOK_EVERY_S = 0.25
AT_REST_S = 0.5
REST_SHARE = 0.1
OPENED_SHARE = 0.5


class Watch:
    """Records what is rendered, and decides when it is finished.

    The work for a block depends on the block alone, and memory grows by one number a stroke: an
    hour of rendering costs at its end what it costs at its beginning. ``travel`` (rad) is the
    least that counts as a stroke; ``wanted`` strokes end the rendering, None leaves that to the
    time; ``tell`` gets the share of ``seconds`` that has passed.
    """

    def __init__(
        self, travel: float, writer: RecordingWriter | None, tell: ShowProgress, seconds: float
    ) -> None:
        self.wanted: int | None = None
        self.frames = 0
        self.limited = 0
        self.largest_torque = 0.0
        self._latency = TimeHistogram()
        self._strokes = TurningPoints(travel)
        self._travel = travel
        self._writer = writer
        self._tell = tell
        self._seconds = seconds
        self._began = self._looked_at = -np.inf
        self._lowest, self._highest = np.inf, -np.inf
        self._changed_at = self._now = -np.inf
        self._opening = np.nan
        self._recent: deque[tuple[float, float, float]] = deque()  # end, lowest and highest opening

    @property
    def strokes(self) -> int:
        """Closings of the blades so far."""
        return self._strokes.closings

    @property
    def still_s(self) -> float:
        """For how long the opening has not changed by a single count, away from the stops."""
        return max(0.0, self._now - self._changed_at) if self._recent else 0.0

    @property
    def latency(self) -> Percentiles | None:
        """Latency in us of the rendering so far; None in virtual time."""
        return self._latency.percentiles_us() if self._latency.total else None

    def take(self, samples: Samples) -> bool:
        """Take a block of the rendering; True once all strokes are done."""
        self.record(samples)
        if len(samples) == 0:
            return False
        self.frames += len(samples)
        met = int(SampleFlag.TORQUE_LIMITED | SampleFlag.FORCE_LIMITED)
        self.limited += int(np.count_nonzero(samples["flags"] & met))
        self.largest_torque = max(
            self.largest_torque, float(np.max(np.abs(samples["torque_command"])))
        )
        sent = samples["latency_ns"]
        self._latency.add(sent[sent > 0])
        now = float(samples["device_time_us"][-1]) * 1e-6
        if self._began == -np.inf:
            self._began = float(samples["device_time_us"][0]) * 1e-6
        valid = samples[(samples["flags"] & int(SampleFlag.INVALID)) == 0]
        if len(valid):
            self._follow(now, valid)
        if now - self._looked_at < LOOK_EVERY_S or not self._recent:
            return False
        self._looked_at = now
        return self._look(now)

    def record(self, samples: Samples) -> None:
        """Record a block of any mode."""
        if self._writer is None:
            return
        if len(samples):
            self._writer.append(samples)
        else:
            self._writer.poll(time.time_ns())

    def _follow(self, now: float, samples: Samples) -> None:
        opening = samples["opening"]
        changes = np.diff(opening, prepend=self._opening) != 0.0
        changes |= (samples["flags"] & int(StateFlag.OPENING_AT_STOP)) != 0
        if changes.any():
            last = np.flatnonzero(changes)[-1]
            self._changed_at = float(samples["device_time_us"][last]) * 1e-6
        self._now = now
        self._strokes.feed(opening)
        low, high = float(opening.min()), float(opening.max())
        self._lowest, self._highest = min(self._lowest, low), max(self._highest, high)
        self._recent.append((now, low, high))
        while self._recent[0][0] <= now - AT_REST_S:
            self._recent.popleft()
        self._opening = float(opening[-1])

    def _look(self, now: float) -> bool:
        """Tell how far it is; True once the last stroke is made and the blades rest, open."""
        passed = (now - self._began) / self._seconds
        if self.wanted is None:
            self._tell(min(passed, 1.0), f"rendering, {self.strokes} strokes so far")
            return False
        share = max(passed, self.strokes / max(1, self.wanted))
        self._tell(min(share, 1.0), f"rendering, stroke {self.strokes} of {self.wanted}")
        low = min(block[1] for block in self._recent)
        high = max(block[2] for block in self._recent)
        resting = high - low < REST_SHARE * self._travel
        span = self._highest - self._lowest
        opened = self._opening > self._lowest + OPENED_SHARE * span
        return self.strokes >= self.wanted and resting and opened
