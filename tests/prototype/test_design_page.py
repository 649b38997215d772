"""The designer as a person uses it: by pointer, touch, keys and tables; files and steps back."""

import tomllib
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.prototype.design_bed import Bed, open_bed

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="60mm" viewBox="0 0 90 60">
<rect id="plate" x="5" y="4" width="80" height="50"/><circle cx="45" cy="29" r="6"/></svg>"""


def spans(bed: Bed) -> list[tuple[float, float]]:
    """Begin and end in mm of the pieces that were applied last."""
    pieces = bed.told[-1]["pieces"]
    return [
        (round(1e3 * one["begin_m"], 3), round(1e3 * one["strips"][-1]["end_m"], 3))
        for one in pieces
    ]


def add(bed: Bed, kind: str, tool: str) -> None:
    bed.page.locator("select").first.select_option(kind)
    bed.page.get_by_role("button", name=tool).click()


def test_nothing_is_applied_until_something_is_drawn(bed: Bed) -> None:
    assert bed.told == []
    row = bed.page.locator(".design-panel tbody tr").first.inner_text().split()
    assert row[:3] == ["1", "0.00", "120.00"]


def test_a_hole_pulled_out_by_the_pointer_makes_two_pieces_and_back(bed: Bed) -> None:
    add(bed, "hole", "Rectangle")
    bed.drag((40, 5), (60, -5))
    assert spans(bed) == [(0, 40), (60, 120)]
    assert bed.told[-1]["applied"]["drawn"]["layers"][0]["holes"]
    bed.page.keyboard.press("Control+z")
    assert spans(bed) == [(0, 120)]
    bed.page.keyboard.press("Control+y")
    assert spans(bed) == [(0, 40), (60, 120)]
    bed.page.get_by_role("button", name="Undo").click()
    assert spans(bed) == [(0, 120)]


def test_a_dragged_corner_is_one_step(bed: Bed) -> None:
    bed.drag((0, 30), (10, 25))
    told = bed.told
    assert len(told) == 1
    assert told[0]["applied"]["drawn"]["layers"][0]["outline"][3] == [10, 25]
    bed.page.get_by_role("button", name="Undo").click()
    assert bed.told[-1]["applied"]["drawn"]["layers"][0]["outline"][3] == [0, 30]
    expect(bed.page.get_by_role("button", name="Undo")).to_be_disabled()  # with the tables


def test_a_corner_is_pulled_out_of_a_side(bed: Bed) -> None:
    bed.drag((0, 0), (20, 0))
    assert bed.told[-1]["applied"]["drawn"]["layers"][0]["outline"][4] == [20, 0]
    assert spans(bed) == [(20, 120)]


def test_a_polygon_is_closed_by_its_first_corner_or_a_key(bed: Bed) -> None:
    add(bed, "outline", "Polygon")
    for place in [(20, -10), (60, -10), (60, 10), (20, -10)]:
        bed.page.mouse.click(*bed.place(*place))
    assert spans(bed) == [(0, 120), (40, 60)]
    add(bed, "hole", "Polygon")
    for place in [(45, -4), (50, -4), (50, 4), (45, 4)]:
        bed.page.mouse.click(*bed.place(*place))
    bed.page.keyboard.press("Enter")
    assert spans(bed) == [(0, 120), (40, 45), (50, 60)]


def test_all_by_keyboard(bed: Bed) -> None:
    page = bed.page
    page.locator("select").first.select_option("hole")
    page.get_by_role("button", name="Rectangle").press("Enter")
    page.locator(".design-drawing").focus()
    page.keyboard.press("Enter")
    assert spans(bed) == [(0, 55), (65, 120)]
    page.keyboard.press("Shift+ArrowRight")
    assert spans(bed) == [(0, 65), (75, 120)]
    page.keyboard.press("PageDown")
    assert "corner 1 of 4: x 65.0 mm, y -5.0 mm" in bed.said
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("a")
    assert "corner 2 of 5" in bed.said
    page.keyboard.press("Delete")
    assert len(bed.told[-1]["applied"]["drawn"]["layers"][0]["holes"][0]) == 4
    page.keyboard.press("Escape")
    page.keyboard.press("Delete")
    assert "Choose a corner" in bed.said


def test_numbers_in_the_tables_change_the_drawing(bed: Bed) -> None:
    page = bed.page
    page.get_by_label("Thickness, mm").fill("0.3")
    page.keyboard.press("Tab")
    (piece,) = bed.told[-1]["pieces"]
    assert piece["scale"] == pytest.approx(3)
    assert piece["upper_face_m"] == pytest.approx(0.15e-3)
    page.get_by_label("Toughness, × calibrated").fill("0.5")
    page.keyboard.press("Enter")
    energy = bed.told[-1]["pieces"][0]["strips"][0]["fracture_energy_J_per_m"]
    assert energy == pytest.approx(0.5 * 3 * 0.4)
    page.get_by_label("x of corner 1, mm").fill("12")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.ariaLabel") == "y of corner 1, mm"
    page.get_by_label("Width, mm").fill("60")
    page.keyboard.press("Enter")
    page.get_by_label("Line of the cut, y, mm").fill("99")
    page.keyboard.press("Enter")
    assert "misses the layer" in page.locator(".warning").inner_text()
    count = len(bed.told)
    page.get_by_label("Line of the cut, y, mm").fill("-30")
    page.keyboard.press("Enter")
    assert len(bed.told) == count + 1
    page.get_by_label("Thickness, mm").fill("-1")
    page.keyboard.press("Tab")
    assert len(bed.told) == count + 1
    assert page.get_by_label("Thickness, mm").input_value() == "0.3"


def test_the_plain_sheet_comes_back_and_goes(bed: Bed) -> None:
    add(bed, "hole", "Rectangle")
    bed.drag((40, 5), (60, -5))
    box = bed.page.get_by_label("cut this drawing")
    assert box.is_checked()
    box.uncheck()
    assert bed.told[-1] == {"pieces": None, "applied": None}
    box.check()
    assert spans(bed) == [(0, 40), (60, 120)]


def test_files_are_loaded_saved_and_loaded_again(bed: Bed, tmp_path: Path) -> None:
    page, file = bed.page, tmp_path / "plate.svg"
    file.write_text(SVG, encoding="utf-8")
    page.set_input_files("input[type=file]", file)
    page.wait_for_function("() => told.length === 1")
    assert spans(bed) == [(0, 34), (46, 80)]
    assert "80.0 by 50.0 mm" in bed.said
    page.get_by_label("Thickness, mm").fill("0.25")
    page.keyboard.press("Enter")
    for name in ("recipe.toml", "drawing.svg"):
        with page.expect_download() as download:
            page.get_by_role("button", name=f"Save {name}").click()
        assert download.value.suggested_filename == name
        download.value.save_as(tmp_path / name)
    saved = tomllib.loads((tmp_path / "recipe.toml").read_text(encoding="utf-8"))
    layers = saved["plate"]["layers"]
    assert (layers[0]["name"], layers[0]["thickness_mm"]) == ("plate", 0.25)
    for name in ("recipe.toml", "drawing.svg"):
        page.get_by_role("button", name="Remove: plate").click()
        page.locator(".warning").wait_for()
        count = len(bed.told)
        page.set_input_files("input[type=file]", tmp_path / name)
        page.wait_for_function("(count) => told.length === count + 1", arg=count)
        assert spans(bed) == [(0, 34), (46, 80)]
        assert bed.told[-1]["pieces"][0]["scale"] == pytest.approx(2.5)


def test_a_file_that_is_no_drawing_changes_nothing(bed: Bed, tmp_path: Path) -> None:
    file = tmp_path / "plate.svg"
    file.write_text("<html>no</html>", encoding="utf-8")
    bed.page.set_input_files("input[type=file]", file)
    bed.page.wait_for_function("() => document.querySelector('.design-status').textContent")
    assert "no SVG file" in bed.said
    assert bed.told == []


def test_a_file_gives_holes_or_an_edge_where_these_are_drawn(bed: Bed, tmp_path: Path) -> None:
    page, file = bed.page, tmp_path / "part.svg"
    head = 'xmlns="http://www.w3.org/2000/svg" width="80mm" height="20mm" viewBox="0 -5 80 20"'
    file.write_text(
        f'<svg {head}><rect x="60" y="-5" width="8" height="3"/></svg>', encoding="utf-8"
    )
    page.locator("select").first.select_option("hole")
    page.set_input_files("input[type=file]", file)
    page.wait_for_function("() => told.length === 1")
    assert spans(bed) == [(0, 60), (68, 120)]
    assert "moved onto the line" in bed.said
    blade = '<path d="M0 3 L70 0 L70 -1 L0 -4z"/>'
    file.write_text(f"<svg {head}>{blade}</svg>", encoding="utf-8")
    page.locator("select").first.select_option("edge")
    page.set_input_files("input[type=file]", file)
    page.wait_for_function("() => told.length === 2")
    edge = bed.told[-1]["applied"]["edge"]
    assert (edge["offset_mm"], edge["length_mm"]) == pytest.approx((-8, 70))  # 5 mm below the top
    assert edge["taper_deg"] == pytest.approx(2.454, abs=1e-3)


def test_an_edge_is_drawn_and_goes_into_the_recipe(bed: Bed, tmp_path: Path) -> None:
    page = bed.page
    page.get_by_role("button", name="Draw another edge").click()
    edge = bed.told[-1]["applied"]["edge"]
    assert edge["offset_mm"] == pytest.approx(-8, abs=1e-3)
    page.get_by_label("Family of the edge").select_option("arc")
    page.get_by_label("Curvature, 1/m").fill("1.5")
    page.keyboard.press("Enter")
    page.get_by_label("offset of corner 5, mm").fill("0")
    page.keyboard.press("Enter")
    told = bed.told[-1]["applied"]["edge"]
    assert told["curvature_per_m"] != 1.5
    with page.expect_download() as download:
        page.get_by_role("button", name="Save recipe.toml").click()
    download.value.save_as(tmp_path / "recipe.toml")
    saved = tomllib.loads((tmp_path / "recipe.toml").read_text(encoding="utf-8"))
    assert saved["rig"]["edge"] == told
    page.get_by_role("button", name="As fitted again").click()
    assert bed.told[-1]["applied"]["edge"] is None


def test_by_touch_on_a_phone(browser: Browser, tmp_path: Path) -> None:
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with open_bed(browser, tmp_path, **phone) as bed:
        bed.mount()
        assert bed.run("() => document.documentElement.scrollWidth") <= 390
        bed.page.get_by_role("button", name="Polygon").tap()
        bed.page.locator(".design-drawing").scroll_into_view_if_needed()
        for place in [(20, -10), (60, -10), (60, 10), (20, 10), (20, -10)]:
            bed.page.touchscreen.tap(*bed.place(*place))
        assert spans(bed) == [(0, 120), (20, 60)]


HOLED = """
[plate]
cut_line_mm = 0.0
[[plate.layers]]
name = "holed"
thickness_mm = 0.1
outline_mm = [[0, -20], [60, -20], [60, 20], [0, 20]]
holes_mm = [[[10, -5], [20, -5], [20, 5], [10, 5]]]
"""


@pytest.mark.parametrize(("recipe", "layer"), [(HOLED, "holed"), (None, "sheet")])
def test_the_plate_of_a_package_is_drawn_first(
    browser: Browser, tmp_path: Path, recipe: str | None, layer: str
) -> None:
    with open_bed(browser, tmp_path) as bed:
        bed.run("(recipe) => Object.assign(scene, { pieces: [], recipe })", recipe)
        bed.mount()
        assert bed.page.locator("[data-key=name0]").input_value() == layer
        bed.page.get_by_label("instead of the package's plate").check()
        assert len(spans(bed)) == (2 if recipe else 1)
        assert ("plain sheet" in bed.said) == (recipe is None)
