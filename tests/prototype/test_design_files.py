"""Files of the designer: recipes with and without a plate, steps back, plates in SVG files."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect

from scissorcal.model import Layer, Outline
from scissorcal.prototype.page_parts import layers_part
from scissorcal.recipe import parse_recipe, plate_pieces
from scissorcal.workday import create_workspace, workspace_plate
from tests.model.drawn import numbers
from tests.prototype.design_bed import Bed, open_bed
from tests.prototype.test_design_page import HOLED, spans

SHEET_RECIPE = """# as the lab wrote it
format = "scissorcal-recipe/1"
name = "a-sheet"
description = "A uniform sheet."
"""


def load(bed: Bed, folder: Path, text: str) -> None:
    """Load a recipe as a person does, and wait until the page has said so."""
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    bed.run("() => { document.querySelector('.design-status').textContent = ''; }")
    bed.page.set_input_files("input[type=file]", file)
    bed.page.wait_for_function("() => document.querySelector('.design-status').textContent")


def saved(bed: Bed, folder: Path) -> str:
    with bed.page.expect_download() as download:
        bed.page.get_by_role("button", name="Save recipe.toml").click()
    download.value.save_as(folder / "saved.toml")
    return (folder / "saved.toml").read_text(encoding="utf-8")


def test_a_recipe_without_a_plate_is_the_uniform_sheet(bed: Bed, tmp_path: Path) -> None:
    load(bed, tmp_path, HOLED)
    box = bed.page.get_by_label("cut this drawing")
    assert box.is_checked()
    load(bed, tmp_path, SHEET_RECIPE)
    assert bed.told[-1] == {"pieces": None, "applied": None}
    assert not box.is_checked()
    assert "mine.toml draws no plate: it is about the uniform sheet" in bed.said
    expect(bed.page.locator(".design .warning")).to_have_count(0)
    box.check()
    assert spans(bed) == [(0, 120)]
    assert saved(bed, tmp_path).startswith("# as the lab wrote it")


def test_a_step_back_brings_the_recipe_that_was_there_too(bed: Bed, tmp_path: Path) -> None:
    first = saved(bed, tmp_path)
    load(bed, tmp_path, SHEET_RECIPE + HOLED)
    loaded = saved(bed, tmp_path)
    assert loaded.startswith("# as the lab wrote it")
    bed.page.get_by_role("button", name="Undo").click()
    assert saved(bed, tmp_path) == first
    bed.page.get_by_role("button", name="Redo").click()
    assert saved(bed, tmp_path) == loaded


def test_a_plate_from_files_is_drawn_and_saved_with_its_outlines(
    browser: Browser, tmp_path: Path
) -> None:
    workspace = create_workspace(tmp_path / "holed", "paper-with-hole")
    wanted = numbers(plate_pieces(workspace.recipe().plate, workspace.root))
    assert len(wanted) == 2
    plate = workspace_plate(workspace)
    assert plate is not None
    told = {
        "pieces": [],
        "recipe": workspace.recipe_path.read_text(encoding="utf-8"),
        "drawn_plate": plate.model_dump(),
    }
    with open_bed(browser, tmp_path) as bed:
        bed.run("(told) => Object.assign(scene, told)", told)
        bed.mount()
        assert "from its SVG files" in bed.said
        assert bed.page.locator("[data-key=name0]").input_value() == plate.layers[0].name
        bed.page.get_by_label("instead of the package's plate").check()
        assert spans(bed) == [(round(one[0], 3), round(one[-2], 3)) for one in wanted]
        text = saved(bed, tmp_path)
    own = numbers(plate_pieces(parse_recipe(text).plate, tmp_path))
    for one, other in zip(own, wanted, strict=True):
        assert one == pytest.approx(other, abs=1e-3)


def test_a_drawing_that_is_gone_is_said_on_the_page(browser: Browser, tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "holed", "paper-with-hole")
    for drawing in workspace.root.glob("*.svg"):
        drawing.unlink()
    assert workspace_plate(workspace) is None
    recipe = workspace.recipe_path.read_text(encoding="utf-8")
    with open_bed(browser, tmp_path) as bed:
        bed.run("(recipe) => Object.assign(scene, { pieces: [], recipe })", recipe)
        bed.mount()
        assert "The plate of the package cannot be drawn here" in bed.said


def test_contours_of_one_shape_are_plates_and_holes(browser: Browser, tmp_path: Path) -> None:
    def square(x: float, y: float, size: float) -> NDArray[np.float64]:
        corners = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
        return np.array(corners) * 1e-3

    two = Outline((square(0, -10, 20), square(5, -5, 10), square(30, -10, 20)))
    part = Layer("part", 1e-4, 1.0, two)
    ring = Layer("ring", 1e-4, 1.0, two, (Outline((square(1, 1, 8), square(2, 2, 4))),))
    with open_bed(browser, tmp_path) as bed:
        told = layers_part(0.0, [part]).model_dump()
        bed.run("(drawn_plate) => Object.assign(scene, { pieces: [], drawn_plate })", told)
        bed.mount()
        names = bed.page.locator(".design-layers input[type=text]")
        assert [one.input_value() for one in names.all()] == ["part", "part 2"]
        bed.page.get_by_label("instead of the package's plate").check()
        assert spans(bed) == [(0, 5), (15, 20), (30, 50)]
    with open_bed(browser, tmp_path) as bed:
        told = layers_part(0.0, [ring]).model_dump()
        bed.run("(drawn_plate) => Object.assign(scene, { pieces: [], drawn_plate })", told)
        bed.mount()
        assert "a hole of its layer ring has a hole" in bed.said


def focus(bed: Bed) -> str:
    """The data-key of what has the focus, once the tables are there anew."""
    found: str = bed.run(
        """() => new Promise((done) => setTimeout(() =>  // behind the timer of the tables
          done(document.activeElement.dataset.key ?? document.activeElement.tagName)))"""
    )
    return found


def test_the_focus_stays_in_the_list_where_something_is_removed(bed: Bed, tmp_path: Path) -> None:
    layers = [
        f"""[[plate.layers]]
name = "l{i}"
thickness_mm = 0.1
outline_mm = [[{20 * i}, -20], [{20 * i + 20}, -20], [{20 * i + 20}, 20], [{20 * i}, 20]]
holes_mm = [{f"[[{20 * i + 5}, -5], [{20 * i + 9}, -5], [{20 * i + 9}, 5]], " * 2}]
"""
        for i in range(3)
    ]
    load(bed, tmp_path, "".join(layers))
    steps = {  # what is pressed, and where the focus is then
        "removehole1-0": "removehole1-0",  # the other hole, which has its number now
        "removehole1-0 ": "Remove1",  # none left: the button before it
        "Remove1": "Remove1",
        "Remove1 ": "Remove0",
        "Remove0": "blade",  # the only button that is left
    }
    for key, wanted in steps.items():
        bed.page.locator(f"[data-key='{key.strip()}']").press("Enter")
        assert focus(bed) == wanted, key
    bed.page.keyboard.press("Control+z")
    expect(bed.page.locator(".design-layers li")).to_have_count(1)


def test_the_focus_leaves_a_button_that_can_do_no_more(bed: Bed) -> None:
    bed.page.get_by_label("Thickness, mm").fill("0.3")
    bed.page.keyboard.press("Enter")
    undo = bed.page.locator("[data-key=undo]")
    expect(undo).to_be_enabled()  # with the tables: a key for a disabled button goes nowhere
    undo.press("Enter")
    expect(undo).to_be_disabled()
    assert focus(bed) == "circle"


def test_the_caption_of_the_cut_lies_over_no_line_of_a_layer(bed: Bed, tmp_path: Path) -> None:
    layer = """[[plate.layers]]
name = "l{}"
thickness_mm = 0.1
outline_mm = [[0, -20], [60, -20], [60, 20], [0, 20]]
"""
    load(bed, tmp_path, "".join(layer.format(i) for i in range(5)))
    bottom = bed.run(
        "() => { const at = document.querySelector('.design-cut text').getBBox();"
        " return at.y + at.height; }"
    )
    lines = bed.run("() => [...document.querySelectorAll('.design-met')].map((e) => e.getBBox().y)")
    assert len(lines) == 5
    assert bottom < min(lines) - 1.9  # half of a line's width
