"""scissorcal bench extremes: what it writes, refuses, and how it ends."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from scissorcal.bench.extremes.cells import Cell, Found
from scissorcal.workday.schemas import generate

from .conftest import Cli


def only(outcome: str) -> tuple[Cell, ...]:
    """One cell of that outcome."""

    def run(_):
        return Found(outcome, "a sentence of the cell", 1e-9, 1e-6)

    return (Cell("the cell", "model", "what is extreme", "what is stated", "its truth", run),)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch):
    """Let a run consist of one cell and no states."""

    def choose(outcome: str) -> None:
        for place in ("cells", "study"):
            name = f"scissorcal.bench.extremes.{place}.all_cells"
            monkeypatch.setattr(name, lambda: only(outcome))
        monkeypatch.setattr("scissorcal.bench.extremes.study.planned", lambda extent, seed: [])

    return choose


def test_it_writes_a_page_and_a_twin_that_keeps_its_schema(few, cli: Cli, tmp_path: Path):
    few("right")
    said = cli("bench", "extremes", "-o", tmp_path, "--workers", "1", "--json")
    assert said.code == 0, said.err
    answer = json.loads(said.out)
    assert [Path(name).name for name in answer["files"]] == ["extremes.html", "extremes.json"]
    assert "the cell" in (tmp_path / "extremes.html").read_text(encoding="utf-8")
    twin = json.loads((tmp_path / "extremes.json").read_text(encoding="utf-8"))
    jsonschema.validate(twin, json.loads(generate("extremes.schema.json")))


def test_a_wrong_answer_ends_with_exit_code_3(few, cli: Cli, tmp_path: Path):
    few("wrong")
    said = cli("bench", "extremes", "-o", tmp_path, "--workers", "1")
    assert said.code == 3
    assert "and 1 wrong" in said.out


def test_a_budget_that_is_no_time_is_refused(cli: Cli, tmp_path: Path):
    said = cli("bench", "extremes", "-o", tmp_path, "--budget", "soon")
    assert said.code == 2
    assert not list(tmp_path.iterdir())


def test_without_mpmath_the_extra_is_named(tmp_path: Path):
    """In a process of its own: here the reference's modules hold mpmath already."""
    program = "import sys\nsys.modules['mpmath'] = None\nfrom scissorcal.cli import main\nmain()\n"
    command = [sys.executable, "-c", program, "bench", "extremes", "-o", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "bench extremes needs mpmath, which is not installed" in done.stderr
    assert "pip install 'scissorcal[bench]'." in done.stderr
    assert not list(tmp_path.iterdir())


def test_workers_and_a_cluster_are_refused(cli: Cli):
    said = cli("bench", "extremes", "--workers", "2", "--cluster", "tcp://host:1")
    assert said.code == 2
    assert "not both" in said.err
