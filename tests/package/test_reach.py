"""What a scene presses beyond its data, beyond the thickness, and beyond the torque limit."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult, SceneMean
from scissorcal.model import edge_height, within_thickness
from scissorcal.package import PackageOptions, build_package, open_package
from scissorcal.package.exact import FitDraws, central_model
from scissorcal.package.reach import data_reach, reach_sentences
from scissorcal.package.scene_torque import scene_torque
from scissorcal.recipe import Recipe
from scissorcal.report import scene_sentence
from tests.package.fits import cut_fit, friction_fit, recipe

WIDE: dict[str, Any] = {"opening_deg": (12.0, 50.0), "contact_mm": (15.0, 60.0)}
H = 2e-3
"""Thickness of the recipe's pad; both blades move, so its upper face stands at half of it."""


def pressed_to(fit: FitResult, chosen: Recipe, depth_m: float, count: int = 50) -> FitResult:
    """The fit with samples that press at 40 mm, from touching down to a depth."""
    law = central_model(FitDraws.centre(fit), None).cutting
    opening = np.radians(np.linspace(12.0, 50.0, 4000))
    depth = law.upper_face_m - edge_height(law.edge, np.full(4000, 0.04), opening / 2).height
    wanted = np.linspace(1e-6, depth_m, count)
    at = np.interp(wanted, depth[::-1], opening[::-1])
    zeros, whole = np.zeros(count), np.zeros(count, dtype=np.int64)
    series = replace(
        fit.series, time_s=zeros, recording=whole, stroke=whole, opening=at,
        opening_rate=np.full(count, -0.1), contact=np.full(count, 0.04), measured=zeros,
        predicted=zeros, band_low=zeros, band_high=zeros,
    )  # fmt: skip
    return replace(fit, series=series)


@pytest.mark.parametrize("response", ["power", "exponential", "spline"])
def test_what_is_rendered_beyond_the_data_is_stated_for_every_law(
    response: str, tmp_path: Path
) -> None:
    """In numbers of data and scene, in the package's warnings, and in the report's sentence."""
    chosen = recipe("press-only", render_friction=False)
    shape = (0.9, 0.2, -0.1) if response == "spline" else ()
    exponent = 1.2
    fit = cut_fit(chosen, energy=None, force=3.0, exponent=exponent, response=response, shape=shape)
    short = pressed_to(fit, chosen, 0.4e-3)
    reach = data_reach(chosen, short)
    assert reach is not None
    law = central_model(FitDraws.centre(fit), None).cutting
    edge = edge_height(law.edge, np.array(0.039), np.radians(20.0) / 2)
    assert reach.data_depth_m == pytest.approx(0.4e-3, rel=1e-3)
    assert reach.data_force_N == pytest.approx(float(law.response.force_at(0.4e-3)), rel=2e-3)
    assert reach.scene_depth_m == pytest.approx(float(law.upper_face_m - edge.height), rel=1e-6)
    assert reach.scene_force_N == pytest.approx(
        float(law.response.force_at(reach.scene_depth_m)), rel=1e-6
    )
    (said,) = reach_sentences(reach, response)
    assert f"the {response} law continued" in said
    assert "0.88 mm" in said
    assert "0.4 mm" in said
    path = tmp_path / "package.zip"
    build_package(
        chosen,
        None,
        short,
        path,
        np.random.default_rng(1),
        options=PackageOptions(allow_failed=True),
    )
    package = open_package(path)
    assert package.manifest.reach == reach
    assert said in package.warnings
    assert said in scene_sentence(scene_torque(chosen, short, None))
    deep = data_reach(chosen, pressed_to(fit, chosen, 0.88e-3))
    assert reach_sentences(deep, response) == ()


def test_without_samples_nothing_is_said_of_them() -> None:
    chosen = recipe("press-only")
    fit = cut_fit(chosen, energy=None, force=3.0)
    assert data_reach(chosen, fit) is None
    assert reach_sentences(None, "power") == ()


def test_what_the_limit_holds_back_is_not_beyond_the_data() -> None:
    """The scene's force ends where the torque does, whatever the law says deeper."""
    chosen = recipe("press-only", **WIDE)
    fit = pressed_to(cut_fit(chosen, energy=None, force=50.0), chosen, 0.9e-3)
    reach = data_reach(chosen, fit)
    assert reach is not None
    limit = chosen.limits.torque_Nm
    assert reach.scene_force_N <= limit / 0.015
    assert reach.scene_depth_m < H


def test_crossed_edges_and_depths_beyond_the_thickness_are_named_by_share() -> None:
    chosen = recipe("press-only", **WIDE)
    fit = pressed_to(cut_fit(chosen, energy=None, force=3.0), chosen, 0.9e-3)
    reach = data_reach(chosen, fit)
    assert reach is not None
    assert 0.0 < reach.through_share < reach.crossed_share < 1.0
    assert any("more than the material's thickness" in said for said in reach_sentences(reach, "x"))
    near = recipe("press-only", opening_deg=(18.0, 50.0), contact_mm=(40.0, 44.0))
    crossed = data_reach(near, fit)
    assert crossed is not None
    assert crossed.through_share == 0.0 < crossed.crossed_share
    assert any("edges have crossed" in said for said in reach_sentences(crossed, "x"))
    cut = data_reach(recipe(), pressed_to(cut_fit(recipe()), recipe(), 1e-4))
    assert cut is not None
    assert (cut.crossed_share, cut.through_share) == (0.0, 0.0)


def test_a_mean_over_the_scene_keeps_to_limit_and_thickness() -> None:
    """It had been 17 N m of error on a rig of 1 N m, of places 7 mm deep in a pad of 2 mm."""
    chosen = recipe("press-only", **WIDE)
    scene = SceneMean.of(cut_fit(chosen, energy=None, force=5.0), chosen)
    view = edge_height(scene.cutting.edge, scene.contact, scene.opening / 2)
    depth = scene.cutting.upper_face_m - view.height
    assert depth.max() <= H < 3.5 * depth.max()
    assert 0.0 < scene.torque() < chosen.limits.torque_Nm
    assert scene.change(offset_m=5e-4) <= chosen.limits.torque_Nm
    tight = SceneMean.of(cut_fit(chosen, energy=None, force=5.0), chosen, limit=0.05)
    assert tight.torque() <= 0.05
    assert tight.change(offset_m=5e-4) < 0.05
    none = replace(scene, opening=np.zeros(0), contact=np.zeros(0))
    assert none.torque() == 0.0


def test_the_scene_of_the_report_leaves_out_what_no_pad_bears() -> None:
    chosen = recipe("press-only", render_friction=False, **WIDE)
    fit = pressed_to(cut_fit(chosen, energy=None, force=3.0), chosen, 0.9e-3)
    found = scene_torque(chosen, fit, None)
    law = central_model(FitDraws.centre(fit), None).cutting
    depth = (
        law.upper_face_m - edge_height(law.edge, found.grid.contact, found.grid.opening / 2).height
    )
    assert not found.grid.reached[depth > H].any()
    assert found.grid.reached[(depth <= H) & (depth > 0.0)].all()
    assert found.largest <= chosen.limits.torque_Nm


def test_only_what_is_pressed_is_bounded_by_its_thickness() -> None:
    law = central_model(FitDraws.centre(cut_fit(recipe())), None).cutting
    assert within_thickness(law, np.array([1e-2])).all()
    pad = central_model(FitDraws.centre(cut_fit(recipe("press-only"), energy=None)), None).cutting
    assert within_thickness(pad, np.array([-1e-3, 1.99e-3, 2.01e-3])).tolist() == [
        True,
        True,
        False,
    ]


@pytest.mark.parametrize("name", ["press-only", "cotton-cloth", "paper-80gsm", "paper-with-hole"])
def test_the_built_in_scenes_press_within_material_and_limit(name: str) -> None:
    """No built-in recipe asks a rig for what it cannot render, or a pad for more than it bears."""
    chosen = recipe(name)
    force = {"press-only": 3.0, "cotton-cloth": 6.5}.get(name, 2.0)
    energy = None if not chosen.scene.cut else 0.5
    fit = pressed_to(cut_fit(chosen, energy=energy, force=force), chosen, 3e-4)
    reach = data_reach(chosen, fit)
    assert reach is not None
    assert (reach.crossed_share, reach.through_share) == (0.0, 0.0)
    scene = SceneMean.of(fit, chosen)
    unlimited = replace(scene, limit=np.inf)
    assert scene.torque() == unlimited.torque(), "nothing is above the limit"


def test_friction_is_not_in_what_presses() -> None:
    """The limit of the material's torque alone decides; friction comes on top."""
    chosen = recipe("press-only")
    fit = pressed_to(cut_fit(chosen, energy=None, force=3.0), chosen, 0.5e-3)
    with_friction = scene_torque(chosen, fit, friction_fit())
    assert with_friction.beyond_data == reach_sentences(data_reach(chosen, fit), "power")
