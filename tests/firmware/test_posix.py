"""The firmware as a process on a pseudo-terminal, in real time: probe, capture and fit."""

import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.device import Operator, RigSession, open_link, open_writer
from scissorcal.device.capture import capture
from scissorcal.verdicts import failed
from scissorcal.workday import create_workspace, fit_workspace
from scissorcal.workday.runs import probe

from .test_c_tests import BUILD, make

pytestmark = pytest.mark.realtime

TRUTH = {"inertia": 3e-4, "coulomb_pos": 0.012, "viscous_pos": 2e-3}
"""Of the blades in firmware/boards/posix.c, SI."""
MOST_SDS = 3.0
CAPTURE = """[capture.friction]
speeds_rad_per_s = [0.2, 0.6, 1.5]
repeats = 2
excitation_s = 8.0
"""


@pytest.fixture
def board() -> Iterator[subprocess.Popen[str]]:
    make("all")
    with subprocess.Popen(
        [BUILD / "posix"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as board:
        yield board
        assert board.poll() is None
        board.communicate()  # it ends with its stdin
    assert board.returncode == 0


class Person:
    """A confirm callback: its hand moves the blades as a sentence asks, and then lets go."""

    def __init__(self, board: subprocess.Popen[str]) -> None:
        self._board = board

    def __call__(self, request: str) -> None:
        if "close the blades by hand" in request:
            self._hand("c")
        elif "open the blades by hand" in request:
            self._hand("o")
        elif "half open" in request:
            self._hand("h")
            self._hand("l")

    def _hand(self, letter: str) -> None:
        assert self._board.stdin is not None
        self._board.stdin.write(letter)
        self._board.stdin.flush()
        time.sleep(1.0)


def test_probe_friction_and_fit_through_the_process(
    board: subprocess.Popen[str], tmp_path: Path
) -> None:
    assert board.stdout is not None
    port = board.stdout.readline().strip()
    workspace = create_workspace(tmp_path / "paper", "paper-80gsm")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    before, _, after = text.partition("[capture.friction]")
    text = before + CAPTURE + "[capture.cut]" + after.partition("[capture.cut]")[2]
    workspace.recipe_path.write_text(text, encoding="utf-8")
    with open_link(port) as link:
        session = RigSession(link, workspace.recipe(), Operator(Person(board)), recipe_toml=text)
        session = replace(session, probe=probe.probe_into(workspace, session))
        assert session.probe is not None
        assert not failed(session.probe.verdicts)
        path = workspace.new_recording("friction")
        with open_writer(session, "friction", path) as writer:
            capture(session, "friction", writer)
    (outcome,) = fit_workspace(workspace, ("friction",))
    assert not failed(outcome.result.verdicts)
    for name, truth in TRUTH.items():
        (row,) = (row for row in outcome.result.parameters if row.name == name)
        sd = (row.q95 - row.q05) / 3.29
        assert abs(row.q50 - truth) <= MOST_SDS * sd, (name, row.q50, sd)
