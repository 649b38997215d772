"""The page at first sight: what to do first, where the blades start, what each colour means."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

from scissorcal.prototype.document import page_of
from scissorcal.prototype.page_parts import LayerPart, LayersPart, Numbers, Stroke
from scissorcal.prototype.scene import Scene
from tests.prototype.test_page_hand import WIDE, Open, close, open_page, package, scene

__all__ = ["package", "scene"]

BEGAN_m = (0.051, 0.053, 0.058)
"""Contacts at which measured closing strokes began."""


def stroke(contact_m: float, kind: str) -> Stroke:
    opening = np.linspace(0.8, 0.3, 5)
    return Stroke(
        recording="cut.mcap",
        kind=kind,
        opening=Numbers.of(opening if kind == "closing" else opening[::-1]),
        contact=Numbers.of(np.linspace(contact_m, contact_m + 0.01, 5)),
        torque=Numbers.of(np.linspace(0.0, 0.05, 5)),
    )


@pytest.fixture
def measured(browser: Browser, scene: Scene, tmp_path: Path) -> Iterator[Open]:
    strokes = (*(stroke(began, "closing") for began in BEGAN_m), stroke(0.03, "opening"))
    told = {"strokes": strokes, "next_step": "scissorcal report sign --name NAME"}
    file = tmp_path / "measured.html"
    file.write_text(page_of(scene.model_copy(update=told)), encoding="utf-8")
    opened = open_page(browser, file, viewport=WIDE)
    yield opened
    close(opened)


def test_the_blades_start_where_measured_strokes_began(measured: Open) -> None:
    start = measured.run("() => scissorcal.rig.pose")
    assert start["advance"] == pytest.approx(-np.median(BEGAN_m), abs=1e-7)
    assert measured.run("() => scissorcal.rig.strokeContact") == pytest.approx(0.053, abs=1e-7)
    assert measured.run("() => scissorcal.rig.step.torque") == 0.0
    drawn = "() => scissorcal.torque.chart.series.filter((one) => one.label === 'measured').length"
    assert measured.run(drawn) == len(BEGAN_m)


def test_the_hint_goes_with_the_first_drag_of_the_handle(measured: Open) -> None:
    hint = measured.page.locator(".hint")
    assert hint.is_visible()
    box = measured.page.locator("canvas.plain").bounding_box()
    assert box is not None
    x, y = measured.run("() => scissorcal.drawing.handle")
    mouse = measured.page.mouse
    mouse.move(box["x"] + x, box["y"] + y)
    mouse.down()
    mouse.move(box["x"] + x, box["y"] + y + 80, steps=5)
    assert hint.is_hidden()
    most = measured.run("() => scissorcal.scene.opening_rad[1]")
    assert measured.run("() => scissorcal.rig.wanted.opening") < most - 0.05
    mouse.up()
    measured.settle(0.3)
    assert measured.run("() => scissorcal.drawing.handle")[1] > y + 5, "it goes with the pointer"


def test_the_next_step_is_that_of_the_workspace(measured: Open) -> None:
    measured.page.locator(".states summary").click()
    said = measured.page.locator(".states .next").inner_text()
    assert said == "next: scissorcal report sign --name NAME"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_colour_has_one_meaning(measured: Open, scheme: str) -> None:
    measured.page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
    measured.page.get_by_role("button", name="One stroke").click()
    measured.settle(0.3)
    named = """() => { const style = getComputedStyle(document.body);
      const names = ["fitted", "whatif", "material", "hand", "alert", "muted", "ink"];
      return Object.fromEntries(names.map(
        (name) => [name, style.getPropertyValue(`--${name}`).trim()])); }"""
    colours = measured.run(named)
    assert len(set(colours.values())) == len(colours)
    series = """() => [scissorcal.torque, scissorcal.time].flatMap(({ chart }) =>
      chart.series.slice(1).map((one) => [one.label, one._stroke]))"""
    meaning = {
        "measured": "muted",
        "draw": "muted",
        "what if": "whatif",
        "as fitted": "fitted",
        "last closing stroke": "ink",
        "torque": "ink",
        "force along the cut": "ink",
    }
    drawn = {label: colour for label, colour in measured.run(series) if label in meaning}
    assert drawn == {label: colours[name] for label, name in meaning.items()}


PIXEL = """([x, y]) => { const canvas = document.querySelector("canvas.plain");
  const ratio = canvas.width / canvas.clientWidth, copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d", { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  return [...context.getImageData(x * ratio, y * ratio, 1, 1).data]; }"""
PLACES = """(places) => { const { drawing, rig } = scissorcal;
  const x = (m) => drawing.origin[0] + drawing.scale * (m - rig.pose.advance);
  const [above, beside] = [drawing.canvas.clientHeight - 30, drawing.origin[1]];
  return places.map((m) => [[x(m), above], [x(m), beside]]); }"""


def piece_of(begin_m: float, end_m: float, scene: Scene) -> dict[str, Any]:
    strip = {"end_m": end_m, "fracture_energy_J_per_m": scene.numbers[4]}
    face_m = scene.upper_face_m
    return {"begin_m": begin_m, "upper_face_m": face_m, "scale": 1.0, "strips": [strip]}


def rectangle(left: float, right: float, half: float) -> tuple[tuple[float, float], ...]:
    return ((left, -half), (right, -half), (right, half), (left, half))


def test_a_hole_is_drawn_in_both_plain_views(
    browser: Browser, scene: Scene, tmp_path: Path
) -> None:
    layer = LayerPart(
        name="sheet",
        thickness_mm=0.1,
        toughness_ratio=1.0,
        outline=(rectangle(0.0, 40.0, 20.0),),
        holes=((rectangle(8.0, 16.0, 9.0),),),
        regions=(),
    )
    pieces = [piece_of(*ends, scene) for ends in ((0.0, 0.008), (0.016, 0.040))]
    plate = LayersPart(cut_line_mm=0.0, layers=(layer,))
    told = {**json.loads(scene.model_dump_json()), "pieces": pieces}
    holed = Scene.model_validate_json(json.dumps(told)).model_copy(update={"drawn_plate": plate})
    file = tmp_path / "holed.html"
    file.write_text(page_of(holed), encoding="utf-8")
    opened = open_page(browser, file, viewport=WIDE)
    opened.settle(0.3)
    in_hole, in_sheet = opened.run(PLACES, [0.012, 0.020])
    for hole, sheet in zip(in_hole, in_sheet, strict=True):
        assert opened.run(PIXEL, hole) == [255, 255, 255, 255]
        assert opened.run(PIXEL, sheet) != [255, 255, 255, 255]
    close(opened)
