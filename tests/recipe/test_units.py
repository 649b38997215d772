"""Units in names: read, split and converted."""

import math

import pytest

from scissorcal.recipe.schema import Recipe
from scissorcal.recipe.units import conversion, parse_unit, split_unit


@pytest.mark.parametrize(
    ("source", "target", "factor"),
    [
        ("cm", "mm", 10.0),
        ("in", "mm", 25.4),
        ("um", "m", 1e-6),
        ("deg", "rad", math.pi / 180),
        ("rad", "deg", 180 / math.pi),
        ("mNm", "Nm", 1e-3),
        ("Ncm", "Nm", 1e-2),
        ("kJ_per_m2", "J_per_m2", 1e3),
        ("mJ_per_mm2", "J_per_m2", 1e3),
        ("N_per_mm", "N_per_m", 1e3),
        ("Nm_per_deg", "Nm_per_rad", 180 / math.pi),
        ("per_mm", "per_m", 1e3),
        ("per_mm_per_ms", "per_m_per_s", 1e6),
        ("kHz", "Hz", 1e3),
        ("J", "Nm", 1.0),
        ("min", "s", 60.0),
    ],
)
def test_conversions(source: str, target: str, factor: float) -> None:
    one, other = parse_unit(source), parse_unit(target)
    assert one is not None
    assert other is not None
    assert conversion(one, other) == pytest.approx(factor, rel=1e-14)
    assert conversion(other, one) == pytest.approx(1 / factor, rel=1e-14)


@pytest.mark.parametrize(("one", "other"), [("mm", "deg"), ("N", "Nm"), ("s", "Hz"), ("m", "m2")])
def test_what_differs_in_kind_is_not_converted(one: str, other: str) -> None:
    first, second = parse_unit(one), parse_unit(other)
    assert first is not None
    assert second is not None
    assert conversion(first, second) is None


@pytest.mark.parametrize("text", ["", "_", "per_", "cloth", "m99", "mm__s", "90"])
def test_what_is_no_unit_is_none(text: str) -> None:
    assert parse_unit(text) is None


def test_every_number_of_the_recipe_reads_its_unit_from_its_name() -> None:
    expected = {
        "thickness_mm": ("thickness", "mm"),
        "opening_kd_Nm_s_per_rad": ("opening_kd", "Nm_s_per_rad"),
        "curvature_per_m": ("curvature", "per_m"),
        "opening_rate_rad_per_s": ("opening_rate", "rad_per_s"),
        "torque_slew_Nm_per_s": ("torque_slew", "Nm_per_s"),
        "strokes_per_sheet": ("strokes_per_sheet", None),
        "factor_90": ("factor_90", None),
    }
    names = str(Recipe.model_json_schema())
    for key, (stem, unit) in expected.items():
        assert f"'{key}'" in names
        found_stem, found = split_unit(key)
        assert (found_stem, found.name if found else None) == (stem, unit)


def test_labels_are_written_as_people_do() -> None:
    labels = {key: unit.label for key in ("Nm_s_per_rad", "per_m") if (unit := parse_unit(key))}
    assert labels == {"Nm_s_per_rad": "N m s/rad", "per_m": "1/m"}
