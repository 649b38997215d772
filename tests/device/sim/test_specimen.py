"""Specimen files: those that come along load, and a wrong one is refused with a sentence."""

from pathlib import Path

import pytest

from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe, recipe_names, specimens_dir
from tests.device.sim.build import specimen


@pytest.mark.parametrize("name", sorted(path.stem for path in specimens_dir().glob("*.toml")))
def test_specimens_that_come_along_load(name: str) -> None:
    assert load_specimen(name).name == name


@pytest.mark.parametrize("name", recipe_names())
def test_every_recipe_fits_its_specimen(name: str) -> None:
    recipe = builtin_recipe(name)
    truth = load_specimen(recipe.specimen or "")
    assert truth.blade.moving == recipe.rig.moving
    assert truth.blade.offset_mm == recipe.rig.edge.offset_mm
    assert truth.blade.taper_deg == recipe.rig.edge.taper_deg
    assert truth.blade.length_mm == recipe.rig.edge.length_mm
    assert truth.material.thickness_mm == recipe.material.thickness_mm
    assert truth.mechanism.handle_radius_mm == recipe.rig.handle_radius_mm
    assert truth.upper_face_m == recipe.upper_face_m
    assert (truth.material.fracture_energy is not None) == recipe.scene.cut
    if recipe.scene.cut:
        assert truth.material.sheet_length_mm == recipe.material.sheet_length_mm
    low, high = recipe.scene.opening_deg
    assert truth.mechanism.opening_range_deg[0] <= low
    assert high <= truth.mechanism.opening_range_deg[1]
    assert recipe.limits.torque_Nm <= truth.motor.torque_limit_Nm


def test_a_typo_is_named_with_file_and_suggestion(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    source = load_text("office-paper").replace("coulomb_opening_Nm", "coulomb_openin_Nm")
    path.write_text(source)
    with pytest.raises(InputError) as caught:
        load_specimen(path)
    assert "mine.toml" in str(caught.value)
    assert "coulomb_opening_Nm" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"material": {"kappa": 1.2}}, "kappa"),
        ({"blade": {"taper_deg": float("nan")}}, "taper_deg"),
        ({"blade": {"curvature_per_m": 1.0}}, "arc"),
        ({"blade": {"moving": "upper", "taper_deg": 20.0, "family": "arc",
                    "curvature_per_m": 4.0}}, "upright"),
        ({"mechanism": {"opening_range_deg": (20.0, 10.0)}}, "opening_range_deg"),
        ({"mechanism": {"friction": {"angle_slope_per_rad": 5.0}}}, "angle_slope_per_rad"),
        ({"mechanism": {"advance": {"range_mm": (1.0, 1.0)}}}, "range_mm"),
        ({"hand": {"closed_deg": 5.0}}, "closed_deg"),
        ({"colour": "red"}, "colour"),
    ],
)  # fmt: skip
def test_impossible_specimens_are_refused(change: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        specimen(**change)


def test_unknown_names_suggest_a_known_one() -> None:
    with pytest.raises(InputError, match="office-paper"):
        load_specimen("office-papr")


def test_a_specimen_cannot_be_changed() -> None:
    truth = specimen()
    with pytest.raises(ValueError, match="frozen"):
        truth.name = "other"  # type: ignore[misc]
    assert isinstance(truth, Specimen)


def load_text(name: str) -> str:
    from scissorcal.recipe import specimen_path

    return specimen_path(name).read_text()
