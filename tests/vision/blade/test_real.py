"""Real photographs of scissors and forks, and a drawn pair whose curves are known exactly."""

from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.vision.blade.photo import photograph_scissors
from scissorcal.vision.photo import read_photo

DATA = Path(__file__).parents[4] / "shared" / "data"
PHOTOS = DATA / "scissors_photos"

needs_photos = pytest.mark.skipif(not PHOTOS.is_dir(), reason=f"{PHOTOS} is not there")

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
        number: photograph_scissors(read_photo(PHOTOS / f"scissors_{number}.jpg"), mat=False)
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
        photograph_scissors(photo, mat=False)
