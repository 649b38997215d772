"""Edges that photographs gave: every family is compiled, and its uncertainty stands in the band."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.errors import InputError
from scissorcal.package import PackageSummary, build_package, check_package, open_package
from scissorcal.recipe import Recipe
from scissorcal.verdicts import failed
from tests.package.fits import cut_fit, recipe, with_edge

PLACES = np.array([0.015, 0.022, 0.03])
EDGES: dict[str, dict[str, Any]] = {
    "line": {},
    "arc": {"curvature_per_m": 0.4},
    "cubic": {"curvature_per_m": 0.4, "bend_per_m2": -8.0},
    "spline": {"spline_m": [0.0, 2e-5, -3e-5, 4e-5, 1e-5, 0.0], "spline_start_m": 0.01},
}


def photographed() -> Recipe:
    chosen = recipe(render_friction=False)
    edge = chosen.rig.edge.model_copy(update={"source": "photographs"})
    return chosen.model_copy(update={"rig": chosen.rig.model_copy(update={"edge": edge})})


def fit_with(family: str, sd: float, **cut: Any) -> FitResult:
    """A cut whose edge is not the recipe's, with offset and shape among what was drawn."""
    edge = {"family": family, "offset_m": -0.0083, "taper_rad": 0.03, "length_m": 0.071}
    edge |= {"curvature_per_m": 0.0, **EDGES[family]}
    sds = {"offset_m": 1e-4 * sd, "taper_rad": 2e-3 * sd}
    if family == "cubic":
        sds["bend_per_m2"] = 0.5 * sd
    if family == "spline":
        sds |= {f"spline_m_{i}": 5e-6 * sd for i in range(6)}
    return with_edge(cut_fit(photographed(), **cut), edge, sds)


@pytest.fixture(scope="module", params=list(EDGES))
def built(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, FitResult, PackageSummary]:
    """An edge's family, a cut with such an edge, and its package."""
    path = tmp_path_factory.mktemp("edges") / f"{request.param}.zip"
    fit = fit_with(request.param, 1.0)
    summary = build_package(photographed(), None, fit, path, np.random.default_rng(1))
    return request.param, fit, summary


def test_a_photographed_edge_of_any_family_is_carried(
    built: tuple[str, FitResult, PackageSummary],
) -> None:
    family, fit, summary = built
    package = open_package(summary.path)
    assert not [v for v in failed(check_package(summary.path)) if v.check != "review"]
    assert package.manifest.provenance.cut.structure.edge.family == family
    names = [parameter.name for parameter in fit.parameters]
    centre = fit.map_point[names.index("edge_offset_m")]
    assert package.exact.cutting.edge.offset_m == centre
    assert centre != fit.structure["edge"]["offset_m"]
    table = package.arrays["tables/edge.npy"]
    assert table[1] == pytest.approx(package.exact.cutting.edge.offset_at(table[0]), abs=1e-8)


@pytest.mark.parametrize("family", ["line", pytest.param("spline", marks=pytest.mark.slow)])
def test_the_uncertainty_of_an_edge_widens_the_band(family: str, tmp_path: Path) -> None:
    """Draws of the law are the same in both packages; only those of the edge differ."""
    widths = []
    for sd in (1e-3, 1.0):
        path = tmp_path / f"{sd}.zip"
        fit = fit_with(family, sd, spread=0.001, draws=60)
        build_package(photographed(), None, fit, path, np.random.default_rng(1))
        low, high = open_package(path).band(np.radians(25.0), -0.2, PLACES)
        widths.append(high - low)
    assert np.all(widths[1] > 3.0 * widths[0])


def test_an_edge_of_a_recipe_is_still_held_to_it(tmp_path: Path) -> None:
    fit = fit_with("arc", 1.0)
    with pytest.raises(InputError, match=r"rig\.edge\.family"):
        build_package(
            recipe(render_friction=False), None, fit, tmp_path / "p.zip", np.random.default_rng(1)
        )


def test_along_smooth_edges_the_release_falls(
    built: tuple[str, FitResult, PackageSummary],
) -> None:
    _, _, summary = built
    assert open_package(summary.path).tables.release_falls
    assert not [said for said in summary.warnings if "knots of the edge" in said]


def test_a_nick_in_the_edge_is_stated(tmp_path: Path) -> None:
    """Behind it the release rises: a step has to look at the knots, and the package says so."""
    fit = fit_with("line", 1.0)
    summary = build_package(photographed(), None, fit, tmp_path / "p.zip", np.random.default_rng(1))
    package = open_package(summary.path)
    station = np.linspace(0.0, 0.071, 120)
    away = (station - 0.035) / 0.002
    nick = -6e-4 * np.exp(-(away**2))
    slope = 0.03 - 2.0 * away / 0.002 * nick
    edge = np.stack([station, -0.0083 + 0.03 * station + nick, slope]).astype(np.float32)
    nicked = replace(package, arrays={**package.arrays, "tables/edge.npy": edge})
    assert not nicked.tables.release_falls
    (said,) = set(nicked.warnings) - set(package.warnings)
    assert "all 120 knots of the edge" in said


def test_a_scene_in_which_the_edge_leans_back_is_refused(tmp_path: Path) -> None:
    wide = recipe(render_friction=False, opening_deg=(10.0, 180.0))
    turned = wide.model_copy(update={"rig": wide.rig.model_copy(update={"moving": "upper"})})
    assert turned.rig.moving_blades == 1
    with pytest.raises(InputError, match=r"degrees no single point of the edge stands over"):
        build_package(turned, None, cut_fit(turned), tmp_path / "p.zip", np.random.default_rng(1))
