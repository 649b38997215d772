"""A fit is done once for the same inputs, and again when any of them changes."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import NEXT_RECORDING, ON_RECORD
from scissorcal.cli.fit_law import text
from scissorcal.errors import InputError, MissingError
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import scatter_on_record
from scissorcal.workday.options import FitOptions
from scissorcal.workday.plan import Plan, make_plan
from scissorcal.workday.recordings import exclude_recording
from scissorcal.workday.runs.fit import fit_workspace, load_result
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.steps import BY_NAME
from scissorcal.workday.workspace import Workspace
from tests.workday.made import quick_workspace, record_friction


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    workspace = quick_workspace(tmp_path_factory.mktemp("day") / "paper")
    record_friction(workspace)
    (outcome,) = fit_workspace(workspace, ("friction",))
    assert not outcome.cached
    assert outcome.path.is_file()
    return workspace


@pytest.fixture
def copied(fitted: Workspace, tmp_path: Path) -> Workspace:
    """Give a copy of the fitted workspace that a test may change."""
    shutil.copytree(fitted.root, tmp_path / "copy")
    return Workspace(tmp_path / "copy")


def states(plan: Plan) -> dict[str, str]:
    return {step.name: step.state for step in plan.steps}


def edit(workspace: Workspace, old: str, new: str) -> None:
    text = workspace.recipe_path.read_text(encoding="utf-8")
    assert old in text
    workspace.recipe_path.write_text(text.replace(old, new), encoding="utf-8")


def test_nothing_changed_means_nothing_done(fitted: Workspace) -> None:
    before = fitted.fit_path("friction").read_bytes()
    (outcome,) = fit_workspace(fitted, ("friction",), FitOptions(seed=99))
    assert outcome.cached
    assert fitted.fit_path("friction").read_bytes() == before


def test_the_same_seed_gives_the_same_draws_and_another_seed_others(copied: Workspace) -> None:
    first, again, other = (
        fit_workspace(copied, ("friction",), FitOptions(seed=seed, force=True))[0]
        for seed in (1, 1, 2)
    )
    assert not again.cached
    assert np.array_equal(first.result.draws, again.result.draws)
    assert not np.array_equal(first.result.draws, other.result.draws)


def test_another_effort_is_another_fit(copied: Workspace) -> None:
    (outcome,) = fit_workspace(copied, ("friction",), FitOptions(effort="standard"))
    assert not outcome.cached
    assert outcome.result.effort == "standard"
    assert states(make_plan(copied))["fit friction"] == "unverified"


def test_a_new_recording_makes_the_fit_stale_and_the_next_fit_takes_it(copied: Workspace) -> None:
    record_friction(copied, seed=2)
    plan = make_plan(copied)
    assert states(plan)["fit friction"] == "stale"
    (outcome,) = fit_workspace(copied, ("friction",))
    assert not outcome.cached
    assert len(outcome.result.sources) == 2
    assert states(make_plan(copied))["fit friction"] == "unverified"


def test_a_fit_of_one_recording_takes_the_scatter_of_an_earlier_fit_of_two(
    copied: Workspace,
) -> None:
    """It stands in brackets beside the intervals, also when the fit is made again."""
    again = record_friction(copied, seed=2)
    (two,) = fit_workspace(copied, ("friction",))
    seen = two.result.diagnostics[NEXT_RECORDING]
    exclude_recording(copied, again.name, "a loose screw")
    for force in (False, True):
        (one,) = fit_workspace(copied, ("friction",), FitOptions(force=force))
        assert len(one.result.sources) == 1
        assert NEXT_RECORDING not in one.result.diagnostics
        assert one.result.diagnostics[ON_RECORD] == seen
    assert f"({seen['inertia']:.2g})" in text(one)


def test_no_scatter_is_taken_from_a_fit_of_another_version_of_the_step(copied: Workspace) -> None:
    record_friction(copied, seed=2)
    (two,) = fit_workspace(copied, ("friction",))
    step, engine = BY_NAME["fit friction"], Engine.of(copied)
    assert scatter_on_record(engine, step) == two.result.diagnostics[NEXT_RECORDING]
    assert scatter_on_record(engine, replace(step, version=step.version + 1)) == {}


def test_a_changed_setting_of_the_fit_makes_it_stale(copied: Workspace) -> None:
    edit(copied, 'law = "coulomb+viscous"', 'law = "coulomb"')
    assert states(make_plan(copied))["fit friction"] == "stale"


def test_a_change_elsewhere_in_the_recipe_leaves_it_fresh(copied: Workspace) -> None:
    edit(copied, "contact_mm = [15.0, 60.0]", "contact_mm = [15.0, 50.0]")
    plan = make_plan(copied)
    assert states(plan)["capture friction"] == "done"
    assert states(plan)["fit friction"] == "unverified"


def test_another_rig_makes_the_capture_stale_and_it_is_not_fitted(copied: Workspace) -> None:
    edit(copied, "handle_radius_mm = 60.0", "handle_radius_mm = 55.0")
    plan = make_plan(copied)
    assert states(plan)["capture friction"] == "stale"
    assert states(plan)["fit friction"] == "stale"
    assert any("rig.handle_radius_mm was 60.0 and is now 55.0" in note for note in plan.notes)
    assert plan.next_command == "scissorcal capture friction --device PORT"
    with pytest.raises(MissingError, match=r"rig\.handle_radius_mm was 60\.0 and is now 55\.0"):
        fit_workspace(copied, ("friction",))


def test_another_material_leaves_friction_alone(copied: Workspace) -> None:
    edit(copied, "thickness_mm = 0.10", "thickness_mm = 0.12")
    assert states(make_plan(copied))["capture friction"] == "done"


def test_a_damaged_fit_is_said_to_be_and_is_fitted_again(copied: Workspace) -> None:
    copied.fit_path("friction").write_bytes(b"no fit")
    plan = make_plan(copied)
    step = next(step for step in plan.steps if step.name == "fit friction")
    assert step.state == "damaged"
    assert step.found.endswith("is damaged: fit again with 'scissorcal fit friction'")
    assert step.command == "scissorcal fit friction"
    with pytest.raises(InputError, match="damaged: fit again with 'scissorcal fit friction'"):
        write_workspace_report(Engine.of(copied))
    (outcome,) = fit_workspace(copied, ("friction",))
    assert outcome.path.is_file()
    assert states(make_plan(copied))["fit friction"] == "unverified"


def test_what_must_come_first_is_named(tmp_path: Path, fitted: Workspace) -> None:
    empty = quick_workspace(tmp_path / "empty")
    with pytest.raises(MissingError, match="scissorcal capture friction --device PORT"):
        fit_workspace(empty)
    with pytest.raises(MissingError, match="scissorcal capture cut --device PORT"):
        fit_workspace(fitted, ("cut",))
    begin = "There is no fit of cut yet: run 'scissorcal capture cut --device PORT' first"
    with pytest.raises(MissingError, match=begin):
        load_result(Engine.of(fitted), "cut")


def test_a_linear_joint_is_asked_for_friction_alone(tmp_path: Path) -> None:
    workspace = quick_workspace(tmp_path / "linear")
    edit(workspace, "[rig]", '[rig]\njoint = "linear"')
    plan = make_plan(workspace)
    assert [step.name for step in plan.steps] == [
        "capture friction",
        "fit friction",
        "verify friction",
        "report",
        "report sign",
    ]
    with pytest.raises(InputError, match="requires no fit of cut"):
        fit_workspace(workspace, ("cut",))


def test_a_foreign_file_among_the_captures_is_named(copied: Workspace) -> None:
    (copied.captures_dir / "friction-20200101T000000Z.mcap").write_text("no recording")
    plan = make_plan(copied)
    assert states(plan)["capture friction"] != "done"
    assert any("friction-20200101T000000Z.mcap" in note for note in plan.notes)
    with pytest.raises(InputError, match=r"friction-20200101T000000Z\.mcap"):
        fit_workspace(copied, ("friction",))
