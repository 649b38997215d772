"""The blades in the 3-D view: by pointer, touch and keys, and what the page says of that."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from tests.prototype.test_page_hand import (
    Open,
    close,
    file,
    open_page,
    package,
    scene,
)

__all__ = ["file", "package", "scene"]

SMALL = {"width": 360, "height": 640}
"""Pictures in three dimensions are slow without a graphics card."""
CAMERA = "() => scissorcal.view3d.orbit.camera.position.toArray()"
HALF_A_TURN = """(canvas) => { for (let k = 0; k < 32; k += 1) canvas.dispatchEvent(
  new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true, cancelable: true })); }"""
WANTED = "() => scissorcal.rig.wanted"


@pytest.fixture
def solid(browser: Browser, file: Path) -> Iterator[Open]:
    found = open_page(browser, file, viewport=SMALL, has_touch=True)
    found.page.get_by_label("3-D").check()
    found.page.locator(".solid canvas").wait_for(state="visible")
    yield found
    close(found)


def tick(solid: Open) -> None:
    solid.page.get_by_role("checkbox", name="move the blades").check()


def middle(solid: Open) -> tuple[float, float]:
    canvas = solid.page.locator(".solid canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    assert box is not None
    return box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"]


def drag(solid: Open, dx: float, dy: float) -> None:
    x, y = middle(solid)
    solid.page.mouse.move(x, y)
    solid.page.mouse.down()
    solid.page.mouse.move(x + dx, y + dy, steps=2)
    solid.page.mouse.up()


def changes(solid: Open) -> tuple[Any, Any, Any]:
    camera, wanted = solid.run(CAMERA), solid.run(WANTED)
    return camera, wanted["opening"], wanted["advance"]


def test_drags_and_arrows_turn_the_view_or_move_the_blades(solid: Open) -> None:
    camera, opening, advance = changes(solid)
    drag(solid, 30, 40)
    solid.page.keyboard.press("ArrowDown")
    turned, *same = changes(solid)
    assert turned != camera
    assert same == [opening, advance]
    tick(solid)
    drag(solid, 30, 40)
    stays, less, more = changes(solid)
    assert stays == turned
    assert less < opening - 0.05
    assert more > advance + 0.002
    solid.page.locator(".solid canvas").press("ArrowUp")
    assert changes(solid)[1] == pytest.approx(less + 0.035)
    solid.page.keyboard.press("+")
    nearer, *_ = changes(solid)
    assert sum(one * one for one in nearer) < sum(one * one for one in stays)


def test_strokes_and_fresh_sheets_by_key_need_no_box(solid: Open) -> None:
    canvas = solid.page.locator(".solid canvas")
    canvas.press("Space")
    assert solid.run("() => scissorcal.rig.plays")
    canvas.press("f")
    assert not solid.run("() => scissorcal.rig.plays")
    canvas.press("s")
    assert solid.run("() => scissorcal.rig.active") == "whatIf"


def test_right_is_right_from_behind_too(solid: Open) -> None:
    solid.page.locator(".solid canvas").evaluate(HALF_A_TURN)
    tick(solid)
    advance = solid.run(WANTED)["advance"]
    drag(solid, 30, 0)
    assert solid.run(WANTED)["advance"] < advance - 0.002


def test_one_finger_moves_the_blades_and_a_second_one_zooms(solid: Open) -> None:
    tick(solid)
    x, y = middle(solid)
    touch = solid.page.context.new_cdp_session(solid.page)

    def fingers(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    camera, opening, _ = changes(solid)
    fingers("touchStart", (x, y))
    fingers("touchMove", (x, y + 40))
    stays, less, advance = changes(solid)
    assert (stays, less < opening - 0.05) == (camera, True)
    fingers("touchStart", (x, y + 40), (x + 50, y))
    fingers("touchMove", (x, y + 60), (x + 150, y))
    fingers("touchEnd")
    nearer, *same = changes(solid)
    assert same == [less, advance]
    assert nearer != camera


def test_the_help_says_what_drags_and_arrows_do(solid: Open) -> None:
    note = solid.page.locator(".solid p")
    assert note.inner_text().startswith("Drag or arrow keys turn the view")
    tick(solid)
    assert note.inner_text().startswith("Drag or arrow keys move the blades")
    solid.page.locator(".solid canvas[aria-label*='keys move the blades']").wait_for()
    solid.page.get_by_text("Mouse, touch and keys").click()
    told = solid.page.locator(".keys dl").inner_text()
    assert "“move the blades” ticked" in told
    solid.page.get_by_label("3-D", exact=True).uncheck()
    assert solid.page.get_by_role("checkbox", name="move the blades").is_hidden()
