"""When a workspace's probe counts, what is said, and where it goes."""

import json
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from scissorcal.device import LockstepLink, Operator, ProbeRefusedError, RigSession
from scissorcal.recipe import Recipe
from scissorcal.recording import probe_of, read_recording
from scissorcal.workday.options import SIM_RIG, RigOptions
from scissorcal.workday.runs.capture import capture_into
from scissorcal.workday.runs.probe import _store, ensure_probed, last_probe, probe_into, probe_state
from scissorcal.workday.workspace import Workspace, create_workspace
from tests.strange_device import FAULTS, Person, StrangeDevice, VirtualPort
from tests.strange_device.trials import short_recipe


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return create_workspace(tmp_path / "day", "paper-80gsm")


def virtual_rig(seed: int = 1) -> LockstepLink:
    return LockstepLink("office-paper", np.random.default_rng(seed))


def changed(recipe: Recipe, **keys: object) -> Recipe:
    return recipe.model_copy(update={"rig": recipe.rig.model_copy(update=keys)})


def test_the_first_run_probes_and_the_next_ones_do_not(workspace: Workspace) -> None:
    recipe = workspace.recipe()
    said: list[str] = []
    first = ensure_probed(
        workspace, RigSession(virtual_rig(), recipe, Operator(say=said.append))
    ).probe
    assert said[0] == (
        "Probing the rig first, with up to 150 mN m at the blades: there is no probe of it yet."
    )
    said.clear()
    again = ensure_probed(
        workspace, RigSession(virtual_rig(2), recipe, Operator(say=said.append))
    ).probe
    assert again == first
    assert said == [
        f"The rig was probed at {first.made_at} ('scissorcal device probe' repeats it)."
    ]


@pytest.mark.slow
def test_an_old_probe_another_rig_and_another_sign_do_not_count(workspace: Workspace) -> None:
    recipe = workspace.recipe()
    first = ensure_probed(workspace, RigSession(virtual_rig(), recipe)).probe
    said: list[str] = []
    later = datetime.fromisoformat(first.made_at) + timedelta(hours=5)
    ensure_probed(
        workspace, RigSession(virtual_rig(), recipe, Operator(say=said.append)), now=later
    )
    assert "5.0 h old, and rig.probe.max_age_h allows 4 h" in said[0]
    _store(workspace, replace(first, motor_sign=-1))
    ensure_probed(workspace, RigSession(virtual_rig(), recipe, Operator(say=said.append)))
    assert "rig.motor_sign changed since" in said[-1]
    device = StrangeDevice(seed=1)
    person = Person(device)
    ensure_probed(
        workspace, RigSession(VirtualPort(device), recipe, Operator(person, say=said.append))
    )
    assert f"another rig, firmware or line ({first.device})" in said[-1]
    assert "let go of the handles and keep clear" in person.heard[-1]


@pytest.mark.slow
def test_a_refused_rig_is_probed_again(workspace: Workspace) -> None:
    recipe = workspace.recipe()
    said: list[str] = []
    broken = StrangeDevice(FAULTS["motor reversed"], seed=1)
    with pytest.raises(ProbeRefusedError) as caught:
        probe_into(workspace, RigSession(VirtualPort(broken), recipe, Operator(Person(broken))))
    assert caught.value.kept == (workspace.probe_path,)
    kept = last_probe(workspace)
    assert kept is not None
    assert any(verdict.status == "fail" for verdict in kept.verdicts)
    repaired = StrangeDevice(seed=1)
    ensure_probed(
        workspace,
        RigSession(VirtualPort(repaired), recipe, Operator(Person(repaired), say=said.append)),
    )
    assert "the last probe refused it" in said[0]


def test_a_file_that_cannot_be_read_is_no_probe(workspace: Workspace) -> None:
    workspace.probe_path.write_text("{", encoding="utf-8")
    assert last_probe(workspace) is None
    workspace.probe_path.write_text(json.dumps({"format": "other"}), encoding="utf-8")
    assert last_probe(workspace) is None


def test_a_capture_probes_and_its_recording_holds_what_was_found(workspace: Workspace) -> None:
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace("repeats = 2", "repeats = 1").replace(
        "excitation_s = 10.0", "excitation_s = 1.0"
    )
    lines = [
        "speeds_rad_per_s = [0.05, 1.0]" if line.startswith("speeds_rad_per_s") else line
        for line in text.splitlines()
    ]
    workspace.recipe_path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    said: list[str] = []
    captured = capture_into(workspace, "friction", SIM_RIG, operator=Operator(say=said.append))
    recording = read_recording(captured.path)
    found = probe_of(recording.device)
    assert found == last_probe(workspace)
    assert found is not None
    assert found.inertia_kg_m2 is not None
    assert "motor_sign" not in recording.device


def test_probe_and_capture_ask_once_to_clear_the_blades(workspace: Workspace) -> None:
    """A capture without a probe asks by itself."""
    recipe = short_recipe()
    for requests, expected in ((3, "The capture follows at once"), (1, "needs them empty")):
        device = StrangeDevice(seed=1)
        person = Person(device)
        port = nullcontext(VirtualPort(device))
        rig = patch("scissorcal.workday.rigs.open_rig", return_value=port)
        with rig, patch.object(Workspace, "recipe", return_value=recipe):
            capture_into(workspace, "friction", RigOptions("a port"), operator=Operator(person))
        assert expected in person.heard[-1]
        assert len(person.heard) == requests


def test_the_plan_says_whether_the_probe_counts(workspace: Workspace) -> None:
    recipe = workspace.recipe()
    assert "there is no probe of it yet" in probe_state(workspace, recipe)
    first = ensure_probed(workspace, RigSession(virtual_rig(), recipe)).probe
    good = probe_state(workspace, recipe)
    assert good.startswith(f"{first.device} was probed at {first.made_at}: no check failed")
    assert "count scale" in good
    later = datetime.now(UTC) + timedelta(hours=5)
    assert "probed again before" in probe_state(workspace, recipe, later)
    assert "rig.motor_sign changed" in probe_state(workspace, changed(recipe, motor_sign=-1))
