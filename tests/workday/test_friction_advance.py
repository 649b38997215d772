"""The carriage's friction among the steps: where a scene needs it, or where it was asked for."""

import re
from pathlib import Path

import pytest

from scissorcal.errors import InputError, MissingError
from scissorcal.recipe import parse_recipe
from scissorcal.recipe.requirements import requirements
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import restore, versions
from scissorcal.workday.options import SIM_RIG, FitOptions
from scissorcal.workday.plan import make_plan
from scissorcal.workday.recordings import exclude_recording
from scissorcal.workday.runs.capture import capture_into
from scissorcal.workday.runs.fit import available, fit_workspace, load_result
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.workspace import Workspace, create_workspace

pytestmark = pytest.mark.slow

NAME = "friction-advance"
STEPS = [f"{verb} {NAME}" for verb in ("capture", "fit", "verify")]
SHORT = """
[capture.friction_advance]
speeds_mm_per_s = [30.0, 80.0]
repeats = 1
excitation_s = 3.0

[fit.friction_advance]
law = "coulomb+viscous"
symmetry = "symmetric"
critic = false
"""


def shown(workspace: Workspace) -> list[str]:
    return [step.name for step in make_plan(workspace).steps if NAME in step.name]


def state(workspace: Workspace, name: str) -> str:
    return Engine.of(workspace).state(name).state


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    made = create_workspace(tmp_path / "work", "paper-80gsm")
    with made.recipe_path.open("a", encoding="utf-8") as file:
        file.write(SHORT)
    return made


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A workspace with a capture and a fit of the carriage."""
    made = create_workspace(tmp_path_factory.mktemp("advance") / "work", "paper-80gsm")
    with made.recipe_path.open("a", encoding="utf-8") as file:
        file.write(SHORT)
    capture_into(made, "friction-advance", SIM_RIG)
    fit_workspace(made, (NAME,))
    return made


def test_a_scene_that_does_not_need_it_is_not_asked_for_it(workspace):
    assert shown(workspace) == []
    assert state(workspace, f"capture {NAME}") == "excluded"


def test_a_force_along_the_cut_with_friction_needs_it(workspace):
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace('["torque", "handle_force"]', '["torque", "translation_force"]')
    workspace.recipe_path.write_text(text, encoding="utf-8")
    assert shown(workspace) == STEPS
    plan = make_plan(workspace)
    (step,) = [step for step in plan.steps if step.name == f"fit {NAME}"]
    assert "the carriage's own comes on top" in step.why
    assert step.command == "scissorcal fit friction --axis advance"
    without = parse_recipe(text.replace("render_friction = true", "render_friction = false"))
    assert not requirements(without).needs_capture(NAME)


def test_captures_are_told_apart_from_those_of_the_opening(day):
    assert len(day.recordings(NAME)) == 1
    assert day.recordings("friction") == ()
    assert state(day, "capture friction") == "missing"


def test_what_was_asked_for_is_shown_with_its_states(day):
    assert shown(day) == STEPS
    steps = {step.name: step for step in make_plan(day).steps}
    assert [steps[name].state for name in STEPS] == ["done", "unverified", "missing"]
    assert "on request" in steps[f"fit {NAME}"].why
    assert make_plan(day).next_command == "scissorcal capture friction --device PORT"
    fit = load_result(Engine.of(day), NAME)
    assert fit.what == NAME
    assert available(Engine.of(day)) == (NAME,)


def test_other_settings_and_an_exclusion_make_it_stale(day):
    before = day.recipe_path.read_text(encoding="utf-8")
    try:
        changed = before.replace('symmetry = "symmetric"', 'symmetry = "asymmetric"')
        day.recipe_path.write_text(changed, encoding="utf-8")
        assert state(day, f"fit {NAME}") == "stale"
        assert state(day, f"capture {NAME}") == "done"
        more = before.replace("speeds_mm_per_s = [30.0, 80.0]", "speeds_mm_per_s = [5.0, 80.0]")
        day.recipe_path.write_text(more, encoding="utf-8")
        found = Engine.of(day).state(f"capture {NAME}")
        assert found.state == "incomplete"
        assert "5 mm/s" in found.found
    finally:
        day.recipe_path.write_text(before, encoding="utf-8")
    assert state(day, f"fit {NAME}") == "unverified"


def test_the_report_shows_it_beside_a_missing_scene(day):
    reported = write_workspace_report(Engine.of(day))
    assert reported.fits == (NAME,)
    page = reported.html.read_text(encoding="utf-8")
    assert "Friction-advance fit: coulomb + viscous, symmetric" in page
    assert "rest on the commanded force" in page
    assert "scissorcal verify friction --axis advance" in page
    assert "A sliding joint carries no blades" not in page
    assert re.search(r"forward at 0\.08 m/s", page)


def test_versions_are_kept_and_restored(day):
    fit_workspace(day, (NAME,), FitOptions(effort="draft"))
    engine = Engine.of(day)
    kept = [one for one in versions(engine, NAME) if not one.current]
    assert len(kept) == 1
    assert kept[0].name.startswith("friction-advance-")
    restore(engine, kept[0].name)
    assert load_result(Engine.of(day), NAME).effort == "standard"


def test_nothing_captured_names_the_command(workspace):
    with pytest.raises(MissingError, match="scissorcal capture friction --axis advance"):
        fit_workspace(workspace, (NAME,))


def test_a_capture_without_travel_is_refused_before_the_rig_is_probed(workspace):
    text = workspace.recipe_path.read_text(encoding="utf-8")
    text = text.replace("[capture.friction_advance]", "[capture.friction_advance]\ntravel_mm = 2.0")
    workspace.recipe_path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="travel_mm = 2 is too little"):
        capture_into(workspace, "friction-advance", SIM_RIG)
    assert not workspace.probe_path.exists()
    assert workspace.recordings(NAME) == ()


def test_its_recordings_can_be_excluded(workspace):
    captured = capture_into(workspace, "friction-advance", SIM_RIG)
    exclude_recording(workspace, captured.path.name, "the carriage was held")
    found = Engine.of(workspace).state(f"capture {NAME}")
    assert (found.state, found.found) == ("missing", "every recording is excluded")
