"""Second derivatives stay within their bounds, in closed form and by differences of the slope."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.aliases import Array
from scissorcal.model import Edge, FrictionLaw, Response
from scissorcal.model.curvature import (
    cubic_curvature,
    edge_breaks,
    edge_curvature,
    level_curvature,
    response_breaks,
    response_curvature,
)

SHARES = np.linspace(0.02, 0.98, 13)[:, None]


def inside(low: Array, high: Array) -> Array:
    return low + SHARES * (high - low)


def assert_within(values: Array, bounds: tuple[Array, Array], slack: float = 1e-9) -> None:
    size = np.maximum(np.abs(bounds[0]), np.abs(bounds[1])) + 1e-300
    assert np.all(values >= bounds[0] - slack * size)
    assert np.all(values <= bounds[1] + slack * size)


@given(exponent=st.floats(0.5, 8.0), start=st.floats(1e-7, 1e-3), ratio=st.floats(1.001, 4.0))
def test_powers_and_exponentials(exponent: float, start: float, ratio: float) -> None:
    low, high = np.array([start]), np.array([start * ratio])
    x = inside(low, high)
    power = Response("power", 2.0, exponent, 3e-4)
    exact = 2.0 * exponent * (exponent - 1.0) * (x / 3e-4) ** (exponent - 2.0) / 3e-4**2
    assert_within(exact, response_curvature(power, low, high))
    exponential = Response("exponential", 2.0, exponent, 3e-4)
    rate = exponent / 3e-4
    exact = 2.0 * rate**2 * np.exp(rate * x) / np.expm1(exponent)
    assert_within(exact, response_curvature(exponential, low, high))


@settings(max_examples=40)
@given(steps=st.lists(st.floats(-1.5, 1.5), min_size=1, max_size=4), exponent=st.floats(0.6, 4.0))
def test_a_spline_between_logarithms(steps: list[float], exponent: float) -> None:
    knots = tuple(1e-4 * 2.0**k for k in range(len(steps) + 2))
    response = Response("spline", 2.0, exponent, 3e-4, tuple(steps), knots)
    ends = np.unique(np.concatenate([np.geomspace(2e-5, 4e-3, 150), response_breaks(response)]))
    low, high = ends[:-1], ends[1:]
    x = inside(low, high)
    step = 1e-6 * x
    found = (response.stiffness_at(x + step) - response.stiffness_at(x - step)) / (2.0 * step)
    crosses = np.any(np.abs(x[..., None] - np.array(knots)) <= 1.01 * step[..., None], axis=-1)
    least, most = response_curvature(response, low, high)
    slack = 1e-4 * response.stiffness_at(x) / x
    assert np.all((found >= least - slack) | crosses)
    assert np.all((found <= most + slack) | crosses)
    assert np.median((most - least) / (np.abs(most) + np.abs(least) + 1e-9)) < 0.5


def test_edges_of_every_family() -> None:
    rng = np.random.default_rng(1)
    edges = [
        Edge("line", -0.008, 0.03, 0.07),
        Edge("arc", -0.008, 0.03, 0.07, curvature_per_m=1.5),
        Edge("cubic", -0.008, 0.03, 0.07, curvature_per_m=1.5, bend_per_m2=-20.0),
        Edge("spline", -0.008, 0.03, 0.07, spline_m=tuple(rng.normal(0, 1e-4, 9))),
    ]
    for edge in edges:
        ends = np.unique(np.concatenate([np.linspace(-0.01, 0.08, 200), edge_breaks(edge)]))
        low, high = ends[:-1], ends[1:]
        x = inside(low, high)
        found = (edge.slope_at(x + 1e-9) - edge.slope_at(x - 1e-9)) / 2e-9
        least, most = edge_curvature(edge, low, high)
        assert np.all(found >= least - 1e-6)
        assert np.all(found <= most + 1e-6)


@given(speed=st.floats(0.0, 3.0), width=st.floats(1e-3, 0.5), scale=st.floats(0.02, 1.0))
def test_friction_levels(speed: float, width: float, scale: float) -> None:
    values = {"coulomb": 0.01, "stribeck": 0.006, "stribeck_rate": scale, "viscous": 0.004}
    law = FrictionLaw({**values, "rate^3": 0.002})
    low, high = np.array([speed]), np.array([speed + width])
    v = inside(low, high)
    u = v / scale
    for sign in (1.0, -1.0):
        exact = 0.006 * (4.0 * u**2 - 2.0) * np.exp(-(u**2)) / scale**2 + 6.0 * 0.002 * v
        assert_within(exact, level_curvature(law, sign, low, high), 1e-6)


def test_a_cubic_is_enclosed_by_its_ends() -> None:
    low, high = np.array([-1.0, 0.5]), np.array([0.0, 2.0])
    least, most = cubic_curvature(lambda x: 3.0 * x**2 - 4.0 * x, low, high)
    assert least == pytest.approx(6.0 * low - 4.0)
    assert most == pytest.approx(6.0 * high - 4.0)
