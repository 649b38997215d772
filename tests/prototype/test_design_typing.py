"""Typed ahead of a page that is slow to show its tables anew: no number is lost or torn."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.prototype.design_bed import Bed, open_bed

HOLD = """() => {
  const held = new Map();
  let last = 0;
  window.setTimeout = (f) => { held.set(++last, f); return last; };
  window.clearTimeout = (which) => held.delete(which);
  window.redrawn = () => {
    const all = [...held.values()];
    held.clear();
    for (const f of all) f();
  };
}"""


@pytest.fixture
def bed(browser: Browser, tmp_path: Path) -> Iterator[Bed]:
    """A designer that shows its tables anew when the test says so: at any time while one types."""
    with open_bed(browser, tmp_path) as found:
        found.run(HOLD)
        found.mount()
        yield found


def redrawn(bed: Bed) -> None:
    bed.run("() => redrawn()")


def outline(bed: Bed) -> list[list[float]]:
    found: list[list[float]] = bed.told[-1]["applied"]["drawn"]["layers"][0]["outline"]
    return found


def test_a_number_that_is_being_typed_outlives_the_tables(bed: Bed) -> None:
    page = bed.page
    page.get_by_label("Width, mm").fill("60")
    page.keyboard.press("Tab")
    page.keyboard.type("4")
    redrawn(bed)
    page.keyboard.type("5.5")
    redrawn(bed)
    page.keyboard.press("Enter")
    assert outline(bed) == [[0, -30], [60, -30], [60, 15.5], [0, 15.5]]
    page.keyboard.type("9")
    redrawn(bed)
    assert page.get_by_label("Height, mm").input_value() == "45.59"
    page.keyboard.press("Enter")
    assert outline(bed)[2] == [60, pytest.approx(15.59)]


def test_what_is_selected_in_a_field_stays_selected(bed: Bed) -> None:
    page = bed.page
    page.get_by_label("x of corner 1, mm").fill("12")
    page.keyboard.press("Enter")
    page.get_by_label("Width, mm").select_text()
    redrawn(bed)
    assert page.evaluate("document.activeElement.dataset.key") == "width"
    page.keyboard.insert_text("60")
    page.keyboard.press("Enter")
    assert outline(bed)[1] == [60, -30]


def test_a_number_that_changes_under_a_selection_is_replaced_by_what_is_typed(bed: Bed) -> None:
    page = bed.page
    page.get_by_label("Width, mm").fill("60")
    page.keyboard.press("Enter")
    page.get_by_label("x of corner 2, mm").select_text()  # 120 as yet
    redrawn(bed)
    assert page.get_by_label("x of corner 2, mm").input_value() == "60"
    page.keyboard.insert_text("7")
    page.keyboard.press("Enter")
    assert outline(bed)[1] == [7, -30]


def test_numbers_of_two_fields_before_the_tables_are_both_taken(bed: Bed) -> None:
    page = bed.page
    page.get_by_label("Thickness, mm").fill("0.3")
    page.get_by_label("Toughness, × calibrated").fill("0.5")
    page.get_by_label("Line of the cut, y, mm").fill("7")
    page.get_by_label("Bottom, mm").fill("-10")
    page.get_by_label("Width, mm").fill("60")
    page.get_by_label("Left, mm").fill("5")
    page.get_by_label("Name of layer 1").fill("card")
    page.keyboard.press("Enter")
    drawn = bed.told[-1]["applied"]["drawn"]
    (layer,) = drawn["layers"]
    assert (drawn["cut_line_mm"], layer["name"]) == (7, "card")
    assert (layer["thickness_mm"], layer["toughness_ratio"]) == (0.3, 0.5)
    assert layer["outline"] == [[5, -10], [65, -10], [65, 50], [5, 50]]
    redrawn(bed)
    assert page.get_by_label("Name of layer 1").input_value() == "card"
    assert page.get_by_label("Left, mm").input_value() == "5"


def test_a_button_that_is_pressed_while_the_tables_change_does_its_work(bed: Bed) -> None:
    page = bed.page
    page.get_by_role("button", name="Choose corner 2").click()
    redrawn(bed)
    page.get_by_label("x of corner 1, mm").fill("12")
    page.get_by_role("button", name="Add corner").hover()
    page.mouse.down()
    redrawn(bed)
    page.mouse.up()
    assert outline(bed)[:3] == [[12, -30], [66, -30], [120, -30]]
