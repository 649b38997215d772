"""Samples that come in bursts, given out evenly, at the pace of the rig's clock."""

from collections import deque

import numpy as np

from scissorcal.aliases import Array

LAG_s = 0.2
"""By which samples are given out behind the newest that could be here: a recording grows by a chunk
each 0.15 s, and up to 0.05 s of samples wait for their block."""
PACE_OVER_s = 2.0
MOST_A_s = 250.0
"""Samples of each second of the rig that are kept."""
MOST_AT_ONCE = 250
MOST_WAITING = 2500


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
