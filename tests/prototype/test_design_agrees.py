"""The page and the recipe see the same plate: the same pieces, or the same refusal."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser

from scissorcal.errors import InputError
from scissorcal.recipe import parse_recipe, plate_pieces, read_drawing, shown_shapes
from tests.foreign.drawings import HEAD, MISPLACED, READ, RECT, UNREAD
from tests.model.drawn import assert_pieces, golden_cases, golden_files, numbers, pieces_of
from tests.prototype.design_bed import Bed, open_bed
from tests.prototype.test_design import SHEET, box, drawn, layer

RANDOM = 300


@pytest.fixture(scope="module")
def bed(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    with open_bed(browser, tmp_path_factory.mktemp("agrees")) as found:
        yield found


def random_outline(rng: np.random.Generator, middle: float, size: float) -> NDArray[np.float64]:
    """Corners around a place on the cut, some of them on half millimetres and on the line."""
    count = int(rng.integers(3, 9))
    angles = np.sort(rng.uniform(0, 2 * np.pi, count))
    radii = rng.uniform(0.3, 1.0, count) * size
    corners = np.stack([middle + radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    return np.round(2 * corners) / 2 if rng.uniform() < 0.5 else corners


def random_drawing(rng: np.random.Generator) -> dict[str, Any]:
    layers = []
    for number in range(int(rng.integers(1, 4))):
        middle = rng.uniform(40, 60)
        holes = [
            random_outline(rng, middle + rng.uniform(-15, 15), 4).tolist()
            for _ in range(int(rng.integers(0, 4)))
        ]
        regions = [
            {
                "toughness_ratio": float(rng.choice([0.5, 2.0, 3.0])),
                "outline": random_outline(rng, middle + rng.uniform(-15, 15), 4).tolist(),
            }
            for _ in range(int(rng.integers(0, 3)))
        ]
        outline = random_outline(rng, middle, 30).tolist()
        thickness = float(rng.choice([0.1, 0.25, 0.5]))
        layers.append(layer(outline, thickness, name=f"l{number}", holes=holes, regions=regions))
    return drawn(*layers, cut=float(rng.choice([0.0, 0.5, -1.0])))


def of_page(bed: Bed, given: dict[str, Any]) -> Any:
    return bed.run(
        "(given) => tried(() => layerPieces(given).map((p) => [p.begin, p.top, p.thickness,"
        " ...p.strips.flatMap((s) => [s.end, s.ratio])]))",
        given,
    )


def test_random_drawings_have_the_same_pieces(bed: Bed) -> None:
    rng = np.random.default_rng(14)
    refused = several = 0
    for _ in range(RANDOM):
        given = random_drawing(rng)
        found = of_page(bed, given)
        try:
            wanted = pieces_of(given)
        except ValueError:
            assert "refused" in found, given
            refused += 1
            continue
        assert "refused" not in found, (found, given)
        assert len(found) == len(wanted), given
        for one, other in zip(found, wanted, strict=True):
            assert one == pytest.approx(other, abs=1e-9), given
        several += len(wanted) > 2
    assert several > RANDOM / 5
    assert RANDOM / 20 < refused < RANDOM / 2


@pytest.mark.parametrize("case", golden_cases(), ids=lambda case: case["title"])
def test_the_page_has_the_pieces_of_the_golden_vectors(bed: Bed, case: dict[str, Any]) -> None:
    found = of_page(bed, case["drawn"])
    assert_pieces(None if "refused" in found else found, case)


@pytest.mark.parametrize("given", golden_files(), ids=lambda given: given["title"])
def test_the_page_and_a_recipe_see_the_same_shapes_of_a_file(
    bed: Bed, tmp_path: Path, given: dict[str, Any]
) -> None:
    page = bed.run("(text) => tried(() => readSvg(text).map((one) => one.id))", given["text"])
    file = tmp_path / "drawing.svg"
    file.write_text(given["text"], encoding="utf-8")
    text = re.sub(r"/\*.*?\*/", "", given["text"], flags=re.S)
    styled = re.search(r"<style[^<]*[{;\s](display|visibility)\s*:", text)
    if given["shapes"] is None or styled:
        assert "in a <style>, which is not read" in page["refused"]
        with pytest.raises(InputError, match=r"in a <style>, which is not read"):
            read_drawing(file)
    else:
        assert page == given["shapes"]
        assert [name for name, _ in read_drawing(file).shapes] == given["shapes"]


@pytest.mark.parametrize(("inner", "_why"), UNREAD)
def test_the_page_refuses_what_a_recipe_refuses(bed: Bed, inner: str, _why: str) -> None:
    found = bed.run("(text) => tried(() => readSvg(text))", f"{HEAD}{inner}</svg>")
    assert "refused" in found
    with pytest.raises(ValueError, match=r"^it") as recipe:
        shown_shapes(f"{HEAD}{inner}</svg>".encode())
    if " is not read" in str(recipe.value) or "it has <" in str(recipe.value):
        assert str(recipe.value) in found["refused"]


@pytest.mark.parametrize(("head", "_why"), MISPLACED)
def test_the_page_refuses_what_would_place_a_whole_drawing_otherwise(
    bed: Bed, head: str, _why: str
) -> None:
    found = bed.run("(text) => tried(() => readSvg(text))", f"{head}{RECT}</svg>")
    assert "refused" in found or '"100px"' in head  # the page takes pixels


@pytest.mark.parametrize(("inner", "box_mm"), READ)
def test_the_page_reads_what_a_recipe_reads(bed: Bed, inner: str, box_mm: list[float]) -> None:
    (shape,) = bed.run("(text) => readSvg(text)", f"{HEAD}{inner}</svg>")
    corners = np.concatenate([np.array(one) for one in shape["outlines"]]) * [1, -1]
    found = [*corners.min(axis=0), *corners.max(axis=0)]
    assert found == pytest.approx(box_mm, abs=0.05)


def test_a_saved_recipe_is_taken_and_has_the_same_pieces(bed: Bed, tmp_path: Path) -> None:
    given = drawn(
        layer(SHEET, holes=[box(30, -5, 40, 5)], name="lower sheet"),
        layer(box(20, -5, 50, 5), 0.25, name="patch", toughness_ratio=0.7,
              regions=[{"toughness_ratio": 3.0, "outline": box(25, -2, 30, 2.125)}]),
        cut=-1.25,
    )  # fmt: skip
    text = bed.run("(given) => recipeText(given, scene, null)", given)
    recipe = parse_recipe(text)
    wanted = numbers(plate_pieces(recipe.plate, tmp_path))
    found = of_page(bed, given)
    assert [len(one) for one in found] == [len(one) for one in wanted]
    for one, other in zip(found, wanted, strict=True):
        assert one == pytest.approx(other, abs=1e-9)


def test_names_that_the_page_gives_are_names_of_a_recipe(bed: Bed) -> None:
    text = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="60mm" viewBox="0 0 90 60">'
        '<rect id="-größe &lt;1&gt;" width="20" height="30"/>'
        '<rect id="größe 1" x="30" width="20" height="30"/></svg>'
    )
    given = bed.run("(text) => drawnFromSvg(text, 0.1)", text)
    names = [one["name"] for one in given["layers"]]
    given["cut_line_mm"] = -15
    recipe = parse_recipe(bed.run("(given) => recipeText(given, scene, null)", given))
    assert [one.name for one in recipe.plate.layers] == names
    assert len(set(names)) == 2


def test_a_saved_drawing_is_an_svg_file_that_a_recipe_may_name(bed: Bed, tmp_path: Path) -> None:
    """x as drawn; y of the file counts down from its upper border, 2 mm above the plate."""
    given = drawn(layer(SHEET, holes=[box(30, -5, 40, 5)]), layer(box(20, -5, 50, 6), name="two"))
    file = tmp_path / "drawing.svg"
    file.write_text(bed.run("(given) => svgOf(given)", given), encoding="utf-8")
    drawing = read_drawing(file)
    for name, corners in (
        ("layer-1", SHEET),
        ("layer-1-hole-1", box(30, -5, 40, 5)),
        ("layer-2", box(20, -5, 50, 6)),
    ):
        (found,) = drawing.shape(name).contours
        wanted = sorted([x, 32.0 - y] for x, y in corners)
        assert sorted(np.round(1e3 * found, 6).tolist()) == wanted
