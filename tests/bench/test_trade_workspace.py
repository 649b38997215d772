"""`bench trade` in a workspace: measurements kept, runs that go on, files and refusals."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import jsonschema
import pytest

from scissorcal.bench.trade import knob as knobs
from scissorcal.bench.trade import study
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Curve, Error, Point, Sample, Setting, Spread
from scissorcal.bench.trade.result import FORMAT, Trade, read_trade
from scissorcal.bench.trade.schedule import Schedule
from scissorcal.bench.trade.study import Task
from scissorcal.bench.trade.together import PRESENT, RECOMMENDED, TOGETHER, Together
from scissorcal.bench.trade.torque import WORST
from scissorcal.errors import InputError, MissingError
from scissorcal.recipe import schemas_dir
from scissorcal.report import twin_text
from scissorcal.workday import ON_A_CLUSTER, Processes, TradeOptions, Workspace, trade_workspace
from scissorcal.workday.runs import bench
from tests.bench.made_trade import ERRORS, FAILING, MADE, Slow, Steps, made_case
from tests.guard import GUARD_S
from tests.workday.made import quick_workspace

ALL = 2 * (len(ERRORS) + 1)
FAILED = 2
"""Measurements of the setting that fails."""


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A workspace whose case is made up and whose only knob is `Steps`."""
    monkeypatch.setattr(knobs, "KNOBS", {"steps": MADE["steps"]})
    monkeypatch.setattr(bench, "load_case", lambda engine, seed: made_case())
    monkeypatch.setattr(bench, "inputs_hash", lambda engine, case: "these inputs")
    monkeypatch.setattr(study, "baseline_s", lambda: 0.02)
    return quick_workspace(tmp_path / "paper")


class Ran(NamedTuple):
    trade: Trade
    notes: tuple[str, ...]
    html: Path
    json: Path


def run(workspace: Workspace, cluster: str | None = None, **options: object) -> Ran:
    processes = Processes(None if cluster else 1, cluster)
    found = trade_workspace(workspace, TradeOptions(**options), processes)  # type: ignore[arg-type]
    return Ran(*found, workspace.trade_html, workspace.trade_json)


def test_a_run_writes_a_page_and_a_twin_that_keeps_its_schema(workspace: Workspace) -> None:
    found = run(workspace)
    assert (found.trade.measured, found.trade.measured_now) == (ALL, ALL)
    page = found.html.read_text(encoding="utf-8")
    assert "<script src" not in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    for words in ("Steps", "coarse", "No step is that fine.", "Pareto front", "middle is enough"):
        assert words in page
    twin = json.loads(found.json.read_text(encoding="utf-8"))
    schema = json.loads((schemas_dir() / "trade.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(twin, schema)
    assert read_trade(found.json) == found.trade


def test_a_second_run_measures_nothing_again(workspace: Workspace) -> None:
    first = run(workspace)
    again = run(workspace)
    assert (again.trade.measured, again.trade.measured_now) == (ALL, FAILED)
    assert again.trade.curves == first.trade.curves
    assert run(workspace, force=True).trade.measured_now == ALL


def test_what_failed_is_tried_again_and_the_newest_counts(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert [p.failed for p in run(workspace).trade.curves[0].points if p.failed]
    measure = Steps.measure

    def able(self: Steps, case: Case, setting: Setting, repeat: int) -> Sample:
        return measure(self, case, replace(setting, label="fine"), repeat)

    monkeypatch.setattr(Steps, "measure", able)
    found = run(workspace).trade
    assert (found.measured, found.measured_now) == (ALL, FAILED)
    (point,) = [p for p in found.curves[0].points if p.setting.label == FAILING]
    assert point.failed == ""
    assert point.costs["processor time"].repeats == 2
    assert run(workspace).trade.measured_now == 0


def test_force_measures_only_the_knobs_that_are_named(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(knobs, "KNOBS", {name: MADE[name] for name in ("steps", "other")})
    monkeypatch.setattr(bench._Run, "together", lambda *_: None)
    assert run(workspace).trade.measured == 2 * ALL
    found = run(workspace, knobs=("other",), force=True).trade
    assert (found.measured, found.measured_now) == (2 * ALL, ALL)
    assert run(workspace).trade.measured_now == 2 * FAILED
    assert run(workspace, force=True).trade.measured_now == 2 * ALL


def test_force_measures_the_present_settings_of_a_knob_again(workspace: Workspace) -> None:
    present = {"knob": TOGETHER, "label": PRESENT, "repeat": 0, "choices": []}
    recommended = {**present, "label": RECOMMENDED, "choices": [["effort", "draft"]]}
    tables = {**present, "knob": "tables", "label": "coarse"}
    kept = {
        names: [one for one in (present, recommended, tables) if not bench._forced(one, names)]
        for names in ((), ("effort",), ("tables",))
    }
    assert kept == {
        (): [],
        ("effort",): [recommended, tables],
        ("tables",): [present, recommended],
    }


def test_each_measurement_names_the_computer_that_made_it(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "machine", lambda: "one computer")
    run(workspace)
    monkeypatch.setattr(bench, "machine", lambda: "another computer")
    found = run(workspace)
    assert found.trade.machine == "one computer; another computer"
    page = found.html.read_text(encoding="utf-8")
    assert "computer</th><td>one computer; another computer</td>" in page


def test_a_cluster_measures_no_photographs_and_says_why(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(knobs, "KNOBS", {"steps": MADE["steps"], "plate": MADE["plate"]})
    monkeypatch.setattr(bench._Run, "together", lambda *_: None)
    whole = bench.open_pool
    monkeypatch.setattr(bench, "open_pool", lambda processes: whole(Processes(1)))
    run(workspace, knobs=("plate",))
    found = run(workspace, "tcp://host:1")
    assert found.trade.measured_now == ALL
    steps, plate = found.trade.curves
    assert len(steps.points) == len(ERRORS) + 1
    assert (plate.points, plate.missing) == ((), ON_A_CLUSTER)
    assert f"{plate.title}: {ON_A_CLUSTER}" in found.trade.notes
    page = found.html.read_text(encoding="utf-8")
    assert "photographs are read from files of this computer" in page
    with pytest.raises(InputError, match="--knob plate: It is left out with --cluster"):
        run(workspace, "tcp://host:1", knobs=("plate",))


def test_an_interrupted_run_goes_on_where_it_was(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run(workspace).trade
    path = workspace.trade_partial_path
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[:4]) + lines[4][:30], encoding="utf-8")
    lost = sum('"failed"' in line for line in lines[:4])
    found = run(workspace)
    assert (found.trade.measured, found.trade.measured_now) == (ALL, ALL - 3 + lost)
    assert found.notes == ()
    labels = [[point.setting.label for point in one.points] for one in found.trade.curves]
    assert labels == [[point.setting.label for point in one.points] for one in whole.curves]


def test_measurements_of_other_inputs_are_put_aside(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(workspace)
    monkeypatch.setattr(bench, "inputs_hash", lambda engine, case: "other inputs")
    found = run(workspace)
    assert found.trade.measured_now == ALL
    assert "made from other inputs" in found.notes[0]


def test_measurements_of_another_version_are_put_aside(workspace: Workspace) -> None:
    workspace.trade_partial_path.parent.mkdir()
    old = '{"format": "scissorcal-records/0", "inputs": "these inputs"}\n'
    workspace.trade_partial_path.write_text(old, encoding="utf-8")
    found = run(workspace)
    assert found.trade.measured_now == ALL
    assert "kept as trade.partial.jsonl.unreadab" in found.notes[0]


def test_a_budget_too_small_for_anything_is_refused_with_one_that_is_enough(
    workspace: Workspace,
) -> None:
    with pytest.raises(InputError, match=r"budget of 2 s is too small .* try --budget \"\d+ s\""):
        run(workspace, budget_s=2.0)
    assert not workspace.trade_html.exists()


def test_a_budget_says_what_was_left_out(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hardly_any(case: Case, names: object) -> tuple[object, ...]:
        return whole(case, ["steps"])[:2]

    whole = study.tasks_of
    monkeypatch.setattr(bench, "tasks_of", hardly_any)
    found = run(workspace, budget_s=GUARD_S)
    assert found.trade.curves[0].unmeasured == ("middle", FAILING)
    assert found.trade.budget_s == GUARD_S
    assert "Not measured within the budget: middle" in found.html.read_text(encoding="utf-8")


def test_a_knob_that_a_budget_leaves_out_as_a_whole_is_named(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = {name: MADE[name] for name in ("steps", "slow")}
    monkeypatch.setattr(knobs, "KNOBS", every)
    whole = study.tasks_of
    monkeypatch.setattr(bench, "tasks_of", lambda case, names: whole(case, ["steps"]))
    monkeypatch.setattr(Slow, "title", "Slow steps")
    monkeypatch.setattr(bench._Run, "together", lambda *_: None)
    found = run(workspace, budget_s=GUARD_S)
    assert "Not measured at all within the budget: Slow steps." in found.trade.notes
    page = found.html.read_text(encoding="utf-8")
    assert "No setting was measured within the budget." in page


def test_time_kept_for_all_settings_at_once_is_used_where_there_is_nothing_to_compare(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(knobs, "KNOBS", {name: MADE[name] for name in ("steps", "broken")})
    monkeypatch.setattr(study, "PRESENT_ALIKE", ())
    monkeypatch.setattr(bench._Run, "together", lambda *_: None)
    kept = []
    whole = bench._Run.measure

    def noted(self: bench._Run, *arguments: Any, keep_time: bool) -> bool:
        kept.append(keep_time)
        return whole(self, *arguments, keep_time=keep_time)

    monkeypatch.setattr(bench._Run, "measure", noted)
    assert run(workspace, budget_s=600.0).trade.measured == 2 * ALL
    assert kept == [True, False]


def both_settings(knob: str) -> Curve:
    """A curve whose recommended setting is another than the present one."""
    spread, error = Spread(1.0, 1.0, 1.0, "s"), Error(1e-3, "N m", 1e-3)
    points = tuple(
        Point(Setting(label, 1.0, present=now), {"time": spread}, {"e": error}, recommended=not now)
        for label, now in (("as now", True), ("less", False))
    )
    return Curve(knob, knob, "time", "e", points)


def test_what_changes_nothing_at_once_is_named_and_alone_not_measured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def record(task: Task) -> dict[str, Any]:
        made = {"knob": task.knob, "label": task.label, "repeat": 0, "seconds": 1.0}
        made |= {"choices": task.choices, "baseline_s": 0.02, "outcome": {}, "notes": []}
        return made | {"costs": {"processor time": [2.0, "s"]}, "rejected": []}

    asked: list[Task] = []
    file = SimpleNamespace(records=[record(Task("effort", "standard"))])

    def work(self: object, pool: object, schedule: Schedule) -> None:
        asked.extend(schedule.left)
        file.records += [record(task) for task in schedule.left]

    def errors(self: object, *_: object) -> dict[str, Error]:
        return {WORST: Error(1e-3, "N m", 1e-3)}

    monkeypatch.setattr(bench._Run, "_work", work)
    monkeypatch.setattr(Together, "errors", errors)
    found = bench._Run(made_case(), file, None, None, lambda *_: None, {})  # type: ignore[arg-type]
    assert found.together(None, [both_settings("rate")]) is None  # type: ignore[arg-type]
    assert asked == []
    curve = found.together(  # type: ignore[arg-type]
        None, [both_settings("rate"), both_settings("tables")]
    )
    assert asked[-1] == Task(TOGETHER, RECOMMENDED, choices=(("tables", "less"),))
    assert curve is not None
    assert curve.sentences[0].endswith(
        "Not part of this measurement, which they do not change: Loop rate (less)."
    )
    assert curve.against.startswith("standard, in place of the most thorough effort")


def test_an_unknown_knob_is_refused(workspace: Workspace) -> None:
    with pytest.raises(InputError, match="--knob speed is no knob; choose from steps"):
        run(workspace, knobs=("speed",))


def test_a_knob_that_the_scene_does_not_have_is_refused(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Steps, "missing", lambda self, case: "Nothing has steps here.")
    with pytest.raises(InputError, match="does not have it"):
        run(workspace, knobs=("steps",))


def test_a_workspace_without_fits_says_what_comes_first(tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="There is no fit of friction yet: run 'scissorcal"):
        run(quick_workspace(tmp_path / "paper"))


def test_results_of_another_version_are_refused(workspace: Workspace) -> None:
    with pytest.raises(MissingError, match="run 'scissorcal bench trade' first"):
        read_trade(workspace.trade_json)
    path = run(workspace).json
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(FORMAT, "scissorcal-trade/0"), encoding="utf-8")
    with pytest.raises(InputError, match="is of format scissorcal-trade/0"):
        read_trade(path)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="holds no results"):
        read_trade(path)
    plain = json.loads(text)
    del plain["curves"]
    path.write_text(json.dumps(plain), encoding="utf-8")
    with pytest.raises(InputError, match="is damaged at curves"):
        read_trade(path)


def test_the_twin_reads_back_as_it_was(workspace: Workspace) -> None:
    found = run(workspace)
    found.json.write_text(twin_text(read_trade(found.json)), encoding="utf-8")
    assert read_trade(found.json) == found.trade
