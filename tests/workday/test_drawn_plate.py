"""The built-in plate with a hole and a band: planned, built, rendered as drawn."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.identity import file_digest
from scissorcal.kernel import ModelTables, PiecesModel
from scissorcal.package import ModelPackage, open_package
from scissorcal.recipe import recipe_path
from scissorcal.recording import read_recording
from scissorcal.render import needs_on, softened
from scissorcal.workday.engine import Engine
from scissorcal.workday.plan import make_plan
from scissorcal.workday.reviewed import reviewed_content
from scissorcal.workday.runs.prototype import workspace_scene
from scissorcal.workday.runs.render import package_warnings
from scissorcal.workday.workspace import Workspace
from tests.workday.faults import run
from tests.workday.made import quick_workspace, record_cut, record_friction

BUILT_IN = recipe_path("paper-with-hole")
DRAWING = "paper-with-hole.svg"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    made = quick_workspace(tmp_path_factory.mktemp("drawn") / "plate")
    plate = re.search(r"^\[plate\].*?(?=^\[scene\])", BUILT_IN.read_text("utf-8"), re.M | re.S)
    assert plate is not None
    text = made.recipe_path.read_text(encoding="utf-8")
    made.recipe_path.write_text(f"{text}\n{plate[0]}", encoding="utf-8")
    drawing = BUILT_IN.with_suffix(".svg").read_text(encoding="utf-8")
    (made.root / DRAWING).write_text(drawing, encoding="utf-8")
    record_friction(made)
    record_cut(made)
    for words in (("fit",), ("report",), ("package", "build")):
        done = run(words, made.root)
        assert done.code == 0, done.err
    return made


@pytest.fixture(scope="module")
def package(workspace: Workspace) -> ModelPackage:
    return open_package(workspace.package_path(workspace.recipe()), warn=False)


def test_plan_says_what_is_measured_of_the_plate(workspace: Workspace) -> None:
    done = run(("plan",), workspace.root)
    assert done.code == 0
    said = " ".join(done.out.split())
    assert "2 pieces with 1 gap within layers" in said
    assert "Toughness ratios of 1, 3 are declared in the recipe, not measured." in said


def test_pieces_follow_the_drawing(package: ModelPackage) -> None:
    first, second = package.pieces
    fracture = package.manifest.mechanics.fracture
    assert fracture is not None
    energy = fracture.energy_J_per_m
    assert (first.begin_m, first.end_m) == pytest.approx((0.0, 22e-3), abs=1e-5)
    assert [strip.end_m for strip in second.strips] == pytest.approx(
        [35e-3, 45e-3, 180e-3], abs=1e-5
    )
    energies = [strip.fracture_energy_J_per_m / energy for strip in second.strips]
    assert energies == pytest.approx([1.0, 3.0, 1.0])
    assert {piece.scale for piece in package.pieces} == {1.0}


def test_the_page_is_told_the_outlines_of_the_drawing(workspace: Workspace) -> None:
    plate = workspace_scene(workspace).drawn_plate
    assert plate is not None
    assert plate.cut_line_mm == workspace.recipe().plate.cut_line_mm
    (layer,) = plate.layers
    (outline,) = layer.outline
    assert max(x for x, _ in outline) == pytest.approx(180.0, abs=1e-3)
    assert (len(layer.holes), [one.toughness_ratio for one in layer.regions]) == (1, [3.0])
    path = workspace.package_path(workspace.recipe())
    assert workspace_scene(workspace, path).drawn_plate is None


def test_torque_is_none_in_the_hole_and_in_proportion_in_the_band(package: ModelPackage) -> None:
    low, high = package.manifest.ranges.opening_rad
    opening = np.concatenate([[high] * 2, np.linspace(high, low, 4000)])
    quiet = replace(package.tables, render_friction=False)
    found = {}
    for at_m in (0.010, 0.024, 0.040):  # in the sheet, the hole, the band
        model = PiecesModel(quiet, package.pieces)
        model.step_many(np.full(2, high), 0.0, at_m - 0.12)
        step = model.step_many(opening, -0.2, at_m - 0.03)
        place = step["contact"] + at_m - 0.03
        near = (place > at_m - 2e-3) & (place < at_m + 2e-3) & (step["torque"] > 0.0)
        found[at_m] = float(np.median(step["torque"][near])) if near.any() else 0.0
    sheet, hole, band = found.values()
    assert sheet > 0.0
    assert hole == 0.0
    assert band / sheet == pytest.approx(3.0, rel=0.1)


def test_the_report_says_of_the_plate_what_plan_says(workspace: Workspace) -> None:
    twin = json.loads(workspace.report_json.read_text(encoding="utf-8"))
    (panel,) = (panel for panel in twin["panels"] if panel["id"] == "scene-plate")
    assert panel["sentence"] == make_plan(workspace).plate
    assert "declared in the recipe, not measured" in panel["sentence"]
    whole, tough = panel["charts"][0]["series"]
    assert whole["x"] == pytest.approx([0, 22, None, 28, 35, None, 45, 180], abs=0.01)
    assert tough["x"] == pytest.approx([35.0, 45.0])
    assert set(whole["y"]) == {0.1, None}
    second = {value["name"]: value for value in panel["rows"][1]["values"]}
    assert second["from"]["number"] == pytest.approx(28.0, abs=0.01)
    assert (
        second["declared toughness ratio"]["text"]
        == "1 (up to 35 mm), 3 (up to 45 mm), 1 (up to 180 mm)"
    )
    page = workspace.report_html.read_text(encoding="utf-8")
    assert panel["sentence"] in " ".join(page.split())


def test_a_changed_drawing_makes_package_and_report_stale(workspace: Workspace) -> None:
    drawing = workspace.root / DRAWING
    before = drawing.read_bytes()
    assert not any("stale" in one for one in package_warnings(workspace))
    assert "stale" not in page_labels(workspace)
    states = {s["name"]: s["state"] for s in plan_steps(workspace)}
    assert "stale" not in states.values()
    try:
        drawing.write_bytes(before.replace(b'cx="25"', b'cx="60"'))
        states = {s["name"]: s["state"] for s in plan_steps(workspace)}
        assert states["package build"] == "stale"
        assert states["report"] == "stale"
        assert states["fit cut"] != "stale"
        assert any("The package is stale" in one for one in package_warnings(workspace))
        assert {"stale", "unverified"} <= page_labels(workspace)
        assert reviewed_content(Engine.of(workspace))[DRAWING] == file_digest(drawing)
    finally:
        drawing.write_bytes(before)


def page_labels(workspace: Workspace) -> set[str]:
    return {state.label for state in workspace_scene(workspace).states}


def plan_steps(workspace: Workspace) -> list[dict[str, str]]:
    found = json.loads(run(("plan", "--json"), workspace.root).out)["result"]["steps"]
    return list(found)


def test_a_hole_asks_for_no_stiffer_rig(package: ModelPackage) -> None:
    """Its edges are too far apart to be pressed at once."""
    limit = package.manifest.limits.torque_Nm
    alone = [needs_on(package.tables, limit, (piece,)).stiffness for piece in package.pieces]
    assert needs_on(package.tables, limit, package.pieces).stiffness == max(alone)


def test_overlapping_pieces_need_a_stiffer_rig(package: ModelPackage) -> None:
    limit = package.manifest.limits.torque_Nm
    sheet = needs_on(package.tables, limit, ())
    one = needs_on(package.tables, limit, package.pieces[:1])
    stack = needs_on(package.tables, limit, (package.pieces[0], package.pieces[0]))
    assert one.found <= sheet.stiffness * 1.01
    assert sheet.stiffness <= one.stiffness < 1.1 * sheet.stiffness
    assert stack.stiffness == pytest.approx(2.0 * one.stiffness, rel=1e-6)


def rendered_friction(
    tables: ModelTables, opening: np.ndarray, rate: np.ndarray, width: float
) -> np.ndarray:
    """The friction that the loop renders: built up over ``width`` of opening since a reversal."""
    anchor, stretch = opening[0], np.zeros(len(opening))
    for i, place in enumerate(opening):
        anchor = min(max(anchor, place - width), place + width)
        stretch[i] = (place - anchor) / width
    speed = np.maximum(np.abs(rate), tables.friction_rate_eps)
    level = np.where(
        stretch > 0.0,
        tables.friction_opening.evaluate(speed, held=True),
        tables.friction_closing.evaluate(speed, held=True),
    )
    return np.asarray(-level * tables.friction_angle.evaluate(opening, held=True) * stretch)


def test_the_rig_renders_the_drawn_plate(workspace: Workspace, package: ModelPackage) -> None:
    """What is sent is friction and the pieces' torque: none of it in the hole, nor off the plate.

    Friction is the law's, and not one level for all frames: it depends on the rate, and where the
    blades begin to close it has not built up yet.
    """
    words = ("render", "--device", "sim", "--strokes", "3", "--seed", "4", "--accept-derated")
    done = run(words, workspace.root)
    assert done.code == 0, done.err
    (path,) = sorted((workspace.root / "captures").glob("render-*.mcap"))
    samples = read_recording(path).samples
    opening, advance = samples["opening"], samples["advance"]
    rate = np.gradient(opening) * package.manifest.mechanics.loop_rate_Hz
    admitted = workspace.package_path(workspace.recipe()).with_suffix(".admission.json")
    admission = json.loads(admitted.read_text(encoding="utf-8"))
    steepest = admission["steepest_N_per_m"]
    tables = softened(package.tables, steepest) if steepest else package.tables
    quiet = PiecesModel(replace(tables, render_friction=False), package.pieces)
    step = quiet.step_many(opening, rate, advance)
    felt, place = step["torque"], step["contact"] + advance
    friction = rendered_friction(tables, opening, rate, admission["friction_width_rad"])
    sent = samples["torque_command"] - friction
    closing = (np.arange(len(rate)) > 600) & (rate < -0.05)  # after the ramp of the force
    touching = closing & (felt > 0.0)
    assert np.count_nonzero(touching) > 100
    error = np.sqrt(np.mean((sent[touching] - felt[touching]) ** 2))
    assert error < 0.05 * felt.max()
    free = closing & (felt == 0.0)
    assert np.quantile(np.abs(sent[free]), 0.9) < 0.05 * felt.max()
    hole = free & (np.abs(place - package.pieces[1].begin_m) < 1e-6)
    assert np.count_nonzero(hole) >= 10
    assert np.abs(sent[hole]).max() < 0.05 * felt.max()
