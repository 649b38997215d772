"""States, cells and what a run of them ends in."""

import dataclasses
import json
import time
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.bench.extremes import cells as cells_module
from scissorcal.bench.extremes import compare
from scissorcal.bench.extremes.cells import Cell, Found, all_cells, judged, try_cell, worst_of
from scissorcal.bench.extremes.compare import Compared, compare_kernel, compare_model
from scissorcal.bench.extremes.quantities import QUANTITIES
from scissorcal.bench.extremes.result import (
    MOST_WRONG,
    OUTCOMES,
    SUBJECTS,
    ErrorMap,
    MapCell,
    Sweep,
    SweepPoint,
    summarise,
)
from scissorcal.bench.extremes.states import SWEPT, everyday_state, random_state
from scissorcal.bench.extremes.study import Done, Extent, Job, Tried, do, jobs, planned, try_state
from scissorcal.bench.run import Run
from scissorcal.errors import InputError
from scissorcal.package.exact import ExactModel
from scissorcal.report.extremes import LOOKS, WRONG, extremes_page, map_chart, sweep_chart
from scissorcal.workday.runs import bench_extremes
from scissorcal.workday.runs.bench_extremes import run_extremes


def cell(run) -> Cell:
    return Cell("a cell", "model", "what is extreme", "what is stated", "how it is known", run)


@pytest.mark.parametrize("name", list(QUANTITIES))
def test_values_and_draws_stay_within_the_ranges(name):
    one = QUANTITIES[name]
    low, high = one.extreme
    assert low <= one.everyday[0] <= one.everyday[1] <= high
    values = one.values(9)
    assert values[0] == pytest.approx(low)
    assert values[-1] == pytest.approx(high)
    rng = np.random.default_rng(1)
    for extreme, (least, most) in ((True, one.extreme), (False, one.everyday)):
        drawn = [one.draw(rng, extreme=extreme) for _ in range(200)]
        assert least <= min(drawn)
        assert max(drawn) <= most
        assert len(set(drawn)) > 20


def test_the_same_seed_tries_the_same_states():
    extent = Extent(values=3, repeats=1, grid=3, random=5, everyday=5, slow=False)
    first, again, other = (planned(extent, seed) for seed in (1, 1, 2))
    assert first == again != other
    assert {one.plan for one in first} == {"everyday", "random", "one", "pair"}
    assert {one.swept[0] for one in first if one.plan == "one"} == set(SWEPT)
    assert sum(len(job.states) for job in jobs(extent, 1)) == len(first)
    assert not [job for job in jobs(extent, 1) if job.cell and "thrown" in job.cell]


def test_a_run_that_ends_early_has_tried_some_of_everything():
    begun = list(jobs(Extent(), 1))[:40]
    parts = {cell.name: cell.part for cell in all_cells()}
    tried = {parts[job.cell] for job in begun if job.cell}
    assert tried >= {"kernel", "model", "inference", "signals", "vision"}
    assert {one.plan for job in begun for one in job.states} >= {"random", "one", "pair"}


def test_everyday_states_are_right_and_nothing_extreme_is_wrong():
    rng = np.random.default_rng(130)
    for state in [
        *(everyday_state(rng) for _ in range(4)),
        *(random_state(rng) for _ in range(6)),
    ]:
        for one in try_state(state).compared:
            assert one.outcome != "wrong", (one, state)
            if state.plan == "everyday":
                assert one.outcome == "right", (one, state)


def test_an_error_of_the_model_beyond_its_roundings_is_found(monkeypatch):
    state = _loaded(1e-4)
    assert compare_model(state).outcome == "right"
    true = ExactModel.torque_settled
    monkeypatch.setattr(ExactModel, "torque_settled", lambda *a: true(*a) * (1.0 + 1e-9))
    assert compare_model(state).outcome == "wrong"


def test_an_error_of_the_kernel_beyond_its_roundings_is_found(monkeypatch):
    state = _loaded(1e-4)
    assert compare_kernel(state)[0].outcome == "right"
    step = compare.Kernel.step
    monkeypatch.setattr(
        compare.Kernel, "step", lambda *a: (o := step(*a))._replace(torque=o.torque * 1.01)
    )
    assert compare_kernel(state)[0].outcome == "wrong"


def _loaded(depth: float):
    """Everyday blades that press a sheet in, without a crack."""
    base = everyday_state(np.random.default_rng(3))
    values = {**base.values, "indentation": depth, "edge_offset": -0.008, "rate_damping": 0.0}
    return dataclasses.replace(base, values=values, cut=False, by_depth=True)


def test_a_refusal_without_reason_is_wrong(monkeypatch):
    monkeypatch.setattr(ExactModel, "torque_settled", lambda *a: np.asarray(np.nan))
    assert compare_model(_loaded(1e-4)).outcome == "wrong"


def test_errors_are_refusals_only_with_a_sentence_of_this_program():
    def refuses(_):
        raise InputError("The recipe has no blade: add one.")

    def numpy_fails(_):
        np.linalg.inv(np.zeros((2, 2)))

    def mute(_):
        raise InputError("no")

    assert try_cell(cell(refuses), 1).outcome == "refused"
    assert try_cell(cell(numpy_fails), 1).outcome == "wrong"
    assert try_cell(cell(mute), 1).outcome == "wrong"


def test_many_outcomes_become_the_worst():
    found = worst_of([judged(1e-9, 1e-6, "one"), judged(1e-7, 1e-6, "two", states=3)])
    assert (found.outcome, found.error, found.states) == ("right", 1e-7, 4)
    assert worst_of([found, Found("wrong", "three")]).sentence == "three"
    assert judged(float("nan"), 1e-6, "not a number").outcome == "wrong"


def test_names_of_cells_are_unique(monkeypatch):
    assert len(all_cells()) > 20
    monkeypatch.setattr(cells_module, "CELLS", cells_module.CELLS[:1] * 2)
    with pytest.raises(ValueError, match="two cells are named"):
        all_cells()


def test_a_run_with_a_budget_writes_its_page_and_twin(tmp_path: Path, monkeypatch):
    only = tuple(c for c in all_cells() if c.name == "model, power response")
    monkeypatch.setattr("scissorcal.bench.extremes.study.all_cells", lambda: only)
    extent = Extent(values=3, repeats=1, grid=3, random=50, everyday=50, slow=False)
    found = run_extremes(extent, tmp_path, seed=4, budget_s=4.5, workers=1)
    result = found.result
    assert 0 < result.states < result.planned
    assert [one.name for one in result.cells] == ["model, power response"]
    every = [one.name for one in all_cells()]
    tried = f"{result.states} of {result.planned} states and 1 of {len(every)} cells were tried"
    assert result.sentence.startswith(tried)
    assert set(result.left_out) == set(every) - {"model, power response"}
    page = found.html.read_text(encoding="utf-8")
    assert result.sentence in page
    assert f"Not run: {result.left_out[0]}; " in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    twin = json.loads(found.json.read_text(encoding="utf-8"))
    assert twin["format"] == "scissorcal-extremes/1"
    assert twin["states"] == result.states
    (verdict,) = result.verdicts
    assert verdict.status == "pass"


def test_a_wrong_answer_fails_the_run(tmp_path: Path, monkeypatch):
    only = (cell(lambda _: Found("wrong", "a number from nowhere")),)
    monkeypatch.setattr("scissorcal.bench.extremes.study.all_cells", lambda: only)
    monkeypatch.setattr("scissorcal.bench.extremes.cells.all_cells", lambda: only)
    monkeypatch.setattr("scissorcal.bench.extremes.study.planned", lambda extent, seed: [])
    result = run_extremes(Extent(), tmp_path, workers=1).result
    (verdict,) = result.verdicts
    assert verdict.status == "fail"
    assert "1 wrong" in result.sentence


def test_a_whole_run_says_nothing_of_parts():
    result = summarise(_facts(planned=1), [_done("right")], ())
    assert result.sentence.startswith("1 states and 0 cells were tried")
    assert result.left_out == ()
    assert "Not run" not in extremes_page(result)


def test_wrong_states_are_counted_and_the_first_are_listed():
    few = summarise(_facts(planned=2), [_done("wrong")] * 2, ())
    assert "Each is listed in the page" in few.verdicts[0].why
    many = summarise(_facts(planned=60), [_done("wrong")] * 60, ())
    said = f"The first {MOST_WRONG} of 60 wrong answers of states are listed in the page: report"
    assert said in many.verdicts[0].why
    assert f"The first {MOST_WRONG} of 60 are listed." in extremes_page(many)


def test_wrong_states_have_marks_of_their_own():
    counts = dict.fromkeys(OUTCOMES, 0)
    points = tuple(
        SweepPoint(value, "model", None, None, counts | {outcome: 1})
        for value, outcome in ((1.0, "refused"), (2.0, "wrong"))
    )
    drawn = {one.name: one for one in sweep_chart(Sweep("force", "N", True, points)).series}
    assert drawn["some refused or marked"].x == (1.0,)
    assert drawn["model, some wrong"].x == (2.0,)
    assert drawn["model, some wrong"].look not in (*LOOKS.values(), "muted")
    places = tuple(MapCell(1.0, x, None, o) for x, o in ((1.0, "refused"), (2.0, "wrong")))
    drawn = {one.name: one for one in map_chart(ErrorMap("force", "kappa", "model", places)).series}
    assert (drawn["refused"].y, drawn["wrong"].y) == ((0.0,), (1.0,))
    assert drawn["wrong"].look == WRONG != drawn["refused"].look


def test_a_job_tells_its_own_seconds(monkeypatch):
    only = (cell(lambda _: time.sleep(0.02) or Found("right", "slept for a while")),)
    monkeypatch.setattr("scissorcal.bench.extremes.study.all_cells", lambda: only)
    assert do(Job(cell="a cell")).seconds >= 0.02


@dataclasses.dataclass(frozen=True)
class MadePool:
    """As `Pool`, on a made-up clock: each worker takes ``job_s`` for a job, one at a time."""

    clock: list[float]
    workers: int
    job_s: float
    ahead: int = 2

    def work(self, job, items, finished, kind):
        todo, free, ends = iter(items), [0.0] * self.workers, []
        while True:
            while len(ends) < self.workers * self.ahead and next(todo, None):
                free.sort()
                free[0] = max(free[0], self.clock[0]) + self.job_s
                ends.append((free[0], Done(seconds=self.job_s)))
            if not ends:
                return
            ends.sort(key=lambda end: end[0])
            self.clock[0], done = ends.pop(0)
            finished(done)


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_a_budget_is_kept_with_several_workers(tmp_path: Path, monkeypatch, workers):
    clock, finished = [0.0], []
    pool = MadePool(clock, workers, 7.0)
    made = SimpleNamespace(monotonic=lambda: clock[0])
    monkeypatch.setattr(bench_extremes, "time", made)
    monkeypatch.setattr(bench_extremes, "open_pool", lambda *_: nullcontext(pool))
    run_extremes(
        Extent(), tmp_path, budget_s=60.0, progress=lambda done, sentence: finished.append(done)
    )
    assert clock[0] == 56.0
    assert len(finished) == 8 * workers


def _facts(planned: int) -> Run:
    return Run(datetime(2026, 1, 2, tzinfo=UTC), "1.0", "none", 1, 0, 1.0, planned)


def _done(outcome: str) -> Done:
    """One state of which all three answers are alike, as far as they are counted."""
    state = everyday_state(np.random.default_rng(5))
    found = [Compared(subject, "right", "") for subject in SUBJECTS[1:]]
    return Done((Tried(state, (Compared("model", outcome, "a sentence"), *found)),))
