"""Numbers that are not of their unit are refused with the likely slip, unless they are meant."""

import math
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.recipe.explain import table_model
from scissorcal.recipe.library import builtin_recipe, recipe_names, recipe_path
from scissorcal.recipe.load import parse_recipe
from scissorcal.recipe.priors import AnyPrior, NormalPrior
from scissorcal.recipe.schema import Recipe
from scissorcal.recipe.show import as_toml, recipe_settings
from scissorcal.recipe.units import split_unit
from scissorcal.recipe.unlikely import EVERYDAY, MARGIN, QUANTITY_OF, bounds, unlikely_numbers

PAPER = recipe_path("paper-80gsm").read_text(encoding="utf-8")


def paper(old: str, new: str) -> str:
    assert old in PAPER
    return PAPER.replace(old, new)


def refused(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_recipe(text, "recipe.toml")
    return str(caught.value)


SLIPS = [
    ("handle_radius_mm = 60.0", "handle_radius_mm = 0.060", "handle_radius_mm = 60."),
    ("handle_radius_mm = 60.0", "handle_radius_mm = 6.0", "handle_radius_mm = 60."),
    ("loop_rate_Hz = 1000.0", "loop_rate_Hz = 1.0", "loop_rate_Hz = 1000."),
    ("thickness_mm = 0.10", "thickness_mm = 100.0", "thickness_mm = 0.1."),
    ("thickness_mm = 0.10", "thickness_mm = 1e-4", "thickness_mm = 0.1."),
    ("= [12.0, 50.0]", "= [0.2, 0.87]", "opening_deg = [11.4592, 49.8473]."),
    ("_per_s = [0.05, 1.0]", "_per_s = [3.0, 60.0]", "= [0.0523599, 1.0472]."),
    ("tolerance_percent = 7.0", "tolerance_percent = 0.07", "tolerance_percent = 7."),
    ("contact_mm = [15.0, 60.0]", "contact_mm = [0.015, 0.06]", "contact_mm = [15, 60]."),
    ("contact_mm = [15.0, 60.0]", "contact_mm = [1.5, 6.0]", "contact_mm = [15, 60]."),
    ("offset_mm = -8.0", "offset_mm = -0.008", "offset_mm = -8."),
    ("torque_Nm = 1.0", "torque_Nm = 1000.0", "torque_Nm = 1."),
    ("force_N = 30.0", "force_N = 30000.0", "force_N = 30."),
    ("force_N = 30.0", "force_slew_N_per_s = 5.0\nforce_N = 30.0", "force_slew_N_per_s = 5000."),
    ("= [0.05, 0.12, 0.3, 0.7, 1.5]", "= [3, 7, 17, 40, 86]", "0.698132, 1.50098]."),
    ("{ median = 5000.0, factor_90 = 10.0 }", "{ median = 5.0, factor_90 = 10.0 }",
     "toughness_J_per_m2 = { median = 5000, factor_90 = 10 }."),
    ("{ median = 2.0, factor_90 = 20.0 }", "{ median = 2000.0, factor_90 = 20.0 }",
     "response_force_N = { median = 2, factor_90 = 20 }."),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "meant"), SLIPS)
def test_a_slip_is_named_with_what_to_write(old: str, new: str, meant: str) -> None:
    message = refused(paper(old, new))
    line = next(n for n, text in enumerate(PAPER.splitlines(), 1) if old in text)
    assert message.startswith(f"recipe.toml, line {line}, ")
    assert " is far from the everyday " in message
    assert meant in message
    key = message.partition('add unusual = ["')[2].partition('"')[0]
    assert parse_recipe(f'unusual = ["{key}"]\n' + paper(old, new)).unusual == (key,)


def test_slips_stand_beside_other_mistakes_in_the_order_of_the_file() -> None:
    text = paper("handle_radius_mm = 60.0", "handle_radius_mm = 0.06")
    text = text.replace("thickness_mm = 0.10", "thicknes_mm = 0.10")
    head, first, second = refused(text).splitlines()
    assert head == "recipe.toml has 2 mistakes:"
    assert "rig.handle_radius_mm: 0.06 mm is far" in first
    assert "Did you mean thickness_mm?" in second


def test_each_layer_of_a_plate_is_judged() -> None:
    layer = '[[plate.layers]]\nname = "a"\noutline_mm = [[0, 0], [90, 0], [90, 60], [0, 60]]\n'
    text = PAPER + layer + "thickness_mm = 0.1\n" + layer.replace('"a"', '"b"')
    message = refused(text + "thickness_mm = 100.0\n")
    assert "plate.layers.thickness_mm: 100 mm is far from the everyday" in message
    assert f"line {len(text.splitlines()) + 1}, " in message


def test_a_key_that_has_no_range_is_refused_with_the_nearest_one() -> None:
    message = refused('unusual = ["rig.handle_radius"]\n' + PAPER)
    assert 'Did you mean "rig.handle_radius_mm"?' in message
    message = refused('unusual = "rig.handle_radius_mm"\n' + PAPER)
    assert 'must be a list: ["rig.handle_radius_mm"].' in message


def test_what_a_capture_wrote_is_not_judged_again() -> None:
    text = paper("handle_radius_mm = 60.0", "handle_radius_mm = 0.060")
    assert parse_recipe(text, judged=False).rig.handle_radius_mm == 0.06


def test_unusual_keys_stand_in_the_shown_recipe_and_in_no_digest() -> None:
    text = 'unusual = ["rig.handle_radius_mm"]\n' + paper("_mm = 60.0", "_mm = 0.06")
    found = parse_recipe(text)
    assert parse_recipe(as_toml(recipe_settings(found, text))) == found
    assert "unusual" not in found.model_dump()


@pytest.mark.parametrize("name", recipe_names())
def test_no_default_of_a_recipe_is_unlikely(name: str) -> None:
    whole = builtin_recipe(name).model_dump(mode="json")
    assert unlikely_numbers(whole) == []


def test_every_key_that_has_a_range_is_in_the_schema_and_names_its_unit() -> None:
    keys = {key for key, _ in numbers(Recipe, ())}
    assert set(QUANTITY_OF) <= keys
    for key in QUANTITY_OF:
        least, most = bounds(key)
        assert least > 0.0 or most < math.inf, key


NO_SLIP_TOLD = {
    "rig.control.": "gains, which are refused where the loop would be unstable",
    "rig.edge.taper_deg": "0 is everyday: a blade may be parallel to within any angle",
    "rig.edge.curvature_per_m": "0 is everyday: an edge may be straight to within any curvature",
    "rig.line.brake_after_ms": "bounded by the schema: seconds are below 1 ms",
    "rig.probe.": "bounded by the schema",
    "plate.turn_deg": "any angle",
    "plate.cut_line_mm": "any place",
    "plate.surface.": "any angle; radii in metres are below 2 mm, which the schema refuses",
    "plate.touch.peak_N": "bounded by the schema",
    "plate.tracking.": "sizes of errors, and motion from a clamp's to a hand's",
    "plate.layers.holes_mm": "the outline of the layer is judged",
    "plate.layers.regions.outline_mm": "the outline of the layer is judged",
    "scene.confidence_percent": "bounded by the schema: a share is below 50",
    "capture.handling_s": "no time is too short; milliseconds are above 3600 s",
    "capture.friction.excitation_s": "milliseconds are above 3600 s, which the schema refuses",
    "capture.friction_advance.excitation_s": "milliseconds are above 3600 s",
    "fit.blade.priors.": "shares of errors",
    "fit.friction.priors.": "the default priors hold a factor of 10,000: no slip is clear of them",
    "fit.friction_advance.lack_of_fit_percent": "0 is everyday",
    "fit.cut.lack_of_fit_percent": "0 is everyday",
}


def test_every_number_with_a_unit_has_a_range_or_a_reason_for_none() -> None:
    """A standard deviation has none: it may be as small as one likes."""
    left = {
        key
        for key, kind in numbers(Recipe, ())
        if key not in QUANTITY_OF
        and split_unit(key.rpartition(".")[2])[1] is not None
        and "_sd_" not in key
        and not (isinstance(kind, type) and issubclass(kind, NormalPrior))
    }
    assert {key for key in left if not key.startswith(tuple(NO_SLIP_TOLD))} == set()
    used = {start for start in NO_SLIP_TOLD if any(key.startswith(start) for key in left)}
    assert set(NO_SLIP_TOLD) == used


def numbers(model: Any, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Keys of the schema that are no tables, with their types."""
    for name, field in model.model_fields.items():
        inner = table_model(field.annotation)
        if inner is None or issubclass(inner, AnyPrior):
            yield ".".join((*path, name)), inner or field.annotation
        else:
            yield from numbers(inner, (*path, name))


@given(st.sampled_from(sorted(QUANTITY_OF)), st.floats(0.0, 1.0))
def test_nothing_near_the_everyday_range_is_refused(key: str, share: float) -> None:
    low, high = EVERYDAY[QUANTITY_OF[key]].magnitudes
    unit = split_unit(key.rpartition(".")[2])[1]
    assert unit is not None
    low, high = low / MARGIN / unit.factor, high * MARGIN / unit.factor
    least, most = bounds(key)
    assert least <= low * (high / low) ** share * (1 + 1e-9)
    assert low * (high / low) ** share <= most * (1 + 1e-9)


@given(st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(
        ["rig", "edge", "points_mm", "length_mm", "plate", "layers", "median", "unusual",
         "thickness_mm", "limits", "torque_Nm"]), inner, max_size=4),
    max_leaves=12,
))  # fmt: skip
def test_any_document_is_judged_in_sentences(document: Any) -> None:
    if isinstance(document, dict):
        for one in unlikely_numbers(document):
            assert one.sentence.endswith((".", "it."))
            assert len(one.full_sentence) < 1000
