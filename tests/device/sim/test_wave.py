"""A simulated edge with a wave on it: its curve, its own solver, and one energy for all forces."""

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.interpolate import CubicSpline

from scissorcal.device.sim.blade import APART, BladeOnSheet, WavyBladeOnSheet, blade_on
from scissorcal.device.sim.plate_contact import PlateContact
from scissorcal.device.sim.specimen import Blade, TouchedPlate
from scissorcal.device.sim.truth import average_torque, tip_at_drive
from scissorcal.device.sim.wave import Wave
from tests.device.sim.build import WAVY, specimen


@st.composite
def waves(draw: st.DrawFn) -> tuple[float, list[tuple[float, float]]]:
    """A blade's length (mm) and points: few or many, also clustered, slopes of up to 17 deg."""
    length = draw(st.floats(10.0, 500.0))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.sampled_from([3, 4, 17, 200]))
    share = np.unique(rng.uniform(0.0, 1.0, count) ** draw(st.sampled_from([1.0, 4.0])))
    stations = np.concatenate([[0.0], share[share > 1e-6], [1.0]])[-200:]
    stations[0] = 0.0
    periods, phase = rng.uniform(0.2, 2.0), rng.uniform(0.0, 6.0)
    size = 0.1 / (2 * np.pi * periods) * draw(st.floats(0.0, 1.0))
    values = size * np.sin(2 * np.pi * periods * stations + phase)
    return length, list(zip((length * stations).tolist(), (length * values).tolist(), strict=True))


@given(waves())
@settings(max_examples=50)
def test_the_wave_is_scipys_natural_spline_and_straight_beyond(
    made: tuple[float, list[tuple[float, float]]],
) -> None:
    length, points = made
    wave = Wave(points)
    x, y = np.array(points).T
    natural = CubicSpline(x, y, bc_type="natural")
    places = np.linspace(x[0], x[-1], 301)
    found = np.array([wave.at(float(place)) for place in places])
    assert found[:, 0] == pytest.approx(natural(places), abs=1e-9 * length)
    assert found[:, 1] == pytest.approx(natural(places, 1), abs=1e-6)
    assert wave.least[1] - 1e-9 <= found[:, 1].min()
    assert found[:, 1].max() <= wave.largest[1] + 1e-9
    for place in (x[0] - 0.3 * length, x[-1] + 0.3 * length):
        end = float(np.clip(place, x[0], x[-1]))
        value, slope = wave.at(end)
        assert wave.at(place)[0] == pytest.approx(value + slope * (place - end), abs=1e-9 * length)


@given(waves(), st.floats(-0.1, 1.0), st.floats(0.01, 0.95), st.sampled_from(["both", "upper"]))
@settings(max_examples=100)
def test_the_edge_is_found_where_the_turned_blade_puts_it(
    made: tuple[float, list[tuple[float, float]]], share: float, opening: float, moving: str
) -> None:
    length, points = made
    blade = blade_on(specimen(blade={"wave_mm": points, "length_mm": length, "moving": moving}))
    assert isinstance(blade, WavyBladeOnSheet)
    beta, station = opening / blade.moving, 1e-3 * length * share
    edge = blade.offset + station * blade.taper + blade.wave.at(station)[0]
    x = station * math.cos(beta) - edge * math.sin(beta)
    y = station * math.sin(beta) + edge * math.cos(beta)
    assert blade.indentation(opening, x) == pytest.approx(blade.upper_face - y, abs=1e-13)


def test_the_gradient_holds_while_the_tip_lets_go() -> None:
    blade = blade_on(specimen(blade=WAVY | {"tip_fade_mm": 2.0}))
    assert isinstance(blade, WavyBladeOnSheet)
    step, opening = 1e-8, 0.1396
    for beyond in (-1e-4, 3e-4, 1e-3, 1.7e-3):
        station = blade.length + beyond
        edge = blade.offset + station * blade.taper + blade.wave.at(station)[0]
        place = station * math.cos(opening / 2) - edge * math.sin(opening / 2)
        touch = blade.touch(opening, place)
        assert touch.torque > 0
        by_opening = blade.energy(opening + step, place) - blade.energy(opening - step, place)
        by_place = blade.energy(opening, place + step) - blade.energy(opening, place - step)
        assert touch.torque == pytest.approx(-by_opening / (2 * step), rel=1e-4)
        assert touch.drive == pytest.approx(-by_place / (2 * step), rel=1e-4)
    assert blade.touch(opening, place + 5e-4) == APART


def test_a_wave_of_nothing_changes_nothing() -> None:
    flat = blade_on(specimen(blade={"wave_mm": [(0, 0), (40, 0), (75, 0)]}))
    line = blade_on(specimen())
    assert isinstance(flat, WavyBladeOnSheet)
    assert not isinstance(line, WavyBladeOnSheet)
    for opening in (0.15, 0.4, 0.9):
        assert flat.crossing(opening) == pytest.approx(line.crossing(opening), abs=1e-15)
        place = line.crossing(opening) - 1e-3
        assert flat.touch(opening, place) == pytest.approx(line.touch(opening, place), rel=1e-12)


@given(waves(), st.floats(0.05, 0.95))
@settings(max_examples=60)
def test_beyond_its_crossing_the_edge_is_above_the_sheet(
    made: tuple[float, list[tuple[float, float]]], opening: float
) -> None:
    length, points = made
    offset = -0.1 * length
    blade = blade_on(
        specimen(blade={"wave_mm": points, "length_mm": length, "offset_mm": max(offset, -50.0)})
    )
    crossing = blade.crossing(opening)
    if math.isinf(crossing):
        return
    assert blade.indentation(opening, crossing) == pytest.approx(0.0, abs=1e-12)
    beyond = np.linspace(crossing, max(1e-3 * length, crossing) + 1e-3, 200)[1:]
    assert max(blade.indentation(opening, float(place)) for place in beyond) < 1e-9


def test_waves_that_come_up_twice_are_crossed_nearest_the_tip() -> None:
    heights = [(s, 4.0 * math.exp(-(((s - 30.0) / 6.0) ** 2))) for s in range(0, 76, 3)]
    blade = blade_on(specimen(blade={"wave_mm": heights, "taper_deg": 0.0}))
    line = blade_on(specimen(blade={"taper_deg": 0.0}))
    assert blade.crossing(0.35) == pytest.approx(line.crossing(0.35), abs=1e-3)
    assert blade.indentation(0.35, blade.crossing(0.35)) == pytest.approx(0.0, abs=1e-12)
    assert blade.indentation(0.35, 0.030) < 0.0 < blade.indentation(0.35, 0.040)


def test_the_mean_torque_is_that_of_the_settled_tip() -> None:
    truth = specimen(blade=WAVY, material={"kappa": 1.0})
    blade = blade_on(truth)
    for opening in (0.3, 0.6, 0.9):
        contact = tip_at_drive(blade, opening, 0.5)
        touch = blade.touch(opening, contact)
        assert touch.drive == pytest.approx(0.5, rel=1e-9)
        mean = float(average_torque(truth, opening, 0.0, 0.0, friction=False))
        assert mean == pytest.approx(touch.torque, rel=1e-9)


def test_the_tip_that_touches_a_plate_is_on_the_wave() -> None:
    tall = Blade(offset_mm=-8.0, taper_deg=0.0, length_mm=75.0, wave_mm=((0, 0), (40, 1), (75, 3)))
    contact = PlateContact(tall, TouchedPlate(place_mm=(60.0, 0.0, 0.0)), 1e-4)
    assert contact.tip(0.0, 0.0) == pytest.approx((0.075, -0.005), abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wave_mm": [(0, 0), (30, 1), (30, 2)]}, "rise strictly"),
        ({"wave_mm": [(0, 0), (30, 1)]}, "at least 3"),
        ({"wave_mm": WAVY["wave_mm"], "family": "arc"}, 'needs family = "line"'),
        ({"wave_mm": [(0, 0), (10, 40), (20, 0)]}, "almost upright"),
    ],
)
def test_what_is_no_wave_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        specimen(blade=changes)


@pytest.mark.parametrize("edge", [{}, WAVY], ids=["line", "wave"])
def test_a_blade_is_copied_and_pickled(edge: dict[str, Any]) -> None:
    blade = blade_on(specimen(blade=edge))
    for twin in (copy.copy(blade), copy.deepcopy(blade), pickle.loads(pickle.dumps(blade))):
        assert type(twin) is type(blade)
        assert twin.touch(0.5, 0.03) == blade.touch(0.5, 0.03)
        assert twin.crossing(0.5) == blade.crossing(0.5)


def test_a_blade_is_of_the_class_of_its_edge() -> None:
    with pytest.raises(ValueError, match="has a wave"):
        BladeOnSheet(specimen(blade=WAVY))
    with pytest.raises(ValueError, match="has no wave"):
        WavyBladeOnSheet(specimen())
