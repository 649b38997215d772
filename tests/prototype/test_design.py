"""The page's designer: a drawn plate becomes the pieces that the kernel meets, and a recipe."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

from scissorcal.recipe import parse_recipe, recipe_path
from tests.prototype.design_bed import EDGE, ENERGY_J_PER_M, THICKNESS_MM, Bed, open_bed

SHEET = [[0, -30], [80, -30], [80, 30], [0, 30]]


def layer(outline: list[Any], thickness: float = THICKNESS_MM, **more: Any) -> dict[str, Any]:
    plain = {"name": "sheet", "thickness_mm": thickness, "toughness_ratio": 1.0}
    return {**plain, "outline": outline, "holes": [], "regions": [], **more}


def drawn(*layers: dict[str, Any], cut: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"cut_line_mm": cut, "layers": list(layers), "edge": None, "edge_points": [], **more}


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


@pytest.fixture(scope="module")
def bed(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    with open_bed(browser, tmp_path_factory.mktemp("design")) as found:
        yield found


def pieces(bed: Bed, given: dict[str, Any]) -> Any:
    return bed.run("(given) => tried(() => piecesOf(given, calibratedOf(scene)))", given)


def test_a_plain_sheet_is_the_calibrated_one(bed: Bed) -> None:
    (piece,) = pieces(bed, drawn(layer(SHEET)))
    assert piece["begin_m"] == 0.0
    assert piece["scale"] == pytest.approx(1.0)
    assert piece["upper_face_m"] == pytest.approx(0.5e-3 * THICKNESS_MM)
    (strip,) = piece["strips"]
    assert strip["end_m"] == pytest.approx(0.08)
    assert strip["fracture_energy_J_per_m"] == pytest.approx(ENERGY_J_PER_M)


def test_a_hole_is_a_gap_and_a_tougher_part_is_a_strip(bed: Bed) -> None:
    given = layer(
        SHEET,
        holes=[box(30, -5, 40, 5), box(10, 5, 20, 9)],
        regions=[{"toughness_ratio": 2.0, "outline": box(50, -8, 60, 8)}],
    )
    first, second = pieces(bed, drawn(given))
    ends = [strip["end_m"] for strip in second["strips"]]
    energies = [strip["fracture_energy_J_per_m"] for strip in second["strips"]]
    assert [first["begin_m"], first["strips"][-1]["end_m"]] == pytest.approx([0.0, 0.03])
    assert second["begin_m"] == pytest.approx(0.04)
    assert ends == pytest.approx([0.05, 0.06, 0.08])
    assert energies == pytest.approx([ENERGY_J_PER_M, 2 * ENERGY_J_PER_M, ENERGY_J_PER_M])


def test_a_layer_lies_on_what_is_below_it_only(bed: Bed) -> None:
    over = layer(box(20, -5, 50, 5), 0.3, name="patch")
    beside = layer(box(100, -5, 120, 5), 0.2, name="second plate")
    found = pieces(bed, drawn(layer(SHEET), over, beside))
    assert [one["upper_face_m"] for one in found] == pytest.approx([0.05e-3, 0.2e-3, 0.1e-3])
    assert [one["scale"] for one in found] == pytest.approx([1.0, 3.0, 2.0])


def test_the_whole_height_counts_where_one_blade_moves(bed: Bed) -> None:
    material = {"thickness_m": 1e-4, "fracture_energy_J_per_m": 1.0, "moving_blades": 1}
    given = drawn(layer(SHEET), layer(box(20, -5, 50, 5), 0.3))
    found = bed.run("(given) => piecesOf(...given)", [given, material])
    assert [one["upper_face_m"] for one in found] == pytest.approx([1e-4, 4e-4])
    assert found[1]["strips"][0]["fracture_energy_J_per_m"] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (drawn(layer(SHEET), cut=31.0), "misses the layer"),
        (drawn(layer(box(-2, -5, 30, 5))), "x of 0 and more"),
        (drawn(), "no plate"),
        (drawn(layer(SHEET, holes=[box(4 * i, -1, 4 * i + 1, 1) for i in range(1, 18)])), "fewer"),
        (
            drawn(
                layer(
                    SHEET,
                    regions=[
                        {"toughness_ratio": 2.0, "outline": box(10, -5, 30, 5)},
                        {"toughness_ratio": 3.0, "outline": box(20, -5, 40, 5)},
                    ],
                )
            ),
            "overlap on the line",
        ),
    ],
)
def test_what_the_kernel_does_not_take_is_refused(
    bed: Bed, given: dict[str, Any], words: str
) -> None:
    assert words in pieces(bed, given)["refused"]


def test_stretches_of_random_outlines_are_where_points_are_inside(bed: Bed) -> None:
    """Against a dense count of the angle by which an outline goes round each point."""
    rng = np.random.default_rng(7)
    for _ in range(30):
        count = int(rng.integers(3, 12))
        angles = np.sort(rng.uniform(0, 2 * np.pi, count))
        radii = rng.uniform(4, 30, count)
        corners = np.stack([40 + radii * np.cos(angles), radii * np.sin(angles)], axis=1)
        found = bed.run("(o) => stretches(o, 1.234)", corners.tolist())
        x = np.linspace(5, 75, 1401)
        rays = corners[None] - np.stack([x, np.full_like(x, 1.234)], axis=1)[:, None]
        bearing = np.arctan2(rays[..., 1], rays[..., 0])
        steps = np.diff(np.append(bearing, bearing[:, :1], axis=1), axis=1)
        turns = np.sum((steps + np.pi) % (2 * np.pi) - np.pi, axis=1)
        inside = np.zeros_like(x, dtype=bool)
        for low, high in found:
            inside |= (x > low) & (x < high)
        borders = np.array(found).ravel()
        clear = np.all(np.abs(x[:, None] - borders) > 1e-9, axis=1) if len(borders) else x > 0
        assert np.array_equal(np.abs(turns[clear]) > np.pi, inside[clear])


SVG = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
 width="100mm" height="50mm" viewBox="0 0 200 100">
 <image xlink:href="data:image/png;base64,AAAA"/>
 <defs><rect id="kept" width="9" height="9"/></defs>
 <g transform="translate(20 10) scale(2)">
  <path id="plate" d="m0 0h40v20h-40z"/><circle cx="20" cy="10" r="4"/></g></svg>"""


def test_an_svg_file_is_read_in_mm(bed: Bed) -> None:
    shapes = bed.run("(text) => readSvg(text)", SVG)
    assert [shape["id"] for shape in shapes] == ["plate", ""]
    assert np.array(shapes[0]["outlines"][0]) == pytest.approx(
        np.array([[10, -5], [50, -5], [50, -25], [10, -25]])
    )
    round_ = np.array(shapes[1]["outlines"][0])
    distance = np.hypot(*(round_ - [30, -15]).T)
    assert distance == pytest.approx(np.full(len(round_), 4.0), abs=2e-3)
    sagitta = 4 * (1 - np.cos(np.pi / len(round_)))
    assert sagitta < 0.021
    (plate,) = bed.run("(text) => drawnFromSvg(text, 0.1)", SVG)["layers"]
    assert (plate["name"], len(plate["holes"])) == ("plate", 1)


@pytest.mark.parametrize(
    "inner",
    [
        "<script>window.hacked = 1</script>",
        '<image onerror="window.hacked = 1" href="data:image/png;base64,AAAA"/>',
        '<image href="http://example.org/a.png"/>',
        '<style>@import "http://example.org/b.css";</style>',
    ],
)
def test_nothing_of_a_refused_svg_file_runs_or_is_fetched(bed: Bed, inner: str) -> None:
    text = SVG.replace("</svg>", f"{inner}</svg>")
    assert "it " in bed.run("(text) => tried(() => readSvg(text))", text)["refused"]
    assert bed.run("() => window.hacked") is None


@pytest.mark.parametrize(
    ("inner", "corners"),
    [
        ('<rect x="1" y="2" width="3" height="4"/>', [[1, -2], [4, -2], [4, -6], [1, -6]]),
        ('<polygon points="0,0 4,0 4,3"/>', [[0, 0], [4, 0], [4, -3]]),
        ('<polyline points="0 0 4 0 4 3 0 0"/>', [[0, 0], [4, 0], [4, -3]]),
        ('<path d="M0 0H4V3Z"/>', [[0, 0], [4, 0], [4, -3]]),
        ('<path transform="rotate(90)" d="M0 0 4 0 4 3z"/>', [[0, 0], [0, -4], [-3, -4]]),
    ],
)
def test_each_kind_of_shape_is_read(bed: Bed, inner: str, corners: list[list[float]]) -> None:
    text = f'<svg xmlns="http://www.w3.org/2000/svg" width="1cm" viewBox="0 0 10 10">{inner}</svg>'
    (shape,) = bed.run("(text) => readSvg(text)", text)
    assert np.array(shape["outlines"][0]) == pytest.approx(np.array(corners), abs=1e-5)


def test_curves_and_arcs_are_followed_closely(bed: Bed) -> None:
    """A rounded rectangle's and an ellipse's areas, an arc's radius and a cubic's places."""
    text = """<svg xmlns="http://www.w3.org/2000/svg" width="100mm" viewBox="0 0 100 100">
    <rect width="40" height="20" rx="5"/><ellipse cx="50" cy="50" rx="20" ry="10"/>
    <path d="M0 0C10 30 40 30 50 0Z"/></svg>"""
    shapes = bed.run("(text) => readSvg(text)", text)
    outlines = [np.array(shape["outlines"][0]) for shape in shapes]
    areas = [
        0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        for x, y in (outline.T for outline in outlines)
    ]
    assert areas[0] == pytest.approx(800 - (4 - np.pi) * 25, rel=2e-3)
    assert areas[1] == pytest.approx(200 * np.pi, rel=2e-3)
    t = np.linspace(0, 1, 20001)[:, None]
    cubic = 3 * t * (1 - t) ** 2 * [10, -30] + 3 * t**2 * (1 - t) * [40, -30] + t**3 * [50, 0]
    between = 0.5 * (outlines[2] + np.roll(outlines[2], -1, axis=0))[:-1]
    nearest = [np.min(np.hypot(*(cubic - place).T)) for place in between]
    assert max(nearest) < 0.021


MANY = '<svg xmlns="http://www.w3.org/2000/svg">' + '<path d="M0 0h1v1z"/>' * 401 + "</svg>"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<html/>", "no SVG"),
        ("<svg", "no SVG"),
        ('<svg xmlns="http://www.w3.org/2000/svg"/>', "no path"),
        ('<!DOCTYPE s [<!ENTITY a "b">]><svg xmlns="http://www.w3.org/2000/svg"/>', "entities"),
        (MANY, "400 shapes"),
        ('<svg xmlns="http://www.w3.org/2000/svg"><path id="p" d="M0 0 Lx y"/></svg>', "SVG asks"),
        ('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0L1e9 1L2 2z"/></svg>', "100 m"),
        ("x" * 2_000_001, "2 MB"),
    ],
)  # fmt: skip
def test_files_that_are_no_drawing_are_refused(bed: Bed, text: str, words: str) -> None:
    assert words in bed.run("(text) => tried(() => readSvg(text))", text)["refused"]


def test_a_saved_drawing_is_loaded_as_it_was(bed: Bed) -> None:
    given = drawn(
        layer(SHEET, holes=[box(30, -5, 40, 5)], name="a & b", toughness_ratio=0.5),
        layer(box(20, -5, 50, 5), 0.25, name="patch",
              regions=[{"toughness_ratio": 3.0, "outline": box(25, -2, 30, 2)}]),
        cut=1.5, edge_points=[[-4, -8], [40, -7], [75, -5]],
    )  # fmt: skip
    given["edge"] = bed.run("(points) => edgeThrough(points, 'arc')", given["edge_points"])
    text = bed.run("(given) => svgOf(given)", given)
    back = bed.run("(text) => drawnFromSvg(text, 1)", text)
    assert back.pop("isOurs")
    given["layers"][0]["name"] = "a  b"  # names of layers are plain, as a recipe takes them
    assert json.loads(json.dumps(back), parse_int=float) == json.loads(
        json.dumps(given), parse_int=float
    )


def recipe_of(bed: Bed, given: dict[str, Any], base: str | None = None) -> Any:
    return bed.run("(given) => tried(() => recipeText(given[0], scene, given[1]))", [given, base])


def test_a_recipe_of_the_scene_is_one_that_a_plan_takes(bed: Bed) -> None:
    text = recipe_of(bed, drawn())
    recipe = parse_recipe(text)
    assert recipe.rig.edge.offset_mm == pytest.approx(EDGE["offset_mm"], abs=1e-3)
    assert recipe.rig.edge.taper_deg == pytest.approx(EDGE["taper_deg"], abs=1e-3)
    assert recipe.rig.edge.length_mm == EDGE["length_mm"]
    assert recipe.material.thickness_mm == pytest.approx(THICKNESS_MM)
    assert recipe.scene.opening_deg == pytest.approx((12, 50))
    assert recipe.fit.cut.toughness_J_per_m2 is not None
    assert recipe.fit.cut.toughness_J_per_m2.median == pytest.approx(
        ENERGY_J_PER_M / (1e-3 * THICKNESS_MM)
    )


def test_layers_stand_in_the_recipe_and_are_read_back(bed: Bed) -> None:
    given = drawn(
        layer(SHEET, holes=[box(30, -5, 40, 5), box(50, -5, 60, 5)], name='the "sheet"'),
        layer(box(20, -5, 50, 5), 0.25, name="patch", toughness_ratio=0.7,
              regions=[{"toughness_ratio": 3.0, "outline": box(25, -2, 30, 2.125)}]),
        cut=-1.25,
    )  # fmt: skip
    text = recipe_of(bed, given)
    plate = tomllib.loads(text)["plate"]
    assert plate["cut_line_mm"] == -1.25
    assert [one["name"] for one in plate["layers"]] == ['the "sheet"', "patch"]
    assert plate["layers"][0]["outline_mm"] == SHEET
    assert plate["layers"][0]["holes_mm"] == [box(30, -5, 40, 5), box(50, -5, 60, 5)]
    assert plate["layers"][1]["regions"] == [
        {"toughness_ratio": 3.0, "outline_mm": box(25, -2, 30, 2.125)}
    ]
    back = bed.run("(text) => drawnFromRecipe(text)", text)
    given["layers"][0]["name"] = "the sheet"
    assert back["layers"] == given["layers"]
    assert back["cut_line_mm"] == -1.25


def test_a_recipe_that_was_loaded_keeps_all_but_the_drawing(bed: Bed) -> None:
    base = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    first = recipe_of(bed, drawn(layer(SHEET), cut=2.0), base)
    edge = {"family": "arc", "offset_mm": -7.5, "taper_deg": 1.25, "curvature_per_m": 0.5,
            "length_mm": 80.0}  # fmt: skip
    second = recipe_of(bed, drawn(layer(box(0, -3, 9, 3), 0.2), edge=edge), first)
    third = recipe_of(bed, drawn(), first)
    assert [line for line in base.splitlines() if line] == [
        line for line in first.splitlines() if line
    ][: len([line for line in base.splitlines() if line])]
    assert tomllib.loads(first)["plate"]["cut_line_mm"] == 2.0
    after = tomllib.loads(second)
    assert after["rig"]["edge"] == edge
    assert after["plate"]["cut_line_mm"] == 0
    assert [one["thickness_mm"] for one in after["plate"]["layers"]] == [0.2]
    known = tomllib.loads(base)
    del after["plate"], after["rig"]["edge"], known["rig"]["edge"]
    assert after == known
    assert "layers" not in tomllib.loads(third)["plate"]


@pytest.mark.parametrize(
    ("base", "words"),
    [
        ("format = ", "no recipe"),
        (
            "plate = { layers = [{ thickness_mm = 1, outline_mm = [[0, 0], [1, 0], [1, 1]] }] }",
            "inline",
        ),
    ],
)
def test_recipes_in_which_nothing_can_be_replaced_are_refused(
    bed: Bed, base: str, words: str
) -> None:
    assert words in recipe_of(bed, drawn(layer(SHEET), layer(SHEET)), base)["refused"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (drawn(layer([[0, 0], [10, 0], [20, 0]])), "no area"),
        (drawn(layer([[0.01 * i, (i % 2)] for i in range(1001)])), "1000 of one outline"),
        (drawn(*[layer([[i, -1], [i + 1, 2 * j], [i, 9]]) for i in range(9) for j in range(75)]),
         "holds 2000 corners"),
        (drawn(layer(SHEET, holes=[SHEET] * 65)), "64 holes"),
    ],
)  # fmt: skip
def test_what_a_recipe_does_not_hold_is_refused(
    bed: Bed, given: dict[str, Any], words: str
) -> None:
    assert words in recipe_of(bed, given)["refused"]


def test_an_edge_goes_through_drawn_points(bed: Bed) -> None:
    stations = np.array([0.0, 5.0, 8.0, 30.0, 55.0, 80.0])
    offsets = -6.0 + stations * np.tan(np.radians(1.5)) + 0.5e-3 * 0.8 * stations**2
    points = np.stack([stations, offsets], axis=1).tolist()
    edge = bed.run("(points) => edgeThrough(points, 'arc')", points)
    assert edge["offset_mm"] == pytest.approx(-6.0, abs=1e-3)
    assert edge["taper_deg"] == pytest.approx(1.5, abs=2e-3)
    assert edge["curvature_per_m"] == pytest.approx(0.8, abs=2e-3)
    assert edge["length_mm"] == 80.0
    table = bed.run("(edge) => { const t = edgeTable(edge, Float32Array.from([0, 0.05]));"
                    " return [[...t.x], [...t.y], [...t.slope]]; }", edge)  # fmt: skip
    s, offset, slope = np.array(table)
    assert (s[0], s[-1] > 0.08) == (0.0, True)
    assert offset == pytest.approx(-6e-3 + s * np.tan(np.radians(1.5)) + 0.4 * s**2, abs=2e-6)
    assert slope == pytest.approx(np.tan(np.radians(1.5)) + 0.8 * s, abs=1e-4)
    few = bed.run("() => tried(() => edgeThrough([[0, 1], [5, 1]], 'arc'))")
    assert "3 points" in few["refused"]


def test_the_sentences_of_the_page_use_no_markup_of_a_file(bed: Bed, tmp_path: Path) -> None:
    """Names out of a file are text, and stay within what a recipe takes."""
    text = SVG.replace('id="plate"', 'id="&lt;img src=x onerror=hacked=1&gt;"')
    (plate,) = bed.run("(text) => drawnFromSvg(text, 0.1)", text)["layers"]
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}", plate["name"])
