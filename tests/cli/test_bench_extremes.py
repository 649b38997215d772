"""scissorcal bench extremes: what it takes, writes, refuses, and how it ends."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from scissorcal.bench.extremes import compare
from scissorcal.workday import Workspace, generate

from .conftest import Cli


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a run consist of three states of the scene."""
    from scissorcal.workday.runs import bench_extremes

    planned = bench_extremes.package_states

    def three(package, size, seed):
        return [s for s in planned(package, 0.02, seed) if s.band == "scene"][:3]

    monkeypatch.setattr(bench_extremes, "package_states", three)


def test_it_takes_the_workspaces_package_and_writes_a_page_and_a_twin(
    few, packed: Workspace, cli: Cli
):
    said = cli("bench", "extremes", "--json")
    assert said.code == 0, said.err
    answer = said.envelope
    assert [Path(name).name for name in answer["files"]] == ["extremes.html", "extremes.json"]
    page = (packed.root / "bench" / "extremes.html").read_text(encoding="utf-8")
    assert "3 states of the package" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    twin = json.loads((packed.root / "bench" / "extremes.json").read_text(encoding="utf-8"))
    assert (twin["format"], twin["states"]) == ("scissorcal-extremes/2", 3)
    schema = json.loads(generate("report.schema.json"))
    panel = {"$ref": "#/$defs/Panel", "$defs": schema["$defs"]}
    for shown in twin["panels"]:
        jsonschema.validate(shown, panel)
    assert twin["panels"][0]["rows"][0]["name"] == "model, scene"


def test_a_package_is_taken_without_a_workspace(few, packed: Workspace, cli: Cli, monkeypatch):
    package = packed.package_path(packed.recipe())
    elsewhere = packed.root.parent / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    said = cli("bench", "extremes", "--package", package, "-o", elsewhere / "out")
    assert said.code == 0, said.err
    assert "Largest errors: Of 10 answers 10 are right" in said.out
    assert (elsewhere / "out" / "extremes.html").exists()


def test_a_wrong_answer_ends_with_exit_code_3(few, packed: Workspace, cli: Cli, monkeypatch):
    step = compare.Kernel.step
    monkeypatch.setattr(
        compare.Kernel, "step", lambda *a: (o := step(*a))._replace(torque=o.torque + 1.0)
    )
    said = cli("bench", "extremes")
    assert said.code == 3
    assert "and 3 wrong" in said.out


def test_without_a_package_it_says_what_to_do(workspace: Path, cli: Cli):
    said = cli("bench", "extremes")
    assert said.code == 5
    assert "build a package first with 'scissorcal package build'" in said.err
    assert not (workspace / "bench").exists()


def test_without_mpmath_the_extra_is_named(packed: Workspace, tmp_path: Path):
    """In a process of its own: here the reference's modules hold mpmath already."""
    program = "import sys\nsys.modules['mpmath'] = None\nfrom scissorcal.cli import main\nmain()\n"
    out = tmp_path / "out"
    command = [sys.executable, "-c", program, "bench", "extremes", "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "bench extremes needs mpmath, which is not installed" in done.stderr
    assert "pip install 'scissorcal[bench]'." in done.stderr
    assert not out.exists()
