"""Borders across lines of pixels: where they are, and how well that is known."""

import numpy as np
import pytest
from scipy.special import ndtr

from scissorcal.vision.blade.profile import crossings, steepest


def strip(place, blur, *, inner=0.2, outer=0.8, slope=0.0, noise=0.0, rows=200, seed=0):
    """A picture whose border stands at x = place(row)."""
    x = np.arange(60.0)[None, :] - np.asarray(place)[:, None]
    share = ndtr(x / blur)
    light = inner * (1 - share) + (outer + slope * x) * share
    light += noise * np.random.default_rng(seed).standard_normal(light.shape)
    return light.astype(np.float32)


def across(light, reach=8.0):
    rows = np.arange(2.0, light.shape[0] - 2)
    points = np.column_stack([np.full(len(rows), 30.0), rows])
    return crossings(light, points, np.tile([1.0, 0.0], (len(rows), 1)), reach)


@pytest.mark.parametrize("blur", [0.6, 1.2, 2.0])
@pytest.mark.parametrize("shift", [-0.37, 0.0, 0.26])
def test_a_clean_border_is_found_to_a_fiftieth_of_a_pixel(blur, shift):
    found = across(strip(np.full(40, 30.0 + shift), blur))
    assert found.good.all()
    assert np.abs(found.place - shift).max() < 0.02


def test_a_shadow_that_fades_away_from_the_border_does_not_move_it():
    found = across(strip(np.full(40, 30.2), 1.0, outer=0.5, slope=0.02))
    assert np.abs(found.place - 0.2).max() < 0.02


@pytest.mark.parametrize("noise", [0.01, 0.03])
def test_the_stated_spread_is_that_of_the_places(noise):
    truth = 30.0 + np.random.default_rng(5).uniform(-0.5, 0.5, 400)
    light = strip(truth, 1.0)
    light = light + (noise * np.random.default_rng(6).standard_normal(light.shape)).astype("f4")
    rows = np.arange(2, 398)
    points = np.column_stack([np.full(len(rows), 30.0), rows.astype(float)])
    # rows differ, so that sampling between them would mix borders: cross exactly along each
    found = crossings(light, points, np.tile([1.0, 0.0], (len(rows), 1)), 8.0)
    z = (found.place - (truth[rows] - 30.0)) / found.sd
    assert 0.7 < np.std(z) < 1.6


def test_noise_gives_no_border():
    light = 0.5 + 0.02 * np.random.default_rng(1).standard_normal((60, 60)).astype("f4")
    assert across(light.astype("f4")).good.mean() < 0.1


def test_a_border_is_followed_past_dirt_and_separated_from_its_shadow():
    rows = 200
    light = strip(np.full(rows, 34.0), 1.0)
    light[80:100, 34:] = 0.2
    points = np.column_stack([np.full(rows, 30.0), np.arange(float(rows))])
    normals = np.tile([1.0, 0.0], (rows, 1))
    found = steepest(light, points, normals, 12.0, 1.5, innermost=False)
    assert np.abs(found - 4.0).max() <= 3.0
    shadow = np.where(np.arange(60)[None, :] < 38, np.minimum(light, 0.45), light).astype("f4")
    shadow[80:100] = shadow[0]
    metal = steepest(shadow, points, normals, 12.0, 1.2, innermost=True)
    # the metal ends at 4, its shadow at 8; a narrow second search settles the rest
    assert 0.0 <= np.median(metal) <= 5.0
