"""The tables of a drawn plate: what is refused, and in which words."""

from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.recipe.load import as_toml, parse_recipe, recipe_path, recipe_settings
from scissorcal.recipe.plate_layers import plate_pieces, plate_sentence

BASE = recipe_path("paper-80gsm").read_text(encoding="utf-8")
BOX = "[[0, -30], [80, -30], [80, 30], [0, 30]]"
SHEET = f'[[plate.layers]]\nname = "sheet"\nthickness_mm = 0.1\noutline_mm = {BOX}\n'


def many_holes(count: int) -> str:
    boxes = ", ".join(
        f"[[{x}, -1], [{x + 1}, -1], [{x + 1}, 1], [{x}, 1]]" for x in range(2, 2 + 3 * count, 3)
    )
    return f"holes_mm = [{boxes}]\n"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (SHEET.replace("outline_mm", "outline_m"), r"line \d+.*Did you mean outline_mm"),
        (SHEET.replace("[80, 30]", "[nan, 30]"), "finite"),
        (SHEET.replace(BOX, "[[0, 0], [1, 1]]"), "at least 3"),
        (SHEET.replace(BOX, "[[0, 0], [1, 1], [2, 2]]"), "no area"),
        (SHEET + "toughness_ratio = 0.001\n", "at least 0.01"),
        (SHEET + "toughness_ratio = 1000\n", "at most 100"),
        (SHEET + SHEET, "one name"),
        ("[plate]\ncut_line_mm = 40\n" + SHEET, 'misses the layer "sheet"'),
        ("[plate]\ncut_line_mm = 4\n", r"needs .*plate\.layers"),
        (SHEET.replace("[[0,", "[[-5,").replace("[0, 30]", "[-5, 30]"), "begins at x = -5 mm"),
        (SHEET + many_holes(17), "18 pieces"),
        (SHEET + 'outline = "a.svg"\n', "keep one of them"),
        (SHEET + 'holes = ["a"]\n', "name shapes of the layer's drawing"),
        (SHEET.replace(f"outline_mm = {BOX}", ""), "needs outline_mm"),
        (SHEET.replace(f"outline_mm = {BOX}", 'outline = "../a.svg"'), "without folders"),
        (SHEET + "[[plate.layers.regions]]\ntoughness_ratio = 2\n", "a region needs"),
    ],
)
def test_mistakes_are_refused(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        parse_recipe(f"{BASE}\n{text}")


def test_a_tracked_plate_is_a_uniform_sheet() -> None:
    text = BASE.replace("[scene]", '[scene]\nplate_pose = "estimated"', 1)
    with pytest.raises(InputError, match="a plate that is tracked is a uniform sheet"):
        parse_recipe(f"{text}\n{SHEET}")


def test_fifteen_holes_are_sixteen_pieces() -> None:
    recipe = parse_recipe(f"{BASE}\n{SHEET}{many_holes(15)}")
    assert len(plate_pieces(recipe.plate, Path())) == 16


def test_a_drawing_that_is_missing_is_named(tmp_path: Path) -> None:
    recipe = parse_recipe(
        BASE + "\n" + SHEET.replace(f"outline_mm = {BOX}", 'outline = "plate.svg"')
    )
    with pytest.raises(InputError, match=r"plate\.svg does not exist"):
        plate_pieces(recipe.plate, tmp_path)


def test_a_uniform_sheet_has_neither_pieces_nor_a_sentence() -> None:
    recipe = parse_recipe(BASE)
    assert plate_pieces(recipe.plate, Path()) == ()
    assert plate_sentence(recipe.plate, "paper", 0.1, ()) == ""


def test_what_is_assumed_and_declared_is_said() -> None:
    recipe = parse_recipe(f"{BASE}\n{SHEET.replace('0.1', '0.3')}toughness_ratio = 2\n")
    pieces = plate_pieces(recipe.plate, Path())
    said = plate_sentence(recipe.plate, "paper", recipe.material.thickness_mm, pieces)
    assert "rest on an assumption: response and fracture energy proportional" in said
    assert "declared in the recipe, not measured" in said
    assert "the whole plate is taken to be of that one material" in said


@pytest.mark.parametrize("table", ["", "[[plate.layers.regions]]\ntoughness_ratio = 2\n"])
def test_a_layer_of_another_material_is_refused(table: str) -> None:
    text = f'{BASE}\n{SHEET}{table}outline_mm = {BOX}\nmaterial = "foil"\n'
    if not table:
        text = f'{BASE}\n{SHEET}material = "foil"\n'
    line = text.splitlines().index('material = "foil"') + 1
    with pytest.raises(InputError, match=rf"line {line}, .*one material.*another workspace"):
        parse_recipe(text)


def test_the_shown_recipe_has_the_same_meaning() -> None:
    region = f"[[plate.layers.regions]]\ntoughness_ratio = 2\noutline_mm = {BOX}\n"
    text = f"{BASE}\n{SHEET}{many_holes(2)}{region}"
    recipe = parse_recipe(text)
    assert parse_recipe(as_toml(recipe_settings(recipe, text))) == recipe
