"""``scissorcal bench trade``: words of the command line, exit codes, refusals."""

from pathlib import Path

import pytest

from scissorcal.bench.trade import knob as knobs
from scissorcal.bench.trade import study
from scissorcal.cli import bench as bench_command
from scissorcal.workday import Workspace
from scissorcal.workday.demo import day
from scissorcal.workday.runs import bench
from tests.bench.made_trade import MADE, made_case
from tests.cli.conftest import Cli


@pytest.fixture
def made(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(knobs, "KNOBS", {"steps": MADE["steps"]})
    monkeypatch.setattr(bench, "load_case", lambda engine, seed: made_case())
    monkeypatch.setattr(bench, "inputs_hash", lambda engine, case: "these inputs")
    monkeypatch.setattr(study, "baseline_s", lambda: 0.02)
    return workspace


def test_bench_trade_prints_settings_and_recommendations(cli: Cli, made: Path) -> None:
    said = cli("bench", "trade", "--workers", "1")
    assert said.code == 0, said.err
    assert "coarse" in said.out
    assert "middle is enough" in said.out
    assert "8 samples, 8 of them by this run" in said.out
    shown = cli("bench", "trade", "--show", "--json")
    assert shown.code == 0
    assert shown.envelope["result"]["trade"]["measured"] == 8


def test_bench_trade_without_fits_says_what_comes_first(cli: Cli, workspace: Path) -> None:
    said = cli("bench", "trade")
    assert said.code == 5
    assert "There is no fit of friction yet: run 'scissorcal capture friction" in said.err


def test_bench_trade_shows_nothing_before_a_run(cli: Cli, workspace: Path) -> None:
    assert cli("bench", "trade", "--show").code == 5


@pytest.mark.parametrize("words", ["soon", "3", "3 parsecs", "0 s", "-1 min"])
def test_a_budget_that_is_no_time_is_refused(cli: Cli, made: Path, words: str) -> None:
    said = cli("bench", "trade", "--budget", words)
    assert said.code == 2
    assert "give a time above zero with its unit" in said.err


def test_an_unknown_knob_and_an_unknown_recipe_are_refused(cli: Cli, made: Path) -> None:
    said = cli("bench", "trade", "--knob", "speed")
    assert said.code == 2
    assert "choose from steps" in said.err
    assert cli("bench", "trade", "--recipe", "wood").code == 2
    for other in (("--workspace", made), ("--show",)):
        said = cli("bench", "trade", "--recipe", "press-only", *other)
        assert said.code == 2
        assert "--recipe" in said.err


def test_a_budget_too_small_for_anything_is_refused(cli: Cli, made: Path) -> None:
    said = cli("bench", "trade", "--budget", "1 s", "--workers", "1")
    assert said.code == 2
    assert "too small" in said.err


@pytest.fixture
def days(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Folder and seed of each day that is made, none of which takes any time."""
    found: list[tuple[str, int]] = []

    def make_day(workspace: Workspace, *, seed: int, progress: object) -> None:
        found.append((workspace.root.name, seed))

    monkeypatch.setattr(day, "make_day", make_day)
    monkeypatch.chdir(tmp_path)
    return found


def test_the_day_of_a_recipe_is_made_once_for_each_seed(days: list[tuple[str, int]]) -> None:
    first = bench_command._day("press-only", 0)
    assert bench_command._day("press-only", 0).root == first.root
    other = bench_command._day("press-only", 7)
    assert other.root != first.root
    assert first.recipe_path.is_file()
    assert days == [("bench-press-only", 0), ("bench-press-only-7", 7)]


def test_a_day_that_was_interrupted_is_made_anew(
    days: list[tuple[str, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(day, "make_day", interrupted)
        with pytest.raises(KeyboardInterrupt):
            bench_command._day("press-only", 0)
    bench_command._day("press-only", 0)
    assert days == [("bench-press-only", 0)]
