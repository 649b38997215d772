"""The table plate.surface of a recipe, and the file of probed points that it names."""

import math

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.model import Cylinder, HeightField, Plane, Sphere
from scissorcal.recipe.library import recipe_path
from scissorcal.recipe.load import parse_recipe
from scissorcal.recipe.plate_surface import PlateSurface, plate_surface, probed_surface

RECIPE = recipe_path("paper-80gsm").read_text(encoding="utf-8")


def with_surface(*lines):
    return parse_recipe("\n".join([RECIPE, "[plate.surface]", *lines]), "recipe.toml")


def written(path, rows, head="x_mm,y_mm,z_mm"):
    path.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    return path


def dome_rows(radius_mm=60.0, noise_mm=0.01):
    rng = np.random.default_rng(0)
    places = [(2.0 * i, 2.0 * j) for i in range(12) for j in range(-6, 7)]
    return [
        f"{x},{y},{math.sqrt(radius_mm**2 - x**2 - y**2) - radius_mm + noise_mm * error:.5f}"
        for (x, y), error in zip(places, rng.standard_normal(len(places)), strict=True)
    ]


def test_a_recipe_without_the_table_has_a_plane(tmp_path):
    recipe = parse_recipe(RECIPE)
    assert plate_surface(recipe.plate.surface, tmp_path) == Plane()


@pytest.mark.parametrize(
    ("lines", "surface"),
    [
        (['kind = "plane"'], Plane()),
        (['kind = "sphere"', "radius_mm = -40.0"], Sphere(-0.04)),
        (
            ['kind = "cylinder"', "radius_mm = 40.0", "axis_deg = 30.0"],
            Cylinder(0.04, math.radians(30.0)),
        ),
    ],
)
def test_radius_and_angle_are_those_of_the_recipe(lines, surface, tmp_path):
    found = plate_surface(with_surface(*lines).plate.surface, tmp_path)
    assert type(found) is type(surface)
    np.testing.assert_allclose(found.hessian(np.zeros(3)), surface.hessian(np.zeros(3)))


MISTAKES = {
    'kind = "cone"': 'plate.surface.kind: "cone" is not allowed here; allowed: "plane", "cylinder"',
    'kind = "cylinder"': 'kind = "cylinder" needs radius_mm, such as radius_mm = 50.',
    'kind = "sphere"\nradius_mm = 0.0': "radius_mm = 0 must be at least 2, or at most -2",
    'kind = "sphere"\nradius_mm = -1.9': "radius_mm = -1.9 must be at least 2, or at most -2",
    'kind = "sphere"\nradius_mm = nan': "nan is not a finite number",
    'kind = "sphere"\nradius_mm = 1e7': "must be at most 1e+06",
    'kind = "sphere"\nradius_m = 0.05': "1 m = 1000 mm, so write radius_mm = 50",
    'kind = "sphere"\nradius_mm = 40\naxis_deg = 5': 'axis_deg needs kind = "cylinder"; here kind',
    "radius_mm = 40": 'radius_mm needs kind = "cylinder" or "sphere"; here kind = "plane"',
    'kind = "spline"': 'kind = "spline" needs file, the probed points',
    'kind = "sphere"\nradius_mm = 9\nfile = "a.csv"': 'file needs kind = "spline"; here kind',
    'kind = "spline"\nfile = "a.csv"\nprobe_sd_mm = 0': "0 must be at least 0.0001",
}


@pytest.mark.parametrize("lines", MISTAKES)
def test_a_mistake_in_the_recipe_is_a_sentence_with_its_line(lines):
    with pytest.raises(InputError, match=r"^recipe\.toml, line \d+, plate\.surface\.") as refused:
        with_surface(lines)
    assert MISTAKES[lines] in str(refused.value)


def test_probed_points_become_a_height_field(tmp_path):
    written(tmp_path / "heights.csv", dome_rows())
    recipe = with_surface('kind = "spline"', 'file = "heights.csv"', "probe_sd_mm = 0.01")
    surface = plate_surface(recipe.plate.surface, tmp_path)
    assert isinstance(surface, HeightField)
    p = [[0.01, 0.004, 0.003], [0.02, -0.008, 0.0]]
    found, exact = surface.nearest_points(p), Sphere(0.06).nearest_points(p)
    np.testing.assert_allclose(found.distance, exact.distance, atol=1e-5)


def test_columns_may_stand_in_any_order_and_lines_be_empty(tmp_path):
    rows = dome_rows()
    one = probed_surface(written(tmp_path / "a.csv", rows), 0.01)
    turned = [",".join(reversed(row.split(","))) for row in rows]
    other = written(tmp_path / "b.csv", ["", *turned, ""], "z_mm, y_mm, x_mm")
    np.testing.assert_array_equal(
        probed_surface(other, 0.01).surface.weights_m, one.surface.weights_m
    )


def changed(row, text):
    rows = dome_rows()
    rows[row] = text
    return rows


FILES = {
    "head": (["1,2,3"], "x,y,z", "line 1: the columns must be x_mm,y_mm,z_mm"),
    "empty": ([], "", "line 1: the columns must be x_mm,y_mm,z_mm"),
    "few": ([], "x_mm,y_mm,z_mm", "There are 0 probed points, but a height field needs 25"),
    "text": (changed(4, "8,-12,high"), None, "line 6: '8,-12,high' is no probed point"),
    "nan": (changed(4, "8,-12,nan"), None, "line 6: '8,-12,nan' is no probed point"),
    "short": (changed(4, "8,-12"), None, "line 6: '8,-12' is no probed point"),
    "long": (changed(4, "8,-12,0,1"), None, "line 6: '8,-12,0,1' is no probed point"),
    "wrong": (changed(70, "10,-2,0.5"), None, "Line 72, (10, -2) mm: the probed point is 1.0"),
    "repeated": ([*dome_rows(), dome_rows()[9]], None, "Line 11 and line 158 are 0 mm apart"),
}


@pytest.mark.parametrize("case", FILES)
def test_a_mistake_in_the_file_is_a_sentence_with_its_line(case, tmp_path):
    rows, head, reason = FILES[case]
    path = written(tmp_path / "heights.csv", rows, "x_mm,y_mm,z_mm" if head is None else head)
    with pytest.raises(InputError) as refused:
        probed_surface(path, 0.01)
    assert str(refused.value).startswith(str(path))
    assert reason in str(refused.value)


def test_a_missing_file_a_folder_and_bytes_that_are_no_text(tmp_path):
    settings = PlateSurface(kind="spline", file="heights.csv")
    with pytest.raises(InputError, match=r"does not exist: plate\.surface\.file in the recipe"):
        plate_surface(settings, tmp_path)
    (tmp_path / "heights.csv").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        plate_surface(settings, tmp_path)
    (tmp_path / "heights.csv").rmdir()
    (tmp_path / "heights.csv").write_bytes(b"\x80\x00x")
    with pytest.raises(InputError, match="byte 0: this is not UTF-8"):
        plate_surface(settings, tmp_path)
    (tmp_path / "heights.csv").write_bytes(b"1" * 5_000_001)
    with pytest.raises(InputError, match="more than 5 MB"):
        plate_surface(settings, tmp_path)
