"""The WebAssembly of the core computes what the native core computes, bit for bit."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.kernel import Kernel, Piece, PiecesModel, PlacedModel, Section, Strip
from tests.kernel.golden_pieces import HOLE, LAYER, STRIPS
from tests.kernel.web import PLACE_DTYPE, WebModel
from tests.kernel.zoo import arc_edge, line_edge, make_tables

MODELS = {
    "smooth crack": make_tables(),
    "rippled, with friction": make_tables(kappa=0.6, render_friction=True),
    "one blade, damped": make_tables(moving_blades=1, rate_damping=3.0, upper_face=1e-4),
    "pressing, eq. 4": make_tables(fracture_energy=0.0, closure="eq4"),
    "bent edge": make_tables(edge=arc_edge(2.0), kappa=0.3),
    "finite blade": make_tables(tip_station=0.075, kappa=0.8),
    "nearly parallel": make_tables(edge=line_edge(slope=1e-6)),
}

SHEETS, STEPS = 40, 5_000
"""Sheets, each fresh, and the steps on each."""


def random_places(count: int, seed: int) -> NDArray[np.void]:
    """Openings, rates and advances of a hand that opens and closes; at the end from anywhere."""
    rng = np.random.default_rng(seed)
    places = np.zeros(count, dtype=PLACE_DTYPE)
    time = np.arange(count) * 1e-3
    places["opening"] = 0.5 + 0.4 * np.sin(2.3 * time) + 2e-3 * rng.standard_normal(count)
    places["rate"] = 0.92 * np.cos(2.3 * time) + 0.05 * rng.standard_normal(count)
    places["advance"] = -0.02 - 0.02 * np.sin(0.7 * time) + 1e-5 * rng.standard_normal(count)
    anywhere = np.arange(count) > 0.95 * count  # a wild step may cut the whole sheet
    sizes = 10.0 ** rng.uniform(-6.0, 2.0, (3, int(anywhere.sum())))
    signs = rng.choice([-1.0, 1.0], sizes.shape)
    for name, size, sign in zip(PLACE_DTYPE.names or (), sizes, signs, strict=True):
        places[name][anywhere] = size * sign
    for name, wrong in zip(PLACE_DTYPE.names or (), (np.nan, np.inf, -np.inf), strict=True):
        places[name][rng.integers(0, count, 5)] = wrong
    return places


@pytest.mark.parametrize("name", MODELS)
def test_steps_are_the_native_ones_bit_for_bit(name: str) -> None:
    web, native = WebModel(MODELS[name]), Kernel(MODELS[name])
    assert web.is_sound
    felt = 0
    for sheet in range(SHEETS):
        places = random_places(STEPS, seed=sheet)
        web.reset(1e-3 * sheet)
        native.reset(1e-3 * sheet)
        wanted = native.step_many(places["opening"], places["rate"], places["advance"])
        felt += np.count_nonzero(wanted["torque"])
        assert web.step_many(places).tobytes() == wanted.tobytes()
        assert np.float32(web.crack) == np.float32(native.crack)
    assert felt > SHEETS * STEPS / 20


@pytest.mark.parametrize("name", MODELS)
def test_settled_torques_are_the_native_ones_bit_for_bit(name: str) -> None:
    places = random_places(50_000, seed=100 + len(name))
    finite = np.all([np.isfinite(places[field]) for field in PLACE_DTYPE.names or ()], axis=0)
    places = places[finite]
    wanted = Kernel(MODELS[name]).torque(places["opening"], places["rate"], places["advance"])
    found = WebModel(MODELS[name]).torque(places)
    numbers = ~np.isnan(wanted)
    np.testing.assert_array_equal(np.isnan(found), ~numbers)  # the sign of a NaN has no meaning
    assert found[numbers].tobytes() == wanted[numbers].tobytes()


def test_steps_on_a_plate_are_the_native_ones() -> None:
    tables, section = make_tables(kappa=0.6), Section(0.0, 1e-4, 0.0, 1.1, 0.9)
    web, native = WebModel(tables), PlacedModel(tables)
    assert web.place(section.edge_x, section.edge_y, section.pitch, section.stretch, 0.9)
    assert not web.place(50.0, 0.0, 0.0, 1.0, 1.0), "a plate 50 m away is refused"
    places = random_places(5_000, seed=1)[:4_700]
    found = web.step_many(places)
    wanted = [native.step(section, *map(float, place))[0] for place in places]
    assert sum(step.torque != 0.0 for step in wanted) > 500
    torque = np.array([step.torque for step in wanted], dtype=np.float32)
    np.testing.assert_allclose(found["torque"], torque, rtol=2e-6, atol=1e-9)


@pytest.mark.parametrize("pieces", [HOLE, LAYER, STRIPS], ids=["hole", "layer", "strips"])
@pytest.mark.parametrize("name", MODELS)
def test_steps_of_pieces_are_the_native_ones_bit_for_bit(
    name: str, pieces: tuple[Piece, ...]
) -> None:
    web, native = WebModel(MODELS[name]), PiecesModel(MODELS[name], pieces)
    assert all(web.add(*pieces))
    assert [web.piece_crack(i) for i in range(len(pieces))] == list(native.cracks)
    felt = 0
    for sheet in range(4):
        places = random_places(STEPS, seed=sheet)
        web.reset()
        native.reset()
        wanted = native.step_many(places["opening"], places["rate"], places["advance"])
        felt += np.count_nonzero(wanted["stored_J"])
        assert web.step_many(places).tobytes() == wanted.tobytes()
        assert [web.piece_crack(i) for i in range(len(pieces))] == list(native.cracks)
    assert felt > 200


def test_pieces_that_are_not_sound_change_nothing() -> None:
    web = WebModel(make_tables())
    whole = Piece(0.0, 5e-5, 1.0, (Strip(0.02, 0.6), Strip(0.04, 0.3)))
    assert not web.strip(0.02, 0.6), "a strip of no piece"
    assert web.begin(0.0, 5e-5, 1.0)
    assert not web.begin(0.0, 5e-5, 1.0), "the piece before has no strip"
    assert not web.strip(-0.01, 0.6), "behind the near edge"
    assert web.strip(0.02, 0.6)
    assert not web.strip(0.02, 0.3), "no longer than the strip before"
    assert not web.strip(0.03, -0.3), "an energy below 0"
    assert web.strip(0.04, 0.3)
    for wrong in ((math.nan, 5e-5, 1.0), (0.0, 0.0, 1.0), (0.0, 5e-5, 1001.0)):
        assert not web.begin(*wrong)
    assert not web.place(0.0, 1e-4, 0.0, 1.0, 1.0), "a plate of pieces has its place"
    places = random_places(STEPS, seed=3)
    columns = (places["opening"], places["rate"], places["advance"])
    wanted = PiecesModel(make_tables(), [whole]).step_many(*columns)
    assert web.step_many(places).tobytes() == wanted.tobytes()
    assert math.isnan(web.piece_crack(1))
    web.clear()
    web.reset()
    uniform = Kernel(make_tables()).step_many(*columns)
    assert web.step_many(places).tobytes() == uniform.tobytes()
    assert web.place(0.0, 1e-4, 0.0, 1.0, 1.0)
    assert not web.begin(0.0, 5e-5, 1.0), "a plate that is placed has no pieces"


def test_there_is_room_for_so_many_pieces_and_strips() -> None:
    web = WebModel(make_tables())
    strips = tuple(Strip(1e-3 * (k + 1), 0.6) for k in range(4))
    assert all(web.add(*[Piece(0.0, 5e-5, 0.1, strips)] * 16))
    assert not web.begin(0.0, 5e-5, 1.0)
    assert not web.strip(0.1, 0.6)
