"""`bench trade` in a workspace: its case, its measurements kept one by one, its results."""

import math
import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from scissorcal.aliases import Progress
from scissorcal.bench.trade import knob as knobs
from scissorcal.bench.trade.assemble import (
    curve_of,
    limit_of,
    measured_curve,
    reference_of,
    refits,
    to_simulate,
    without_prospect,
)
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import PRESENT_ALIKE, make_knob
from scissorcal.bench.trade.next_capture import CAPTURES
from scissorcal.bench.trade.point import Curve, Quantity, Spread
from scissorcal.bench.trade.recommend import choices_of, together_sentence
from scissorcal.bench.trade.result import FORMAT, Trade
from scissorcal.bench.trade.schedule import Schedule
from scissorcal.bench.trade.study import (
    PRESENT_TASK,
    Task,
    capture_tasks,
    key_of,
    knob_of,
    records_of,
    run_task,
    setting_of,
    tasks_of,
)
from scissorcal.bench.trade.together import RECOMMENDED, TOGETHER, Together
from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.identity import VERSION
from scissorcal.report.build import twin_text
from scissorcal.report.trade import trade_page
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import Processes, TradeOptions
from scissorcal.workday.pool import Pool, open_pool, unpacked
from scissorcal.workday.records import Record, RecordFile
from scissorcal.workday.runs.bench_case import (
    LOCAL_KNOBS,
    ON_A_CLUSTER,
    coverage_notes,
    inputs_hash,
    load_case,
    machine,
    wanted_knobs,
)
from scissorcal.workday.workspace import Workspace

FINISH_S = 2.0
"""Time within a budget for writing the results."""

RESERVED_SHARE = 0.5
"""At most this share of a budget is kept for simulated captures, and for measuring all recommended
settings at once."""

STRETCH = 2.0
"""All recommended settings are begun where this many times the time left is expected for them."""


def trade_workspace(
    workspace: Workspace,
    chosen: TradeOptions = TradeOptions(),
    processes: Processes = Processes(),
    progress: Progress | None = None,
    began: float | None = None,
) -> tuple[Trade, tuple[str, ...]]:
    """Measure how cost buys accuracy on a workspace's own recordings, scene and fits.

    Each measurement is kept in bench/trade.partial.jsonl as soon as it is made, so that a killed
    run goes on where it was and nothing is measured twice on the same inputs and computer, unless
    ``force``; what failed is tried again by the next run. Knobs that read photographs are left out
    on a cluster. ``began`` is the time (of `time.time`) from which the budget counts. The page is
    written to bench/trade.html, its JSON twin to bench/trade.json. Gives the result, and sentences
    to say on the side.

    Raises MissingError where a fit that the scene needs is missing or stale, InputError where a
    knob is unknown or not of this scene, the budget is too small for any measurement, the cluster
    cannot be used, or another run holds the file.
    """
    start = time.time() if began is None else began
    tell = progress or (lambda done, sentence: None)
    tell(0.0, "reading recordings and fits")
    engine = Engine.of(workspace)
    case = load_case(engine, chosen.seed)
    names = wanted_knobs(case, chosen.knobs or (), on_cluster=processes.cluster is not None)
    shown = names if chosen.knobs else tuple(knobs.KNOBS)
    deadline = None if chosen.budget_s is None else start + chosen.budget_s - FINISH_S
    inputs = inputs_hash(engine, case)
    with RecordFile(workspace.trade_partial_path, inputs) as file:
        if chosen.force:
            file.keep([one for one in file.records if not _forced(one, chosen.knobs or ())])
        left_out = {} if processes.cluster is None else dict.fromkeys(LOCAL_KNOBS, ON_A_CLUSTER)
        run = _Run(case, file, chosen.budget_s, deadline, tell, left_out)
        with open_pool(processes) as pool:
            together = None
            for keep_time in (True, False):  # time that was kept and not needed goes to the knobs
                if run.measure(pool, names, keep_time=keep_time) or keep_time:
                    run.simulate(pool, names)
                    curves = run.curves(shown)
                    together = run.together(pool, curves) if len(names) > 1 else None
        trade = run.result(engine, curves, together, time.time() - start, pool.workers)
        notes = (file.note,) if file.note else ()
    for path, text in (
        (workspace.trade_json, twin_text(trade)),
        (workspace.trade_html, trade_page(trade)),
    ):
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8")
    return trade, notes


class _Run:
    """One run over a record file: what it measures, how long it may, and what comes of it.

    ``left_out`` says of knobs why this run measures none of them.
    """

    def __init__(
        self,
        case: Case,
        file: RecordFile,
        budget_s: float | None,
        deadline: float | None,
        tell: Progress,
        left_out: Mapping[str, str],
    ) -> None:
        self._case, self._file, self._tell = case, file, tell
        self._budget_s, self._deadline = budget_s, deadline
        self._blob = pickle.dumps(case)
        self._began, self.made = time.time(), 0
        self._left_out = left_out
        # a missing tool may be installed by now: what failed before is tried again
        self._failed = {key_of(one) for one in self._records if "failed" in one}

    @property
    def _records(self) -> list[Record]:
        """The newest record of each task."""
        return list({key_of(record): record for record in self._file.records}.values())

    def _known(self) -> list[Record]:
        """Records of the tasks that are not measured again."""
        return [record for record in self._records if key_of(record) not in self._failed]

    def measure(self, pool: Pool, names: Sequence[str], *, keep_time: bool = True) -> bool:
        """Measure the tasks of the knobs named that have no record yet; whether any was.

        Of a budget some is left for all recommended settings at once. With ``keep_time`` some is
        left for simulated captures too, and only what can lead to a recommendation is measured.
        """
        together = Together(())
        present = together.settings(self._case)[0]
        schedule = self._schedule(tasks_of(self._case, names), self._known())
        planned = len(schedule.left)

        def reserve() -> float:
            # without the present fits there is nothing to compare all settings at once with
            if self._budget_s is None or PRESENT_TASK in schedule.left:
                return 0.0
            once = together.expected_s(self._case, present) * schedule.factor(TOGETHER)
            # all settings at once, and captures with the present and two recommended ones
            count = (len(names) > 1) + (3 * CAPTURES if keep_time else 0)
            return min(count * once, RESERVED_SHARE * self._budget_s)

        schedule.reserve = reserve
        schedule.hold = keep_time and self._budget_s is not None

        def order() -> None:
            schedule.later = without_prospect(self._case, names, self._records)

        order()
        before = self.made
        self._work(pool, schedule, order)
        if not self._file.records and self._budget_s is not None and planned and not keep_time:
            fixed = self._budget_s - (self._deadline or 0.0) + self._began
            least = max(fixed + 2.0 * schedule.least_s(), 3.0 * self._budget_s)
            raise InputError(
                f"A budget of {self._budget_s:g} s is too small for any measurement of this scene: "
                f'try --budget "{10 * math.ceil(0.1 * least)} s".'
            )
        return self.made > before

    def simulate(self, pool: Pool, names: Sequence[str]) -> None:
        """Try the settings that would be recommended on simulated captures, the cheapest first.

        The present settings come before all others, which are compared with them in pairs.
        """
        if self._case.friction_fit is None:
            return
        if any(refits(make_knob(name)) for name in names):
            self._captured(pool, capture_tasks())
        while wanted := to_simulate(self._case, names, self._records):
            tasks = [task for one in wanted for task in capture_tasks(one)]
            if not self._captured(pool, sorted(tasks, key=lambda task: task.repeat)):
                return

    def _captured(self, pool: Pool, tasks: Sequence[Task]) -> bool:
        """Measure simulated captures that have no record yet; whether any was."""
        known = {key_of(record) for record in self._records}
        left = [task for task in tasks if task.key not in known]
        before = self.made
        self._work(pool, self._schedule(left, (), share=1.0))
        return self.made > before

    def _schedule(
        self, tasks: Sequence[Task], records: Sequence[Record], **limits: Any
    ) -> Schedule:
        """The tasks that none of the records is of, with what all known records tell of times."""
        known = {key_of(record) for record in records}
        expected = {}
        for task in tasks:
            knob = knob_of(task)
            expected[task] = knob.expected_s(self._case, setting_of(knob, self._case, task.label))
        left = [task for task in tasks if task.key not in known]
        schedule = Schedule(left, expected, self._deadline, **limits)
        for record in self._known():
            schedule.learn(record)
        return schedule

    def curves(self, names: Sequence[str]) -> tuple[Curve, ...]:
        """The curves of the knobs named, from all records; of those left out, why."""
        case, limit = self._case, limit_of(self._case)
        found = []
        for name in names:
            curve = curve_of(case, make_knob(name), self._of(name), limit, self._records)
            if name in self._left_out and not curve.missing:
                why = self._left_out[name]
                curve = replace(curve, points=(), unmeasured=(), sentences=(), missing=why)
            found.append(curve)
        return tuple(found)

    def together(self, pool: Pool, curves: Sequence[Curve]) -> Curve | None:
        """Measure the present and all recommended settings.

        None where they are the same, but for settings that this measurement does not hold.
        """
        effort = make_knob("effort")
        reference, against = reference_of(self._case, effort, self._of("effort"))
        choices = choices_of(curves)
        if reference is None or not choices:
            return None
        present = {c.knob: p.setting.label for c in curves for p in c.points if p.setting.present}
        differing = [pair for pair in choices if present.get(pair[0]) != pair[1]]
        changed = tuple(pair for pair in differing if make_knob(pair[0]).combined)
        if not changed:
            return None
        apart = [
            f"{make_knob(name).title} ({label})"
            for name, label in differing
            if not make_knob(name).combined
        ]
        tasks = [PRESENT_TASK, Task(TOGETHER, RECOMMENDED, choices=changed)]
        # nothing else waits for the time that is left, so it is used even where it may not do
        schedule = self._schedule(tasks, self._known(), share=STRETCH, stretch=STRETCH)
        self._work(pool, schedule)
        keys = {task.key for task in tasks}
        own = [record for record in self._of(TOGETHER) if key_of(record) in keys]
        curve = measured_curve(self._case, Together(changed), own, reference)
        sentences = (together_sentence(curve, apart),)
        return replace(curve, against=against, sentences=sentences) if own else None

    def result(
        self,
        engine: Engine,
        curves: tuple[Curve, ...],
        together: Curve | None,
        seconds: float,
        workers: int,
    ) -> Trade:
        """Everything that was found, with the sentences that it ends in."""
        records = self._records
        sentences = [
            f"{curve.title}: {curve.sentences[0]}"
            for curve in curves
            if curve.points and curve.sentences
        ]
        if together is not None:
            sentences += together.sentences
        notes = [f"{curve.title}: {curve.missing}" for curve in curves if curve.missing]
        if untouched := [c.title for c in curves if not c.points and not c.missing]:
            notes.append(f"Not measured at all within the budget: {'; '.join(untouched)}.")
        notes += coverage_notes(engine)
        if workers > 1:
            notes.append(
                f"{workers} measurements were made at a time: times are processor seconds, which "
                "shared caches and memory make somewhat longer than one measurement alone would."
            )
        return Trade(
            format=FORMAT,
            created=datetime.now(UTC),
            scissorcal_version=VERSION,
            recipe_name=engine.recipe.name,
            material=engine.recipe.material.name,
            simulated=self._case.simulated,
            machine="; ".join(dict.fromkeys(record["machine"] for record in records)),
            workers=workers,
            seconds=round(seconds, 1),
            budget_s=self._budget_s,
            tolerance=engine.recipe.scene.tolerance_percent / 100.0,
            limit=limit_of(self._case),
            baseline=Spread.of([Quantity(1e3 * r["baseline_s"], "ms") for r in records]),
            measured=len(records),
            measured_now=self.made,
            curves=curves,
            together=together,
            sentences=tuple(sentences),
            notes=tuple(notes),
        )

    def _of(self, name: str) -> list[Record]:
        return records_of(self._case, name, self._records)

    def _work(
        self,
        pool: Pool,
        schedule: Schedule,
        learned: Callable[[], None] = lambda: None,
    ) -> None:
        """Make measurements, keep each, and call ``learned`` after it.

        Within a budget no worker is handed a second one.
        """
        jobs = (
            (self._blob, task, self._deadline and self._deadline - schedule.reserve())
            for task in schedule
        )
        done, count = 0, len(schedule.left)

        def keep(record: Record | None) -> None:
            nonlocal done
            done += 1
            if record is None:
                return
            self._file.append(record)
            self._failed.discard(key_of(record))
            schedule.learn(record)
            self.made += 1
            learned()
            share = done / max(count, done)
            if self._budget_s is not None:
                spent = time.time() - (self._deadline or 0.0) + self._budget_s
                share = max(share, min(spent / self._budget_s, 0.99))
            self._tell(share, f"{record['knob']}: {record['label']}")

        handed = pool if self._deadline is None else replace(pool, ahead=1)
        handed.work(_do, jobs, keep, dict[str, Any] | None)


def _do(job: tuple[bytes, Task, float | None]) -> Record | None:
    blob, task, end = job
    record = run_task(unpacked(blob), task, end)
    return record and {**record, "machine": machine()}


def _forced(record: Record, names: Sequence[str]) -> bool:
    """Whether a record is of one of the knobs named, or of the settings that they have now."""
    alike = key_of(record) == PRESENT_TASK.key and any(name in PRESENT_ALIKE for name in names)
    return not names or record["knob"] in names or alike
