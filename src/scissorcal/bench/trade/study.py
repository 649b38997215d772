"""The measurements of a run: which there are, in which order, and one of them made."""

import json
import signal
import threading
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import PRESENT_ALIKE, Knob, make_knob
from scissorcal.bench.trade.next_capture import CAPTURES, NEXT_CAPTURE, Recapture
from scissorcal.bench.trade.point import Quantity, Sample, Setting
from scissorcal.bench.trade.together import PRESENT, RECOMMENDED, TOGETHER, Together
from scissorcal.errors import ScissorcalError

Record = Mapping[str, Any]


@dataclass(frozen=True)
class Task:
    """One repeat of one setting. ``choices`` are the settings that `Together` combines."""

    knob: str
    label: str
    repeat: int = 0
    choices: tuple[tuple[str, str], ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """What a record of this task equals in."""
        return (self.knob, self.label, self.repeat, self.choices)


PRESENT_TASK = Task(TOGETHER, PRESENT)

BEFORE_PRESENT_S = 3.0
"""Each knob may take so many of the seconds expected before the present fits are made."""


def key_of(record: Record) -> tuple[object, ...]:
    """The key of the task that a record is of."""
    choices = tuple((knob, label) for knob, label in record["choices"])
    return (record["knob"], record["label"], record["repeat"], choices)


def knob_of(task: Task) -> Knob:
    """The knob that a task turns."""
    if task.knob == NEXT_CAPTURE:
        return Recapture(task.choices)
    return Together(task.choices) if task.knob == TOGETHER else make_knob(task.knob)


def tasks_of(case: Case, names: Sequence[str]) -> tuple[Task, ...]:
    """All measurements of the knobs named, in the order in which a budget is spent.

    Each knob begins with its present setting, its cheapest, its reference; what lies between
    follows, the middle first, and second repeats come last. Knobs take turns so that the time
    expected for each grows alike: each has its coarse points before another has its fine ones.
    The present fits come early, since several knobs and the comparison of all settings at once need
    them, and after the quickest measurements, whose times tell how long the fits will take.
    """
    found: dict[Task, float] = {}
    for name in names:
        knob = make_knob(name)
        ordered = _ordered(knob.settings(case))
        tasks = [
            (Task(name, setting.label, repeat), setting)
            for repeat in range(max(knob.repeats(case, setting) for setting in ordered))
            for setting in ordered
            if repeat < knob.repeats(case, setting)
        ]
        spent = 0.0
        for task, setting in tasks:
            if setting.present and not task.repeat and name in PRESENT_ALIKE:
                found[PRESENT_TASK] = BEFORE_PRESENT_S
                continue
            spent += knob.expected_s(case, setting)
            found[task] = spent
    return tuple(sorted(found, key=lambda task: found[task]))


def capture_tasks(choice: tuple[str, str] | None = None) -> tuple[Task, ...]:
    """Simulated captures with the present settings, or with one knob (name, label) at a choice."""
    choices = () if choice is None else (choice,)
    label = PRESENT if choice is None else RECOMMENDED
    return tuple(Task(NEXT_CAPTURE, label, repeat, choices) for repeat in range(CAPTURES))


def records_of(case: Case, name: str, records: Iterable[Record]) -> list[Record]:
    """The records of a knob, that of the present settings among them where it has the same."""
    every = list(records)
    own = [record for record in every if record["knob"] == name]
    if name not in PRESENT_ALIKE:
        return own
    present = next(one for one in make_knob(name).settings(case) if one.present)
    alike = [record for record in every if key_of(record) == PRESENT_TASK.key]
    return [*own, *({**record, "knob": name, "label": present.label} for record in alike)]


def run_task(case: Case, task: Task, deadline: float | None = None) -> Record | None:
    """Measure one task; a setting that fails, or gives no number, is recorded with the reason.

    ``deadline`` is a time of `time.time`; None is returned where the measurement did not end by
    then, as far as this thread and system can interrupt it.
    """
    knob = knob_of(task)
    setting = setting_of(knob, case, task.label)
    began = time.time()
    record = {"knob": task.knob, "label": task.label, "repeat": task.repeat}
    record |= {"choices": [list(pair) for pair in task.choices], "began": began}
    before = baseline_s()
    try:
        with _until(deadline):
            measured: dict[str, Any] = _plain(knob.measure(case, setting, task.repeat))
            json.dumps(measured, allow_nan=False)
    except _OverdueError:
        return None
    except ScissorcalError as error:
        measured = {"failed": str(error)}
    except (ValueError, ArithmeticError) as error:
        measured = {"failed": f"The computation ended in {type(error).__name__}: {error}."}
    baseline = 0.5 * (before + baseline_s())
    return {**record, **measured, "baseline_s": baseline, "seconds": time.time() - began}


def setting_of(knob: Knob, case: Case, label: str) -> Setting:
    """The setting of a label. KeyError where the knob has none of it."""
    for setting in knob.settings(case):
        if setting.label == label:
            return setting
    raise KeyError(label)


def sample_of(record: Record) -> Sample:
    """The sample that a record holds."""
    costs = {name: Quantity(*pair) for name, pair in record["costs"].items()}
    return Sample(costs, record["outcome"], tuple(record["notes"]), tuple(record["rejected"]))


def _plain(sample: Sample) -> dict[str, Any]:
    found = asdict(sample)
    costs = {name: [cost.value, cost.unit] for name, cost in sample.costs.items()}
    return {**found, "costs": costs, "notes": list(sample.notes), "rejected": list(sample.rejected)}


def _ordered(settings: Sequence[Setting]) -> list[Setting]:
    """Present, cheapest, reference, then the middles of what is left between them."""
    best = max(settings, key=lambda one: one.accuracy)
    first = [one for one in settings if one.present] + [settings[0]]
    first += [best] if best.accuracy else []
    order = [*first, *(settings[place] for place in _middles(0, len(settings) - 1))]
    return list({one.label: one for one in order}.values())


def _middles(low: int, high: int) -> Iterable[int]:
    """All places from low to high: ends, middle, middles of the halves and so on."""
    yield low
    yield high
    spans = [(low, high)]
    while spans:
        low, high = spans.pop(0)
        middle = (low + high) // 2
        if middle != low:
            yield middle
            spans += [(low, middle), (middle, high)]


class _OverdueError(BaseException):
    """The time allowed for a measurement is over; not an Exception, so that no fit catches it."""


@contextmanager
def _until(deadline: float | None) -> Iterator[None]:
    """Interrupt what runs inside at a time; only the main thread of a POSIX process can be."""
    able = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if deadline is None or not able:
        yield
        return
    left = deadline - time.time()
    if left <= 0.0:
        raise _OverdueError

    def overdue(number: int, frame: object) -> None:
        raise _OverdueError

    before = signal.signal(signal.SIGALRM, overdue)
    signal.setitimer(signal.ITIMER_REAL, left)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


SIZE, ROUNDS = 160, 24


def baseline_s() -> float:
    """Processor seconds that the baseline step takes here and now.

    Fixed work of some 20 ms: linear solves of 160 equations, sines and a cumulative sum. Costs in
    multiples of it compare between machines better than seconds do.
    """
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(SIZE, SIZE)) + SIZE * np.eye(SIZE)
    vector = rng.normal(size=SIZE)
    began = time.process_time()
    for _ in range(ROUNDS):
        vector = np.asarray(np.linalg.solve(matrix, vector))
        vector += 1e-6 * np.cumsum(np.sin(matrix), axis=None)[:SIZE]
    return time.process_time() - began
