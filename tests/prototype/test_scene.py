"""What a page is told of a package: its tables, sliders, draws, band and measured strokes."""

import base64
import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from scissorcal.package import (
    ModelPackage,
    PackageSummary,
    Variations,
    build_package,
    central_values,
    open_package,
    table_file,
)
from scissorcal.package.variations import variations
from scissorcal.prototype.page_parts import Numbers, Slider, State
from scissorcal.prototype.scene import NODES, Scene, scene_of, slider_nodes
from tests.package.conftest import pad
from tests.package.fits import cut_fit, friction_fit, recipe

__all__ = ["pad"]

FLOAT32 = 2e-7
"""Relative: half a place of float32, twice."""


def unpacked(packed: Numbers) -> NDArray[np.float32]:
    return np.frombuffer(base64.b64decode(packed.base64), "<f4").reshape(packed.shape)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    chosen = recipe()
    friction = friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002)
    path = tmp_path_factory.mktemp("package") / "paper.zip"
    fit = cut_fit(chosen, kappa=0.75)
    build_package(chosen, friction, fit, path, np.random.default_rng(3))
    return open_package(path, warn=False)


@pytest.fixture(scope="module")
def scene(package: ModelPackage) -> Scene:
    return scene_of(package, made_utc="2026-01-02T03:04:05Z", version="0")


def test_the_tables_are_the_packages_own(package: ModelPackage, scene: Scene) -> None:
    for name, packed in scene.tables.items():
        table = getattr(package.tables, name)
        np.testing.assert_array_equal(unpacked(packed), np.stack([table.x, table.y, table.slope]))
    assert scene.mean_energy is not None
    mean = package.arrays[table_file("mean_energy")]
    np.testing.assert_array_equal(unpacked(scene.mean_energy), np.float32(mean))


def test_the_law_at_the_fitted_values_is_that_of_the_tables(scene: Scene) -> None:
    """Up to the tables' own tolerance: sliders add differences, so that cancels."""
    for name, packed in scene.centre.tables.items():
        rows = unpacked(packed)[0]
        own = scene.mean_energy if name == "mean_energy" else scene.tables[name]
        assert own is not None
        values = unpacked(own)[1]
        np.testing.assert_allclose(rows[0], values, atol=2e-4 * np.abs(values).max())


def test_sliders_have_the_fitted_value_among_their_nodes(scene: Scene) -> None:
    assert {slider.name for slider in scene.sliders} >= {"fracture_energy", "kappa", "coulomb"}
    for slider in scene.sliders:
        nodes = unpacked(slider.nodes)
        assert len(nodes) == NODES
        assert (np.diff(nodes) > 0.0).all()
        assert np.float32(slider.value) in nodes
        assert nodes[0] <= slider.q05 < slider.q95 <= nodes[-1] or slider.sd == 0.0


def varied(package: ModelPackage, slider: Slider, node: int) -> Variations:
    """The law at one node of a slider, computed afresh from float64 values."""
    cut, friction = central_values(package)
    assert friction is not None
    both = np.concatenate([cut, friction])
    both[slider.column] = slider_nodes(slider.name, slider.value, slider.sd)[node]
    return variations(package, both[None, : len(cut)], both[None, len(cut) :])


@pytest.mark.parametrize("node", [0, 3, 8, NODES - 1])
def test_what_if_at_a_node_is_the_law_computed_afresh(
    package: ModelPackage, scene: Scene, node: int
) -> None:
    for slider in scene.sliders:
        afresh = varied(package, slider, node)
        for name, packed in slider.rows.tables.items():
            wanted = np.float32(afresh.rows[name][0])
            np.testing.assert_allclose(unpacked(packed)[node], wanted, rtol=FLOAT32, atol=1e-30)
        for name in ("fracture_energy", "kappa", "rate_damping"):
            found = unpacked(getattr(slider.rows, name))[node]
            assert found == pytest.approx(getattr(afresh, name)[0], rel=FLOAT32)
        for name in set(scene.centre.tables) - set(slider.rows.tables):
            same = unpacked(scene.centre.tables[name])[0]
            np.testing.assert_array_equal(np.float32(afresh.rows[name][0]), same)


def test_every_parameter_that_changes_the_law_has_a_slider(
    package: ModelPackage, scene: Scene
) -> None:
    """Counted from the other side: move each parameter, and see whether any torque changes."""
    columns = {slider.column for slider in scene.sliders}
    cut, friction = central_values(package)
    assert friction is not None
    both = np.concatenate([cut, friction])
    centre = variations(package, cut[None], friction[None])
    for column, value in enumerate(both):
        moved = both.copy()
        moved[column] = 1.01 * value + 1e-12
        law = variations(package, moved[None, : len(cut)], moved[None, len(cut) :])
        changes = any(np.any(law.rows[name] != centre.rows[name]) for name in law.rows) or any(
            np.any(getattr(law, name) != getattr(centre, name))
            for name in ("fracture_energy", "kappa", "rate_damping")
        )
        assert changes == (column in columns), column


def test_draws_are_the_packages_draws_with_their_laws(package: ModelPackage, scene: Scene) -> None:
    assert scene.draws is not None
    values = unpacked(scene.draws.values)
    cut, friction = package.arrays["draws/cut.npy"], package.arrays["draws/friction.npy"]
    np.testing.assert_array_equal(values, np.float32(np.hstack([cut, friction])[: len(values)]))
    law = variations(package, cut[4:5], friction[4:5])
    for name, rows in law.rows.items():
        np.testing.assert_array_equal(
            unpacked(scene.draws.rows.tables[name])[4], np.float32(rows[0])
        )


def test_the_band_is_the_packages_band(package: ModelPackage, scene: Scene) -> None:
    closing = next(band for band in scene.bands if band.friction and band.rate < 0.0)
    opening, contact = unpacked(closing.opening), unpacked(closing.contact)
    grid = np.linspace(*scene.opening_rad, len(opening)), np.linspace(*scene.contact_m, 13)
    low, high = package.band(grid[0][20:24, None], closing.rate, grid[1][None, 3:5])
    np.testing.assert_array_equal(unpacked(closing.low)[20:24, 3:5], np.float32(low))
    np.testing.assert_array_equal(unpacked(closing.high)[20:24, 3:5], np.float32(high))
    assert contact.shape == (13,)
    alone = next(band for band in scene.bands if not band.friction)
    assert (unpacked(alone.high) < unpacked(closing.high)).all(), "closing friction adds torque"


def test_only_fits_of_the_package_say_what_its_parameters_mean(package: ModelPackage) -> None:
    fit = cut_fit(recipe(), kappa=0.75)
    said = [dataclasses.replace(one, meaning=f"about {one.name}") for one in fit.parameters]
    fit = dataclasses.replace(fit, parameters=tuple(said))
    own = dataclasses.replace(fit, inputs_hash=package.manifest.provenance.cut.inputs_hash)
    other = dataclasses.replace(fit, inputs_hash="of other inputs")
    made = {"made_utc": "2026-01-02T03:04:05Z", "version": "0"}
    with_own = scene_of(package, fits=[own], **made)
    names = {one.name for one in own.parameters}
    for slider in with_own.sliders:
        assert slider.meaning == (f"about {slider.name}" if slider.name in names else "")
    with_other = scene_of(package, fits=[other], **made)
    assert with_other == scene_of(package, **made)
    assert any(slider.meaning for slider in with_own.sliders)


def test_states_stand_before_those_of_the_package(package: ModelPackage) -> None:
    simulated = State(label="simulated", sentence="Simulated.")
    scene = scene_of(package, made_utc="", version="", states=[simulated])
    assert scene.states[0] == simulated
    assert tuple(state.sentence for state in scene.states[1:]) == package.warnings
    assert any(
        state.label == "unsigned" and "not signed" in state.sentence for state in scene.states
    )


def test_each_slider_has_a_label_of_its_own_and_torques_one_unit(package: ModelPackage) -> None:
    scene = scene_of(package, made_utc="", version="")
    labels = [slider.meaning or slider.name for slider in scene.sliders]
    assert len(set(labels)) == len(labels)
    units = {slider.unit for slider in scene.sliders}
    assert "mN m" in units
    assert not any(unit.startswith("N m") or unit == "m" for unit in units)


@given(
    st.sampled_from(["fracture_energy", "kappa", "response_exponent", "angle_slope"]),
    st.floats(1e-6, 1e6) | st.floats(-1e6, -1e-6),
    st.floats(1e-6, 2.0),
)
def test_nodes_ascend_around_the_value_and_keep_a_certain_sign(
    name: str, value: float, share: float
) -> None:
    if name == "kappa" and not 0.0 < value < 1.0:
        return
    nodes = slider_nodes(name, value, share * abs(value))
    assert (np.diff(nodes) >= 0.0).all()
    assert value in nodes
    if share < 0.5:
        assert (np.sign(nodes) == np.sign(value)).all()
    if name == "kappa":
        assert nodes[-1] <= 1.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e39])
def test_a_number_that_is_not_finite_in_float32_is_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="finite"), np.errstate(over="ignore"):
        Numbers.of([1.0, wrong])


def test_a_pad_that_is_only_pressed_has_neither_crack_nor_friction(pad: PackageSummary) -> None:
    scene = scene_of(open_package(pad.path, warn=False), made_utc="2026", version="1")
    assert {slider.name for slider in scene.sliders} == {"response_force", "response_exponent"}
    assert (scene.mean_energy, scene.levels) == (None, ())
    assert {band.friction for band in scene.bands} == {False}
    assert np.all(unpacked(scene.centre.fracture_energy) == 0.0)
