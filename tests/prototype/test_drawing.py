"""The plain drawing: where its captions and the magnified contact stand, at every size."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser import wait_until
from tests.prototype.test_page_hand import close, file, open_page, package, scene

__all__ = ["file", "package", "scene"]

NOTE = """() => {
  window.noted = { texts: {}, lens: null };
  const { prototype } = CanvasRenderingContext2D;
  const { fillText, arc } = prototype;
  prototype.fillText = function (text, x, y) {
    if (this.canvas.classList.contains("plain")) {
      const { width } = this.measureText(text);
      const left = { left: x, center: x - 0.5 * width }[this.textAlign];
      noted.texts[text] = [left, left + width, y - 9, y + 3];
    }
    return fillText.apply(this, arguments);
  };
  prototype.arc = function (x, y, radius) {
    if (this.canvas.classList.contains("plain") && radius > 8) noted.lens = [x, y, radius];
    return arc.apply(this, arguments);
  };
}"""
FOUND = """() => { const { drawing, scene } = scissorcal, canvas = drawing.canvas;
  const tip = drawing.origin[0] + drawing.scale * scene.blade_length_m;
  const thick = Math.max(2 * scene.upper_face_m * drawing.scale, 2);
  return { ...noted, width: canvas.clientWidth, height: canvas.clientHeight, tip,
    line: [drawing.origin[1] - 0.5 * thick, drawing.origin[1] + 0.5 * thick] }; }"""


@pytest.mark.parametrize(
    ("width", "height"),
    [(1920, 1080), (1400, 1000), (1000, 800), (740, 900), (390, 844), (320, 568)],
)
def test_captions_are_whole_and_lie_over_nothing(
    browser: Browser, file: Path, width: int, height: int
) -> None:
    opened = open_page(browser, file, viewport={"width": width, "height": height})
    opened.run(NOTE)
    drawn = "() => noted.lens !== null && Object.keys(noted.texts).length > 1"
    wait_until(opened.page, lambda: opened.run(drawn), "the drawing was made")
    found = opened.run(FOUND)
    assert any("contact" in text for text in found["texts"])
    for text, (left, right, top, bottom) in found["texts"].items():
        assert left >= 0, text
        assert right <= found["width"], text
        assert bottom < found["line"][0] or top > found["line"][1], text
        assert bottom <= found["height"], text
    x, y, radius = found["lens"]
    assert radius >= 20
    assert x - radius > found["tip"], "beside the blades"
    assert x + radius <= found["width"]
    assert y + radius < found["line"][0]
    close(opened)
