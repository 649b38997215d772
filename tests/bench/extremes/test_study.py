"""The benchmark of all laws: its states, its cells, and what a run of them ends in."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.extremes import __main__ as program
from benchmarks.extremes import cells as cells_module
from benchmarks.extremes.cells import Cell, Found, all_cells, judged, try_cell, worst_of
from benchmarks.extremes.charts import LOOKS, sweep_chart
from benchmarks.extremes.quantities import QUANTITIES
from benchmarks.extremes.states import (
    SWEPT,
    everyday_state,
    fitted_tables,
    made_state,
    random_state,
)
from benchmarks.extremes.study import Extent, planned, try_state

from scissorcal.bench.extremes import compare
from scissorcal.bench.extremes.compare import Judgement, compare_kernel, compare_model
from scissorcal.bench.extremes.states import State
from scissorcal.errors import InputError
from scissorcal.package import ExactModel
from scissorcal.report import WRONG_LOOK

SMALL = Extent(values=3, repeats=1, grid=3, random=5, everyday=5, slow=False)


def cell(run) -> Cell:
    return Cell("a cell", "model", "what is extreme", "what is stated", "how it is known", run)


@pytest.mark.parametrize("name", list(QUANTITIES))
def test_values_and_draws_stay_within_the_ranges(name):
    quantity = QUANTITIES[name]
    low, high = quantity.extreme
    assert low <= quantity.everyday[0] <= quantity.everyday[1] <= high
    values = quantity.values(9)
    assert values[0] == pytest.approx(low)
    assert values[-1] == pytest.approx(high)
    rng = np.random.default_rng(1)
    for extreme, (least, most) in ((True, quantity.extreme), (False, quantity.everyday)):
        drawn = [quantity.draw(rng, extreme=extreme) for _ in range(200)]
        assert least <= min(drawn)
        assert max(drawn) <= most
        assert len(set(drawn)) > 20


def test_the_same_seed_tries_the_same_states():
    first, again, other = (planned(SMALL, seed) for seed in (1, 1, 2))
    assert first == again != other
    assert {state.band for state in first} == {"everyday", "extreme"}
    assert {state.swept[0] for state in first if len(state.swept) == 1} == set(SWEPT)
    assert all(state.swept == () for state in first if state.band == "everyday")


def test_a_small_run_leaves_slow_cells_out(monkeypatch):
    slow = replace(cell(lambda _: Found("right", "")), name="slow", slow=True)
    monkeypatch.setattr(program, "all_cells", lambda: (slow, cell(lambda _: Found("right", ""))))
    monkeypatch.setattr(program, "planned", lambda extent, seed: [])
    assert [run.name for run, _ in program.run(Extent.of_size(0.02), 0)[1]] == ["a cell"]
    assert [run.name for run, _ in program.run(Extent.of_size(1.0), 0)[1]] == ["slow", "a cell"]


def test_everyday_states_are_right_and_nothing_extreme_is_wrong():
    rng = np.random.default_rng(130)
    for state in [
        *(everyday_state(rng) for _ in range(4)),
        *(random_state(rng) for _ in range(6)),
    ]:
        for answer in try_state(state):
            assert answer.outcome != "wrong", (answer, state)
            if state.band == "everyday":
                assert answer.outcome == "right", (answer, state)


def test_an_error_of_the_model_beyond_its_roundings_is_found(monkeypatch):
    state = _loaded(1e-4)
    assert compare_model(state).outcome == "right"
    true = ExactModel.torque_settled
    monkeypatch.setattr(ExactModel, "torque_settled", lambda *a: true(*a) * (1.0 + 1e-9))
    assert compare_model(state).outcome == "wrong"


def test_an_error_of_the_kernel_beyond_its_roundings_is_found(monkeypatch):
    state = _loaded(1e-4)
    tables, _ = fitted_tables(state, 1e-3)
    assert compare_kernel(state, tables).outcome == "right"
    step = compare.Kernel.step
    monkeypatch.setattr(
        compare.Kernel, "step", lambda *a: (o := step(*a))._replace(torque=o.torque * 1.01)
    )
    assert compare_kernel(state, tables).outcome == "wrong"


def _loaded(depth: float) -> State:
    """Everyday blades that press a sheet in, without a crack."""
    values = everyday_state(np.random.default_rng(3)).values
    changes = {"indentation": depth, "edge_offset": -0.008, "rate_damping": 0.0}
    return made_state({**values, **changes}, cut=False, by_depth=True)


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
    worst = worst_of([judged(1e-9, 1e-6, "one"), judged(1e-7, 1e-6, "two", states=3)])
    assert (worst.outcome, worst.error, worst.states) == ("right", 1e-7, 4)
    assert worst_of([worst, Found("wrong", "three")]).sentence == "three"
    assert judged(float("nan"), 1e-6, "not a number").outcome == "wrong"


def test_names_of_cells_are_unique(monkeypatch):
    assert len(all_cells()) > 20
    monkeypatch.setattr(cells_module, "CELLS", cells_module.CELLS[:1] * 2)
    with pytest.raises(ValueError, match="two cells are named"):
        all_cells()


def test_a_run_writes_the_tables_and_pictures_of_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr(program, "PAGE", tmp_path / "extremes.md")
    monkeypatch.setattr(program, "PICTURES", tmp_path)
    shutil.copy(program.DOCS / "extremes.md", tmp_path)
    states = [s for s in planned(SMALL, 0) if set(s.swept) <= {"thickness", "indentation"}]
    monkeypatch.setattr(program, "planned", lambda extent, seed: states)
    monkeypatch.setattr(program, "all_cells", lambda: (cell(lambda _: Found("flagged", "Why.")),))
    monkeypatch.setattr(program, "MAPS", (("kernel", "thickness", "indentation"),))
    monkeypatch.setattr(program, "SWEEPS", ("thickness",))
    assert program.main(["--write", "--seed", "4"]) == 0
    page = (tmp_path / "extremes.md").read_text(encoding="utf-8")
    assert f"{len(states)} states and 1 cells were tried: of " in page
    assert "Seed 4." in page
    assert "| a cell | what is extreme | what is stated | flagged |  |" in page
    assert "| kernel, everyday | 5 | 5 | 0 |" in page
    assert {path.name for path in tmp_path.glob("*.svg")} == {
        "extremes-thickness.svg", "extremes-kernel-thickness.svg",
    }  # fmt: skip


def test_something_wrong_is_said_with_exit_code_3(monkeypatch, capsys):
    monkeypatch.setattr(program, "all_cells", lambda: (cell(lambda _: Found("wrong", "Why.")),))
    monkeypatch.setattr(program, "planned", lambda extent, seed: [])
    assert program.main([]) == 3
    assert "wrong: a cell: Why." in capsys.readouterr().out


def test_wrong_states_have_marks_of_their_own():
    base = everyday_state(np.random.default_rng(5))
    answers = [
        (replace(base, swept=("force",), values={"force": value}), Judgement("model", outcome))
        for value, outcome in ((1.0, "refused"), (2.0, "wrong"))
    ]
    drawn = {series.name: series for series in sweep_chart("force", answers).series}
    assert drawn["some refused or marked"].x == (1.0,)
    assert drawn["model, some wrong"].x == (2.0,)
    assert drawn["model, some wrong"].look == WRONG_LOOK
    assert WRONG_LOOK not in LOOKS.values()
