"""A page with the designer and the 3-D view alone, on a scene of round numbers."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page

from scissorcal.kernel import TABLE_NAMES
from scissorcal.prototype.page_parts import Numbers
from tests.browser import PAGE, Seen, bundled, open_file, put_back

HARNESS = """
import { View3d } from "./src/view3d";
import { mountDesign } from "./src/design";
import { asFitted } from "./src/law";
import { edgeOfTable, edgeTable, edgeThrough, nearestFamily, offsetAt } from "./src/blade_edge";
import { edgeIn } from "./src/edge_file";
import { splineSlope, splineThrough, splineValue } from "./src/edge_points";
import { layerPieces, piecesOf } from "./src/pieces";
import { crossesItself, nested, stretches } from "./src/outline";
import { drawnFromSvg, readSvg, svgOf } from "./src/svg_file";
import { calibratedOf, drawnFromRecipe, recipeText } from "./src/recipe_text";
const scene = JSON.parse(document.getElementById("scene")!.textContent!);
const step = { torque: 0, force: 0, contact: 0, indentation: 0, height: 0, response: 1,
  friction_torque: 0, stored_J: 0, fracture_J: 0, arrest_J: 0, flags: 0 };
const view = { scene, law: asFitted(scene), pose: { opening: 0.45, advance: 0 },
  wanted: { opening: 0.45, advance: 0 }, step, crack: 0.03 };
Object.assign(window, { View3d, mountDesign, edgeOfTable, edgeTable, edgeThrough, layerPieces,
  nearestFamily, offsetAt, edgeIn, splineSlope, splineThrough, splineValue,
  piecesOf, crossesItself, nested, stretches, drawnFromSvg, readSvg, svgOf, calibratedOf,
  drawnFromRecipe, recipeText, scene, view, told: [] });
/** The value of an expression, or the sentence with which it was refused. */
(window as any).tried = (f: () => unknown) => {
  try { return f(); } catch (error) { return { refused: (error as Error).message }; }
};
"""

COLOURS = {
    "light": {"ink": "#202224", "muted": "#6b7075", "grid": "#dfe2e5", "paper": "#ffffff"},
    "dark": {"ink": "#e8eaec", "muted": "#9aa1a8", "grid": "#33383d", "paper": "#16181a"},
}
SHARED = {
    "raised": "#eef0f2",
    "fitted": "#0072b2",
    "whatif": "#d55e00",
    "material": "#00865f",
    "hand": "#8a3f9c",
}
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'"

THICKNESS_MM, ENERGY_J_PER_M = 0.1, 0.4
EDGE = {"offset_mm": -8.0, "taper_deg": 2.0, "length_mm": 75.0}


def scene(moving_blades: int = 2) -> dict[str, Any]:
    """What the designer and the 3-D view read of a scene."""
    knots = np.linspace(0.0, 0.1, 5)
    slope = np.tan(np.radians(EDGE["taper_deg"]))
    flat = [knots, np.zeros(5), np.zeros(5)]
    tables = {name: Numbers.of(flat).model_dump() for name in TABLE_NAMES}
    rows = [knots, -8e-3 + slope * knots, np.full(5, slope)]
    tables["edge"] = Numbers.of(rows).model_dump()
    return {
        "name": 'paper "80" <g/m^2>',
        "opening_rad": [np.radians(12), np.radians(50)],
        "opening_rate_rad_per_s": [0.05, 1.0],
        "contact_m": [0.015, 0.06],
        "loop_rate_Hz": 1000.0,
        "handle_radius_m": 0.06,
        "torque_limit_Nm": 1.0,
        "blade_length_m": 0.075,
        "upper_face_m": THICKNESS_MM * 1e-3 / moving_blades,
        "moving_blades": moving_blades,
        "tables": tables,
        "numbers": [0.0, 0.0, 1.0, 5e-5, ENERGY_J_PER_M, 0.7, 0.0, 0.01, 0.06, 0.075],
        "mean_energy": None,
        "levels": [],
    }


@cache
def script() -> str:
    return bundled(HARNESS)


def write_page(path: Path, moving_blades: int = 2) -> None:
    """One file, offline: the style of the page's own designer, and nothing from elsewhere."""
    light, dark = (
        "".join(f"--{name}:{value};" for name, value in {**SHARED, **COLOURS[theme]}.items())
        for theme in ("light", "dark")
    )
    style = (PAGE / "src/design.css").read_text(encoding="utf-8")
    text = json.dumps(scene(moving_blades)).replace("</", "<\\/")
    code = script().replace("</script", "<\\/script")
    path.write_text(
        f"""<!doctype html><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<style>:root {{ {light} }} @media (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}
body {{ background: var(--paper); color: var(--ink); }} #three {{ height: 300px; }}
{style}</style>
<div id="three"></div><div id="design"></div>
<script type="application/json" id="scene">{text}</script>
<script>{code}</script>""",
        encoding="utf-8",
    )


@dataclass
class Bed:
    """An open page, and what it did that it must not."""

    page: Page
    seen: Seen

    def run(self, function: str, given: Any = None) -> Any:
        return self.page.evaluate(function, given)

    def mount(self) -> None:
        """The designer alone; ``told`` keeps what it applied."""
        self.run("() => document.getElementById('three').remove()")
        self.run(
            "() => mountDesign(document.getElementById('design'), scene,"
            " (pieces, applied) => told.push({ pieces, applied }))"
        )

    @property
    def told(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.run("() => told")
        return found

    @property
    def said(self) -> str:
        return self.page.locator(".design-status").inner_text()

    def place(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Where a place of the drawing stands in the window: from the corners of the sheet."""
        box = self.page.locator(".design-drawing").bounding_box()
        plate = self.page.locator(".design-plate").first
        assert box is not None
        size = plate.evaluate("e => [e.getBBox().x, e.getBBox().y, e.getBBox().width / 120]")
        left, top, scale = size
        return box["x"] + left + scale * x_mm, box["y"] + top + scale * (30.0 - y_mm)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        mouse = self.page.mouse
        (x0, y0), (x1, y1) = self.place(*start), self.place(*end)
        mouse.move(x0, y0)
        mouse.down()
        mouse.move(0.5 * (x0 + x1), 0.5 * (y0 + y1))
        mouse.move(x1, y1)
        mouse.up()


@contextmanager
def open_bed(
    browser: Browser, folder: Path, moving_blades: int = 2, **context: object
) -> Iterator[Bed]:
    """The page in a context of its own; it must end without an error and without a request."""
    file = folder / "bed.html"
    write_page(file, moving_blades)
    page, seen = open_file(browser, file, **context)
    yield Bed(page, seen)
    put_back(page)
    # pictures for the test are read back from the graphics, which the browser remarks on
    errors = [error for error in seen.errors if "GPU stall due to ReadPixels" not in error]
    assert errors == [], errors
    assert seen.elsewhere == [], seen.elsewhere
