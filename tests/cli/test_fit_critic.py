"""``fit friction --critic``: asked at draft effort, once, and what it tried is printed."""

from dataclasses import replace

import numpy as np

from scissorcal.recording import write_recording
from tests.calibration.planted import planted
from tests.calibration.truth import QUICK, Truth, friction_recording
from tests.cli.conftest import Cli
from tests.workday.made import quick_workspace


def test_the_critic_is_asked_once_and_prints_what_it_tried(tmp_path, monkeypatch, cli: Cli) -> None:
    workspace = quick_workspace(tmp_path / "day")
    rng = np.random.default_rng(4)
    drifting = planted(friction_recording(Truth(), rng, QUICK), "drift", rng)
    text = workspace.recipe_path.read_text(encoding="utf-8")
    write_recording(replace(drifting, recipe_toml=text), workspace.new_recording("friction"))
    monkeypatch.chdir(workspace.root)
    silent = cli("fit", "friction", "--effort", "draft")
    assert "The critic tried" not in silent.out
    assert "--critic asks it" in silent.out
    asked = cli("fit", "friction", "--effort", "draft", "--critic", "--json")
    assert asked.code == 3
    (fit,) = asked.envelope["result"]["fits"]
    assert not fit["cached"]
    assert [one["name"] for one in fit["critic"]] == ["sign*time"]
    again = cli("fit", "friction", "--effort", "draft", "--critic")
    assert "The critic tried" in again.out
    assert "structure" in again.out
