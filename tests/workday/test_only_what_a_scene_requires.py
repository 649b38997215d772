"""Five scenes that need little: nothing else is planned, fitted, compiled or shipped.

What a scene does without is shown by the steps of its plan, the strokes of its captures, the laws
that its fits compare, the files in its package, and the functions that ran while it was built.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult, allowed_laws
from scissorcal.device import cut_plan, friction_plan
from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.recipe import Recipe, parse_recipe, recipe_path
from scissorcal.recipe.requirements import requirements
from scissorcal.workday.plan import make_plan
from scissorcal.workday.steps import BY_NAME
from scissorcal.workday.workspace import Workspace
from tests.device.conftest import IDENTITY
from tests.package.fits import cut_fit, friction_fit

PHOTOGRAPHED = {
    f"{verb} {what}" for verb in ("capture", "fit") for what in ("camera", "blade", "plate")
}
SCENES = {
    "presses": ("press-only", {}),
    "no friction": ("paper-80gsm", {"render_friction = true": "render_friction = false"}),
    "one speed": (
        "paper-80gsm",
        {
            "opening_rate_rad_per_s = [0.05, 1.0]": "opening_rate_rad_per_s = [0.249, 0.251]",
            "speeds_rad_per_s = [0.05, 0.12, 0.3, 0.7, 1.5]": "speeds_rad_per_s = [0.25]",
            "speeds_rad_per_s = [0.1, 0.25, 0.6]": "speeds_rad_per_s = [0.25]",
        },
    ),
    "translation force": (
        "paper-80gsm",
        {
            'render = ["torque", "handle_force"]': 'render = ["translation_force"]',
            "render_friction = true": "render_friction = false",
        },
    ),
    "one blade": ("paper-80gsm", {'moving = "both"': 'moving = "upper"'}),
}


def scene(name: str) -> tuple[str, Recipe]:
    """A built-in recipe with lines replaced, each of which it has."""
    built_in, changes = SCENES[name]
    text = recipe_path(built_in).read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text, parse_recipe(text)


def fits_of(recipe: Recipe) -> tuple[FitResult, FitResult]:
    """Fits as rich as the data of a usual day make them."""
    cutting: dict[str, Any] = {"energy": None, "force": 5.0}
    if recipe.scene.cut:
        cutting = {"kappa": 0.75}
    return cut_fit(recipe, draws=40, spread=0.01, **cutting), friction_fit(draws=40, spread=0.01)


@contextmanager
def functions_called() -> Iterator[set[str]]:
    """Names of the functions of scissorcal that are called in the block, as module:function."""
    called: set[str] = set()

    def note(frame: FrameType, event: str, _: Any) -> None:
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith("scissorcal."):
            called.add(f"{module.removeprefix('scissorcal.')}:{frame.f_code.co_name}")

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        yield called
    finally:
        sys.setprofile(before)


def built(recipe: Recipe, folder: Path) -> tuple[ModelPackage, set[str]]:
    """A package of the scene, and the functions that ran to build it."""
    cut, friction = fits_of(recipe)
    with functions_called() as called:
        build_package(recipe, friction, cut, folder / "p.zip", np.random.default_rng(1))
    assert "package.compile:table_of_law" in called, "calls are seen"
    return open_package(folder / "p.zip"), called


def planned(name: str, folder: Path) -> set[str]:
    """Steps that the plan of a new workspace has."""
    folder.mkdir()
    (folder / "recipe.toml").write_text(scene(name)[0], encoding="utf-8")
    return {step.name for step in make_plan(Workspace(folder)).steps}


@pytest.mark.parametrize("name", list(SCENES))
def test_no_photograph_is_asked_for(name: str, tmp_path: Path) -> None:
    steps = planned(name, tmp_path / "day")
    assert not steps & PHOTOGRAPHED
    assert {"capture friction", "capture cut", "fit friction", "fit cut"} <= steps


def test_a_scene_that_only_presses_cuts_nothing(tmp_path: Path) -> None:
    _, recipe = scene("presses")
    strokes = cut_plan(recipe, IDENTITY).strokes
    assert {stroke.kind for stroke in strokes} <= {"press", "closing", "opening"}
    assert len({stroke.sheet for stroke in strokes if stroke.sheet >= 0}) <= 1, (
        "one piece is enough"
    )
    assert {law.fracture for law in allowed_laws(recipe)} == {"none"}
    package, called = built(recipe, tmp_path)
    assert package.manifest.mechanics.fracture is None
    assert "tables/mean_energy.npy" not in package.arrays
    names = [row.name for row in package.manifest.provenance.cut.parameters]
    assert not {"fracture_energy", "kappa"} & set(names)
    never = {
        "package.compile:_mean_energy_law",
        "package.simplest.restructure:_fracture",
    }
    assert not called & never


def test_a_scene_without_friction_ships_none_and_still_captures_it(tmp_path: Path) -> None:
    """What is measured with material between the blades contains friction (decision 002): the fit
    of the cut needs it, so it is captured and fitted, and it ends there."""
    _, recipe = scene("no friction")
    steps = planned("no friction", tmp_path / "day")
    assert {"capture friction", "fit friction"} <= steps
    package, called = built(recipe, tmp_path)
    assert not any("friction" in file for file in package.arrays)
    assert package.manifest.provenance.friction is None
    assert package.manifest.mechanics.friction is None
    never = {
        "package.friction_tables:friction_tables",
        "model.friction:friction_torque",
        "package.simplest.restructure:_friction",
    }
    assert not called & never


def test_a_scene_at_one_speed_has_one_level_of_friction(tmp_path: Path) -> None:
    """The fit has Stribeck and viscous friction; at one speed they are one level."""
    _, recipe = scene("one speed")
    empty, cutting = friction_plan(recipe, IDENTITY), cut_plan(recipe, IDENTITY)
    speeds = {s.speed for plan in (empty, cutting) for s in plan.strokes if s.kind != "excitation"}
    assert 0.249 <= min(speeds) <= max(speeds) <= 0.251
    package, _ = built(recipe, tmp_path)
    shipped = package.manifest.provenance.friction
    assert shipped is not None
    assert shipped.structure.law in ("coulomb", "coulomb+angle")
    assert not {"viscous", "stribeck", "stribeck_rate"} & {row.name for row in shipped.parameters}
    for way in ("opening", "closing"):
        assert package.arrays[f"tables/friction_{way}.npy"].shape[1] == 2, "a level has two knots"


def test_a_scene_that_renders_the_translation_force_has_no_friction_or_handle(
    tmp_path: Path,
) -> None:
    _, recipe = scene("translation force")
    package, called = built(recipe, tmp_path)
    assert package.manifest.mechanics.render == ("translation_force",)
    assert not any("friction" in file for file in package.arrays)
    assert "package.friction_tables:friction_tables" not in called
    folder = tmp_path / "day"
    folder.mkdir()
    (folder / "recipe.toml").write_text(scene("translation force")[0], encoding="utf-8")
    left_out = {item.name for item in make_plan(Workspace(folder)).left_out}
    assert "translation force" not in left_out
    assert "friction table" in left_out


def test_friction_that_a_translation_force_does_not_need_is_named() -> None:
    """It stays, as the recipe asks for it: the loop renders a torque whatever else it renders."""
    text, _ = scene("translation force")
    asked = parse_recipe(text.replace("render_friction = false", "render_friction = true"))
    (said,) = [item.why for item in requirements(asked).tables if item.name == "friction"]
    assert "a translation force has none" in said
    assert "a translation force has none" not in str(requirements(scene("one blade")[1]).tables)


def test_a_scene_with_one_moving_blade_has_the_same_parts(tmp_path: Path) -> None:
    """One blade or both is a number of the mechanics, not another table or fit."""
    _, recipe = scene("one blade")
    package, _ = built(recipe, tmp_path)
    assert package.manifest.mechanics.moving_blades == 1
    both = open_both(tmp_path)
    assert set(package.arrays) == set(both.arrays)
    assert planned("one blade", tmp_path / "day") == planned("no friction", tmp_path / "other")


def test_a_plates_surface_does_not_make_the_fit_of_its_pose_stale() -> None:
    text = recipe_path("paper-photographed").read_text(encoding="utf-8")
    settings = BY_NAME["fit plate"].settings
    flat, bent = (
        parse_recipe(text.replace('kind = "plane"', kind))
        for kind in ('kind = "plane"', 'kind = "sphere"\nradius_mm = 50.0')
    )
    assert flat.plate.surface != bent.plate.surface
    assert settings(flat) == settings(bent)
    turned = parse_recipe(text.replace("turn_deg = 0.0", "turn_deg = 1.0"))
    assert settings(flat) != settings(turned)


def open_both(folder: Path) -> ModelPackage:
    """The package of the same scene with both blades moving."""
    recipe = parse_recipe(recipe_path("paper-80gsm").read_text(encoding="utf-8"))
    cut, friction = fits_of(recipe)
    build_package(recipe, friction, cut, folder / "both.zip", np.random.default_rng(1))
    return open_package(folder / "both.zip")
