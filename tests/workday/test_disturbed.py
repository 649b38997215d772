"""Captures that the servo stopped, or that cut nothing: incomplete, and what is there is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import Faults, LockstepLink, Operator, RigSession
from scissorcal.device import capture as rig_capture
from scissorcal.errors import DeviceError
from scissorcal.kernel import StopReason
from scissorcal.recording import read_recording, write_recording
from scissorcal.workday.engine import Engine
from scissorcal.workday.workspace import Workspace
from tests.strange_device import FAULTS, StrangeDevice, VirtualPort
from tests.workday.made import quick_workspace

SHORT = """[0.3, 0.8]
repeats = 1
excitation_s = 3.0

[capture.cut]
speeds_rad_per_s = [0.6]
strokes_per_sheet = 2
sheets = 2
"""


def short_workspace(folder: Path) -> Workspace:
    """A quick workspace whose captures take seconds."""
    workspace = quick_workspace(folder)
    text = workspace.recipe_path.read_text(encoding="utf-8")
    short = text.replace("[0.1, 0.3, 0.8]\n", SHORT)
    assert short != text
    workspace.recipe_path.write_text(short, encoding="utf-8")
    return workspace


def capture(workspace: Workspace, faults: Faults | None = None) -> Path:
    recipe = workspace.recipe()
    link = LockstepLink("office-paper", np.random.default_rng(1), faults)
    path = workspace.new_recording("friction")
    with rig_capture.open_writer(
        RigSession(link, recipe, recipe_toml=workspace.recipe_path.read_text()), "friction", path
    ) as writer:
        rig_capture.capture(RigSession(link, recipe), "friction", writer)
    return path


def test_a_capture_that_was_stopped_is_incomplete_and_kept(tmp_path: Path) -> None:
    workspace = short_workspace(tmp_path / "stuck")
    with pytest.raises(DeviceError) as raised:
        capture(workspace, Faults(stuck_encoder_s=3.0))
    assert raised.value.exit_code == 4
    assert raised.value.stop == StopReason.ENCODER_FAULT.name
    (path,) = workspace.recordings("friction")
    recording = read_recording(path)
    assert recording.stop == StopReason.ENCODER_FAULT.name
    assert len(recording.samples) > 1500
    assert any(StopReason.ENCODER_FAULT.sentence in note for note in recording.notes)
    assert Engine.of(workspace).state("capture friction").state == "incomplete"
    capture(workspace)
    assert Engine.of(workspace).state("capture friction").state == "done"


def test_a_stop_after_the_last_stroke_leaves_a_capture_incomplete(tmp_path: Path) -> None:
    workspace = short_workspace(tmp_path / "late")
    path = capture(workspace)
    whole = read_recording(path)
    path.unlink()
    write_recording(replace(whole, marks=(("stop", "OSCILLATION"),)), path)
    found = Engine.of(workspace).state("capture friction")
    assert found.state == "incomplete"
    assert "an undisturbed end: the servo stopped the last capture (oscillation)" in found.found


def test_strokes_that_cut_nothing_do_not_count(tmp_path: Path) -> None:
    workspace = short_workspace(tmp_path / "old-sheet")
    recipe = workspace.recipe()
    path = workspace.new_recording("cut")
    link = VirtualPort(StrangeDevice(FAULTS["no sheet"], seed=1))
    asked: list[str] = []
    with rig_capture.open_writer(
        RigSession(link, recipe, recipe_toml=workspace.recipe_path.read_text()), "cut", path
    ) as writer:
        report = rig_capture.capture(
            RigSession(link, recipe, Operator(asked.append)), "cut", writer
        )
    closing = [stroke for stroke in read_recording(path).strokes if stroke.kind == "closing"]
    assert set(report.empty) == set(closing)
    found = Engine.of(workspace).state("capture cut")
    assert found.state == "incomplete"
    assert any("0 of" in note for note in found.notes)
    later = [request for request in asked if "fresh piece" in request][1:]
    assert all("(piece" in request and "cut nothing" in request for request in later)
