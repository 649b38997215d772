"""The page of a package: the hand that feels, states, themes, and how often it draws."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.prototype.document import page_of
from scissorcal.prototype.scene import Scene, scene_of
from tests.browser import Seen, open_file, put_back, wait_until
from tests.package.fits import cut_fit, friction_fit, recipe

WIDE = {"width": 1400, "height": 1000}
PHONE = {"width": 390, "height": 844}


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
        end = self.run("() => scissorcal.rig.time") + seconds
        passed = "() => scissorcal.rig.time"
        wait_until(self.page, lambda: self.run(passed) >= end, f"the page's time is {end}")

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
    put_back(opened.page)
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_what_if_stands_beside_as_fitted_and_is_felt_after_a_swap(opened: Open) -> None:
    opened.set_slider("fracture_energy", 400)
    drag(opened, 0.45)
    opened.settle()
    beside = "torque, what if"
    assert opened.number(beside) > 1.15 * opened.number("torque")
    canvas = opened.page.locator("canvas.plain")
    canvas.focus()
    canvas.press("s")
    assert opened.run("() => scissorcal.rig.active") == "whatIf"
    assert opened.page.locator("[data-key=whatIf]").is_checked()


def test_what_is_to_be_known_is_one_line_of_labels_that_opens(opened: Open, scene: Scene) -> None:
    assert scene.states
    labels = opened.page.locator(".states .state")
    assert labels.all_inner_texts() == list(dict.fromkeys(state.label for state in scene.states))
    sentences = opened.page.locator(".states p")
    assert not sentences.first.is_visible()
    line, stage = labels.first.bounding_box(), opened.page.locator("canvas.plain").bounding_box()
    assert line is not None
    assert stage is not None
    assert line["y"] + line["height"] < stage["y"]
    assert line["height"] < 30
    opened.page.locator(".states summary").click()
    told = [f"{state.label}: {state.sentence}" for state in scene.states]
    assert sentences.all_inner_texts() == told


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


def test_blades_at_rest_are_still_and_strokes_are_not(opened: Open) -> None:
    opened.settle()
    assert opened.run("() => scissorcal.rig.isStill")
    opened.page.get_by_role("button", name="One stroke").click()
    assert not opened.run("() => scissorcal.rig.isStill")


def test_a_law_that_the_kernel_refuses_is_named_and_its_blades_stand(opened: Open) -> None:
    code = """() => {
        const { choices } = scissorcal.controls, law = scissorcal.fitted;
        const kept = law.tables.response.y.slice();
        law.tables.response.y.fill(-1);
        scissorcal.changed();
        const said = document.querySelector(".law [role=status]").textContent;
        law.tables.response.y.set(kept);
        scissorcal.changed();
        return [said, document.querySelector(".law [role=status]").hidden, choices.active];
    }"""
    said, is_hidden, active = opened.run(code)
    assert "as fitted" in said
    assert "refuses" in said
    assert is_hidden
    assert active == "fitted"
