"""A workspace's report and signature follow the fits of its photographs."""

from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.calibration import save
from scissorcal.errors import MissingError
from scissorcal.workday.geometry import fit_state
from scissorcal.workday.photographs import INDEX_FILE, PhotoIndex
from scissorcal.workday.plan import make_plan
from scissorcal.workday.reported_geometry import report_geometry
from scissorcal.workday.runs.blade import blade_inputs_hash, blade_path
from scissorcal.workday.runs.camera import camera_path
from scissorcal.workday.runs.plate import plate_inputs_hash, plate_path
from scissorcal.workday.runs.report import reported_fits, why_stale, write_workspace_report
from scissorcal.workday.runs.sign import review_state, sign_report
from scissorcal.workday.workspace import Workspace
from tests.report.geometry_fits import blade_result, imported_camera, plate_fit
from tests.workday.made import RECIPE, quick_workspace

PHOTOGRAPHED = RECIPE.replace("[rig.edge]", '[rig.edge]\nsource = "photographs"').replace(
    "[scene]", '[scene]\nplate_pose = "estimated"'
)


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """A camera, a blade and a plate that are of what is there now, and nothing of the rig yet."""
    made = quick_workspace(tmp_path / "work")
    made.recipe_path.write_text(PHOTOGRAPHED, encoding="utf-8")
    recipe = made.recipe()
    save(imported_camera(), camera_path(made))
    blade = replace(blade_result(), inputs_hash=blade_inputs_hash(made, recipe, (), "draft"))
    save(blade, blade_path(made))
    save(replace(plate_fit(), inputs_hash=plate_inputs_hash(made, recipe)), plate_path(made))
    return made


def test_photographs_alone_can_be_reported_and_signed(workspace: Workspace) -> None:
    written = write_workspace_report(workspace)
    assert {verdict.scope for verdict in written.verdicts} == {
        "fit.camera",
        "fit.blade",
        "fit.plate",
    }
    fits = report_geometry(workspace, workspace.recipe()).fits
    hashes = {what: fit.inputs_hash for what, fit in fits.items()}
    assert reported_fits(workspace) == set(hashes.values())
    assert why_stale(workspace, workspace.recipe(), {}) == ""
    review = sign_report(workspace, "A. Lovelace", "accept")
    assert review.fit_hashes == hashes
    assert review_state(workspace, workspace.recipe(), {}).valid == review


def test_another_outcome_makes_report_and_signature_stale(workspace: Workspace) -> None:
    write_workspace_report(workspace)
    sign_report(workspace, "A. Lovelace", "accept")
    stored = report_geometry(workspace, workspace.recipe()).plate
    assert stored is not None
    save(replace(stored, rms_px=0.4), plate_path(workspace))
    stale = "it shows other fits of photographs than there are now"
    assert why_stale(workspace, workspace.recipe(), {}) == stale
    assert stale in review_state(workspace, workspace.recipe(), {}).why
    with pytest.raises(MissingError, match="other fits of photographs"):
        sign_report(workspace, "A. Lovelace", "accept")


def test_what_fell_behind_is_named_and_not_shown(workspace: Workspace) -> None:
    text = workspace.recipe_path.read_text(encoding="utf-8")
    moved = text.replace("contact_mm = [15.0, 60.0]", "contact_mm = [15.0, 50.0]")
    workspace.recipe_path.write_text(moved, encoding="utf-8")
    plate_path(workspace).unlink()
    found = report_geometry(workspace, workspace.recipe())
    assert list(found.fits) == ["camera"]
    assert "its inputs changed since" in found.missing["blade"]
    assert "`scissorcal capture blade" in found.missing["blade"]
    assert "not fitted yet" in found.missing["plate"]
    assert "`scissorcal fit plate`" in found.missing["plate"]


def test_an_imported_camera_gives_way_to_photographs_of_a_board(workspace: Workspace) -> None:
    recipe = workspace.recipe()
    assert fit_state(workspace, recipe, "camera").status == "done"
    index = PhotoIndex(kind="camera", photographs=())
    folder = workspace.captures_dir / "camera-20260101T000000Z"
    folder.mkdir(parents=True)
    (folder / INDEX_FILE).write_text(index.model_dump_json(), encoding="utf-8")
    assert fit_state(workspace, recipe, "camera").status == "stale"


def test_damage_is_a_state_of_the_plan_with_a_command_that_mends_it(workspace: Workspace) -> None:
    folder = workspace.captures_dir / "rig-20260101T000000Z"
    folder.mkdir(parents=True)
    (folder / INDEX_FILE).write_text("{", encoding="utf-8")
    blade_path(workspace).write_text("{", encoding="utf-8")
    steps = {step.name: step for step in make_plan(workspace).steps}
    assert steps["fit plate"].status == "stale"
    assert steps["fit blade"].command == "scissorcal fit blade --force"
    missing = report_geometry(workspace, workspace.recipe()).missing
    assert folder.name in missing["plate"]


def test_a_scene_without_photographs_loads_none(workspace: Workspace) -> None:
    workspace.recipe_path.write_text(RECIPE, encoding="utf-8")
    found = report_geometry(workspace, workspace.recipe())
    assert (found.fits, found.missing) == ({}, {})
    with pytest.raises(MissingError, match="no fit of friction"):
        write_workspace_report(workspace)
