"""What a page is told of a package: its own tables, sliders about the fit, finite numbers only."""

import base64

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from scissorcal.kernel.tables import TABLE_NAMES
from scissorcal.package import PackageSummary, open_package
from scissorcal.package.model_package import ModelPackage
from scissorcal.prototype.arrays import Numbers
from scissorcal.prototype.scene import NODES, Scene, scene_of
from tests.package.conftest import pad, paper

__all__ = ["pad", "paper"]


def read(numbers: Numbers) -> NDArray[np.float32]:
    return np.frombuffer(base64.b64decode(numbers.base64), dtype="<f4").reshape(numbers.shape)


@pytest.fixture(scope="module")
def package(paper: PackageSummary) -> ModelPackage:
    return open_package(paper.path, warn=False)


@pytest.fixture(scope="module")
def scene(package: ModelPackage) -> Scene:
    return scene_of(package, made_utc="2026-11-24T00:00:00Z", version="1", warnings=("read me",))


def test_tables_are_those_of_the_package(package: ModelPackage, scene: Scene) -> None:
    assert set(scene.tables) == set(TABLE_NAMES)
    for name in TABLE_NAMES:
        table = getattr(package.tables, name)
        for told, own in zip(
            read(scene.tables[name]), (table.x, table.y, table.slope), strict=True
        ):
            np.testing.assert_array_equal(told, np.asarray(own, dtype=np.float32))
    assert scene.mean_energy is not None
    np.testing.assert_array_equal(
        read(scene.mean_energy), package.arrays["tables/mean_energy.npy"].astype(np.float32)
    )


def test_ranges_and_warnings_are_those_of_the_package(package: ModelPackage, scene: Scene) -> None:
    ranges, limits = package.manifest.ranges, package.manifest.limits
    assert scene.opening_rad == ranges.opening_rad
    assert scene.contact_m == ranges.contact_m
    assert scene.torque_limit_Nm == limits.torque_Nm
    assert scene.warnings == ("read me", *package.warnings)


def test_nodes_of_each_slider_hold_the_fit_and_its_interval(scene: Scene) -> None:
    names = {slider.name for slider in scene.sliders}
    assert {"response_force", "fracture_energy", "kappa", "coulomb", "stribeck"} <= names
    assert names.isdisjoint({"inertia"})
    for slider in scene.sliders:
        nodes = read(slider.nodes)
        assert nodes.shape == (NODES,)
        assert np.all(np.diff(nodes) > 0.0), slider.name
        assert np.float32(slider.value) in nodes, slider.name
        assert nodes[0] <= slider.q05 < slider.q95 <= nodes[-1], slider.name


def test_rows_at_the_fitted_value_are_the_centre(scene: Scene) -> None:
    for slider in scene.sliders:
        at = int(np.flatnonzero(read(slider.nodes) == np.float32(slider.value))[0])
        for name, rows in slider.rows.tables.items():
            own, centre = read(rows)[at], read(scene.centre.tables[name])[0]
            np.testing.assert_allclose(own, centre, rtol=1e-6, atol=1e-6 * np.abs(centre).max())
        assert read(slider.rows.fracture_energy)[at] == read(scene.centre.fracture_energy)[0]


def test_columns_of_draws_are_those_of_the_sliders(package: ModelPackage, scene: Scene) -> None:
    assert scene.draws is not None
    values = read(scene.draws.values)
    energy = next(slider for slider in scene.sliders if slider.name == "fracture_energy")
    np.testing.assert_array_equal(values[:, energy.column], read(scene.draws.rows.fracture_energy))
    for slider in scene.sliders:
        column = values[:, slider.column]
        assert slider.value == pytest.approx(column.mean(), abs=slider.sd), slider.name


def test_bands_hold_the_fitted_torque(package: ModelPackage, scene: Scene) -> None:
    assert {(band.rate < 0.0, band.friction) for band in scene.bands} == {
        (True, False),
        (True, True),
        (False, True),
    }
    for band in (band for band in scene.bands if band.friction):
        opening, contact = read(band.opening)[:, None], read(band.contact)[None, :]
        low, high = read(band.low), read(band.high)
        assert np.all(low <= high)
        place = (
            np.clip(opening.astype(float), *scene.opening_rad),
            band.rate,
            np.clip(contact.astype(float), *scene.contact_m),
        )
        torque = package.torque(*place)
        spare = scene.bound_Nm + 1e-6
        within = (torque >= low - spare) & (torque <= high + spare)
        assert within.mean() > 0.95


def test_a_pad_that_is_only_pressed_has_neither_crack_nor_friction(pad: PackageSummary) -> None:
    scene = scene_of(open_package(pad.path, warn=False), made_utc="2026", version="1")
    assert {slider.name for slider in scene.sliders} == {"response_force", "response_exponent"}
    assert (scene.mean_energy, scene.levels) == (None, ())
    assert {band.friction for band in scene.bands} == {False}
    assert np.all(read(scene.centre.fracture_energy) == 0.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e39])
def test_numbers_that_are_not_finite_in_float32_are_refused(value: float) -> None:
    with np.errstate(over="ignore"), pytest.raises(ValueError, match="finite"):
        Numbers.of([0.0, value])


@pytest.mark.parametrize(
    "changed",
    [{"bound_Nm": np.nan}, {"contact_m": (0.01, np.inf)}, {"numbers": (np.nan,)}, {"odd": 1}],
)
def test_a_scene_with_hostile_values_is_refused(scene: Scene, changed: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Scene.model_validate({**scene.model_dump(), **changed})
