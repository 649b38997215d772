"""Captures until the scene's tolerance: options, exit codes, what is stated and what is done."""

import json
import re
from pathlib import Path

import pytest

from scissorcal.recording import UNTIL_MARK, UntilMark, read_recording

from .conftest import Cli


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["friction", "--max-minutes", "2"], "add --until-tolerance"),
        (["cut", "--at-least", "5"], "add --until-tolerance"),
        (["cut", "--until-tolerance", "--designed"], "leave out --designed"),
        (["cut", "--until-tolerance", "--hand"], "Leave out --hand"),
        (["cut", "--until-tolerance", "--max-minutes", "0"], "not above 0"),
    ],
)
def test_options_at_odds_are_refused_before_anything_moves(
    words: list[str], says: str, workspace: Path, cli: Cli
) -> None:
    said = cli("capture", *words, "--device", "sim")
    assert said.code == 2
    assert says in said.err
    assert not list(workspace.glob("captures/*"))


def test_a_cut_until_the_tolerance_needs_the_fit_of_friction(workspace: Path, cli: Cli) -> None:
    said = cli("capture", "cut", "--device", "sim", "--until-tolerance", "--json")
    assert said.code == 5
    assert "capture friction" in said.envelope["result"]["error"]
    assert not list(workspace.glob("captures/*"))


@pytest.mark.slow
def test_a_day_until_the_tolerance_on_the_virtual_rig(workspace: Path, cli: Cli) -> None:
    """Friction to its share, then the cut; a limit of minutes that is too short fails a verdict."""
    said = cli("capture", "friction", "--device", "sim", "--until-tolerance", "--json")
    assert said.code == 0, said.err
    mark = said.envelope["result"]["until"]
    assert mark["ended"] == "tolerance"
    assert mark["friction_alone"]
    assert cli("fit", "friction", "--effort", "draft").code == 0
    hurried = cli(
        "capture", "cut", "--device", "sim", "--until-tolerance", "--max-minutes", "0.5", "--json"
    )
    assert hurried.code == 3, hurried.err
    assert hurried.envelope["result"]["until"]["ended"] == "time"
    (step,) = [s for s in _steps(cli) if s["name"] == "capture cut"]
    assert step["state"] == "incomplete"
    said = cli("capture", "cut", "--device", "sim", "--until-tolerance", "--at-least", "5")
    assert said.code == 0, said.err
    assert "tolerance reached at 95 % confidence" in said.out
    assert re.search(r"[▁▂▃▄▅▆▇█]+ \d strokes, [\d.]+ planned min: band within 7 %", said.err)
    last = read_recording(sorted(workspace.glob("captures/cut-*.mcap"))[-1])
    marks = [json.loads(value) for name, value in last.marks if name == UNTIL_MARK]
    assert [one["strokes"] for one in marks] == list(range(len(marks)))
    assert marks[-1]["strokes"] >= 5
    found = UntilMark.last_of(last.marks)
    assert found is not None
    assert found.reached
    assert len([s for s in last.strokes if s.kind == "closing"]) == found.strokes
    (step,) = [s for s in _steps(cli) if s["name"] == "capture cut"]
    assert step["state"] == "done"


def _steps(cli: Cli) -> list[dict[str, str]]:
    steps: list[dict[str, str]] = cli("plan", "--json").envelope["result"]["steps"]
    return steps
