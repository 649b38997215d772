"""The 3-D view: what is drawn changes with what it shows, and all of it goes away again."""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser

from tests.prototype.design_bed import COLOURS, SHARED, Bed, open_bed
from tests.prototype.test_design import SHEET, box, drawn, layer

Picture = NDArray[np.float64]
GROUND = "#8f8a84"
"""The light from below in the view; its other lights are white."""
PAPER_SHARE = 0.25
"""Of the paper in the colour of a plate."""
STILL = "() => { window.frames_asked = 0; const ask = requestAnimationFrame;"
COUNT = f"{STILL} window.requestAnimationFrame = (f) => (frames_asked++, ask(f)); }}"


@pytest.fixture(scope="module")
def bed(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    with open_bed(
        browser, tmp_path_factory.mktemp("view"), viewport={"width": 640, "height": 480}
    ) as found:
        found.run(COUNT)
        found.run("() => { window.shown = new View3d(document.getElementById('three')); }")
        yield found


def picture(bed: Bed, **changed: Any) -> Picture:
    """Pixels (rows, columns, 3) of the view at a changed view."""
    bed.run("(changed) => shown.draw({ ...view, ...changed })", changed)
    png = bed.page.locator("#three canvas").screenshot()
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"), dtype=np.float64)


def differ(one: Picture, other: Picture) -> int:
    """Pixels that differ visibly."""
    return int(np.count_nonzero(np.abs(one - other).max(axis=2) > 24))


def linear(levels: Picture) -> Picture:
    """Light of sRGB levels from 0 to 255, by IEC 61966-2-1."""
    share = np.clip(levels, 0.0, 255.0) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def light_of(colour: str) -> Picture:
    """Red, green and blue light of a colour written as #rrggbb."""
    return linear(np.array(list(bytes.fromhex(colour[1:])), dtype=np.float64))


def green_over_red(light: Picture) -> float:
    return float(light[1] / light[0])


def is_plate(shown: Picture) -> NDArray[np.bool_]:
    """Which pixels (rows, columns) show the plate, by their ratio of green to red light.

    The lights are white or redder: a surface has at most its colour's ratio, and at least as much
    of it as the reddest light has. So a plate is greener than all else is, however it is lit, and a
    pixel is a plate's where its ratio is beyond that of every other colour of the view, however its
    levels were rounded.
    """
    colours = COLOURS["light"]
    largest = max(
        green_over_red(light_of(colour)) for colour in (*colours.values(), SHARED["hand"])
    )
    material, paper = light_of(SHARED["material"]), light_of(colours["paper"])
    plate = (1.0 - PAPER_SHARE) * material + PAPER_SHARE * paper
    assert green_over_red(light_of(GROUND)) * green_over_red(plate) > largest
    return np.asarray(linear(shown[..., 1] - 0.5) > largest * linear(shown[..., 0] + 0.5))


def plate_pixels(shown: Picture) -> int:
    return int(np.count_nonzero(is_plate(shown)))


def test_blades_sheet_and_crack_are_seen(bed: Bed) -> None:
    plain = picture(bed)
    assert plate_pixels(plain) > 5000
    canvas, note = (bed.page.locator(f"#three {name}").bounding_box() for name in ("canvas", "p"))
    assert canvas is not None
    assert note is not None
    above = plain[: int(note["y"] - canvas["y"])]
    blades = ~is_plate(above) & np.any(linear(above) != light_of(COLOURS["light"]["paper"]), axis=2)
    assert np.count_nonzero(blades) > 2000
    assert differ(plain, picture(bed)) == 0
    open_ = {"opening": 0.8, "advance": 0}
    assert differ(plain, picture(bed, pose=open_, wanted=open_)) > 1000
    assert differ(plain, picture(bed, crack=0.0)) > 300
    assert differ(plain, picture(bed, wanted={"opening": 0.2, "advance": 0})) > 300


def test_a_drawn_plate_has_its_hole_and_its_layers(bed: Bed) -> None:
    whole = picture(bed, drawn=drawn(layer(SHEET)), crack=0.0)
    holed = layer(SHEET, holes=[box(45, -20, 75, 20)])
    assert plate_pixels(picture(bed, drawn=drawn(holed), crack=0.0)) < plate_pixels(whole) - 1500
    thick = drawn(layer(SHEET), layer(box(40, -25, 75, 25), 6.0, name="second"))
    assert differ(whole, picture(bed, drawn=thick, crack=0.0)) > 1500
    regions = [{"toughness_ratio": 3.0, "outline": box(45, -20, 75, 20)}]
    assert differ(whole, picture(bed, drawn=drawn(layer(SHEET, regions=regions)), crack=0.0)) > 1500


def test_pieces_without_a_drawing_are_shown_as_long_as_they_are(bed: Bed) -> None:
    def piece(begin: float, *ends: float) -> dict[str, Any]:
        strips = [{"end_m": end, "fracture_energy_J_per_m": 0.4 + i} for i, end in enumerate(ends)]
        return {"begin_m": begin, "upper_face_m": 5e-5, "scale": 1.0, "strips": strips}

    one = picture(bed, pieces=[piece(0.0, 0.08)], crack=0.0)
    two = picture(bed, pieces=[piece(0.0, 0.03), piece(0.06, 0.08)], crack=0.0)
    strips = picture(bed, pieces=[piece(0.0, 0.03, 0.08)], crack=0.0)
    assert plate_pixels(two) < plate_pixels(one) - 1500
    assert differ(one, strips) > 1500


def test_a_piece_that_nothing_touched_is_not_cut(bed: Bed) -> None:
    """Its crack is where it begins, which float32 may put beyond it."""
    pieces = [
        {
            "begin_m": begin,
            "upper_face_m": 5e-5,
            "scale": 1.0,
            "strips": [{"end_m": begin + 0.02, "fracture_energy_J_per_m": 0.4}],
        }
        for begin in (0.0, 0.0331, 0.0661)
    ]
    begun = [float(np.float32(one["begin_m"])) for one in pieces]
    assert begun[1] > 0.0331
    whole = picture(bed, pieces=pieces, crack=0.0)
    assert differ(whole, picture(bed, pieces=pieces, cracks=begun, crack=0.07)) == 0
    assert differ(whole, picture(bed, pieces=pieces, cracks=[0.02, *begun[1:]])) > 100


def test_the_plate_stands_in_its_pose(bed: Bed) -> None:
    """A pose is the rig's, whose y is up: a plate without a tilt is turned by -90 degrees there."""

    def pose(height_m: float, turn_rad: float) -> Picture:
        bed.run(
            "([y, turn]) => { scene.plate_pose = { position_m: [0.03, y, 0.01],"
            " rotation_vector_rad: [turn, 0, 0] }; }",
            [height_m, turn_rad],
        )
        return picture(bed)

    flat = picture(bed)
    assert differ(flat, pose(0.0, -0.5 * np.pi)) < 20
    assert differ(flat, pose(0.0, -0.5 * np.pi + 0.3)) > 3000
    assert differ(flat, pose(-0.01, -0.5 * np.pi)) > 1000
    bed.run("() => { delete scene.plate_pose; }")
    assert differ(flat, picture(bed)) == 0


def test_pointer_and_keys_turn_it_and_home_sets_it_back(bed: Bed) -> None:
    def shot() -> Picture:
        png = bed.page.locator("#three canvas").screenshot()
        return np.asarray(Image.open(BytesIO(png)).convert("RGB"), dtype=np.float64)

    home = picture(bed)
    canvas = bed.page.locator("#three canvas")
    canvas.focus()
    focused = shot()
    for key in ("ArrowLeft", "ArrowUp", "+"):
        before = shot()
        bed.page.keyboard.press(key)
        assert differ(before, shot()) > 500, key
    bed.page.keyboard.press("Home")
    assert differ(focused, shot()) == 0
    where = canvas.bounding_box()
    assert where is not None
    bed.page.mouse.move(where["x"] + 300, where["y"] + 100)
    bed.page.mouse.down()
    bed.page.mouse.move(where["x"] + 380, where["y"] + 120)
    bed.page.mouse.up()
    assert differ(home, shot()) > 500
    bed.page.keyboard.press("Home")


def test_it_draws_when_it_is_told_to_and_says_what_it_shows(bed: Bed) -> None:
    picture(bed, pose={"opening": 0.5, "advance": 0}, crack=0.042)
    assert bed.run("() => frames_asked") == 0
    label = bed.page.locator("#three canvas").get_attribute("aria-label")
    assert label is not None
    assert "opening 29 degrees, 42 mm cut" in label


def test_it_takes_the_colours_of_the_theme(bed: Bed) -> None:
    light = picture(bed)
    bed.page.emulate_media(color_scheme="dark")
    dark = picture(bed)
    bed.page.emulate_media(color_scheme="light")
    corner = (slice(0, 20), slice(600, 620))
    assert light[corner].mean() > 240
    assert dark[corner].mean() < 40
    assert differ(light, picture(bed)) == 0


@pytest.mark.slow
def test_it_is_disposed_of_and_made_again(bed: Bed) -> None:
    """Browsers keep sixteen contexts alive: more views than that, one after the other."""
    for _ in range(17):
        bed.run(
            "() => { const other = document.createElement('div'); other.style.height = '80px';"
            " document.body.append(other); const made = new View3d(other); made.draw(view);"
            " made.dispose(); made.draw(view); if (other.children.length) throw new Error('left');"
            " other.remove(); }"
        )
    assert plate_pixels(picture(bed)) > 5000


def test_one_blade_that_moves_lifts_no_flap(browser: Browser, tmp_path: Path) -> None:
    with open_bed(browser, tmp_path, moving_blades=1) as bed:
        bed.run("() => { window.shown = new View3d(document.getElementById('three')); }")
        assert plate_pixels(picture(bed)) > 5000


def test_without_webgl_a_sentence_says_so(browser: Browser, tmp_path: Path) -> None:
    with open_bed(browser, tmp_path) as bed:
        text = bed.run(
            "() => { HTMLCanvasElement.prototype.getContext = () => null;"
            " const quiet = console.error; console.error = () => {};"
            " const made = new View3d(document.getElementById('three')); console.error = quiet;"
            " made.draw(view); const text = document.getElementById('three').textContent;"
            " made.dispose(); return text; }"
        )
        assert "has no WebGL" in text
