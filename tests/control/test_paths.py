"""A path's file, and the path laid on a surface and timed."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from scissorcal.control.path_file import SurfacePoints, read_path
from scissorcal.control.surface_path import (
    ACCELERATION_M_PER_S2,
    FASTEST_M_PER_S,
    map_contour,
    time_path,
)
from scissorcal.errors import InputError
from scissorcal.model import Cylinder, HeightField, Plane, Surface
from scissorcal.tracking import PlatePose, level_plate
from tests.control.virtual import points

POSE = PlatePose(0.0, *level_plate((20.0, 10.0, 0.0)), np.zeros((6, 6)))
TICK_S = 1e-3


def write(folder: Path, text: str) -> Path:
    path = folder / "path.csv"
    path.write_text(text)
    return path


def test_a_path_is_read_with_its_lines(tmp_path: Path) -> None:
    text = "x_mm, force_N ,speed_mm_per_s\n10,2.0,5\n\n20,3.5,10\n"
    read = read_path(write(tmp_path, text))
    assert read.x.tolist() == [0.01, 0.02]
    assert read.force.tolist() == [2.0, 3.5]
    assert read.speed.tolist() == [0.005, 0.01]
    assert np.isnan(read.y).all()
    assert read.lines.tolist() == [2, 4]
    open_ = read_path(write(tmp_path, "x_mm,y_mm\n1,0\n2,0\n")).stated(1.5, 0.02)
    assert open_.force.tolist() == [1.5, 1.5]
    assert open_.speed.tolist() == [0.02, 0.02]
    assert open_.y.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x_mm\n1\nnan\n", "line 3: x_mm is 'nan'"),
        ("x_mm\n1\ninf\n", "line 3: x_mm is 'inf'"),
        ("x_mm,y_mm\n1,0\n2,here\n", "line 3: y_mm is 'here'"),
        ("x_mm,y_mm\n1,0\n2\n", "line 3: 1 numbers where line 1 names 2 columns"),
        ("x_mm,force_N\n1,2\n2,0\n", "line 3: force_N = 0 must be above 0"),
        ("x_mm,speed_mm_per_s\n1,2\n2,-3\n", "line 3: speed_mm_per_s = -3 must be above 0"),
        ("x_mm\n1\n1e9\n", "line 3: no plate is larger"),
        ("x,y\n1,2\n", "line 1: the columns must be x_mm"),
        ("y_mm\n1\n2\n", "line 1: the columns must be x_mm"),
        ("x_mm,x_mm\n1,2\n", "line 1"),
        ("", "is empty"),
        ("x_mm\n1\n", "has 1 points"),
        ('x_mm\n"1\n2\n', "line 2: x_mm is"),
        (f"x_mm\n1\n{'2' * 200_000}\n", "line 3: no number has so many characters"),
    ],
)
def test_a_wrong_path_is_refused_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_path(write(tmp_path, text))
    assert "path.csv" in str(caught.value)


def test_a_path_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_path(tmp_path / "none.csv")
    with pytest.raises(InputError, match="cannot be read"):
        read_path(tmp_path)
    (tmp_path / "path.csv").write_bytes(b"x_mm\n\xff\xfe\n")
    with pytest.raises(InputError, match="byte 5: this is not UTF-8"):
        read_path(tmp_path / "path.csv")


def test_places_count_along_the_surface() -> None:
    """On a circle about the apex the place is the arc's length."""
    radius = 0.05
    surface = Cylinder(radius, math.pi / 2)
    contour = map_contour(points(0.0, 20.0), surface, POSE, 0.1)
    at = np.interp([0.0, 0.02], contour.x, contour.place)
    assert at[1] - at[0] == pytest.approx(radius * math.asin(0.02 / radius), abs=2e-6)
    foot = contour.feet[len(contour.feet) // 2]
    assert contour.place_of(foot) == pytest.approx(contour.place[len(contour.feet) // 2], abs=1e-9)


@settings(max_examples=40)
@given(
    x=st.lists(st.integers(0, 80), min_size=2, max_size=8).filter(lambda x: len(set(x)) > 1),
    speed=st.floats(1.0, 90.0),
)
@example(x=[55, 16, 16], speed=11.0)
def test_a_timed_path_passes_every_point_at_its_speed(x: list[int], speed: float) -> None:
    path = points(*map(float, x), speed=speed)
    contour = map_contour(path, Plane(), POSE, 0.1)
    timed = time_path(path, contour, TICK_S)
    wanted = np.interp(path.x, contour.x, contour.place)
    assert timed.place[0] == pytest.approx(wanted[0], abs=1e-9)
    assert timed.place[-1] == pytest.approx(wanted[-1], abs=1e-9)
    for place in wanted:
        assert np.abs(timed.place - place).min() < 2e-3 * speed * TICK_S + 1e-6
    assert np.abs(timed.rate).max() <= 1e-3 * speed * (1 + 1e-6)
    assert np.abs(np.diff(timed.rate)).max() / TICK_S <= 2.1 * max(
        ACCELERATION_M_PER_S2, 1e-3 * speed / 0.15
    )
    assert timed.rate[0] == timed.rate[-1] == 0.0
    assert np.cumsum(timed.rate)[-1] * TICK_S == pytest.approx(
        timed.place[-1] - timed.place[0], abs=1e-6
    )
    assert (np.diff(timed.stage) >= 0).all()
    assert timed.stage[-1] == len(x) - 1


def test_force_changes_along_the_way_between_points() -> None:
    path = points(10.0, 20.0, 30.0)
    path = SurfacePoints(path.x, path.y, np.array((1.0, 3.0, 2.0)), path.speed, path.lines, "p")
    timed = time_path(path, map_contour(path, Plane(), POSE, 0.1), TICK_S)
    middle = np.argmin(np.abs(timed.place - timed.place[0] - 5e-3))
    assert timed.force[0] == 1.0
    assert timed.force[middle] == pytest.approx(2.0, abs=0.01)
    assert timed.force.max() == pytest.approx(3.0, abs=0.01)
    assert timed.force[-1] == 2.0


def test_a_force_along_the_normal_is_less_of_one_in_the_blades_plane() -> None:
    leaned = level_plate((20.0, 10.0, 0.0))[0] @ np.array(
        [[1, 0, 0], [0, math.cos(0.4), -math.sin(0.4)], [0, math.sin(0.4), math.cos(0.4)]]
    )
    pose = PlatePose(0.0, leaned, POSE.translation, POSE.covariance)
    path = points(10.0, 20.0)
    timed = time_path(path, map_contour(path, Plane(), pose, 0.1), TICK_S)
    assert timed.force[0] == pytest.approx(2.0 * math.cos(0.4))


def bump() -> HeightField:
    """A field with a ridge across the path: steep sides within a millimetre."""
    weights = np.zeros((43, 6))
    weights[20:23] = 8e-4
    return HeightField((0.0, 0.02), (-0.02, 0.02), weights)


@pytest.mark.parametrize(
    ("path", "surface", "words"),
    [
        (points(-1.0, 20.0), Plane(), "line 2: x = -1 mm is beyond the plate"),
        (points(10.0, 101.0), Plane(), "line 3: x = 101 mm is beyond the plate"),
        (points(1.0, 60.0), Cylinder(0.05, math.pi / 2), "line 3: x = 60 mm leaves the surface"),
        (points(2.0, 30.0), bump(), "line 3: x = 30 mm leaves the surface"),
        (points(2.0, 18.0), bump(), "has a kink near x = "),
        (points(10.0, 10.0), Plane(), "all points are one"),
        (points(10.0, 90.0, speed=0.01), Plane(), "longer than an hour"),
        (points(10.0, 90.0, speed=1e3 * FASTEST_M_PER_S + 1), Plane(), "line 2: 101 mm/s"),
    ],
)
def test_a_path_that_cannot_be_followed_is_refused(
    path: SurfacePoints, surface: Surface, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        time_path(path, map_contour(path, surface, POSE, 0.1), TICK_S)


def test_a_point_beside_the_blades_is_refused() -> None:
    path = points(10.0, 20.0)
    beside = SurfacePoints(
        path.x, np.array((0.0, 3e-3)), path.force, path.speed, path.lines, path.source
    )
    with pytest.raises(InputError, match="line 3: y = 3 mm lies beside the blades' plane"):
        map_contour(beside, Plane(), POSE, 0.1)
    near = SurfacePoints(
        path.x, np.array((0.0, 0.5e-3)), path.force, path.speed, path.lines, path.source
    )
    assert len(map_contour(near, Plane(), POSE, 0.1).x) > 10
