"""What a rig does now, from the recording that the command which runs it appends to.

Neither the loop nor its supervisor knows of a page: the file that they write anyway is read. So any
command can be followed, from whichever terminal it was started.
"""

import contextlib
import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recording import layout
from scissorcal.recording.following import RecordingFollower
from scissorcal.recording.layout import POSE

SEARCH_EVERY_s = 0.2
QUIET_s = 3.0
"""A recording that did not grow for so long is asked whether its writer still runs."""

LAG_s = 0.2
"""By which samples are given out behind the newest that could be here: a recording grows by a chunk
each 0.15 s, and up to 0.05 s of samples wait for their block."""
PACE_OVER_s = 2.0
MOST_A_s = 250.0
"""Samples of each second of the rig that are kept."""
MOST_AT_ONCE = 250
MOST_WAITING = 2500

COLUMNS = ("time_s", "opening_rad", "advance_m", "torque_Nm", "force_N")
RENDERED = ("render", "control")
"""Kinds whose motors play the material; in the others they work against it."""

_INTERRUPTED = (
    "The command that wrote {name} ended without closing it; the next command recovers it."
)
_REMOVED = "{name} was removed: its command ended before anything was recorded."


@dataclass(frozen=True)
class Look:
    """What a look at the recording found.

    ``rows`` (n, 5) are samples with `COLUMNS`, ``lost`` how many were left out since the last look,
    ``pose`` the newest tracked pose of the plate (quaternion, then translation in m) or None.
    ``recording`` is the name of the followed file, "" without one. ``sentence`` is set where that
    changed.
    """

    rows: Array
    lost: int = 0
    pose: tuple[float, ...] | None = None
    recording: str = ""
    sentence: str = ""


class RigFeed:
    """Follows the newest recording in a folder that is being written.

    ``clock`` gives seconds, of which only differences count. Call :meth:`look` about forty times a
    second while somebody watches.
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._folder = folder
        self._clock = clock
        self._now: _Followed | None = None
        self._done: set[str] = set()
        self._searched_s = -math.inf

    def look(self) -> Look:
        """What came since the last look. A damaged or vanished file ends the following of it."""
        now_s = self._clock()
        if self._now is not None:
            try:
                look = self._now.look(now_s)
            except (InputError, OSError) as error:
                sentence = f"{self._now.name} cannot be followed any more: {error}"
                look = Look(_no_rows(), 0, None, self._now.name, sentence)
            if look.sentence:
                self._done.add(self._now.name)
                self.close()
            return look
        if now_s - self._searched_s >= SEARCH_EVERY_s:
            self._searched_s = now_s
            with contextlib.suppress(OSError):  # of the folder; it is searched again
                self._now = self._found(now_s)
        if self._now is None:
            return Look(_no_rows())
        return Look(_no_rows(), 0, None, self._now.name, f"Following {self._now.name}.")

    def close(self) -> None:
        """Close the file that is followed, if any."""
        if self._now is not None:
            self._now.follower.close()
        self._now = None

    def _found(self, now_s: float) -> "_Followed | None":
        """The newest recording that is being written."""
        for path in _newest_first(self._folder):
            if _name_of(path) in self._done:
                continue
            try:
                follower = RecordingFollower(path)
            except InputError:
                continue  # it was renamed, or is no file: the next search finds out
            if follower.is_written:
                return _Followed(follower, now_s)
            if follower.age_s > QUIET_s:  # else its writer may have been about to lock it
                self._done.add(_name_of(path))
            follower.close()
        return None


class _Followed:
    """One recording that is followed."""

    def __init__(self, follower: RecordingFollower, now_s: float) -> None:
        self.follower = follower
        self.name = _name_of(follower.path)
        self._playout = Playout()
        self._size = -1
        self._grew_s = now_s
        self._began_us: int | None = None

    def look(self, now_s: float) -> Look:
        """What is due; with a sentence where that was all."""
        follower, pose = self.follower, None
        size = follower.size
        if follower.is_removed:
            return self._looked(now_s, sentence=_REMOVED.format(name=self.name))
        if size != self._size:
            self._size, self._grew_s = size, now_s
            self._playout.add(self._rows(follower.read()), now_s)
            pose = self._pose()
        elif now_s - self._grew_s > QUIET_s and not follower.finished:
            self._grew_s = now_s
            if not follower.is_written:
                return self._looked(now_s, sentence=_INTERRUPTED.format(name=self.name))
        looked = self._looked(now_s, pose)
        if follower.finished and not self._playout.waits:
            return replace(looked, sentence=f"{self.name} is complete.")
        return looked

    def _looked(
        self, now_s: float, pose: tuple[float, ...] | None = None, sentence: str = ""
    ) -> Look:
        rows = self._playout.take(now_s).reshape(-1, len(COLUMNS))
        lost, self._playout.lost = self._playout.lost, 0
        return Look(rows, lost, pose, self.name, sentence)

    def _pose(self) -> tuple[float, ...] | None:
        row = self.follower.newest_row(POSE)
        if not len(row):
            return None
        both = np.concatenate([row["quaternion"][0], row["translation"][0]])
        return tuple(both.tolist()) if np.isfinite(both).all() else None

    def _rows(self, samples: NDArray[np.void]) -> Array:
        about = self.follower.metadata
        if about is None or not len(samples) or about.joint != "rotary":
            return _no_rows()
        if self._began_us is None:
            self._began_us = int(samples["device_time_us"][0])
        time_s = 1e-6 * (samples["device_time_us"] - self._began_us)
        motor, hand = samples["motor_torque"], samples["handle_force"]
        torque, force = motor, samples["force_command"]
        if about.kind not in RENDERED:
            radius = about.handle_radius_m or 0.0
            torque, force = radius * np.where(np.isfinite(hand), hand, 0.0) - motor, -force
        rows = np.stack([time_s, samples["opening"], samples["advance"], torque, force], axis=1)
        return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def _name_of(path: Path) -> str:
    """The name that a recording has once it is complete; each has another."""
    return path.name.removesuffix(layout.PART_SUFFIX)


def _newest_first(folder: Path) -> list[Path]:
    """Unfinished recordings of a folder; none where it is not there."""
    found = []
    for path in folder.glob(f"*.mcap{layout.PART_SUFFIX}"):
        try:
            found.append((path.stat().st_mtime_ns, path))
        except OSError:
            continue  # renamed meanwhile: it is complete
    return [path for _, path in sorted(found, reverse=True)]


def _no_rows() -> Array:
    return np.zeros((0, len(COLUMNS)))


class Playout:
    """Takes rows (n, columns), of which the first column is the rig's time in s, and gives them out
    evenly.

    A row is due ``LAG_s`` after the moment at which the newest rows of the last seconds would have
    allowed it, so that bursts become an even stream with one delay. Rows that come later than that
    are given out at once, such as those of a rig in virtual time. What is too much is left out,
    the oldest first, and counted in ``lost``.
    """

    def __init__(self) -> None:
        self._rows: deque[Array] = deque()
        self._leads: deque[tuple[float, float]] = deque()
        self._slot = -1.0
        self.lost = 0

    def add(self, rows: Array, now_s: float) -> None:
        """Take rows in the order of time; of those in one slot of time only the first."""
        if not len(rows):
            return
        self._leads.append((now_s, float(rows[-1, 0]) - now_s))
        slots = np.floor(rows[:, 0] * MOST_A_s + 1e-6)
        fresh = slots > np.concatenate([[self._slot], np.maximum.accumulate(slots)[:-1]])
        self._slot = max(self._slot, float(slots.max()))
        self._rows.extend(rows[fresh])
        while len(self._rows) > MOST_WAITING:
            self._rows.popleft()
            self.lost += 1

    def take(self, now_s: float) -> Array:
        """The rows (n, columns) that are due by now, at most `MOST_AT_ONCE`, the newest last."""
        while len(self._leads) > 1 and self._leads[0][0] < now_s - PACE_OVER_s:
            self._leads.popleft()
        if not self._rows:
            return np.zeros((0, 0))
        until = now_s + max(lead for _, lead in self._leads) - LAG_s
        due = []
        while self._rows and self._rows[0][0] <= until:
            due.append(self._rows.popleft())
        if len(due) > MOST_AT_ONCE:
            self.lost += len(due) - MOST_AT_ONCE
            due = due[-MOST_AT_ONCE:]
        return np.array(due) if due else np.zeros((0, 0))

    @property
    def waits(self) -> bool:
        """Whether there are rows that are not due yet."""
        return bool(self._rows)
