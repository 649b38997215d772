"""A blade whose edge a recipe states by points: planned, captured, fitted, packaged, and true.

The rig's blade is a line with a wave of 0.4 mm, interpolated by the simulation's own spline; the
recipe has points of it. A recipe with the line alone is fitted to the same captures.
"""

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.aliases import Array
from scissorcal.device import Blade, Cut, LockstepLink, RigSession, Sheet, Specimen, blade_on
from scissorcal.device import capture as rig_capture
from scissorcal.errors import InputError
from scissorcal.kernel import Kernel
from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.recipe import edge_sentence, parse_recipe, stated_curve
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import FitOptions
from scissorcal.workday.plan import make_plan
from scissorcal.workday.runs.fit import fit_workspace, load_result
from scissorcal.workday.runs.package import build_workspace_package
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.workspace import Workspace
from tests.device.sim.build import specimen
from tests.workday.faults import run
from tests.workday.made import RECIPE

pytestmark = pytest.mark.slow

SEED = 5
CAPTURE = """
[capture.friction]
speeds_rad_per_s = [0.2, 0.5]
repeats = 1
excitation_s = 4.0

[capture.cut]
speeds_rad_per_s = [0.3, 0.6]
strokes_per_sheet = 3
sheets = 1
"""


def offset_mm(station_mm: float) -> float:
    wave = 0.4 * math.sin(2.0 * math.pi * station_mm / 40.0)
    return -8.0 + station_mm * math.tan(math.radians(2.0)) + wave


def recipe_of_line() -> str:
    """Few captures, and the package keeps the laws as they were fitted."""
    text, count = re.subn(r"\[capture\.friction\].*?(?=\n\[)", CAPTURE, RECIPE, flags=re.DOTALL)
    assert count == 1
    return text.replace("tolerance_percent", "simplify = false\ntolerance_percent")


def recipe_of_points(count: int = 40, lift_mm: float = 0.0) -> str:
    pairs = ", ".join(
        f"[{s:.4f}, {offset_mm(s) + lift_mm:.4f}]" for s in np.linspace(0.0, 75.0, count)
    )
    stated = f'[rig.edge]\nfamily = "points"\npoints_mm = [{pairs}]\n'
    text, count = re.subn(r"\[rig\.edge\].*?(?=\n\[)", stated, recipe_of_line(), flags=re.DOTALL)
    assert count == 1
    return text


def truth() -> Specimen:
    """Friction of the law that the recipe fits; the wave's points are not the recipe's."""
    wave = [(s, 0.4 * math.sin(2.0 * math.pi * s / 40.0)) for s in np.linspace(-4.0, 81.0, 30)]
    friction = {
        "coulomb_opening_Nm": 0.013, "coulomb_closing_Nm": 0.013,
        "viscous_opening_Nm_s_per_rad": 0.002, "viscous_closing_Nm_s_per_rad": 0.002,
        "stribeck_Nm": 0.0, "angle_slope_per_rad": 0.0, "angle_curvature_per_rad2": 0.0,
    }  # fmt: skip
    return specimen(
        blade={"wave_mm": wave}, material={"kappa": 1.0}, mechanism={"friction": friction}
    )


def capture(workspace: Workspace, rig: Specimen, seed: int) -> None:
    recipe, text = workspace.recipe(), workspace.recipe_path.read_text("utf-8")
    link = LockstepLink(rig, np.random.default_rng(seed))
    session = ensure_probed(workspace, RigSession(link, recipe, recipe_toml=text))
    for kind in ("friction", "cut"):
        path = workspace.new_recording(kind)
        with rig_capture.open_writer(session, kind, path) as writer:
            rig_capture.capture(session, kind, writer)
    link.close()


def made(root: Path, text: str) -> Workspace:
    root.mkdir(parents=True)
    workspace = Workspace(root)
    workspace.recipe_path.write_text(text, encoding="utf-8")
    return workspace


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    workspace = made(tmp_path_factory.mktemp("edge") / "points", recipe_of_points())
    capture(workspace, truth(), SEED)
    fit_workspace(workspace, ("friction", "cut"), FitOptions(seed=SEED))
    return workspace


@pytest.fixture(scope="module")
def package(workspace: Workspace) -> ModelPackage:
    return built_package(workspace)


def built_package(workspace: Workspace) -> ModelPackage:
    built = build_workspace_package(Engine.of(workspace), seed=SEED, allow_failed=True)
    return open_package(built.path, warn=False)


def errors(package: ModelPackage) -> tuple[float, float]:
    """Relative rms errors along one closing stroke: of the torque without friction, of the force.

    The truth is the simulation's own contact law, whose crack runs through a sheet as it cuts.
    """
    rig, count = truth(), 2000
    (low, high), nearest = package.manifest.ranges.opening_rad, package.manifest.ranges.contact_m[0]
    opening = np.linspace(high, low, count)
    quiet = replace(package.tables, render_friction=False)
    step = Kernel(quiet).step_many(opening, np.full(count, -0.3), np.full(count, -nearest))
    cut = Cut(blade_on(rig), Sheet(rig.material, None))
    touches = [cut.move_to(float(theta), -nearest) for theta in opening]
    torque = np.array([touch.torque for touch in touches])
    force = np.array([-touch.drive for touch in touches])
    assert np.count_nonzero(torque > 0.0) > 0.9 * count
    return share(step["torque"], torque), share(step["force"], force)


def share(rendered: Array, true: Array) -> float:
    return float(np.sqrt(np.mean((rendered - true) ** 2) / np.mean(true**2)))


def test_plan_says_what_the_points_are(workspace: Workspace) -> None:
    said = edge_sentence(workspace.recipe().rig.edge, "rotary")
    assert re.match(r"The edge follows 40 points of the recipe, from 0 to 75 mm: ", said)
    assert make_plan(workspace).notes[0] == said
    done = run(("plan",), workspace.root)
    assert done.code == 0
    assert said in " ".join(done.out.split())


def test_strokes_are_planned_along_the_curve(workspace: Workspace) -> None:
    """Deepest and widest openings are those at which the curve meets the ends of the scene."""
    recipe = workspace.recipe()
    blade, rig = Blade.of(recipe), blade_on(truth())
    for opening in np.radians([12.0, 20.0, 30.0, 45.0]):
        assert blade.crossing(opening) == pytest.approx(rig.crossing(float(opening)), abs=1.5e-4)


def test_torque_and_force_are_the_rigs(package: ModelPackage) -> None:
    torque, force = errors(package)
    assert torque < 0.04
    assert force < 0.04


def test_a_line_in_its_place_is_far_off(workspace: Workspace, package: ModelPackage) -> None:
    line = made(workspace.root.parent / "line", recipe_of_line())
    shutil.copytree(workspace.root / "captures", line.root / "captures")
    fit_workspace(line, ("friction", "cut"), FitOptions(seed=SEED))
    straight, curved = errors(built_package(line)), errors(package)
    assert straight[0] > 0.1
    assert straight[0] > 4.0 * curved[0]


def test_the_package_holds_the_curve(workspace: Workspace, package: ModelPackage) -> None:
    edge = package.manifest.provenance.cut.structure.edge
    stated = stated_curve(workspace.recipe().rig.edge).edge
    assert edge.family == "spline"
    assert edge.spline_m == pytest.approx(stated.spline_m, abs=1e-15)
    assert (edge.spline_start_m, edge.length_m) == (0.0, 0.075)


def test_the_report_shows_the_points(workspace: Workspace) -> None:
    done = run(("report",), workspace.root)
    assert done.code == 0, done.err
    twin = json.loads(workspace.report_json.read_text(encoding="utf-8"))
    (panel,) = (panel for panel in twin["panels"] if panel["id"] == "scene-edge")
    assert panel["sentence"] == edge_sentence(workspace.recipe().rig.edge, "rotary")
    values = {value["name"]: value for value in panel["rows"][0]["values"]}
    assert (values["family"]["text"], values["points"]["number"]) == ("points", 40)
    misfit = 1e6 * stated_curve(workspace.recipe().rig.edge).misfit_m
    assert values["largest misfit"]["number"] == pytest.approx(misfit, rel=1e-4)
    drawn = panel["charts"][0]["series"]
    assert [one["name"] for one in drawn] == ["edge", "points of the recipe"]
    assert len(drawn[1]["x"]) == 40


def test_other_points_make_the_fit_stale_and_the_friction_not(workspace: Workspace) -> None:
    text = workspace.recipe_path.read_text(encoding="utf-8")
    assert states(workspace)["fit cut"] == "done"
    try:
        workspace.recipe_path.write_text(recipe_of_points(lift_mm=0.01), encoding="utf-8")
        found = states(workspace)
        assert (found["fit cut"], found["fit friction"]) == ("stale", "done")
        assert found["capture cut"] == "done"
    finally:
        workspace.recipe_path.write_text(text, encoding="utf-8")


def states(workspace: Workspace) -> dict[str, str]:
    """Of what is there, whether or not it was verified."""
    return {
        step.name: "done" if step.state == "unverified" else step.state
        for step in make_plan(workspace).steps
    }


def test_a_package_of_other_points_is_refused(workspace: Workspace, package: ModelPackage) -> None:
    recipe = parse_recipe(recipe_of_points(lift_mm=0.01))
    friction, cut = (load_result(Engine.of(workspace), what) for what in ("friction", "cut"))
    with pytest.raises(InputError, match=r"another rig\.edge\.points_mm.*scissorcal fit"):
        build_package(recipe, friction, cut, workspace.root / "no.zip", np.random.default_rng(0))
    line = parse_recipe(recipe_of_line())
    with pytest.raises(InputError, match=r"another rig\.edge\.family"):
        build_package(line, friction, cut, workspace.root / "no.zip", np.random.default_rng(0))
