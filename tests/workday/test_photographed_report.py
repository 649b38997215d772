"""A workspace's report and signature follow the fits of its photographs."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.calibration import PlateFit, load, save
from scissorcal.errors import InputError, MissingError
from scissorcal.identity import file_digest
from scissorcal.workday.engine import Engine
from scissorcal.workday.photographs import PhotoIndex
from scissorcal.workday.plan import make_plan
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.runs.sign import sign_report, standing_review
from scissorcal.workday.workspace import PHOTOGRAPH_INDEX, Workspace
from tests.report.geometry_fits import blade_result, imported_camera, plate_fit
from tests.workday.made import RECIPE, quick_workspace

PHOTOGRAPHED = RECIPE.replace("[rig.edge]", '[rig.edge]\nsource = "photographs"').replace(
    "[scene]", '[scene]\nplate_pose = "estimated"'
)


def photographs(workspace: Workspace, kind: str) -> Path:
    folder = workspace.captures_dir / f"{kind}-20260101T000000Z"
    folder.mkdir(parents=True)
    index = PhotoIndex(kind=kind, photographs=())  # type: ignore[arg-type]
    (folder / PHOTOGRAPH_INDEX).write_text(index.model_dump_json(), encoding="utf-8")
    return folder


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """A camera, a blade and a plate that are current, and nothing of the rig yet."""
    made = quick_workspace(tmp_path / "work")
    made.recipe_path.write_text(PHOTOGRAPHED, encoding="utf-8")
    photographs(made, "blade")
    photographs(made, "plate")
    (made.root / "fits").mkdir()
    save(imported_camera(), Engine.of(made).file("fit camera"))
    engine = Engine.of(made)
    for name, result in (("fit blade", blade_result()), ("fit plate", plate_fit())):
        current = replace(result, inputs_hash=engine.identity(name, "draft"))  # type: ignore[type-var]
        save(current, engine.file(name))  # type: ignore[arg-type]
    return made


def test_photographs_alone_can_be_reported_and_signed(workspace: Workspace) -> None:
    engine = Engine.of(workspace)
    written = write_workspace_report(engine)
    assert {verdict.scope for verdict in written.verdicts} == {
        "fit.camera",
        "fit.blade",
        "fit.plate",
    }
    assert written.fits == ("camera", "blade", "plate")
    assert engine.state("report").state == "done"
    review = sign_report(engine, "A. Lovelace", "accept")
    hashes = {what: engine.facts(f"fit {what}")["inputs"] for what in written.fits}
    assert review.fit_hashes == hashes
    assert standing_review(engine) == review


def test_a_page_that_cannot_take_the_signature_leaves_the_report_unsigned(
    workspace: Workspace,
) -> None:
    engine = Engine.of(workspace)
    write_workspace_report(engine)
    workspace.report_html.write_text("no page", encoding="utf-8")
    with pytest.raises(InputError, match="cannot take the signature"):
        sign_report(engine, "A. Lovelace", "accept")
    assert not workspace.signature_path.exists()
    assert Engine.of(workspace).state("report sign").state == "missing"


def test_a_signature_that_cannot_be_written_leaves_the_page_unsigned(workspace: Workspace) -> None:
    engine = Engine.of(workspace)
    write_workspace_report(engine)
    page = workspace.report_html.read_bytes()
    workspace.signature_path.mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        sign_report(engine, "A. Lovelace", "accept")
    assert workspace.report_html.read_bytes() == page
    assert list(workspace.report_html.parent.glob("*.part")) == []


def test_a_missing_page_of_a_signed_report_is_written_again_with_its_signature(
    workspace: Workspace,
) -> None:
    engine = Engine.of(workspace)
    write_workspace_report(engine)
    review = sign_report(engine, "A. Lovelace", "accept")
    page, twin = workspace.report_html.read_bytes(), workspace.report_json.read_bytes()
    assert not write_workspace_report(engine).written
    workspace.report_html.unlink()
    engine = Engine.of(workspace)
    assert write_workspace_report(engine).written
    assert workspace.report_html.read_bytes() == page
    assert workspace.report_json.read_bytes() == twin
    assert standing_review(engine) == review


def test_another_result_makes_report_and_signature_stale(workspace: Workspace) -> None:
    engine = Engine.of(workspace)
    write_workspace_report(engine)
    sign_report(engine, "A. Lovelace", "accept")
    path = engine.file("fit plate")
    save(replace(load(path, PlateFit), rms_px=0.4), path)
    engine = Engine.of(workspace)
    assert engine.state("report").state == "stale"
    assert "other fits" in engine.state("report").found
    assert engine.state("report sign").state == "stale"
    assert standing_review(engine) is None
    with pytest.raises(MissingError, match="other fits"):
        sign_report(engine, "A. Lovelace", "accept")


def test_a_stale_fit_is_named_and_stops_the_report(workspace: Workspace) -> None:
    text = workspace.recipe_path.read_text(encoding="utf-8")
    moved = text.replace("contact_mm = [15.0, 60.0]", "contact_mm = [15.0, 50.0]")
    workspace.recipe_path.write_text(moved, encoding="utf-8")
    assert Engine.of(workspace).state("fit blade").state == "stale"
    with pytest.raises(MissingError, match="The fit of blade is stale"):
        write_workspace_report(Engine.of(workspace))


def test_a_missing_fit_is_named_in_the_report(workspace: Workspace) -> None:
    engine = Engine.of(workspace)
    engine.file("fit plate").unlink()
    write_workspace_report(engine)
    assert "`scissorcal fit plate`" in workspace.report_json.read_text(encoding="utf-8")


def test_an_imported_camera_gives_way_to_photographs_of_a_board(workspace: Workspace) -> None:
    assert Engine.of(workspace).state("fit camera").state == "failed"  # as its own checks say
    photographs(workspace, "camera")
    assert Engine.of(workspace).state("fit camera").state == "stale"


def test_damage_is_a_state_with_a_command(workspace: Workspace) -> None:
    folder = photographs(workspace, "rig")
    (folder / PHOTOGRAPH_INDEX).write_text("{", encoding="utf-8")
    Engine.of(workspace).file("fit blade").write_text("{", encoding="utf-8")
    steps = {step.name: step for step in make_plan(workspace).steps}
    assert steps["capture plate"].state == "failed"
    assert folder.name in steps["capture plate"].found
    assert steps["fit blade"].state == "damaged"
    assert steps["fit blade"].command == "scissorcal fit blade"


def test_a_scene_without_photographs_needs_none_of_their_steps(workspace: Workspace) -> None:
    workspace.recipe_path.write_text(RECIPE, encoding="utf-8")
    engine = Engine.of(workspace)
    assert not engine.needed("fit camera")
    assert "fit camera" not in [step.name for step in make_plan(workspace).steps]
    with pytest.raises(MissingError, match="nothing to report"):
        write_workspace_report(engine)


@pytest.mark.parametrize("change", ["changed", "gone"])
def test_a_photograph_that_is_no_longer_what_was_captured_fails_its_capture(
    workspace: Workspace, change: str
) -> None:
    folder = next(workspace.captures_dir.glob("blade-*"))
    picture = folder / "001-blade.jpg"
    picture.write_bytes(b"as it was captured")
    listed = {"photographs": [{"file": picture.name, "sha256": file_digest(picture)}]}
    (folder / PHOTOGRAPH_INDEX).write_text(json.dumps(listed), encoding="utf-8")
    assert Engine.of(workspace).state("capture blade").state == "done"
    if change == "gone":
        picture.unlink()
    else:
        picture.write_bytes(b"as another program left it")
    found = Engine.of(workspace).state("capture blade")
    assert found.state == "failed"
    assert found.found.startswith(f"{folder.name}/{picture.name} ")
    assert "put it back as it was" in found.found
    assert Engine.of(workspace).state("fit blade").state == "stale"
