"""Blades through points: the page has the curve of the model, its table and its recipe."""

import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.kernel import Table
from scissorcal.model import Edge, edge_through
from scissorcal.package import hermite
from scissorcal.recipe import parse_recipe, recipe_path
from tests.model.golden_edges import golden
from tests.prototype.design_bed import Bed, open_bed
from tests.prototype.test_design import SHEET, box, drawn, layer, recipe_of

RANDOM = 120
OFFSET_M, SLOPE = 1e-9, 1e-6
CURVE = """([points, at]) => tried(() => { const c = splineThrough(points); return {
  pieces: c.weights_m.length - 3, misfit_m: c.misfit_m,
  offset_m: at.map((s) => splineValue(c, s)), slope: at.map((s) => splineSlope(c, s)) }; })"""
TABLE = """(points) => { const edge = edgeThrough(points, 'points');
  const t = edgeTable(edge, Float32Array.from([0, 0.1]));
  return { x: [...t.x], y: [...t.y], slope: [...t.slope] }; }"""
WAVE_MM = [[s, -8.0 + 0.03 * s + 0.3 * float(np.sin(s / 9.0))] for s in np.linspace(0, 75, 20)]


@pytest.fixture(scope="module")
def bed(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bed]:
    with open_bed(browser, tmp_path_factory.mktemp("edges")) as found:
        yield found


def curve(bed: Bed, points_m: Any, at_m: Any) -> Any:
    return bed.run(CURVE, [np.asarray(points_m).tolist(), np.asarray(at_m).tolist()])


@pytest.mark.parametrize("case", golden()["cases"], ids=lambda case: case["title"])
def test_the_page_has_the_golden_edges(bed: Bed, case: dict[str, Any]) -> None:
    found = curve(bed, case["points_m"], case["at_m"])
    assert found["pieces"] == case["pieces"]
    assert found["misfit_m"] <= 2e-5
    assert np.max(np.abs(np.subtract(found["offset_m"], case["offset_m"]))) < OFFSET_M
    assert np.max(np.abs(np.subtract(found["slope"], case["slope"]))) < SLOPE


@pytest.mark.parametrize("case", golden()["refused"], ids=lambda case: case["words"])
def test_the_page_refuses_what_the_model_refuses(bed: Bed, case: dict[str, Any]) -> None:
    assert case["words"] in curve(bed, case["points_m"], [])["refused"]
    with pytest.raises(ValueError, match=case["words"]) as refused:
        edge_through(case["points_m"])
    assert curve(bed, case["points_m"], [])["refused"] == str(refused.value)


def random_points(rng: np.random.Generator) -> Array:
    """Smooth and less smooth edges, even and clustered stations, some from before the pivot."""
    count = int(rng.integers(3, 201)) if rng.uniform() < 0.7 else int(rng.integers(3, 9))
    length = rng.uniform(0.02, 0.3)
    inner = rng.beta(rng.uniform(0.5, 3), rng.uniform(0.5, 3), count - 2)
    begin = -0.1 * length if rng.uniform() < 0.3 else 0.0
    station = np.unique(np.concatenate([[0.0], inner, [1.0]])) * (length - begin) + begin
    wave = rng.uniform(0, 1e-3) * np.sin(2 * np.pi * rng.uniform(0.3, 6) * station / length)
    offset = -0.008 + rng.uniform(-0.1, 0.3) * station + rng.uniform(-2, 2) * station**2 + wave
    return np.stack([station, offset + rng.normal(0, rng.choice([0, 5e-6]), len(station))], axis=1)


def test_random_points_have_the_same_curve_or_the_same_refusal(bed: Bed) -> None:
    rng = np.random.default_rng(19)
    sentences, many = [], 0
    for _ in range(RANDOM):
        points = random_points(rng)
        at = np.linspace(points[0, 0] - 0.01, points[-1, 0] + 0.01, 97)
        found = curve(bed, points, at)
        try:
            wanted, misfit = edge_through(points)
        except ValueError as error:
            sentences.append((found.get("refused"), str(error)))
            continue
        assert "refused" not in found, found
        assert found["pieces"] == len(wanted.spline_m) - 3
        assert found["misfit_m"] == pytest.approx(misfit, abs=OFFSET_M)
        assert np.max(np.abs(found["offset_m"] - wanted.offset_at(at))) < OFFSET_M
        assert np.max(np.abs(found["slope"] - wanted.slope_at(at))) < SLOPE
        many += found["pieces"] > 4
    assert len(sentences) > RANDOM / 20
    assert all(found == wanted for found, wanted in sentences), sentences
    assert many > RANDOM / 10


@pytest.mark.parametrize("case", golden()["cases"], ids=lambda case: case["title"])
def test_the_table_of_the_kernel_is_the_curve(bed: Bed, case: dict[str, Any]) -> None:
    """Its knots are the curve's, so what is left is the rounding to float32: far below 10 um."""
    points_mm = (1e3 * np.array(case["points_m"])).tolist()
    table = bed.run(TABLE, points_mm)
    rows = Table(*(np.array(table[name]) for name in ("x", "y", "slope")))
    assert len(rows.x) == case["pieces"] + 1
    edge, _ = edge_through(case["points_m"])
    at = np.linspace(case["points_m"][0][0], case["points_m"][-1][0], 3001)
    away = hermite(rows.x, rows.y, rows.slope, at) - edge.offset_at(at)
    assert np.max(np.abs(away)) < 1e-8


def test_a_recipe_keeps_every_digit_of_the_points(bed: Bed) -> None:
    points = [[0.0, -8.0], [12.345678901234, -7.123456789], [40.1, -6.3], [75.0, -4.000000001]]
    given = bed.run("(points) => edgeThrough(points, 'points')", points)
    text = recipe_of(bed, drawn(edge=given, edge_points=points))
    stated = tomllib.loads(text)["rig"]["edge"]
    assert stated == {"family": "points", "points_mm": points}
    back = bed.run("(text) => drawnFromRecipe(text)", text)
    assert back["edge"]["points_mm"] == points
    again = recipe_of(bed, back, text)
    assert tomllib.loads(again)["rig"]["edge"] == stated
    edge = parse_recipe(again).rig.edge
    assert edge.points_mm == tuple(tuple(point) for point in points)
    assert edge.length_m == 0.075


def test_recipe_and_page_refuse_the_same_points_by_the_same_sentence(bed: Bed) -> None:
    base = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    head, tail = base.split("[rig.edge]")
    tail = tail.partition("\n\n")[2]
    for case in golden()["refused"]:
        points_mm = (1e3 * np.array(case["points_m"])).tolist()
        stated = f'{head}[rig.edge]\nfamily = "points"\npoints_mm = {points_mm}\n\n{tail}'
        found = bed.run("(text) => tried(() => drawnFromRecipe(text))", stated)["refused"]
        assert found.startswith("rig.edge.points_mm cannot be an edge: ")
        with pytest.raises(InputError) as refused:
            parse_recipe(stated)
        assert found.removeprefix("rig.edge.").rstrip(".") in str(refused.value)


def test_what_a_recipe_says_besides_the_shape_stays(bed: Bed) -> None:
    base = recipe_path("paper-80gsm").read_text(encoding="utf-8")
    before = base.replace(
        "[rig.edge]", '[rig.edge]\nsource = "photographs"\noffset_sd_mm = 0.25', 1
    )
    given = bed.run("(points) => edgeThrough(points, 'points')", WAVE_MM)
    after = recipe_of(bed, drawn(layer(SHEET), edge=given, edge_points=WAVE_MM), before)
    stated = tomllib.loads(after)["rig"]["edge"]
    assert stated == {
        "family": "points",
        "points_mm": WAVE_MM,
        "source": "photographs",
        "offset_sd_mm": 0.25,
    }
    plain = drawn(layer(box(0, -3, 9, 3)), edge={
        "family": "line", "offset_mm": -7.5, "taper_deg": 1.2345678, "curvature_per_m": 0,
        "length_mm": 80}, edge_points=[])  # fmt: skip
    back = tomllib.loads(recipe_of(bed, plain, after))["rig"]["edge"]
    assert back == {"family": "line", "offset_mm": -7.5, "taper_deg": 1.2345678, "length_mm": 80,
                    "source": "photographs", "offset_sd_mm": 0.25}  # fmt: skip


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ('family = "spline"\nlength_mm = 70', 'one of "line", "arc", "points"'),
        ("family = 3", "one of"),
        ('family = "points"\npoints_mm = [[0, 0], [70, 0]]', "3 to 200"),
        ('family = "points"\npoints_mm = [[0, 0], [30, 1, 2], [70, 0]]', "not [x, y]"),
        ('family = "points"\npoints_mm = [[0, -8], [30, "a"], [70, 0]]', "must be a number"),
        ('family = "points"\nlength_mm = 70\npoints_mm = [[0, 0], [30, 1], [70, 0]]', "length_mm"),
        ('family = "points"\npoints_mm = [[0, 0], [30, 1], [1070, 0]]', "within 1000 mm"),
        ("offset_mm = -8\ntaper_deg = 1\nlength_mm = 70\npoints_mm = []", "needs family"),
        ("offset_mm = -8\ntaper_deg = 1\nlength_mm = 7\ncurvature_per_m = 1", 'family = "arc"'),
        ('family = "arc"\noffset_mm = -8\ntaper_deg = 1', "length_mm"),
    ],
)  # fmt: skip
def test_edges_that_the_page_does_not_know_are_refused(bed: Bed, stated: str, words: str) -> None:
    text = f"[rig.edge]\n{stated}\n"
    assert words in bed.run("(text) => tried(() => drawnFromRecipe(text))", text)["refused"]


def test_a_saved_drawing_keeps_the_curve(bed: Bed) -> None:
    points = [[round(s, 4), round(e, 4)] for s, e in WAVE_MM]
    given = drawn(layer(SHEET), cut=1.5, edge_points=points)
    given["edge"] = bed.run("(points) => edgeThrough(points, 'points')", points)
    back = bed.run("(given) => drawnFromSvg(svgOf(given), 1)", given)
    assert back["edge"] == given["edge"]
    assert back["edge_points"] == points
    text = bed.run("(given) => svgOf(given)", given)
    other = text.replace('data-family="points"', 'data-family="cubic"')
    assert "cubic" in bed.run("(text) => tried(() => drawnFromSvg(text, 1))", other)["refused"]


def test_the_plainest_family_that_follows_the_points_is_begun_with(bed: Bed) -> None:
    stations = np.linspace(0, 75, 12)
    shapes = {"line": 0.0, "arc": 0.004 * stations**2, "points": 0.3 * np.sin(stations / 9)}
    for family, shape in shapes.items():
        points = np.stack([stations, -8 + 0.03 * stations + shape], axis=1).tolist()
        assert bed.run("(points) => nearestFamily(points)", points) == family


def test_the_blades_as_fitted_are_read_from_their_table(bed: Bed) -> None:
    """A table of a curve that is no parabola becomes points within 0.02 mm of it."""
    edge, _ = edge_through(1e-3 * np.array(WAVE_MM))
    knots = np.linspace(0.0, 0.08, 60)
    rows = [knots.tolist(), edge.offset_at(knots).tolist(), edge.slope_at(knots).tolist()]
    script = """(rows) => {
      const [x, y, slope] = rows.map((row) => Float32Array.from(row));
      return edgeOfTable({ x, y, slope }, 0.075); }"""
    found = bed.run(script, rows)
    assert found["family"] == "points"
    assert 12 <= len(found["points_mm"]) <= 20
    again: Edge = edge_through(1e-3 * np.array(found["points_mm"]))[0]
    at = np.linspace(0, 0.075, 500)
    assert np.max(np.abs(again.offset_at(at) - edge.offset_at(at))) < 2e-5


def svg_edge(bed: Bed, inner: str) -> Any:
    head = 'xmlns="http://www.w3.org/2000/svg" width="90mm" height="40mm" viewBox="0 0 90 40"'
    return bed.run("(text) => tried(() => edgeIn('b.svg', readSvg(text)))",
                   f"<svg {head}>{inner}</svg>")  # fmt: skip


def test_an_open_line_is_the_edge_as_it_is_drawn(bed: Bed) -> None:
    """Also one whose chord lies lower, and one that is drawn from the tip."""
    wanted = [[0, -8], [20, -6], [50, -5], [75, -5.5]]
    ways = " L".join(f"{s} {-e}" for s, e in wanted)
    back = " L".join(f"{s} {-e}" for s, e in wanted[::-1])
    for path in (ways, back):
        assert svg_edge(bed, f'<path d="M{path}"/>')["points"] == wanted


def test_the_lower_side_of_a_closed_outline_is_the_edge(bed: Bed) -> None:
    """Heel and tip are left out, whichever way round it is drawn and wherever it begins.

    Its points lie on the sides, no farther apart than 1.5 mm, the corners among them.
    """
    edge = [[0, -8], [30, -7], [60, -5], [75, -4.5]]
    corners = [[-12, -2], [-12, -9], [0, -8], [30, -7], [60, -5], [75, -4.5], [75, -1], [30, 6]]
    for turn in (0, 3, 6):
        for way in (1, -1):
            points = (corners[turn:] + corners[:turn])[::way]
            path = " L".join(f"{10 + s} {20 - e}" for s, e in points)
            inner = f'<circle id="pivot" cx="10" cy="20" r="2"/><path d="M{path}z"/>'
            found = svg_edge(bed, inner)
            assert all(corner in found["points"] for corner in edge)
            station, offset = np.array(found["points"]).T
            assert np.all((np.diff(station) > 0.0) & (np.diff(station) <= 1.5))
            np.testing.assert_allclose(offset, np.interp(station, *np.array(edge).T), atol=6e-5)
            assert 'shape "pivot"' in found["sentence"]


def test_a_blade_of_many_points_is_thinned_and_says_what_that_costs(bed: Bed) -> None:
    s = np.linspace(-4, 75, 400)
    low = -8 + 0.03 * s + 0.3 * np.sin(s / 9)
    path = " L".join(f"{10 + x} {12 - y}" for x, y in zip(s, low, strict=True))
    pivot = '<rect id="pivot" x="9" y="11" width="2" height="2"/>'
    found = svg_edge(bed, f'{pivot}<path d="M{path} L85 9 C40 0 20 0 6 9z"/>')
    assert len(found["points"]) == 199
    assert "of 380 from 0 to 75 mm; the curve through them leaves those left" in found["sentence"]
    edge, _ = edge_through(1e-3 * np.array(found["points"]))
    away = 1e3 * edge.offset_at(1e-3 * s) - low
    assert np.max(np.abs(away[s > 0])) < 0.021


@pytest.mark.parametrize(
    ("inner", "words"),
    [
        ('<path d="M5 3V20"/>', "no line or outline"),
        (
            '<circle id="pivot" cx="80" cy="3" r="2"/><path d="M0 3H40V9H0z"/>',
            "in front of the pivot",
        ),
    ],
)  # fmt: skip
def test_files_without_an_edge_are_refused(bed: Bed, inner: str, words: str) -> None:
    assert words in svg_edge(bed, inner)["refused"]
