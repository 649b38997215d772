"""Height fields through probed points: frame, noise, kinks, and points that are refused.

The points are made of closed forms and noise along their normals, without any spline.
"""

import math

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.model.surface import curvatures, fit_height_field
from scissorcal.model.surface.probed_checks import SMALLEST_RADIUS_M
from scissorcal.recipe import SMALLEST_RADIUS_MM

NOISE_M = 2e-5


def grid(count=16, gap=2e-3):
    """Places (count^2, 2) from the near edge, on both sides of the cut."""
    x, y = np.meshgrid(gap * np.arange(count), gap * (np.arange(count) - (count - 1) / 2))
    return np.stack((x.ravel(), y.ravel()), axis=-1)


def probed(height, places, noise=NOISE_M, seed=0):
    """Points of z = height(x, y) with noise along the normal."""
    x, y = places[:, 0], places[:, 1]
    step = 1e-7
    fx = (height(x + step, y) - height(x - step, y)) / (2 * step)
    fy = (height(x, y + step) - height(x, y - step)) / (2 * step)
    out = np.stack((-fx, -fy, np.ones_like(x)), axis=-1)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    off = noise * np.random.default_rng(seed).standard_normal((len(places), 1))
    return np.column_stack((places, height(x, y))) + off * out


def dome(x, y, radius=0.04, apex=0.004):
    return np.sqrt(radius**2 - (x - apex) ** 2 - y**2) - radius


def plane(x, y):
    return 0.0 * x


def wave(x, y):
    return 4e-4 * np.sin(x / 4e-3) * np.cos(y / 5e-3)


def test_the_radius_below_which_a_bend_counts_as_a_kink_is_that_of_the_recipe():
    assert pytest.approx(SMALLEST_RADIUS_MM * 1e-3) == SMALLEST_RADIUS_M


@pytest.mark.parametrize("height", [plane, dome, wave])
@pytest.mark.parametrize("seed", range(10))
def test_smooth_surfaces_are_found_within_their_uncertainty(height, seed):
    """Of 1200 such surfaces none was refused, and none was off by more than 1.71 sd (rms)."""
    places = grid()
    if seed % 2:
        places = np.random.default_rng(seed).uniform((0.0, -0.015), (0.03, 0.015), (300, 2))
    found = fit_height_field(probed(height, places, seed=seed), NOISE_M)
    true = np.column_stack((places, height(*places.T)))
    off = found.surface.level(true) / np.linalg.norm(found.surface.gradient(true), axis=-1)
    assert np.sqrt(np.mean(off**2)) < 2.0 * found.sd_m
    assert found.sd_m < 0.7 * NOISE_M
    free = 1.0 - (found.sd_m / NOISE_M) ** 2
    assert found.residual_rms_m == pytest.approx(NOISE_M * math.sqrt(free), rel=0.25)
    assert found.largest_residual_m <= 5.0 * NOISE_M


def test_points_stay_in_their_frame():
    tilt = math.tan(math.radians(4.0))
    points = probed(lambda x, y: tilt * x + 5e-4, grid(), noise=0.0)
    level, gradient, hessian = fit_height_field(points, 1e-6).surface.at(np.zeros(3))
    assert level == pytest.approx(-5e-4, abs=1e-12)
    np.testing.assert_allclose(gradient, (-tilt, 0.0, 1.0), atol=1e-9)
    np.testing.assert_allclose(hessian, 0.0, atol=1e-6)


def test_a_dome_probed_beside_its_apex_is_a_dome_of_the_same_radius():
    places = grid(31, 1e-3)
    found = fit_height_field(probed(dome, places, 1e-6), 1e-6)
    centre = np.array((0.004, 0.0, -0.04))
    on_it = np.column_stack((places, np.zeros(len(places))))
    on_it = on_it[found.surface.inside(on_it)]
    assert len(on_it) > 800
    on_it[:, 2] = -found.surface.level(on_it)
    np.testing.assert_allclose(np.linalg.norm(on_it - centre, axis=-1), 0.04, atol=3e-6)
    np.testing.assert_allclose(curvatures(found.surface, on_it), 25.0, rtol=0.1)
    assert found.smallest_radius_m == pytest.approx(0.04, rel=0.1)


def test_outside_the_probed_points_is_told():
    angle = np.linspace(0.0, 2 * math.pi, 12, endpoint=False)
    rings = [(r * np.cos(angle), r * np.sin(angle)) for r in np.linspace(1e-3, 1e-2, 8)]
    found = fit_height_field(probed(plane, np.concatenate(rings, axis=-1).T), NOISE_M)
    at = np.array([[0.0, 0.0, 0.0], [9e-3, 0.0, 0.0], [8e-3, 8e-3, 0.0], [0.02, 0.0, 0.0]])
    assert found.surface.inside(at).tolist() == [True, True, False, False]
    assert abs(found.surface.level([8e-3, 8e-3, 0.0])) < 1e-3  # a corner without points


def test_lengths_scale():
    points = probed(wave, grid())
    one, other = fit_height_field(points, NOISE_M), fit_height_field(10 * points, 10 * NOISE_M)
    assert other.smallest_radius_m == pytest.approx(10 * one.smallest_radius_m, rel=1e-6)
    np.testing.assert_allclose(other.surface.weights_m, 10 * one.surface.weights_m, atol=1e-12)


# --------------------------------------------------------------------------------------- kinks


@pytest.mark.parametrize("bend_deg", [10, 20, 40])
@pytest.mark.parametrize("seed", range(3))
def test_a_crease_is_refused_with_its_place(bend_deg, seed):
    def crease(x, y):
        return -math.tan(math.radians(bend_deg)) * np.maximum(0.0, x - 0.0137)

    with pytest.raises(InputError, match="has a kink or a step there") as refused:
        fit_height_field(probed(crease, grid(), seed=seed), NOISE_M)
    place = str(refused.value).partition("(")[2].partition(",")[0]
    assert float(place) == pytest.approx(13.7, abs=2.5)


def test_a_step_is_refused():
    with pytest.raises(InputError, match="has a kink or a step there"):
        fit_height_field(probed(lambda x, y: 2e-4 * (y > 1e-3), grid()), NOISE_M)


def test_a_wrong_point_is_named():
    points = probed(dome, grid())
    points[100, 2] += 3e-4
    labels = [f"line {k + 2}" for k in range(len(points))]
    with pytest.raises(
        InputError, match=r"^Line 102, \(8\.0\d*, -3\.0\d*\) mm: the probed point is 0\.2"
    ):
        fit_height_field(points, NOISE_M, labels)


def test_noise_larger_than_stated_is_refused():
    with pytest.raises(InputError, match="or the noise is larger than stated") as refused:
        fit_height_field(probed(dome, grid(), noise=2 * NOISE_M), NOISE_M)
    assert "with a noise of 0.02 mm" in str(refused.value)


def test_a_bend_below_two_millimetres_is_refused_with_its_radius():
    def bump(x, y):  # its radius of curvature at the top is 1.5 mm
        return 0.75e-3 * np.exp(-(((x - 0.0125) / 1.5e-3) ** 2))

    with pytest.raises(InputError, match=r"with a radius of 1\.[2-8] mm at \(1[23]\.") as refused:
        fit_height_field(probed(bump, grid(40, 5e-4)), NOISE_M)
    assert "below 2 mm that is a kink" in str(refused.value)


# ------------------------------------------------------------------------------ points refused


def with_row(row, value, places=None):
    points = probed(dome, grid() if places is None else places)
    points[row] = value
    return points


REFUSED = {
    "shape": (np.zeros((30, 2)), "need three columns x, y, z, not the shape (30, 2)"),
    "none": (np.zeros((0, 3)), "There are 0 probed points, but a height field needs 25 (5 by 5)"),
    "few": (probed(dome, grid(4)), "There are 16 probed points"),
    "many": (np.zeros((20_001, 3)), "There are 20001 probed points"),
    "nan": (with_row(3, (0.01, math.nan, 0.0)), "Point 4: (10, nan, 0) mm is no probed point"),
    "far": (with_row(3, (11.0, 0.0, 0.0)), "Point 4: (1.1e+04, 0, 0) mm is no probed point"),
    "line": (
        np.column_stack((np.linspace(0, 0.03, 30), np.linspace(0, 0.02, 30), np.zeros(30))),
        "The probed points lie on one line",
    ),
    "repeated": (
        probed(dome, grid())[[*range(256), 40]],
        "Point 41 and point 257 are 0 mm apart in the x-y plane at",
    ),
    "two heights": (
        np.concatenate((probed(dome, grid()), [[0.0101, 0.0, -0.02]])),
        "their heights differ by 19.5 mm: no height field has both",
    ),
    "hole": (
        probed(dome, grid()[np.hypot(*(grid() - (0.016, 0.0)).T) > 8e-3]),
        "probe this hole too",
    ),
    "origin": (probed(dome, grid() + np.array((0.008, 0.0))), "is 8 mm outside the probed points"),
    "tilt": (
        probed(lambda x, y: math.tan(math.radians(12)) * x, grid()),
        "tilted by 12.0 deg at (0, 0) mm",
    ),
    "height": (
        probed(lambda x, y: wave(x, y) + 0.0123, grid()),
        "mm at (0, 0) mm, but the plate's frame has its origin on the surface: subtract 12.2",
    ),
    "steep": (
        probed(lambda x, y: -4e5 * np.maximum(0.0, x - 0.01) ** 4, grid(27, 1e-3) * (1.0, 0.5)),
        "is steeper than 75 deg at (",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_points_that_no_height_field_can_have(case):
    points, reason = REFUSED[case]
    with pytest.raises(InputError) as refused:
        fit_height_field(points, NOISE_M)
    assert reason in str(refused.value)
    assert str(refused.value).endswith(".")


@pytest.mark.parametrize("noise", [0.0, -1e-5, math.nan, math.inf])
def test_a_noise_must_be_stated(noise):
    with pytest.raises(InputError, match="must be above 0"):
        fit_height_field(probed(dome, grid()), noise)
