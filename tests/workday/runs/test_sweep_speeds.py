"""Speeds of empty sweeps that a rig cannot make, or its encoder does not show, are left out."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from scissorcal.device import Operator, count_recorded
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import Estimate, ProbeResult, read_recording
from scissorcal.workday.options import SIM_RIG
from scissorcal.workday.runs.capture import capture_into
from scissorcal.workday.runs.sweep_speeds import with_usable_sweeps
from scissorcal.workday.workspace import create_workspace
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed

RECIPE = builtin_recipe("paper-80gsm")
PROBE = ProbeResult(
    "rig",
    "0",
    "2026-11-22T20:00:00+00:00",
    delay_s=Estimate(1e-3, 1e-4),
    inertia_kg_m2=Estimate(2.1e-4, 5e-6),
    coulomb_Nm=Estimate(0.014, 3e-4),
    viscous_Nm_s_per_rad=Estimate(2e-3, 1e-3),
)


def speeds(recipe: object) -> tuple[float, ...]:
    return recipe.capture.friction.speeds_rad_per_s  # type: ignore[attr-defined,no-any-return]


def test_a_recipe_that_fits_the_rig_stays_as_it_is() -> None:
    assert with_usable_sweeps(RECIPE, IDENTITY, PROBE) == (RECIPE, "")
    assert with_usable_sweeps(RECIPE, IDENTITY, None) == (RECIPE, "")


def test_a_speed_that_the_encoder_does_not_show_is_left_out() -> None:
    coarse = IDENTITY._replace(opening_resolution=2.0 * np.pi / 20_000)
    recipe, sentence = with_usable_sweeps(RECIPE, coarse, None)
    assert speeds(recipe) == (0.13, 0.3, 0.7, 1.5)
    assert sentence.startswith("Sweeps at 0.05, 0.12 rad/s are left out: an encoder")
    assert "from 0.081 rad/s on" in sentence
    assert "slowest usable speed is about 0.13 rad/s" in sentence
    few = changed("paper-80gsm", capture__friction={"speeds_rad_per_s": (0.05, 0.14)})
    assert speeds(with_usable_sweeps(few, coarse, None)[0]) == (0.14,)
    slow = changed("paper-80gsm", capture__friction={"speeds_rad_per_s": (0.02, 0.05)})
    with pytest.raises(InputError, match=r"too slow \(0.02, 0.05 rad/s\).* to 0.13 and more"):
        with_usable_sweeps(slow, coarse, None)


def test_a_speed_at_which_the_blades_are_known_to_stick_is_left_out() -> None:
    late = replace(
        PROBE,
        delay_s=Estimate(3e-3, 1e-4),
        facts={"stribeck_Nm": 4.1e-3, "stribeck_rate_rad_per_s": 0.075},
    )
    recipe, sentence = with_usable_sweeps(RECIPE, IDENTITY, late)
    assert speeds(recipe)[-3:] == (0.3, 0.7, 1.5)
    assert 0.05 < speeds(recipe)[0] < 0.12
    assert "stick and slip" in sentence
    assert with_usable_sweeps(RECIPE, IDENTITY, replace(late, delay_s=PROBE.delay_s))[1] == ""
    unknown = replace(late, facts={})
    assert with_usable_sweeps(RECIPE, IDENTITY, unknown) == (RECIPE, "")


def test_a_capture_follows_the_shorter_list_and_is_judged_by_it(tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "day", "paper-80gsm")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace("[0.05, 0.12, 0.3, 0.7, 1.5]", "[0.005, 0.9, 1.5]")
    text = text.replace("repeats = 2", "repeats = 1").replace(
        "excitation_s = 10.0", "excitation_s = 1.0"
    )
    workspace.recipe_path.write_text(text, encoding="utf-8")
    said: list[str] = []
    with patch("scissorcal.workday.runs.sweep_speeds.NEXT", 1e3):
        captured = capture_into(workspace, "friction", SIM_RIG, operator=Operator(say=said.append))
    assert any("Sweeps at 0.005 rad/s are left out" in sentence for sentence in said)
    recording = read_recording(captured.path)
    swept = {stroke.speed for stroke in recording.strokes if np.isfinite(stroke.speed)}
    assert swept == {0.9, 1.5}
    assert tuple(count_recorded(recording, workspace.recipe(), "friction")["speeds"]) == (0.9, 1.5)
    assert workspace.recipe_path.read_text(encoding="utf-8") == text
