"""A blade in a workspace: photographs in, a fit out, nothing half-written."""

import cv2
import numpy as np
import pytest
from benchmarks.scissors import photographed

from scissorcal.calibration import BladeResult, fit_blade, load
from scissorcal.errors import InputError, MissingError
from scissorcal.vision import (
    measure_edge,
    read_photo,
    render_blade_photographs,
    usual_camera,
    write_camera_file,
)
from scissorcal.workday.demo.photographs import specimen_blade
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import FitOptions
from scissorcal.workday.photographs import BladeSetup, photo_captures
from scissorcal.workday.runs.blade import STREAM, capture_blade
from scissorcal.workday.runs.camera import import_camera
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.workspace import create_workspace
from tests.vision.blade.scenes import scissors_photo


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    return create_workspace(tmp_path_factory.mktemp("blades") / "lab", "paper-80gsm")


@pytest.fixture(scope="module")
def photographs(workspace, tmp_path_factory):
    folder = tmp_path_factory.mktemp("photographs")
    return render_blade_photographs(specimen_blade(workspace.recipe()), folder, seed=1, count=2)


def test_nothing_captured_is_said(tmp_path):
    empty = create_workspace(tmp_path / "empty", "paper-80gsm")
    with pytest.raises(MissingError, match="capture blade"):
        fit_workspace(empty, ["blade"])


def test_photographs_that_cannot_be_used_are_left_out_and_none_leaves_nothing(workspace, tmp_path):
    text = tmp_path / "notes.jpg"
    text.write_text("no picture")
    told = []
    with pytest.raises(InputError, match="Nothing was kept"):
        capture_blade(workspace, [text, tmp_path / "absent.jpg"], BladeSetup(), told.append)
    assert len(told) == 2
    assert not list(workspace.captures_dir.glob("*")) if workspace.captures_dir.exists() else True


def test_the_virtual_blade_is_captured_and_fitted(workspace, photographs):
    done = capture_blade(workspace, [*photographs, photographs[0]], BladeSetup(), lambda _: None)
    assert len(done.taken) == 2
    assert "given twice" in done.refused[0]
    assert len(photo_captures(workspace, "blade")) == 1
    (outcome,) = fit_workspace(workspace, ["blade"], FitOptions(effort="draft"))
    assert not outcome.cached
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in outcome.pictures)
    assert len(outcome.pictures) == 2
    edge_posterior = load(Engine.of(workspace).file("fit blade"), BladeResult).edge_posterior
    edge = workspace.recipe().rig.edge
    middle = 0.5e-3 * edge.length_mm
    found = float(edge_posterior.edge.offset_at(middle))
    stated = 1e-3 * edge.offset_mm + middle * 0.0349208
    assert found == pytest.approx(stated, abs=6e-5)
    (again,) = fit_workspace(workspace, ["blade"], FitOptions(effort="draft"))
    assert again.cached
    assert again.result.edge_posterior.edge == edge_posterior.edge
    assert again.pictures == outcome.pictures
    assert_arrays_give_the_fit(workspace, photographs, outcome.result)


def assert_arrays_give_the_fit(workspace, photographs, result):
    """The same pixels, measured and fitted without files: the same numbers to the last bit."""
    recipe = workspace.recipe()
    priors = recipe.fit.blade.priors
    measured = []
    for path in photographs:
        measured += measure_edge(read_photo(path).image, priors=priors).measured
    rng = np.random.default_rng([0, STREAM, 0])
    fit = fit_blade(measured, recipe, effort="draft", rng=rng)
    (stored,) = result.blades
    assert fit.edge_posterior.edge == stored.edge_posterior.edge
    assert np.array_equal(fit.draws, stored.draws)
    assert np.array_equal(fit.offset.q05, stored.offset.q05)
    assert np.array_equal(fit.height.mean, stored.height.mean)


def test_a_camera_of_another_size_is_not_used_by_a_workspace(tmp_path, photographs):
    """Its photographs are measured without it, as the fit states."""
    lab = create_workspace(tmp_path / "lab", "paper-80gsm")
    file = write_camera_file(usual_camera(640, 480), tmp_path / "camera.yml", "opencv")
    import_camera(Engine.of(lab), file)
    capture_blade(lab, photographs[:1], BladeSetup(), lambda _: None)
    (outcome,) = fit_workspace(lab, ["blade"], FitOptions(effort="draft"))
    assert any("No camera fit" in note for note in outcome.result.blades[0].notes)


def test_open_scissors_do_not_mix_with_a_blade_alone(workspace, photographs):
    capture_blade_needed = photo_captures(workspace, "blade")
    assert capture_blade_needed
    with pytest.raises(InputError, match="one fit uses one kind"):
        capture_blade(workspace, photographs, BladeSetup(both=True), lambda _: None)


def test_both_blades_of_virtual_scissors(tmp_path):
    lab = create_workspace(tmp_path / "pair", "paper-80gsm")
    made = render_blade_photographs(
        specimen_blade(lab.recipe()), tmp_path, seed=2, count=1, both=True
    )
    capture_blade(lab, made, BladeSetup(both=True), lambda _: None)
    (outcome,) = fit_workspace(lab, ["blade"], FitOptions(effort="draft"))
    result = outcome.result
    assert [blade.name for blade in result.blades] == ["left", "right"]
    assert 0.45 < result.openings[0].opening_rad < 0.95


def test_closed_scissors_are_refused_at_the_capture_and_nothing_is_kept(tmp_path):
    lab = create_workspace(tmp_path / "closed", "paper-80gsm")
    path = tmp_path / "closed.png"
    cv2.imwrite(str(path), scissors_photo(0.0, mat=False).image)
    told = []
    with pytest.raises(InputError, match=r"it is closed.*Nothing was kept"):
        capture_blade(lab, [path], BladeSetup(both=True, mat=False), told.append)
    assert "Open it by 30 to 80 deg" in told[0]
    assert not list(lab.captures_dir.glob("blade-*"))


def test_a_pair_has_verdicts_on_its_lengths_and_its_lamps(tmp_path):
    lab = create_workspace(tmp_path / "pair", "paper-80gsm")
    paths = []
    for index, lamp in ((0, 40.0), (3, 60.0)):
        pair = photographed(np.random.default_rng([163, index]), tilt_deg=2.0, lamp_deg=lamp)
        paths.append(tmp_path / f"{index}.png")
        cv2.imwrite(str(paths[-1]), pair.photo.image)
    setup = BladeSetup(both=True, mat=False, length_mm=78.0)
    capture_blade(lab, paths, setup, lambda _: None)
    (outcome,) = fit_workspace(lab, ["blade"], FitOptions(effort="draft"))
    checks = {verdict.check for verdict in outcome.result.verdicts}
    assert {"residual against claimed sd", "blade lengths", "lamps apart"} <= checks
    again = load(Engine.of(lab).file("fit blade"), BladeResult)
    assert again.openings == outcome.result.openings
    assert again.shared_verdicts == outcome.result.shared_verdicts
