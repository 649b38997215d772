"""Texts of the page can be read in both themes: contrast by the computed colours (WCAG 2, AA)."""

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from scissorcal.prototype.document import page_of
from scissorcal.prototype.scene import Scene
from tests.browser import put_back
from tests.prototype.test_page_hand import WIDE, open_page, package, scene

__all__ = ["package", "scene"]

LEAST = 4.5
SHOW_ALL = """() => {
  const { panel, readout, rig, scene } = scissorcal;
  const state = { kind: "state", state: "idle", command: null, sentence: "It ended.", code: 1,
    request: "Take everything out.", question: 0, following: "Following a.mcap.",
    commands: ["render"] };
  panel.show({ ...state, state: "running", command: "render" });
  panel.refusal.textContent = "Refused.";
  for (const one of document.querySelectorAll("details")) one.open = true;
  rig.wanted = { ...rig.wanted, advance: -2 * scene.contact_m[1] };
}"""
CONTRASTS = """() => {
  const context = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (text) => {
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = text;
    context.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = ([r, g, b, a], [R, G, B]) =>
    [[r, R], [g, G], [b, B]].map(([x, X]) => a * x + (1 - a) * X);
  const linear = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const contrast = (a, b) => {
    const [x, y] = [light(a), light(b)];
    return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05);
  };
  const behind = (element) => {
    const layers = [];
    for (let at = element; at; at = at.parentElement) {
      layers.unshift(rgba(getComputedStyle(at).backgroundColor));
    }
    return layers.reduce((below, one) => over(one, below), [255, 255, 255]);
  };
  const found = [];
  const kinds = ["checkbox", "radio", "range", "file"].map((kind) => `[type=${kind}]`);
  for (const one of document.querySelectorAll("body *")) {
    const says = [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    const isField = one.matches(`select, input:not(${kinds})`);
    if (!(says || isField) || one.matches("script, style, option, :disabled, .said")) continue;
    if (!one.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    const style = getComputedStyle(one);
    const colour = rgba(one instanceof SVGElement ? style.fill : style.color);
    const below = behind(one);
    const kind = `${one.localName}.${one.getAttribute("class") ?? ""}`;
    found.push([contrast(over(colour, below), below), kind, one.textContent.trim().slice(0, 40)]);
  }
  // canvases and the drawing write in these on these, or on a seam of the paper's colour
  const style = getComputedStyle(document.body);
  const named = (name) => rgba(style.getPropertyValue(`--${name}`).trim());
  for (const ink of ["ink", "muted", "hand"]) {
    found.push([contrast(named(ink), named("paper")), "canvas", ink]);
  }
  const clear = (one) => getComputedStyle(one).paintOrder.startsWith("stroke");
  const seamless = [...document.querySelectorAll(".design-drawing text")]
    .filter((one) => !clear(one));
  const note = rgba(getComputedStyle(document.querySelector(".solid p")).backgroundColor);
  if (seamless.length || note[3] < 1) found.push([0, "text on a picture", ""]);
  return found;
}"""


@pytest.mark.parametrize("scheme", [pytest.param("light", marks=pytest.mark.slow), "dark"])
def test_every_text_has_the_contrast_that_reading_needs(
    browser: Browser, scene: Scene, tmp_path: Path, scheme: str
) -> None:
    file = tmp_path / "served.html"
    served = page_of(scene).replace('id="server">null', 'id="server">{"socket": "/rig"}')
    file.write_text(served, encoding="utf-8")
    opened = open_page(browser, file, viewport=WIDE, color_scheme=scheme)
    page = opened.page
    opened.run(SHOW_ALL)
    page.locator(".design-layers").wait_for()
    page.get_by_label("3-D", exact=True).check()
    page.locator(".solid p").wait_for()
    page.get_by_label("Line of the cut").fill("99")
    page.keyboard.press("Enter")
    page.locator(".design .warning").wait_for()
    page.locator("section.now .warning").wait_for(state="visible")
    opened.run("() => { document.querySelector('.hint').hidden = false; }")
    found: list[list[Any]] = opened.run(CONTRASTS)
    put_back(page)
    texts = {kind for _, kind, _ in found}
    assert {
        "p.request",
        "button.stop",
        "button.primary",
        "p.note",
        "p.warning",
        "dt.",
        "p.hint",
        "span.state",
    } <= texts
    assert len(found) > 100
    assert [one for one in found if one[0] < LEAST] == []
