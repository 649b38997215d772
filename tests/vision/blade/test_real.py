"""Real photographs of scissors and forks, and a drawn pair whose curves are known exactly."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from scissorcal.errors import InputError
from scissorcal.recipe import BladePriors
from scissorcal.vision.blade.photo import BladeLayout, photograph_scissors
from scissorcal.vision.blade.profile import crossings, sampled, steepest
from scissorcal.vision.blade.silhouette import silhouette
from scissorcal.vision.blade.view import PlainView
from scissorcal.vision.photo import read_photo
from scissorcal.vision.sim.optics import Looks, coverage, develop
from scissorcal.vision.targets.sides import linear_light

DATA = Path(__file__).parents[4] / "shared" / "data"
PHOTOS = DATA / "scissors_photos"
DRAWN = DATA / "svg_scissors" / "fontawesome_scissors.svg"

needs_photos = pytest.mark.skipif(not PHOTOS.is_dir(), reason=f"{PHOTOS} is not there")
needs_drawing = pytest.mark.skipif(not DRAWN.is_file(), reason=f"{DRAWN} is not there")

SCREWS = {
    1: (450, 327),
    5: (448, 273),
    8: (392, 282),
    10: (378, 293),
    12: (408, 322),
    15: (444, 327),
}
"""Middles of the screws, read off the photographs by eye, to about 2 pixels."""

CLOSED = (1, 5)
OPEN_DEG = {8: 53.0, 10: 53.0, 12: 82.0, 15: 36.0}
"""Angles between the blades' middles, by eye, to about 3 degrees."""


@pytest.fixture(scope="module")
def found():
    return {
        number: photograph_scissors(
            read_photo(PHOTOS / f"scissors_{number}.jpg"), layout=BladeLayout(mat=False)
        )
        for number in SCREWS
    }


@needs_photos
@pytest.mark.parametrize("number", SCREWS)
def test_the_pivot_is_the_screw(found, number):
    scissors = found[number].scissors
    assert scissors.screw
    assert np.linalg.norm(scissors.pivot - SCREWS[number]) < 4.0
    assert len(scissors.rings) >= 1


@needs_photos
@pytest.mark.parametrize("number", SCREWS)
def test_blades_and_opening(found, number):
    one = found[number]
    if number in CLOSED:
        assert one.measured == ()
        assert one.scissors.opening == 0.0
        return
    assert len(one.measured) == 2
    assert np.degrees(one.scissors.opening) == pytest.approx(OPEN_DEG[number], abs=3.0)
    for measured in one.measured:
        assert not measured.metric
        assert len(measured.station) > 60
        # one edge curves up to its tip, which lies on the centreline
        assert np.median(measured.offset) < 0.0


@needs_photos
def test_two_photographs_of_one_pair_agree_to_a_hundredth_of_its_length(found):
    """By similarity: lengths from pivot to tip are made one, and nothing else is moved."""
    for one, other in zip(found[8].measured, found[10].measured, strict=True):
        s = np.linspace(0.4, 0.93, 60)
        curves = [np.interp(s, m.station / m.length, m.offset / m.length) for m in (one, other)]
        apart = curves[0] - curves[1]
        turned = apart - np.polyval(np.polyfit(s, apart, 1), s)
        assert np.sqrt(np.mean(turned**2)) < 0.01
        assert np.sqrt(np.mean(apart**2)) < 0.01


@needs_photos
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_forks_are_refused_with_the_reason(number):
    photo = read_photo(PHOTOS / f"fork_{number}.jpg")
    with pytest.raises(InputError, match=rf"fork_{number}.*no handle with a ring.*fork"):
        photograph_scissors(photo, layout=BladeLayout(mat=False))


def drawn_curves():
    """The drawing's closed outlines, sampled 64 times per unit and more."""
    path = re.search(r' d="([^"]+)"', DRAWN.read_text()).group(1)
    words = iter(re.findall(r"[MLCZz]|-?\d*\.?\d+", path))
    outlines, points, command, pen, numbers = [], [], "M", np.zeros(2), []
    for word in words:
        if word in "Zz":
            outlines.append(np.vstack(points))
            points = []
        elif word in "MLC":
            command = word
        else:
            numbers.append(float(word))
            if command in "ML" and len(numbers) == 2:
                end = np.array(numbers)
                if command == "L":
                    steps = np.linspace(0.0, 1.0, int(np.hypot(*(end - pen)) * 64) + 2)[1:, None]
                    points.append(pen + steps * (end - pen))
                pen, numbers = end, []
            elif command == "C" and len(numbers) == 6:
                a, b, c = np.array(numbers).reshape(3, 2)
                t = np.linspace(0.0, 1.0, 4000)[1:, None]
                points.append(
                    (1 - t) ** 3 * pen
                    + 3 * (1 - t) ** 2 * t * a
                    + 3 * (1 - t) * t**2 * b
                    + t**3 * c
                )
                pen, numbers = c, []
    return outlines


REACH_PX, FARTHEST_PX = 4.0, 16.0


def refined(light, view, outline):
    """Border crossings (m, 2) in pixels along a rough outline (n, 2), and which are clear (m,)."""
    pixels = view.to_pixels(outline)
    closed = np.vstack([pixels, pixels[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(int(length[-1]), 16)
    even = np.linspace(0.0, length[-1], count, endpoint=False)
    points = np.stack([np.interp(even, length, closed[:, k]) for k in (0, 1)], axis=1)
    points = gaussian_filter1d(points, 2.5, axis=0, mode="wrap")
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    sides = sampled(light, points, normals, REACH_PX, REACH_PX)
    normals = normals * (1.0 if np.median(sides[:, 2] - sides[:, 0]) > 0.0 else -1.0)
    shift = steepest(light, points, normals, REACH_PX, 1.0, innermost=False)
    points = points + normals * shift[:, None]
    found = crossings(light, points, normals, REACH_PX)
    blur = float(np.median(found.blur))
    if 4.0 * blur > REACH_PX:
        found = crossings(light, points, normals, min(4.0 * blur, FARTHEST_PX))
    return points + normals * found.place[:, None], found.good & (found.outer > found.inner)


@needs_drawing
@pytest.mark.parametrize(
    ("size", "blur", "noise", "median", "worst"),
    [
        (300, 0.5, 0.0, 0.05, 0.5),
        (600, 1.0, 0.01, 0.08, 0.8),
        (1200, 1.0, 0.01, 0.08, 0.8),
        (600, 2.0, 0.03, 0.3, 2.5),
    ],
)
def test_a_drawn_pair_is_outlined_to_a_fraction_of_a_pixel(size, blur, noise, median, worst):
    curves = [(outline + 24.0) * size / 560.0 for outline in drawn_curves()]
    assert len(curves) == 4
    light = (0.9 - 0.8 * coverage(curves, size, size)).astype(np.float32)
    picture = develop(light, Looks(1.0, softness_px=blur, noise=noise), np.random.default_rng(1))
    read = linear_light(picture[:, :, 1])
    view = PlainView.by_hand(size, size, BladePriors())
    shape = silhouette(read, view, "drawn", longest=min(size, 1000))
    tree = cKDTree(np.concatenate(curves))
    away = []
    for outline in (shape.outer, *shape.others, *shape.holes):
        pixels, clear = refined(read, view, outline)
        away.append(tree.query(pixels[clear])[0])
        assert clear.mean() > 0.9
    every = np.concatenate(away)
    assert np.median(every) < median
    assert every.max() < worst
