"""Blades through points as a person draws them, and the torque that the page then shows."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from scissorcal.aliases import Array
from scissorcal.calibration import at_typical
from scissorcal.kernel import Kernel, Table
from scissorcal.model import Edge, edge_through
from scissorcal.package import FitDraws, ModelPackage, build_package, central_model, open_package
from scissorcal.prototype.document import page_of
from scissorcal.prototype.scene import scene_of
from tests.browser import open_file, put_back
from tests.package.fits import cut_fit, friction_fit, recipe
from tests.prototype.design_bed import EDGE, Bed

ROUNDED = 2e-5
"""Of the torque: five roundings of a height of 8 mm, 0.9 nm each, of 0.2 mm of indentation."""
DENSE = 250
BENT_MM = [[0.0, -8.0], [15.0, -7.9], [30.0, -6.8], [45.0, -6.3], [60.0, -5.6], [82.0, -5.0]]


def applied(bed: Bed) -> Any:
    return bed.told[-1]["applied"]["edge"]


def saved(bed: Bed, folder: Path) -> Any:
    with bed.page.expect_download() as download:
        bed.page.get_by_role("button", name="Save recipe.toml").click()
    download.value.save_as(folder / "recipe.toml")
    return tomllib.loads((folder / "recipe.toml").read_text(encoding="utf-8"))["rig"]["edge"]


def loaded(page: Page, file: Path) -> None:
    page.set_input_files("input[type=file]", file)
    page.wait_for_function(
        "(name) => document.querySelector('.design-status').textContent.startsWith(name)",
        arg=file.name,
    )


def test_the_blades_as_fitted_are_bent_by_their_points(bed: Bed, tmp_path: Path) -> None:
    page = bed.page
    page.get_by_role("button", name="Points of the blades as fitted").click()
    points = applied(bed)["points_mm"]
    assert 12 <= len(points) <= 20
    line = EDGE["offset_mm"] + np.tan(np.radians(EDGE["taper_deg"])) * np.array(points)[:, 0]
    assert np.max(np.abs(np.array(points)[:, 1] - line)) < 1e-3
    assert "16 points of the blades as fitted" in bed.said
    page.get_by_label("offset of corner 9, mm").fill("-6.5")
    page.keyboard.press("Enter")
    bent = applied(bed)
    assert bent["points_mm"][8] == [points[8][0], -6.5]
    expect(page.get_by_text("A smooth curve of")).to_contain_text("75 mm long")
    assert saved(bed, tmp_path) == {"family": "points", "points_mm": bent["points_mm"]}
    page.get_by_role("button", name="Undo").click()
    assert applied(bed)["points_mm"] == points
    page.get_by_role("button", name="Undo").click()
    assert applied(bed) is None
    page.get_by_role("button", name="Redo").click()
    assert applied(bed)["points_mm"] == points


def test_points_that_are_no_edge_are_said_and_nothing_is_lost(bed: Bed) -> None:
    page = bed.page
    page.get_by_role("button", name="Points of the blades as fitted").click()
    before = applied(bed)
    page.get_by_label("station of corner 3, mm").fill("4")
    page.keyboard.press("Enter")
    warning = page.locator(".design-panel .warning")
    expect(warning).to_contain_text("rise strictly, from pivot to tip. The blades keep the edge")
    assert applied(bed) == before
    assert page.get_by_label("station of corner 3, mm").input_value() == "4"
    page.get_by_role("button", name="Save recipe.toml").click()
    assert "no recipe can hold them" in bed.said
    page.get_by_label("Family of the edge").select_option("line")
    assert applied(bed)["family"] == "line"
    expect(warning).to_have_count(0)
    page.get_by_label("Family of the edge").select_option("points")
    expect(warning).to_contain_text("rise strictly")
    page.get_by_label("station of corner 3, mm").fill("9")
    page.keyboard.press("Enter")
    expect(warning).to_have_count(0)
    assert applied(bed)["points_mm"][2][0] == 9


def test_an_edge_is_drawn_by_the_pointer_and_moved_by_keys(bed: Bed) -> None:
    page = bed.page
    page.get_by_role("button", name="Show all").click()
    page.locator("select").first.select_option("edge")
    page.get_by_role("button", name="Rectangle").click()
    page.locator(".design-drawing").press("Enter")
    assert "no closed shape" in bed.said
    page.get_by_role("button", name="Polygon").click()
    for place in [(75, -4), (50, -6), (25, -6), (5, -9)]:  # from the tip, not to the pivot
        page.mouse.click(*bed.place(*place))
    page.keyboard.press("Enter")
    edge = applied(bed)
    assert edge["family"] == "points"
    assert edge["points_mm"] == [[0, -9.75], [5, -9], [25, -6], [50, -6], [75, -4]]
    page.keyboard.press("PageUp")
    page.keyboard.press("ArrowUp")
    assert applied(bed)["points_mm"][-1] == [75, -3]
    path = page.locator(".design-edge path").get_attribute("d")
    assert path is not None
    assert path.count("L") > 100


def test_a_recipe_goes_through_the_page_as_it_is(bed: Bed, tmp_path: Path) -> None:
    text = "\n".join(
        [
            '[rig.edge]\nfamily = "points"',
            f"points_mm = {[*BENT_MM, [90.0, -4.123456789]]}",
            "offset_sd_mm = 0.1\n",
        ]
    )
    file = tmp_path / "bent.toml"
    file.write_text(text, encoding="utf-8")
    loaded(bed.page, file)
    assert saved(bed, tmp_path) == tomllib.loads(text)["rig"]["edge"]
    note = bed.page.get_by_text("cuts with the blades as fitted")
    expect(note).to_be_visible()  # a recipe without a plate is not cut as drawn
    bed.page.get_by_label("cut this drawing").check()
    expect(note).to_have_count(0)
    assert applied(bed)["points_mm"] == tomllib.loads(text)["rig"]["edge"]["points_mm"]
    file.write_text('[rig.edge]\nfamily = "spline"\n', encoding="utf-8")
    bed.page.set_input_files("input[type=file]", file)
    expect(bed.page.locator(".design-status")).to_contain_text('one of "line", "arc", "points"')
    assert saved(bed, tmp_path) == tomllib.loads(text)["rig"]["edge"]


@dataclass
class Shown:
    package: ModelPackage
    page: Page

    def run(self, script: str, given: Any = None) -> Any:
        return self.page.evaluate(script, given)

    def torque(self, opening: Array, rate: float, contact: float) -> Array:
        script = "([openings, rate, contact]) => scissorcal.torqueAt(openings, rate, contact)"
        return np.array(self.run(script, [opening.tolist(), rate, contact]))


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[ModelPackage, Any, Path]:
    """Of a law without a ripple: its average is one kernel's torque."""
    chosen, folder = recipe(), tmp_path_factory.mktemp("page")
    fit = cut_fit(chosen)
    build_package(chosen, friction_fit(), fit, folder / "p.zip", np.random.default_rng(3))
    package = open_package(folder / "p.zip", warn=False)
    scene = scene_of(package, made_utc="2026-11-24T00:00:00Z", version="1")
    (folder / "paper.html").write_text(page_of(scene), encoding="utf-8")
    return package, fit, folder / "paper.html"


@pytest.fixture
def shown(browser: Browser, built: tuple[ModelPackage, Any, Path]) -> Iterator[Shown]:
    page, seen = open_file(browser, built[2], viewport={"width": 1280, "height": 900})
    page.wait_for_selector("canvas.plain")
    page.get_by_text("Draw plates and blades").click()
    yield Shown(built[0], page)
    put_back(page)
    assert seen.errors == []


def assert_torque(shown: Shown, edge: Edge, fit: Any) -> None:
    """The package's law with another edge, by the kernel and by the model itself."""
    tables = shown.package.tables
    at = np.linspace(0.0, edge.length_m, DENSE)
    dense = Table(*np.float32([at, edge.offset_at(at), edge.slope_at(at)]))
    kernel = Kernel(replace(tables, edge=dense, tip_station=edge.length_m))
    friction = FitDraws.centre(at_typical(friction_fit()))
    model = central_model(FitDraws.centre(fit), friction)
    exact = replace(model, cutting=replace(model.cutting, edge=edge))
    low, high = shown.package.manifest.ranges.opening_rad
    inside = np.linspace(low, high, 63)[1:-1].astype(np.float32).astype(np.float64)
    bound = shown.package.manifest.bound.stated_Nm
    touched = 0
    for contact in np.linspace(*shown.package.manifest.ranges.contact_m, 4):
        for rate in (-0.5, 0.5):
            found = shown.torque(inside, rate, contact)
            wanted = kernel.torque(inside, rate, contact)
            largest = np.abs(wanted).max()
            np.testing.assert_allclose(found, wanted, rtol=0, atol=ROUNDED * largest + 1e-7)
            itself = exact.torque(inside, rate, contact)
            np.testing.assert_allclose(found, itself, rtol=0, atol=2.0 * bound)
            touched += int(
                np.sum(np.abs(wanted - shown.package.torque(inside, rate, contact)) > 5e-3)
            )
    assert touched > 10  # the drawn blades are felt


def test_the_torque_of_blades_from_a_table_is_the_models(
    shown: Shown, built: tuple[ModelPackage, Any, Path]
) -> None:
    page = shown.page
    page.get_by_role("button", name="Points of the blades as fitted").click()
    points = np.array(shown.run("() => scissorcal.edge.points_mm"))
    bend = 0.6 * np.sin(points[:, 0] / 14.0)
    for i in range(len(points)):
        if i == 12:
            page.get_by_role("button", name="Next", exact=True).click()
        offset = page.get_by_label(f"offset of corner {i + 1}, mm")
        offset.fill(f"{points[i, 1] + bend[i]:.4f}")
        offset.press("Enter")
    drawn = np.array(shown.run("() => scissorcal.edge.points_mm"))
    assert np.max(np.abs(drawn[:, 1] - points[:, 1] - bend)) < 1e-4
    assert_torque(shown, edge_through(1e-3 * drawn)[0], built[1])


def test_the_torque_of_blades_from_an_svg_file_is_the_models(
    shown: Shown, built: tuple[ModelPackage, Any, Path], tmp_path: Path
) -> None:
    """A longer blade: its material is met beyond the fitted tip, and its picture is as long."""
    file = tmp_path / "blade.svg"
    bent, _ = edge_through(1e-3 * np.array(BENT_MM))
    station = np.linspace(0.0, 82.0, 83)
    curve = np.column_stack([station, np.round(1e3 * bent.offset_at(1e-3 * station), 4)])
    places = " L".join(f"{20 + s:.4f} {30 - e:.4f}" for s, e in curve)
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" viewBox="0 0 120 60">'
        '<circle id="pivot" cx="20" cy="30" r="1"/>'
        f'<path d="M8 34 L8 40 L{places} L102 20 L20 20z"/></svg>',
        encoding="utf-8",
    )
    shown.page.locator(".design select").first.select_option("edge")
    loaded(shown.page, file)
    drawn = shown.run("() => scissorcal.edge.points_mm")
    np.testing.assert_allclose(drawn, curve, atol=1.1e-4)
    edge, _ = edge_through(1e-3 * np.array(drawn))
    assert_torque(shown, edge, built[1])
    fitted_m = shown.package.manifest.mechanics.tip_station_m
    assert fitted_m < 0.08 < edge.length_m
    places = ["() => scissorcal.rig.bladeLength_m", "() => scissorcal.laws.whatIf.numbers[9]"]
    assert [shown.run(one) for one in places] == [np.float32(0.082), np.float32(0.082)]
    shown.page.get_by_role("button", name="As fitted again").click()
    assert shown.run(places[0]) == np.float32(fitted_m)
    assert shown.run("() => scissorcal.edge") is None


def test_beyond_the_tip_of_a_drawn_blade_there_is_no_force(shown: Shown) -> None:
    """The same line, ended at 40 mm: what stands farther out is not reached."""
    page = shown.page
    opening = np.array([np.radians(15.0)])
    place = 0.045
    page.get_by_label("friction", exact=True).uncheck()
    assert shown.torque(opening, -0.3, place)[0] > 1e-3
    page.get_by_role("button", name="Draw another edge").click()
    page.get_by_label("Length, mm").fill("40")
    page.keyboard.press("Enter")
    assert shown.run("() => scissorcal.rig.bladeLength_m") == np.float32(0.04)
    assert shown.torque(opening, -0.3, place)[0] == 0.0


def test_an_edge_that_leans_back_is_said_and_gives_no_torque(shown: Shown) -> None:
    page = shown.page
    told = page.locator("section.now .warning", has_text="leans back")
    note = page.locator("section.torque .note", has_text="The blades are drawn")
    assert (told.is_visible(), note.is_visible()) == (False, False)
    page.get_by_role("button", name="Draw another edge").click()
    page.get_by_label("Taper, deg").fill("75")
    page.keyboard.press("Enter")
    expect(note).to_be_visible()
    page.locator("canvas.plain").press("ArrowUp")
    expect(told).to_be_visible()
    assert shown.run("() => scissorcal.rig.step.torque") == 0.0
    page.get_by_role("button", name="As fitted again").click()
    page.locator("canvas.plain").press("ArrowUp")
    expect(told).to_be_hidden()
    expect(note).to_be_hidden()


def test_low_blades_begin_in_front_of_the_sheet_and_cut_it(shown: Shown) -> None:
    """A piece is met from outside alone: blades that lie in it when it is fresh would never cut."""
    shown.page.get_by_role("button", name="Draw another edge").click()
    offset = shown.page.get_by_label("Offset, mm")
    offset.fill("-15")
    offset.press("Enter")
    shown.page.get_by_role("button", name="One stroke").click()
    shown.page.wait_for_function("() => !scissorcal.rig.plays")
    assert shown.run("() => scissorcal.rig.crackMost") > 0.005


def test_an_outline_is_its_sides_and_a_bevelled_tip_is_no_arc(shown: Shown, tmp_path: Path) -> None:
    file = tmp_path / "bevel.svg"
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" viewBox="0 0 120 60">'
        '<circle id="pivot" cx="20" cy="20" r="1"/>'
        '<path d="M0 20 L0 27 L20 28 L85 25 L100 20 L20 12z"/></svg>',
        encoding="utf-8",
    )
    shown.page.locator(".design select").first.select_option("edge")
    loaded(shown.page, file)
    assert "smooth corners" in shown.page.locator(".design .warning").inner_text()
    assert shown.run("() => scissorcal.edge") is None


def kept(page: Page, folder: Path) -> str:
    with page.expect_download() as download:
        page.get_by_role("button", name="Save recipe.toml").click()
    download.value.save_as(folder / "saved.toml")
    return (folder / "saved.toml").read_text(encoding="utf-8")


def test_the_box_and_the_blades_follow_steps_back_and_what_was_taken(
    shown: Shown, tmp_path: Path
) -> None:
    page, box = shown.page, shown.page.get_by_label("cut this drawing")
    file = tmp_path / "recipe.toml"
    file.write_text(
        '[rig.edge]\n# by caliper\nfamily = "line"\noffset_mm = -7\ntaper_deg = 2\n'
        'length_mm = 70\n[scene]\nplate_pose = "estimated"\n',
        encoding="utf-8",
    )
    loaded(page, file)
    assert not box.is_checked()
    page.get_by_role("button", name="Undo").click()
    assert box.is_checked()
    page.get_by_role("button", name="Redo").click()
    assert not box.is_checked()
    assert "# by caliper" in kept(page, tmp_path)
    page.get_by_role("button", name="As fitted again").click()
    again = tomllib.loads(kept(page, tmp_path))
    assert again["rig"]["edge"]["offset_mm"] == pytest.approx(-8.0)
    assert "plate" not in again
    assert box.is_checked()
    page.get_by_label("Left, mm").fill("-50")
    page.keyboard.press("Enter")
    box.uncheck()
    assert shown.run("() => scissorcal.rig.pieces") is None
    box.check()
    assert len(shown.run("() => scissorcal.rig.pieces")) == 1
