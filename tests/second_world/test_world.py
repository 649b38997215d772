"""The second world is what it says: independent, of the stated sizes, on the filter's surfaces."""

import ast
import inspect
from pathlib import Path

import numpy as np
import pytest
from benchmarks.control import world as first_world
from scipy.spatial.transform import Rotation

from scissorcal.model import Cylinder, Plane, Sphere, Surface

from . import SHAPES, Scene, draw_world
from .motion import SPEED_M_PER_S, SPIN_RAD_PER_S, moved
from .touch import touches

SURFACES: dict[str, Surface] = {
    "plane": Plane(),
    "cylinder 30 mm": Cylinder(30e-3),
    "sphere 30 mm": Sphere(30e-3),
}
ALIASES = "scissorcal.aliases"
"""Names of types, without code."""
OUTSIDE = {"numpy", "scipy", "cv2", "math", "dataclasses", "collections", ALIASES}


def imported(path: Path) -> set[str]:
    """The packages that a file imports anywhere, those of its own folder as "."."""
    packages = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            packages |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            package = module if module == ALIASES else module.split(".")[0]
            packages.add("." if node.level else package)
    return packages


def test_the_worlds_share_nothing_with_the_tracker_and_each_other():
    here = Path(__file__).parent
    files = [path for path in here.glob("*.py") if not path.name.startswith("test_")]
    assert len(files) == 6
    for path in files:
        assert imported(path) <= OUTSIDE | {"."}, path.name
    assert imported(Path(inspect.getfile(first_world))) <= OUTSIDE


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_lies_on_the_filters_surface(name: str):
    arcs = np.random.default_rng(3).uniform(-10e-3, 10e-3, (100, 2))
    points, normals, axes = SHAPES[name].walk(arcs)
    assert np.abs(SURFACES[name].level(points)).max() < 1e-15
    assert np.abs(SURFACES[name].gradient(points) - normals).max() < 1e-12
    assert np.abs(axes @ axes.swapaxes(1, 2) - np.eye(3)).max() < 1e-12
    step = 1e-7
    along = (SHAPES[name].walk(arcs + np.array([step, 0.0]))[0] - points) / step
    assert np.abs(np.sum(along * normals, axis=1)).max() < 1e-5


@pytest.mark.parametrize("kind", ["springs", "hand"])
def test_a_moving_plate_has_the_stated_speeds(kind: str):
    """Rms over 12 draws of 20 s: 72 axes, whose mean scatters by some 4 %; 15 % are allowed."""
    times, speeds, spins = np.arange(0.0, 20.0, 5e-3), [], []
    for seed in range(12):
        rotation, place = moved(kind, 20.0, np.random.default_rng([1, seed]))(times)
        speeds.append(np.diff(place, axis=0) / 5e-3)
        turn = Rotation.from_matrix(rotation)
        spins.append((turn[1:] * turn[:-1].inv()).as_rotvec() / 5e-3)
    assert np.sqrt(np.mean(np.square(speeds))) == pytest.approx(SPEED_M_PER_S, rel=0.15)
    assert np.sqrt(np.mean(np.square(spins))) == pytest.approx(SPIN_RAD_PER_S, rel=0.15)


def test_a_pictures_covariance_is_that_of_its_errors():
    """Less what 6 cameras are off by: 1400 errors of 6 numbers, mean square within 10 % of 6.

    They are not normal, so the mean scatters by some 3 %.
    """
    squares = []
    for seed in range(6):
        world = draw_world(Scene(), SHAPES["plane"], np.random.default_rng([2, seed]))
        (axes,), (place,) = world.motion(np.zeros(1))
        true = Rotation.from_matrix(axes)
        errors = np.array(
            [
                [
                    *(true * Rotation.from_matrix(picture.rotation).inv()).as_rotvec(),
                    *(place - picture.place_m),
                ]
                for picture in world.pictures
            ]
        )
        errors -= errors.mean(axis=0)
        squares += [
            error @ np.linalg.solve(picture.covariance, error)
            for error, picture in zip(errors, world.pictures, strict=True)
        ]
        assert all(picture.certain and not picture.mirrored for picture in world.pictures)
    assert np.mean(squares) == pytest.approx(6.0, rel=0.1)


def test_a_flat_view_has_mirrored_poses_that_are_not_made_up():
    pictures = [
        picture
        for seed in range(6)
        for picture in draw_world(
            Scene(flat=True), SHAPES["plane"], np.random.default_rng([4, seed])
        ).pictures
    ]
    mirrored = np.mean([picture.mirrored for picture in pictures])
    doubted = np.mean([not picture.certain for picture in pictures])
    assert 0.005 < mirrored < 0.2
    assert doubted > 2.0 * mirrored


def test_a_tip_sticks_slips_lifts_and_errs_by_the_stated_sizes():
    motion = moved("clamped", 20.0, np.random.default_rng(5))
    normal_off = []
    for seed in range(20):
        rows = touches(motion, SHAPES["plane"], 20.0, 0.0, np.random.default_rng([6, seed]))
        (axes,), (place,) = motion(np.zeros(1))
        height = (rows.point_m - place) @ axes[:, 2]
        pressed = rows.pressed_N > 1.0
        assert 0.05 < np.mean(rows.pressed_N == 0.0) < 0.3
        assert np.mean(np.abs(rows.force_N - rows.pressed_N)) < 0.2
        assert np.all(np.diff(rows.stamp_s) > 0.0)
        assert np.all((rows.true_s >= rows.stamp_s) & (rows.true_s < rows.stamp_s + 5e-3))
        # The face gives way by some 0.1 mm per N, so the tip stands below it by that.
        slope = np.polyfit(rows.force_N[pressed], height[pressed], 1)[0]
        assert -2e-4 < slope < -0.2e-4
        normal_off.append(np.mean(height[pressed] + 1e-4 * rows.pressed_N[pressed]))
    assert 0.03e-3 < np.std(normal_off) < 0.2e-3
