"""The page of a package, opened from disk: what it draws, and how a person works it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from scissorcal.package import ModelPackage, build_package, central_values, open_package
from scissorcal.package.variations import variations
from scissorcal.prototype.document import page_of
from scissorcal.prototype.page_parts import State
from scissorcal.prototype.scene import scene_of
from tests.browser import Seen, open_file, put_back, wait_until
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.prototype.test_scene import unpacked as read

MOST_BYTES = 1_000_000
OLD = State(label="old", sentence="The rig is old.")
UNNAMED = """() => [...document.querySelectorAll("input, button, select, textarea, canvas.plain")]
  .filter((one) => !(one.getAttribute("aria-label") || one.textContent.trim()
    || [...(one.labels || [])].some((label) => label.textContent.trim())))
  .map((one) => one.outerHTML)"""
LAW = """() => { const plain = (law) => ({ numbers: law.numbers, tables: Object.fromEntries(
    Object.entries(law.tables).map(([name, t]) => [name, [[...t.y], [...t.slope]]])) });
  return [plain(scissorcal.laws.fitted), plain(scissorcal.laws.whatIf)]; }"""


@dataclass
class Shown:
    """A package and its page; ``seen`` is what the page must not have done."""

    package: ModelPackage
    scene: Any
    page: Page
    seen: Seen

    def run(self, script: str, *given: Any) -> Any:
        return self.page.evaluate(script, *given)

    def until(self, script: str) -> None:
        """Wait until an expression of the app `a` is true; the page's policy forbids eval in it."""
        asked = f"() => {{ const a = scissorcal; return {script}; }}"
        wait_until(self.page, lambda: self.run(asked), script)

    def stroke(self) -> None:
        """One stroke by the key, to its end."""
        self.page.locator("canvas.plain").focus()
        self.page.keyboard.press("Space")
        self.until("!a.rig.plays")

    def part(self, name: str, is_on: bool) -> None:
        self.page.locator(f"[data-part={name}]").set_checked(is_on)

    def torque(self, opening: Any, rate: float, contact: float) -> Any:
        script = "([openings, rate, contact]) => scissorcal.torqueAt(openings, rate, contact)"
        return np.array(self.run(script, [list(opening), rate, contact]))


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[ModelPackage, Any, Path]:
    chosen, folder = recipe(), tmp_path_factory.mktemp("page")
    cut = cut_fit(chosen, kappa=0.75)
    path = folder / "paper.zip"
    build_package(chosen, friction_fit(), cut, path, np.random.default_rng(3))
    package = open_package(path, warn=False)
    told = {"made_utc": "2026-11-24T00:00:00Z", "version": "1", "states": (OLD,)}
    scene = scene_of(package, **told)
    (folder / "paper.html").write_text(page_of(scene), encoding="utf-8")
    return package, scene, folder / "paper.html"


def opened(browser: Browser, built: Any, **context: Any) -> Iterator[Shown]:
    package, scene, path = built
    page, seen = open_file(browser, path, **context)
    shown = Shown(package, scene, page, seen)
    page.wait_for_selector("canvas.plain")
    shown.until("a && a.frames.count > 2")
    yield shown
    put_back(page)
    assert seen.errors == []


@pytest.fixture
def shown(browser: Browser, built: Any) -> Iterator[Shown]:
    yield from opened(browser, built, viewport={"width": 1280, "height": 900})


@pytest.fixture
def phone(browser: Browser, built: Any) -> Iterator[Shown]:
    context = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    yield from opened(browser, built, color_scheme="dark", **context)


def test_the_file_alone_is_the_page(shown: Shown, built: Any) -> None:
    path = built[2]
    assert path.stat().st_size < MOST_BYTES
    assert [url for url in shown.seen.requests if not url.startswith("data:")] == [path.as_uri()]
    shown.page.locator(".states summary").click()
    told = shown.page.locator(".states p").all_inner_texts()
    assert told[0] == "old: The rig is old."
    assert [line.partition(": ")[2] for line in told[1:]] == list(shown.package.warnings)
    assert shown.page.locator("h1").inner_text() == shown.package.manifest.name


def test_a_stroke_of_the_pointer_cuts_the_sheet(shown: Shown) -> None:
    box = shown.page.locator("canvas.plain").bounding_box()
    assert box is not None
    before = shown.run("() => scissorcal.rig.crackMost")
    mouse, x = shown.page.mouse, box["x"] + 0.5 * box["width"]
    mouse.move(x, box["y"] + 30)
    mouse.down()
    mouse.move(x, box["y"] + box["height"] - 10, steps=12)
    shown.until("a.rig.wanted.opening < 0.5 * a.scene.opening_rad[1]")
    mouse.up()
    # at rest, behind the hand by what friction holds: at most the lag at the largest torque
    shown.until("a.rig.rate === 0 && a.rig.pose.opening - a.rig.wanted.opening < 0.15")
    number = "parseFloat(document.querySelector('[data-number=crack] dd').textContent)"
    shown.until(f"Math.abs({number} - 1e3 * a.rig.crackMost) < 0.06")
    assert shown.run("() => scissorcal.rig.crackMost") > before + 0.005


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_torque_drawn_is_that_of_the_package(shown: Shown, sign: float) -> None:
    inside = np.linspace(*shown.scene.opening_rad, 63)[1:-1]
    openings = inside.astype(np.float32).astype(float)
    rate = sign * 0.5 * sum(shown.scene.opening_rate_rad_per_s)
    for contact in np.linspace(*shown.scene.contact_m, 3):
        own = shown.package.torque(openings, rate, contact)
        found = shown.torque(openings, rate, contact)
        assert np.ptp(own) > 1e-3
        np.testing.assert_allclose(found, own, rtol=0, atol=1e-5 * np.abs(own).max() + 1e-7)


def test_parts_of_the_law_can_be_left_out(shown: Shown) -> None:
    openings = np.linspace(*shown.scene.opening_rad, 31)
    near, far = shown.scene.contact_m
    whole = shown.torque(openings, -0.3, near)
    shown.part("friction", False)
    material = shown.torque(openings, -0.3, near)
    shown.part("response", False)
    assert np.all(shown.torque(openings, -0.3, near) == 0.0)
    shown.part("friction", True)
    friction = shown.torque(openings, -0.3, near)
    assert friction.min() > 0.0
    assert np.all(shown.torque(openings, 0.3, near) < 0.0)
    assert np.all(shown.torque(openings, -0.3, far) == friction)
    np.testing.assert_allclose(material + friction, whole, atol=1e-6 * whole.max())


def test_without_fracture_the_crack_stays(shown: Shown) -> None:
    shown.part("fracture", False)
    before = shown.run("() => scissorcal.rig.crackMost")
    shown.stroke()
    assert shown.run("() => scissorcal.rig.crackMost") == before
    shown.part("fracture", True)
    shown.stroke()
    assert shown.run("() => scissorcal.rig.crackMost") > before + 0.005


def test_energy_is_accounted_for_over_a_stroke(shown: Shown) -> None:
    shown.stroke()
    energy = shown.run("() => ({ ...scissorcal.rig.energy })")
    spent = sum(energy[name] for name in ("stored", "fracture", "arrest", "friction"))
    assert energy["hand"] > 1e-3
    assert energy["fracture"] > 0.0
    assert energy["friction"] > 0.0
    assert abs(energy["hand"] - spent) < 0.02 * energy["hand"]


@pytest.mark.parametrize("name", ["response_force", "fracture_energy", "coulomb"])
def test_a_slider_moves_the_law_to_what_the_model_says(shown: Shown, name: str) -> None:
    slider = next(one for one in shown.scene.sliders if one.name == name)
    nodes = read(slider.nodes).astype(float)
    shown.stroke()
    shown.page.locator(f"[data-slider={name}]").evaluate(
        "(one, at) => { one.value = String(at * Number(one.max));"
        " one.dispatchEvent(new Event('input')); }",
        (nodes[12] - nodes[0]) / (nodes[-1] - nodes[0]),
    )
    cut, friction = central_values(shown.package)
    assert friction is not None
    both = np.tile(np.concatenate([cut, friction]), (2, 1))
    both[1, slider.column] = nodes[12]
    law = variations(shown.package, both[:, : len(cut)], both[:, len(cut) :])
    fitted, what_if = shown.run(LAW)
    for table in fitted["tables"]:
        moved = np.array(what_if["tables"][table]) - np.array(fitted["tables"][table])
        wanted = np.diff(law.rows[table], axis=0)[0] if table in law.rows else 0.0 * moved
        largest = np.abs(what_if["tables"][table]).max(axis=1, keepdims=True)
        assert np.all(np.abs(moved - wanted) <= 2e-6 * largest), table
    energy, kappa, damping = what_if["numbers"][4:7]
    assert energy == pytest.approx(law.fracture_energy[1], rel=1e-6)
    assert kappa == pytest.approx(law.kappa[1], rel=1e-6)
    assert damping == law.rate_damping[1]
    assert what_if != fitted


def test_the_law_that_is_felt_changes_the_torque(shown: Shown) -> None:
    assert shown.run("() => scissorcal.rig.active") == "fitted"
    shown.page.locator("[data-slider=coulomb]").evaluate(
        "(one) => { one.value = one.max; one.dispatchEvent(new Event('input')); }"
    )
    moving = "() => { const k = scissorcal.rig.kernels[scissorcal.rig.active];"
    moving += (
        " return k.step(scissorcal.rig.pose.opening, -0.3, scissorcal.rig.pose.advance).torque; }"
    )
    before = shown.run(moving)
    shown.page.get_by_label("what if", exact=True).check()
    assert shown.run("() => scissorcal.rig.active") == "whatIf"
    assert shown.run(moving) > before + 1e-3


def test_a_draw_sets_the_sliders(shown: Shown) -> None:
    values = read(shown.scene.draws.values)
    for draw in (0, 1):
        shown.page.get_by_role("button", name="Next draw").click()
        assert shown.run("() => scissorcal.controls.choices.draw") == draw
        chosen = shown.run("() => Object.fromEntries(scissorcal.controls.choices.values)")
        for slider in shown.scene.sliders:
            nodes = read(slider.nodes)
            own = values[draw, slider.column]
            assert chosen[slider.name] == own
            at = float(shown.page.locator(f"[data-slider={slider.name}]").input_value())
            assert nodes[0] + at / 400 * np.ptp(nodes) == pytest.approx(own, rel=1e-4)


def test_a_slider_with_the_focus_follows_a_draw_and_moves_on_from_there(shown: Shown) -> None:
    """The slider with the focus stays in its place when the others are shown anew."""
    slider = shown.scene.sliders[0]
    nodes, own = read(slider.nodes), read(shown.scene.draws.values)[0, slider.column]
    field = shown.page.locator(f"[data-slider={slider.name}]")
    field.focus()
    shown.page.get_by_role("button", name="Next draw").dispatch_event("click")
    at = float(field.input_value())
    assert nodes[0] + at / 400 * np.ptp(nodes) == pytest.approx(own, rel=1e-4)
    assert field.evaluate("(one) => document.activeElement === one")
    field.evaluate("(one) => { one.value = 100; one.dispatchEvent(new Event('input')); }")
    found = shown.run("() => Object.fromEntries(scissorcal.controls.choices.values)")
    assert found[slider.name] == pytest.approx(nodes[0] + 0.25 * np.ptp(nodes))
    assert shown.run("() => scissorcal.controls.choices.draw") is None


def test_blades_that_nobody_moves_stand_still(shown: Shown) -> None:
    start = shown.run("() => scissorcal.rig.pose.opening")
    shown.page.locator("canvas.plain").press("ArrowDown")
    shown.until(f"a.rig.pose.opening !== {start} && a.rig.isStill")
    before = shown.run("() => [scissorcal.rig.pose, scissorcal.rig.energy]")
    passed = shown.run("() => scissorcal.rig.time")
    shown.until(f"a.rig.time > {passed} + 0.3")
    assert shown.run("() => [scissorcal.rig.pose, scissorcal.rig.energy]") == before
    assert shown.run("() => scissorcal.rig.rate") == 0.0


def test_keys_alone_work_the_page(shown: Shown) -> None:
    reached: set[str] = set()
    for _ in range(80):
        shown.page.keyboard.press("Tab")
        reached.add(
            shown.run(
                "() => document.activeElement.tagName + ' ' + document.activeElement.textContent"
            )
        )
        if any(one.startswith("SUMMARY Draw") for one in reached):
            break
    wanted = {"CANVAS ", "BUTTON One stroke", "BUTTON Fresh sheet", "BUTTON Next draw"}
    assert wanted <= reached
    shown.page.locator("canvas.plain").focus()
    before = shown.run("() => scissorcal.rig.pose")
    for key in ("ArrowDown", "ArrowDown", "ArrowDown", "Shift+ArrowRight"):
        shown.page.keyboard.press(key)
    wanted_now = shown.run("() => scissorcal.rig.wanted")
    assert wanted_now["opening"] == pytest.approx(before["opening"] - 3 * 0.035)
    assert wanted_now["advance"] == pytest.approx(before["advance"] + 0.005)
    shown.until(f"a.rig.rate === 0 && a.rig.pose.opening < {before['opening']} - 0.06")
    shown.until(f"a.rig.pose.advance > {before['advance']} + 0.003")
    assert shown.run(UNNAMED) == []


def test_a_phone_shows_all_without_scrolling_sideways(phone: Shown) -> None:
    width = phone.run("() => [document.documentElement.scrollWidth, window.innerWidth]")
    assert width == [390, 390]
    background = "() => getComputedStyle(document.body).backgroundColor"
    dark = phone.run(background)
    phone.page.emulate_media(color_scheme="light")
    assert (dark, phone.run(background)) == ("rgb(20, 23, 26)", "rgb(255, 255, 255)")


def test_the_solid_view_and_the_designer_open(shown: Shown) -> None:
    shown.page.get_by_label("3-D").check()
    shown.page.locator(".solid canvas").first.wait_for(state="visible")
    assert shown.page.locator("canvas.plain").is_hidden()
    shown.page.get_by_text("Draw plates and blades").click()
    shown.page.locator(".design button").first.wait_for(state="visible")
    assert shown.run(UNNAMED) == []


def test_the_other_law_beside_the_felt_one_has_its_own_name(shown: Shown) -> None:
    names = "() => [...document.querySelectorAll('section.now dt')].map((one) => one.textContent)"
    shown.page.wait_for_selector("[data-number='torque, what if']")
    shown.page.locator("[data-key=whatIf]").check()
    shown.page.wait_for_selector("[data-number='torque, as fitted']")
    assert "torque, as fitted" in shown.run(names)
    assert "torque, what if" not in shown.run(names)


def test_beyond_the_range_of_the_package_is_said_for_all_to_see(shown: Shown) -> None:
    told = shown.page.locator("section.now .warning")
    assert not told.is_visible()
    far = 2.0 * shown.scene.contact_m[1]
    shown.run(
        "(far) => { scissorcal.rig.wanted = { ...scissorcal.rig.wanted, advance: -far }; }", far
    )
    told.wait_for(state="visible")
    assert "Outside the range" in told.inner_text()


def test_a_slider_or_a_reset_ends_the_draws(shown: Shown) -> None:
    draw, play = shown.page.locator("[data-key=draw]"), shown.page.locator("[data-key=play]")
    play.click()
    shown.until("a.controls.choices.draw !== null")
    shown.page.locator("[data-slider=kappa]").evaluate(
        "(e) => { e.value = 200; e.dispatchEvent(new Event('input')); }"
    )
    assert (draw.input_value(), play.inner_text()) == ("0", "Play draws")
    play.click()
    shown.until("a.controls.choices.draw !== null")
    shown.page.locator("[data-key=reset]").click()
    shown.page.wait_for_timeout(1500)  # draws follow each other every 0.6 s
    assert shown.run(
        "() => [scissorcal.controls.choices.draw, scissorcal.controls.choices.values.size]"
    ) == [None, 0]
    assert play.inner_text() == "Play draws"


def test_a_plate_of_pieces_keeps_its_cracks_where_the_law_changes(shown: Shown) -> None:
    shown.run(
        """() => { const a = scissorcal, upper_face_m = a.scene.upper_face_m;
        const strips = [{ end_m: 0.2, fracture_energy_J_per_m: a.scene.numbers[4] }];
        a.rig.cut([{ begin_m: 0, upper_face_m, scale: 1, strips }]);
        a.changed(); a.rig.freshSheet(); }"""
    )
    shown.stroke()
    cut_m = shown.run("() => scissorcal.rig.crackMost")
    assert cut_m > 0.005
    shown.part("friction", False)
    assert shown.run("() => scissorcal.rig.crackMost") == cut_m
    shown.part("friction", True)
    shown.run("() => scissorcal.rig.freshSheet()")
    assert shown.run("() => scissorcal.rig.crackMost") == 0.0


FOLLOW = """(messages) => {
  const { rig } = scissorcal;
  for (const [recording, time_s, opening_rad, advance_m] of messages)
    rig.follow({ recording, time_s, opening_rad, advance_m });
  const { pose, crackMost, energy, isFollowing } = rig;
  return { pose, crackMost, energy, isFollowing };
}"""
"""All in one go: between two calls of a test the page may have waited for too long."""


def test_the_page_cuts_what_a_followed_rig_cuts_and_gives_the_blades_back(shown: Shown) -> None:
    low, high = shown.scene.opening_rad
    time_s = np.arange(0.0, 0.8, 0.004)
    opening = high - (high - low) * np.sin(np.pi * time_s / 1.6) ** 2
    advance = np.full_like(time_s, -shown.scene.contact_m[0])
    messages = [
        ["one", *(values[first:last].tolist() for values in (time_s, opening, advance))]
        for first, last in pairwise((0, 60, 200))
    ]
    found = shown.run(FOLLOW, messages)
    assert found["isFollowing"]
    assert found["pose"]["opening"] == opening[-1]
    fine_s = np.arange(0.0, time_s[-1] + 5e-4, 1e-3)
    fine = np.interp(fine_s, time_s, opening).astype(np.float32)
    rate = np.gradient(fine, 1e-3).astype(np.float32)
    along = np.full(len(fine), advance[0], dtype=np.float32)
    stepped = shown.package.simulate(fine, rate, along)
    fracture_J = float(stepped["fracture_J"][1:].sum())  # the books begin after the first sample
    assert found["energy"]["fracture"] == pytest.approx(fracture_J, rel=1e-3)
    cracks_m = stepped["contact"] + along
    assert found["crackMost"] == pytest.approx(float(cracks_m[-1]), abs=1e-6)
    shown.until("!a.rig.isFollowing")
    fresh = shown.run(FOLLOW, [["two", [0.0], [opening[0]], [advance[0]]]])
    assert fresh["crackMost"] == pytest.approx(float(cracks_m[0]), abs=1e-6)
