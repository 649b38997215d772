"""The edge of a recipe: what each family states, what is refused, and the curve that follows."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from scissorcal.errors import InputError
from scissorcal.recipe.edge import edge_sentence, stated_curve
from scissorcal.recipe.load import (
    as_toml,
    builtin_recipe,
    parse_recipe,
    recipe_path,
    recipe_settings,
)
from scissorcal.recipe.schema import Recipe

POINTS = 'family = "points"\npoints_mm = [[0, -8], [30, -7], [75, -5]]'


def text_with(edge: str) -> str:
    text = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    return re.sub(r"\[rig\.edge\].*?(?=\n\[)", f"[rig.edge]\n{edge}\n", text, flags=re.DOTALL)


def refused(edge: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_recipe(text_with(edge), "recipe.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("edge", "words"),
    [
        ("points_mm = [[0, -8], [30, -7], [75, -5]]", 'points_mm needs family = "points"'),
        (POINTS + "\nlength_mm = 75.0", 'length_mm does not go with family = "points"'),
        (POINTS + "\noffset_mm = 1.0", 'offset_mm does not go with family = "points"'),
        (POINTS + "\ntaper_deg = 0.0", 'taper_deg does not go with family = "points"'),
        (POINTS + "\ncurvature_per_m = 1.0", "leave curvature_per_m out"),
        ('family = "points"', "points_mm is missing: add points_mm in [rig.edge]"),
        ("offset_mm = 1.0", "taper_deg and length_mm are missing: add them in [rig.edge]"),
        ("offset_mm = 1.0\ntaper_deg = 1.0", "length_mm is missing: add length_mm in [rig.edge]"),
        (
            "offset_mm = 1.0\ntaper_deg = 1.0\nlength_mm = 90.0\ncurvature_per_m = 1.0",
            'curvature_per_m needs family = "arc"',
        ),
        ('family = "points"\npoints_mm = [[0, 1], [9, 2]]', "3 to 200 points, and these are 2"),
        ('family = "points"\npoints_mm = [[0, 1], [9, 2], [8, 1]]', "stations of an edge's points"),
        ('family = "points"\npoints_mm = [[1, 1], [9, 2], [19, 1]]', "first station"),
        ('family = "points"\npoints_mm = [[-9, 1], [-5, 2], [0, 1]]', "its last above 0"),
        ('family = "points"\npoints_mm = [[0, 1], [9, 2, 3], [10, 1]]', "points_mm[1]: [9, 2, 3]"),
        ('family = "points"\npoints_mm = [[0, 1], [9, inf], [10, 1]]', "not a finite number"),
        ('family = "points"\npoints_mm = [[0, 1], [9, 2], [2000, 1]]', "must be at most 1000"),
        ('family = "points"\npoints_mm = [[0, 0], [10, 100], [20, 250]]', "steeper than 80 deg"),
    ],
)  # fmt: skip
def test_what_is_no_edge_is_one_sentence(edge: str, words: str) -> None:
    said = refused(edge)
    assert words in said
    assert re.match(r"recipe\.toml, line \d+, rig\.edge", said)
    assert "\n" not in said


def test_points_become_the_models_curve() -> None:
    recipe = parse_recipe(text_with(POINTS))
    curve = stated_curve(recipe.rig.edge)
    assert recipe.rig.edge.length_m == curve.edge.length_m == 0.075
    assert curve.edge.offset_at([0.0, 0.03, 0.075]) == pytest.approx([-8e-3, -7e-3, -5e-3])
    assert curve.pieces == 1
    said = edge_sentence(recipe.rig.edge, "rotary")
    assert said.startswith("The edge follows 3 points of the recipe, from 0 to 75")
    assert "not measured" in said
    assert stated_curve(parse_recipe(text_with(POINTS)).rig.edge) is curve


def test_points_may_plan_for_photographs_and_have_deviations() -> None:
    recipe = parse_recipe(text_with(POINTS + '\nsource = "photographs"\noffset_sd_mm = 0.05'))
    assert recipe.rig.edge.offset_sd_mm == 0.05
    assert "Photographs take its place" in edge_sentence(recipe.rig.edge, recipe.rig.joint)


@pytest.mark.parametrize("family", ["line", "arc"])
def test_lines_and_arcs_are_their_numbers(family: str) -> None:
    bent = "\ncurvature_per_m = 0.5" if family == "arc" else ""
    stated = f'family = "{family}"\noffset_mm = -8.0\ntaper_deg = 2.0\nlength_mm = 75.0{bent}'
    recipe = parse_recipe(text_with(stated))
    edge = stated_curve(recipe.rig.edge).edge
    assert (edge.family, edge.offset_m, edge.length_m) == (family, -8e-3, 75e-3)
    assert edge.taper_rad == np.radians(2.0)
    assert edge.curvature_per_m == (0.5 if bent else 0.0)
    assert edge_sentence(recipe.rig.edge, recipe.rig.joint) == ""


def test_recipes_without_points_are_written_as_before() -> None:
    """Identities of results are digests of what is written here."""
    written = builtin_recipe("paper-80gsm").model_dump(mode="json")["rig"]["edge"]
    assert list(written) == [
        "source", "family", "offset_mm", "taper_deg", "curvature_per_m", "length_mm",
        "offset_sd_mm", "taper_sd_deg",
    ]  # fmt: skip
    assert json.loads(builtin_recipe("paper-80gsm").model_dump_json())["rig"]["edge"] == written


def test_a_recipe_of_points_comes_back_from_json_and_from_its_listing() -> None:
    text = text_with(POINTS)
    recipe = parse_recipe(text)
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe
    assert parse_recipe(as_toml(recipe_settings(recipe, text))) == recipe


@pytest.mark.parametrize(
    ("edge", "right"),
    [
        ({"family": "points", "points_mm": [[0, 1], [5, 1], [9, 1]]}, True),
        ({"family": "points"}, False),
        ({"offset_mm": 1.0, "taper_deg": 1.0, "length_mm": 9.0}, True),
        ({"family": "arc", "offset_mm": 1.0, "length_mm": 9.0}, False),
        ({}, False),
    ],
)
def test_the_schema_knows_what_each_family_needs(edge: dict[str, Any], right: bool) -> None:
    whole = Recipe.model_json_schema()
    schema = whole["$defs"]["Edge"] | {"$defs": whole["$defs"]}
    assert Draft202012Validator(schema).is_valid(edge) is right


def test_the_example_of_the_documents_says_what_it_prints() -> None:
    page = (Path(__file__).parents[2] / "docs/files.md").read_text(encoding="utf-8")
    example = re.search(r"```toml\n\[rig\.edge\]\n(.*?)```", page, re.DOTALL)
    assert example is not None
    assert (
        f"note: {edge_sentence(parse_recipe(text_with(example[1])).rig.edge, 'rotary')}\n" in page
    )
