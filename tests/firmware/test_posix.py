"""The firmware as a process on a pseudo-terminal, in real time: a probe and a capture with its fit."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from scissorcal.workday import Workspace
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import load_result
from tests.cli.conftest import Cli
from tests.cli.conftest import cli as cli

from .test_c_tests import BUILD, make

pytestmark = [pytest.mark.realtime, pytest.mark.probes]

INERTIA, COULOMB, VISCOUS = 3e-4, 0.012, 2e-3
"""Of the blades in firmware/boards/posix.c, SI."""
CAPTURE = """
[capture.friction]
speeds_rad_per_s = [0.2, 0.6, 1.5]
repeats = 2
excitation_s = 8.0
"""


@pytest.fixture
def port() -> Iterator[str]:
    make("all")
    with subprocess.Popen(
        [BUILD / "posix"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as board:
        assert board.stdout is not None
        yield board.stdout.readline().strip()
        assert board.poll() is None
        board.communicate()  # it ends with its stdin
    assert board.returncode == 0


def test_probe_friction_and_fit_through_the_process(
    cli: Cli, port: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = Workspace(tmp_path / "paper")
    assert cli("init", workspace.root, "--recipe", "paper-80gsm").code == 0
    text = workspace.recipe_path.read_text(encoding="utf-8")
    workspace.recipe_path.write_text(text + CAPTURE, encoding="utf-8")
    monkeypatch.chdir(workspace.root)
    for words in (
        ("device", "probe", "--device", port, "--yes"),
        ("capture", "friction", "--device", port, "--yes"),
        ("fit", "friction"),
    ):
        said = cli(*words)
        assert said.code == 0, (words, said.out, said.err)
    fit = load_result(Engine.of(workspace), "friction")
    found = {row.name: row for row in fit.parameters}
    assert found["inertia"].q50 == pytest.approx(INERTIA, rel=0.05)
