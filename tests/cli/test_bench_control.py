"""scissorcal bench control: what it writes, refuses, and how it ends."""

import json
from pathlib import Path

import jsonschema
import pytest

from scissorcal.bench.control.study import Job
from scissorcal.workday.schemas import generate

from .conftest import Cli


@pytest.fixture
def one_job(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a run consist of one world."""
    job = Job("pose", 0, seeds=(5,))
    monkeypatch.setattr("scissorcal.bench.control.study.jobs", lambda extent, seed: [job])


def test_it_writes_a_page_and_a_twin_that_keeps_its_schema(
    one_job: None, cli: Cli, tmp_path: Path
) -> None:
    said = cli("bench", "control", "-o", tmp_path, "--workers", "1", "--json")
    assert said.code == 0, said.err
    answer = json.loads(said.out)
    assert [Path(name).name for name in answer["files"]] == ["control.html", "control.json"]
    assert "Errors of the pose" in (tmp_path / "control.html").read_text(encoding="utf-8")
    twin = json.loads((tmp_path / "control.json").read_text(encoding="utf-8"))
    jsonschema.validate(twin, json.loads(generate("bench-control.schema.json")))


def test_it_prints_its_tables(one_job: None, cli: Cli, tmp_path: Path) -> None:
    said = cli("bench", "control", "-o", tmp_path, "--workers", "1")
    assert said.code == 0
    assert "plane, fixed, contact" in said.out


def test_workers_and_a_cluster_exclude_each_other(cli: Cli) -> None:
    said = cli("bench", "control", "--workers", "2", "--cluster", "tcp://host:1")
    assert said.code == 2
    assert "not both" in said.err
