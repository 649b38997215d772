"""The firmware as a process on a pseudo-terminal, in real time: from a probe to a felt cut.

Nothing lies between its blades, so the material is stated; cuts are captured in test_arm_day.py.
"""

import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal import Blades, Friction, Material, build_package
from scissorcal.device import Operator, RigSession, open_link, open_writer
from scissorcal.device.capture import capture
from scissorcal.recording import read_recording
from scissorcal.verdicts import failed
from scissorcal.workday import create_workspace, fit_workspace
from scissorcal.workday.runs import probe
from tests.cli.conftest import Cli
from tests.cli.conftest import cli as cli

from .test_c_tests import BUILD, make

pytestmark = pytest.mark.realtime

TRUTH = {"inertia": 3e-4, "coulomb_pos": 0.012, "viscous_pos": 2e-3}
"""Of the blades in firmware/boards/posix.c, SI."""
MOST_SDS = 3.0
PAPER = Material(force_N=2.0, exponent=1.4, toughness_J_per_m2=4000.0, thickness_mm=0.1)
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

    @contextmanager
    def closing_and_opening(self) -> Iterator[None]:
        """It does so every second, beside what the block does."""
        over = threading.Event()

        def strokes() -> None:
            while not over.is_set():
                self._hand("c")
                self._hand("o")

        hand = threading.Thread(target=strokes)
        hand.start()
        try:
            yield
        finally:
            over.set()
            hand.join()
            self._hand("l")

    def _hand(self, letter: str) -> None:
        assert self._board.stdin is not None
        self._board.stdin.write(letter)
        self._board.stdin.flush()
        time.sleep(1.0)


def test_a_day_through_the_process(
    board: subprocess.Popen[str], cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert board.stdout is not None
    port = board.stdout.readline().strip()
    workspace = create_workspace(tmp_path / "paper", "paper-80gsm")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    before, _, after = text.partition("[capture.friction]")
    text = before + CAPTURE + "[capture.cut]" + after.partition("[capture.cut]")[2]
    workspace.recipe_path.write_text(text, encoding="utf-8")
    person = Person(board)
    with open_link(port) as link:
        session = RigSession(link, workspace.recipe(), Operator(person), recipe_toml=text)
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

    monkeypatch.chdir(workspace.root)
    said = cli("report")
    assert said.code == 0, said.err
    means = {row.name: row.mean for row in outcome.result.parameters}
    friction = Friction(
        coulomb_Nm=0.5 * (means["coulomb_pos"] + means["coulomb_neg"]),
        viscous_Nm_s_per_rad=0.5 * (means["viscous_pos"] + means["viscous_neg"]),
    )
    package = tmp_path / "paper.zip"
    build_package(PAPER, Blades(), friction, package)
    words = ("--package", package, "--seconds", 6, "--yes")
    with person.closing_and_opening():
        said = cli("render", "--device", port, *words)
    assert said.code == 0, (said.out, said.err)
    (path,) = workspace.recordings("render")
    rendered = read_recording(path).samples
    assert np.ptp(rendered["opening"]) > 0.5
    assert np.any(rendered["torque_command"] != 0.0)
