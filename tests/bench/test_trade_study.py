"""Which measurements a run makes, in which order, and within which time."""

import time
from dataclasses import replace

import pytest

from scissorcal.bench.trade import fits, study
from scissorcal.bench.trade import knob as knobs
from scissorcal.bench.trade.assemble import (
    curve_of,
    limit_of,
    reference_of,
    to_simulate,
    without_prospect,
)
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import KNOBS, make_knob
from scissorcal.bench.trade.knobs.effort import Effort
from scissorcal.bench.trade.next_capture import NEXT_CAPTURE
from scissorcal.bench.trade.point import Sample, Setting
from scissorcal.bench.trade.schedule import Schedule
from scissorcal.bench.trade.study import PRESENT_TASK, Record, Task, records_of, run_task, tasks_of
from scissorcal.bench.trade.torque import WORST
from tests.bench.made_trade import ERRORS, FAILING, MADE, Slow, Steps, made_case
from tests.package.fits import friction_fit


@pytest.fixture(autouse=True)
def made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(knobs, "KNOBS", MADE)


class Clock:
    """Time that passes only where a test lets it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_every_setting_is_measured_as_often_as_its_knob_says() -> None:
    tasks = tasks_of(made_case(), ["steps"])
    assert len(set(tasks)) == len(tasks) == 2 * (len(ERRORS) + 1)
    first = [task.label for task in tasks[:4]]
    assert first[:2] == ["fine", "coarse"]
    assert {task.repeat for task in tasks[:4]} == {0}


def test_knobs_take_turns() -> None:
    order = [task.knob for task in tasks_of(made_case(), ["steps", "broken"])]
    assert set(order[:2]) == set(order[2:4]) == {"steps", "broken"}


def run_schedule(budget: float, factor: float, reserve: float = 0.0) -> tuple[float, list[Task]]:
    """Work through a schedule in virtual time; give its end and what was handed out."""
    case, clock = made_case(), Clock()
    tasks = tasks_of(case, ["steps"])
    knob = make_knob("steps")
    sizes = {one.label: one.size for one in knob.settings(case)}
    expected = {task: sizes[task.label] for task in tasks}
    schedule = Schedule(tasks, expected, clock.now + budget, clock=clock)
    schedule.reserve = lambda: reserve
    handed = []
    for task in schedule:
        took = factor * sizes[task.label]
        clock.now += took
        schedule.learn({"knob": task.knob, "label": task.label, "seconds": took})
        handed.append(task)
    return clock.now - 100.0, handed


def test_no_measurement_is_begun_that_would_not_end_in_time() -> None:
    for budget in (1.0, 4.0, 9.0, 13.0, 19.0):
        end, _ = run_schedule(budget, 1.0)
        assert end <= budget
    end, handed = run_schedule(9.0, 1.0, reserve=5.0)
    assert end <= 4.0
    assert handed


def test_the_present_fits_may_take_most_of_the_time_and_others_half_of_it() -> None:
    clock = Clock()
    other = Task("steps", "fine")
    schedule = Schedule(
        [other, PRESENT_TASK], {PRESENT_TASK: 7.0, other: 7.0}, clock.now + 10.0, clock=clock
    )
    assert next(iter(schedule)) == PRESENT_TASK
    assert list(schedule) == []
    too_long = Schedule([PRESENT_TASK], {PRESENT_TASK: 9.0}, clock.now + 10.0, clock=clock)
    assert list(too_long) == []


def test_the_present_fits_follow_the_quickest_measurements(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "PRESENT_ALIKE", ("steps",))
    order = tasks_of(made_case(), ["broken", "steps"])
    assert order.index(Task("steps", "coarse")) < order.index(PRESENT_TASK)
    assert order.index(PRESENT_TASK) < order.index(Task("broken", "coarse"))
    assert Task("steps", "fine") not in order


def test_measured_times_take_the_place_of_expected_ones() -> None:
    end, handed = run_schedule(30.0, 3.0)
    assert end <= 30.0
    assert len(handed) < len(run_schedule(30.0, 1.0)[1])


def test_without_a_budget_everything_is_measured() -> None:
    tasks = tasks_of(made_case(), ["steps"])
    assert list(Schedule(tasks, {})) == list(tasks)


class Barred(Steps):
    """A knob of which every cheaper setting fails a check."""

    name = "barred"

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Reject all but the present one."""
        found = super().measure(case, replace(setting, label="coarse"), repeat)
        return replace(found, rejected=() if setting.present else ("bound share",))


def test_what_can_recommend_nothing_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    here = {"barred": f"{__name__}:Barred", "plate": f"{__name__}:Unfelt"}
    monkeypatch.setattr(knobs, "KNOBS", {**MADE, **here})
    case, names = made_case(), ["steps", "barred", "plate"]
    tasks = tasks_of(case, names)
    waiting = without_prospect(case, names, [])
    assert {task for task in tasks if task.knob == "plate"} <= waiting
    # what is listed after the present setting is dearer, and no reference
    first = {task for task in waiting if task.knob == "steps"}
    assert {task.label for task in first if not task.repeat} == {FAILING}
    assert {task for task in tasks if task.repeat} <= waiting
    made = [run_task(case, task) for task in tasks if task.label in ("fine", "coarse")]
    waiting = without_prospect(case, names, [record for record in made if record])
    assert {task for task in tasks if task.knob == "barred"} <= waiting
    assert Task("steps", "middle") not in waiting
    schedule = Schedule(tasks, dict.fromkeys(tasks, 1.0), time.time() + 1e3)
    schedule.later = waiting
    order = list(schedule)
    assert set(order) == set(tasks)
    assert set(order[-len(waiting) :]) == waiting
    held = Schedule(tasks, dict.fromkeys(tasks, 1.0), time.time() + 1e3)
    held.later, held.hold = waiting, True
    assert set(held) == set(tasks) - waiting


def test_what_would_be_recommended_is_tried_on_simulated_captures() -> None:
    case = replace(made_case(), friction_fit=friction_fit(symmetric=False))
    records = [record for task in tasks_of(case, ["steps"]) if (record := run_task(case, task))]
    assert to_simulate(case, ["steps"], records) == [("steps", "middle")]
    assert to_simulate(made_case(), ["steps"], records) == []
    for choices in ([], [["steps", "middle"]]):
        records += [
            {
                "knob": NEXT_CAPTURE,
                "label": "",
                "repeat": k,
                "choices": choices,
                "outcome": {WORST: e},
            }
            for k, e in enumerate((0.01, 0.02))
        ]
    assert to_simulate(case, ["steps"], records) == []
    curve = curve_of(case, make_knob("steps"), records_of(case, "steps", records), 0.02, records)
    assert "2 captures simulated from the fits" in curve.sentences[0]


class Unfelt(Steps):
    """A knob whose error is not one of torque."""

    name, of_torque = "plate", False


def test_a_setting_that_fails_is_recorded_with_its_reason() -> None:
    record = run_task(made_case(), Task("steps", FAILING))
    assert record is not None
    assert record["failed"] == "No step is that fine."
    record = run_task(made_case(), Task("broken", "fine"))
    assert record is not None
    assert "ValueError" in record["failed"]


def test_a_measurement_is_interrupted_at_the_deadline() -> None:
    """One that comes to an end gives a record."""
    assert run_task(made_case(), Task("slow", "fine"), time.time() + 0.3) is None


def test_a_curve_is_made_of_the_records_of_its_knob() -> None:
    case, knob = made_case(), make_knob("steps")
    records = [
        record
        for task in tasks_of(case, ["steps"])
        if task.label != "middle" and (record := run_task(case, task))
    ]
    curve = curve_of(case, knob, records, limit_of(case))
    assert curve.unmeasured == ("middle",)
    by_label = {point.setting.label: point for point in curve.points}
    assert by_label[FAILING].failed == "No step is that fine."
    coarse = by_label["coarse"].costs[knob.cost]
    assert (coarse.median, coarse.low, coarse.high, coarse.repeats) == (1.05, 1.0, 1.1, 2)
    assert coarse.ratio is not None
    assert coarse.ratio > 0.0
    assert by_label["fine"].recommended
    assert {label for label, point in by_label.items() if point.front} == {"coarse", "fine"}


def efforts(*labels: str, **rejected: list[str]) -> list[Record]:
    """Records of efforts, with the checks that each fails."""
    return [
        {"label": label, "repeat": 0, "costs": {}, "outcome": {}, "notes": [], "rejected": checks}
        for label in labels
        for checks in [rejected.get(label, [])]
    ]


def test_a_reference_that_stands_for_a_better_one_says_why() -> None:
    case, knob = made_case(), Effort()
    every = ("draft", "standard", "thorough")
    for records, said in (
        (efforts(*every), "the most thorough effort (thorough)"),
        (efforts(*every[:2]), "(thorough was not measured)"),
        (efforts(*every, thorough=["k-hat"]), "(thorough fails the check k-hat)"),
        (
            [*efforts(*every[:2]), {"label": "thorough", "failed": "It broke."}],
            "(thorough gave no result)",
        ),
    ):
        sample, against = reference_of(case, knob, records)
        assert sample is not None
        if said.startswith("("):
            said = f"standard, in place of the most thorough effort {said}"
        assert against == said
    assert reference_of(case, knob, []) == (None, "the most thorough effort")


def test_draft_effort_says_that_it_compares_no_laws(monkeypatch: pytest.MonkeyPatch) -> None:
    remarks = {one.label: one.remark for one in Effort().settings(made_case())}
    assert remarks == {"draft": fits.DRAFT_NOTE, "standard": "", "thorough": ""}
    monkeypatch.setattr(fits, "fit_case", lambda case, repeat: (None, None, {}, ()))
    monkeypatch.setattr(fits, "fits_outcome", lambda *_: {})
    assert fits.measure_fits(replace(made_case(), effort="draft"), 0).notes == (fits.DRAFT_NOTE,)
    assert fits.measure_fits(made_case(), 0).notes == ()


def test_the_limit_is_the_tolerance_over_the_knobs_of_torque(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    case = made_case(tolerance_percent=6.0)
    assert limit_of(case) == pytest.approx(0.06 / len(MADE))
    monkeypatch.setattr(Slow, "of_torque", False)
    assert limit_of(case) == pytest.approx(0.06 / (len(MADE) - 1))
    monkeypatch.setattr(knobs, "KNOBS", {"steps": MADE["steps"]})
    assert limit_of(case) == pytest.approx(0.06)


def test_every_knob_can_be_made_and_names_itself() -> None:
    for name in KNOBS:
        module, _, attribute = KNOBS[name].partition(":")
        found = getattr(__import__(module, fromlist=[attribute]), attribute)()
        assert found.name == name
        assert found.title
        assert found.cost
        assert found.error
