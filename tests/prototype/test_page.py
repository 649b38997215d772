"""The page of a package in a browser: strokes, numbers, parts, sliders, themes, a phone."""

import base64
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.package.variations import central_values
from scissorcal.prototype.document import page_of
from scissorcal.prototype.scene import Scene, scene_of
from tests.browser import Seen, open_browser, open_file
from tests.package.fits import cut_fit, friction_fit, recipe

MOST_BYTES = 1_000_000
WIDE = {"width": 1400, "height": 1000}
PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with open_browser() as found:
        yield found


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    chosen = recipe()
    friction = friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002)
    path = tmp_path_factory.mktemp("package") / "paper.zip"
    build_package(chosen, friction, cut_fit(chosen, kappa=0.75), path, np.random.default_rng(3))
    return open_package(path, warn=False)


@pytest.fixture(scope="module")
def scene(package: ModelPackage) -> Scene:
    return scene_of(package, made_utc="2026-01-02T03:04:05Z", version="0")


@pytest.fixture(scope="module")
def file(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page_of(scene), encoding="utf-8")
    return path


@dataclass
class Open:
    """An open page with its numbers."""

    page: Page
    seen: Seen

    def run(self, code: str, given: Any = None) -> Any:
        return self.page.evaluate(code, given)

    def number(self, name: str) -> float:
        row = self.page.locator(f'[data-number="{name}"] dd').first
        return float(row.inner_text().split()[0].replace("\u2212", "-"))

    def settle(self, seconds: float = 0.6) -> None:
        """Let the page's own time pass; it has less of it than the clock on a busy computer."""
        until = self.run("() => scissorcal.rig.time") + seconds
        while self.run("() => scissorcal.rig.time") < until:
            self.page.wait_for_timeout(50)

    def set_slider(self, name: str, value: float) -> None:
        code = """([name, value]) => {
            const input = document.querySelector(`[data-slider="${name}"]`);
            input.value = value;
            input.dispatchEvent(new Event("input", { bubbles: true }));
        }"""
        self.run(code, [name, value])


@pytest.fixture
def opened(browser: Browser, file: Path) -> Iterator[Open]:
    with_page = open_page(browser, file, viewport=WIDE)
    yield with_page
    close(with_page)


def open_page(browser: Browser, file: Path, **context: object) -> Open:
    page, seen = open_file(browser, file, **context)
    page.locator("[data-number=torque]").wait_for()
    return Open(page, seen)


def close(opened: Open) -> None:
    opened.page.context.close()
    assert opened.seen.errors == []
    assert opened.seen.elsewhere == []


def drag(opened: Open, share: float) -> None:
    """Pull the pointer down over a share of the drawing's height: closes the blades."""
    canvas = opened.page.locator("canvas.plain")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    assert box is not None
    x, top = box["x"] + 0.3 * box["width"], box["y"] + 0.1 * box["height"]
    mouse = opened.page.mouse
    mouse.move(x, top)
    mouse.down()
    for i in range(1, 16):
        mouse.move(x, top + share * box["height"] * i / 15)
        opened.page.wait_for_timeout(20)
    mouse.up()


def test_a_stroke_by_the_pointer_cuts_the_sheet(opened: Open, scene: Scene) -> None:
    assert opened.number("crack") == 0.0
    before = opened.number("opening")
    assert before == pytest.approx(np.degrees(scene.opening_rad[1]), abs=0.1)
    drag(opened, 0.45)
    opened.settle()
    assert opened.number("opening") < before - 20.0
    assert opened.number("crack") > 5.0
    assert opened.number("torque") > 10.0
    assert opened.number("fracture") > 0.5
    assert abs(opened.number("error")) < 0.05 * opened.number("work of the hand")


def test_blades_lag_behind_the_pointer_by_the_force(opened: Open) -> None:
    lag = "() => scissorcal.rig.pose.opening - scissorcal.rig.wanted.opening"
    drag(opened, 0.4)
    opened.settle(1.0)
    loaded = opened.run(lag)
    step = opened.run("() => scissorcal.rig.step.torque")
    assert step > 0.01
    assert loaded > 0.01, "the sheet holds the blades open"
    opened.run("() => scissorcal.rig.freshSheet()")
    opened.settle()
    assert abs(opened.run(lag)) < 0.003


def test_blades_at_rest_do_not_chatter(opened: Open) -> None:
    """Dry friction holds them; it does not push back and forth from tick to tick."""
    drag(opened, 0.4)
    opened.settle(1.0)
    torques = opened.run("() => scissorcal.rig.recent.slice(-50).map((one) => one.torque)")
    assert np.ptp(torques) < 1e-6
    assert opened.run("() => Math.abs(scissorcal.rig.rate)") < 1e-5


def test_the_keyboard_does_what_the_pointer_does(opened: Open) -> None:
    canvas = opened.page.locator("canvas.plain")
    canvas.focus()
    for _ in range(12):
        canvas.press("ArrowDown")
    opened.settle()
    assert opened.number("opening") < 30.0
    crack = opened.number("crack")
    assert crack > 0.0
    canvas.press("ArrowRight")
    opened.settle(0.4)
    canvas.press(" ")
    opened.settle(2.5)
    assert opened.number("crack") > crack
    canvas.press("f")
    opened.settle(0.2)
    assert opened.number("crack") == 0.0


def test_the_pages_torque_is_the_packages(opened: Open, package: ModelPackage) -> None:
    """Within float32, at 3,000 places of the scene, in both directions."""
    rng = np.random.default_rng(5)
    ranges = package.manifest.ranges
    for rate in (-0.9, -0.05, 0.3):
        for contact in rng.uniform(*ranges.contact_m, 10):
            openings = rng.uniform(*ranges.opening_rad, 100)
            wanted = package.torque(openings, rate, np.float32(contact))
            found = opened.run(
                "([o, r, c]) => scissorcal.torqueAt(o, r, c)", [openings.tolist(), rate, contact]
            )
            largest = np.abs(wanted).max()
            np.testing.assert_allclose(found, wanted, rtol=3e-6, atol=3e-6 * largest)


def test_parts_that_are_off_give_nothing(opened: Open) -> None:
    page = opened.page
    page.locator('[data-part="friction"]').uncheck()
    drag(opened, 0.45)
    opened.settle()
    assert opened.number("of it friction") == 0.0
    assert opened.number("friction") == 0.0
    assert opened.number("torque") > 5.0
    page.locator('[data-part="response"]').uncheck()
    opened.settle()
    assert opened.number("torque") == 0.0
    assert opened.run("() => scissorcal.torqueAt([0.3, 0.5], -0.3, 0.03)") == [0.0, 0.0]
    page.locator('[data-part="friction"]').check()
    page.locator('[data-part="response"]').check()
    page.locator('[data-part="fracture"]').uncheck()
    opened.run("() => scissorcal.rig.freshSheet()")
    drag(opened, 0.25)
    opened.settle()
    assert opened.number("crack") == 0.0, "without fracture a sheet is only pressed"
    assert opened.number("fracture") == 0.0


def test_a_slider_changes_the_law_as_variations_says(opened: Open, scene: Scene) -> None:
    """At the last node, where the page's law is the row that was evaluated there."""
    slider = next(one for one in scene.sliders if one.name == "response_force")
    rows = unpacked(slider.rows.tables["response"])
    centre = unpacked(scene.centre.tables["response"])[0]
    own = unpacked(scene.tables["response"])
    opened.set_slider("response_force", 400)
    found = opened.run("() => Array.from(scissorcal.laws.whatIf.tables.response.y)")
    wanted = own[1] + rows[-1, 0] - centre[0]
    np.testing.assert_allclose(found, wanted, rtol=2e-6, atol=1e-7)
    untouched = opened.run("() => Array.from(scissorcal.laws.fitted.tables.response.y)")
    np.testing.assert_array_equal(np.float32(untouched), own[1])
    opened.page.get_by_text("Reset what if").click()
    found = opened.run("() => Array.from(scissorcal.laws.whatIf.tables.response.y)")
    np.testing.assert_array_equal(np.float32(found), own[1])


def test_what_if_stands_beside_as_fitted_and_is_felt_after_a_swap(opened: Open) -> None:
    opened.set_slider("fracture_energy", 400)
    drag(opened, 0.45)
    opened.settle()
    beside = "what if, the same motion"
    assert opened.number(beside) > 1.15 * opened.number("torque")
    canvas = opened.page.locator("canvas.plain")
    canvas.focus()
    canvas.press("s")
    assert opened.run("() => scissorcal.rig.active") == "whatIf"
    assert opened.page.locator('[data-key="whatIf"]').is_checked()


def test_a_draw_of_the_posterior_moves_every_slider(
    opened: Open, package: ModelPackage, scene: Scene
) -> None:
    field = opened.page.locator('[data-key="draw"]')
    field.fill("3")
    field.press("Tab")
    values = opened.run("() => Object.fromEntries(scissorcal.controls.choices.values)")
    drawn = np.hstack([package.arrays["draws/cut.npy"], package.arrays["draws/friction.npy"]])[2]
    assert len(central_values(package)[0]) < len(drawn)
    for slider in scene.sliders:
        assert values[slider.name] == pytest.approx(drawn[slider.column], rel=1e-6)
    opened.page.locator('[data-key="draw"]').fill("0")
    opened.page.locator('[data-key="draw"]').press("Tab")
    assert opened.run("() => scissorcal.controls.choices.draw") is None


def test_warnings_come_first(opened: Open, scene: Scene) -> None:
    assert scene.warnings
    found = opened.page.locator("header .warning")
    assert tuple(found.all_inner_texts()) == scene.warnings
    first, stage = found.first.bounding_box(), opened.page.locator("canvas.plain").bounding_box()
    assert first is not None
    assert stage is not None
    assert first["y"] < stage["y"]


def test_every_control_has_a_name_and_can_be_reached_by_keys(opened: Open) -> None:
    nameless = opened.run(
        """() => [...document.querySelectorAll("button, input, select, canvas[tabindex]")]
        .filter((e) => !e.closest("[hidden]"))
        .filter((e) => !(e.getAttribute("aria-label") || e.labels?.[0]?.textContent.trim()
            || e.textContent.trim()))
        .map((e) => e.outerHTML)"""
    )
    assert nameless == []
    assert opened.run("() => document.querySelectorAll('[tabindex=\"-1\"]').length") == 0
    said = opened.page.locator("[aria-live=polite]")
    expect(said).to_contain_text("degrees")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_and_both_themes(browser: Browser, file: Path, scheme: str) -> None:
    opened = open_page(
        browser, file, viewport=PHONE, color_scheme=scheme, has_touch=True, reduced_motion="reduce"
    )
    width = opened.run("() => document.documentElement.scrollWidth")
    assert width <= PHONE["width"], "nothing has to be scrolled sideways"
    paper, ink = opened.run(
        """() => [getComputedStyle(document.body).backgroundColor,
                  getComputedStyle(document.body).color]"""
    )
    brightness = [sum(map(int, text[4:-1].split(","))) for text in (paper, ink)]
    assert (brightness[0] < brightness[1]) == (scheme == "dark")
    opened.page.locator("canvas.plain").tap()
    close(opened)


def test_the_page_is_one_file_below_a_megabyte_without_script_from_elsewhere(file: Path) -> None:
    page = file.read_text(encoding="utf-8")
    assert len(page.encode()) < MOST_BYTES
    policy = page.partition('http-equiv="Content-Security-Policy" content="')[2].partition('"')[0]
    assert "unsafe-inline" not in policy
    assert "connect-src &#x27;none&#x27;" in policy
    data = page.partition('id="scene">')[2].partition("</script>")[0]
    assert json.loads(data)["format"] == "scissorcal-prototype/1"


def unpacked(packed: Any) -> NDArray[np.float32]:
    return np.frombuffer(base64.b64decode(packed.base64), "<f4").reshape(packed.shape)
