"""Which measurement is next, and which no longer fit into the time allowed."""

import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from statistics import median

from scissorcal.bench.trade.study import PRESENT_TASK, Record, Task

LARGEST_SHARE = 0.5
"""No measurement may be expected to take more than this share of the whole time: one long reference
must not use up what the other knobs need."""

PRESENT_SHARE = 0.7
"""The same for the present fits, which several knobs need."""


class Schedule:
    """Hands out tasks in their order, passing over those that would end after the deadline.

    ``expected`` are seconds of each task before anything was measured. Seconds that records tell
    take their place, for the same setting as they are, for others of the knob as a factor.
    ``reserve`` gives the seconds at the end that are not handed out, and ``later`` holds the tasks
    that wait for all others, and with ``hold`` are not handed out at all. Without ``deadline`` (of
    ``clock``) every task is handed out. No task may be expected to take more than ``share`` of the
    time that there is at the start (the present fits: than `PRESENT_SHARE`), nor ``stretch`` times
    what is left.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        expected: Mapping[Task, float],
        deadline: float | None = None,
        *,
        share: float = LARGEST_SHARE,
        stretch: float = 1.0,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self.left = list(tasks)
        self.reserve: Callable[[], float] = lambda: 0.0
        self.later: Container[Task] = ()
        self.hold = False
        self._expected = dict(expected)
        self._deadline, self._clock, self._stretch = deadline, clock, stretch
        self._whole = float("inf") if deadline is None else deadline - clock()
        self._share = share
        self._seconds: dict[tuple[str, str], list[float]] = {}
        self._factors: dict[str, list[float]] = {}

    def __iter__(self) -> Iterator[Task]:
        while (task := self._next()) is not None:
            self.left.remove(task)
            yield task

    def learn(self, record: Record) -> None:
        """Take the seconds that a measurement took into account."""
        knob, label, seconds = record["knob"], record["label"], float(record["seconds"])
        self._seconds.setdefault((knob, label), []).append(seconds)
        first = next(
            (s for task, s in self._expected.items() if (task.knob, task.label) == (knob, label)),
            None,
        )
        if first:
            self._factors.setdefault(knob, []).append(seconds / first)

    def factor(self, knob: str) -> float:
        """How much longer measurements of a knob take than was expected; of all, if none did."""
        every = [factor for own in self._factors.values() for factor in own]
        factors = self._factors.get(knob, every)
        return median(factors) if factors else 1.0

    def expected_s(self, task: Task) -> float:
        """Seconds that a task is expected to take, by all that is known now."""
        known = self._seconds.get((task.knob, task.label))
        return max(known) if known else self._expected.get(task, 0.0) * self.factor(task.knob)

    def least_s(self) -> float:
        """Seconds that must be left for the shortest of the tasks to be handed out."""
        shortest = min((self.expected_s(task) for task in self.left), default=0.0)
        return shortest / LARGEST_SHARE + self.reserve()

    def _next(self) -> Task | None:
        if self._deadline is None:
            return self.left[0] if self.left else None
        left = self._deadline - self.reserve() - self._clock()
        able = [task for task in self.left if self._fits(task, left)]
        first = next((task for task in able if task not in self.later), None)
        return first if first or self.hold else next(iter(able), None)

    def _fits(self, task: Task, left: float) -> bool:
        share = max(self._share, PRESENT_SHARE) if task == PRESENT_TASK else self._share
        return self.expected_s(task) <= min(self._stretch * left, share * self._whole)
