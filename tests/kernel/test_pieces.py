"""A plate made of pieces: exact cases, an independent reference, books, servo and loop."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.kernel import (
    Kernel,
    ModelTables,
    Piece,
    PiecesModel,
    ServoConfig,
    StateFlag,
    StepFlag,
    Strip,
)
from tests.kernel.golden import FOLDER
from tests.kernel.golden_pieces import (
    FACE,
    FILE,
    HOLE,
    LAYER,
    STRIPS,
    hand,
    pieces_cases,
    pieces_vectors,
)
from tests.kernel.reference_pieces import PIECES_COLUMNS, ReferencePieces
from tests.kernel.test_golden import same, titles
from tests.kernel.test_model import nicked_edge
from tests.kernel.zoo import line_edge, make_tables, power_response

ENABLED = int(StateFlag.MOTOR_ENABLED)
CONFIG = ServoConfig(torque_limit=1.0, torque_slew=2000.0, force_limit=0.0, force_slew=0.0)
VECTORS = json.loads((FOLDER / FILE).read_text(encoding="utf-8"))
ENDLESS = Piece(0.0, FACE, 1.0, (Strip(1.0, 0.6),))
MODELS: dict[str, dict[str, Any]] = {
    "smooth": {},
    "rippled": {"kappa": 0.7, "render_friction": True},
    "one blade, damped, eq4": {
        "moving_blades": 1,
        "closure": "eq4",
        "rate_damping": 3.0,
        "kappa": 0.9,
        "render_friction": True,
    },
    "over the tip": {"tip_station": 0.05},
}
SUMS = ("torque", "force", "stored_J", "fracture_J", "arrest_J")


def strokes(steps: int = 6000) -> tuple[NDArray[np.float32], ...]:
    """The hand twice, the second time 10 mm farther into the plate."""
    opening, rate, advance = hand(steps // 2)
    return tuple(map(np.concatenate, ([opening] * 2, [rate] * 2, [advance, advance + 0.01])))


def test_stored_vectors_are_what_the_reference_gives() -> None:
    made = json.loads(json.dumps(pieces_vectors()))
    assert same(made, VECTORS), "run: python -m tests.kernel.golden_pieces, and review pieces.json"


@pytest.mark.parametrize("case", VECTORS["cases"], ids=titles(VECTORS["cases"]))
def test_steps_against_the_reference(case: dict[str, Any]) -> None:
    model = PiecesModel(*pieces_cases()[case["title"]])
    got = model.step_many(case["opening"], case["rate"], case["advance"])
    for name in PIECES_COLUMNS:
        if f"out_{name}" not in case:
            continue
        wanted = np.array(case[f"out_{name}"])
        found = got[name].astype(np.float64)
        found = np.cumsum(found) if name in ("fracture_J", "arrest_J") else found
        allowed = max(case["tolerance"], 1e-4 if name == "fracture_J" else 0.0)
        allowed = case.get("arrest_tolerance", allowed) if name == "arrest_J" else allowed
        assert np.abs(found - wanted).max() <= allowed * np.abs(wanted).max() + 1e-9, name
    assert max(case["out_fracture_J"]) > 0.002
    assert np.all(got["arrest_J"] >= 0.0)


@pytest.mark.parametrize(
    ("pieces", "kappa"),
    [
        pytest.param(HOLE, 1.0, id="hole, smooth"),
        pytest.param(STRIPS, 0.7, id="strips, rippled"),
        pytest.param(LAYER, 1.0, id="layer, smooth", marks=pytest.mark.slow),
        pytest.param(STRIPS, 1.0, id="strips, smooth", marks=pytest.mark.slow),
        pytest.param(HOLE, 0.7, id="hole, rippled", marks=pytest.mark.slow),
        pytest.param(LAYER, 0.7, id="layer, rippled", marks=pytest.mark.slow),
    ],
)
def test_finer_steps_come_closer_to_the_reference(pieces: tuple[Piece, ...], kappa: float) -> None:
    """The core books a step where it ends, an error that falls with the step."""
    tables = make_tables(response=power_response(knots=25), kappa=kappa)
    errors = []
    for steps in (240, 9600):
        columns = hand(steps)
        model, reference = PiecesModel(tables, pieces), ReferencePieces(tables, pieces)
        got = model.step_many(*columns)
        wanted = [reference.step(*map(float, row)) for row in zip(*columns, strict=True)][-1]
        assert wanted["arrest_J"] > 5e-5
        off = abs(float(got["arrest_J"].sum(dtype=np.float64)) - wanted["arrest_J"])
        errors.append(off / wanted["arrest_J"])
        ripple = 5e-4 * 0.6
        off = abs(float(got["fracture_J"].sum(dtype=np.float64)) - wanted["fracture_J"])
        assert off < (1e-4 * wanted["fracture_J"] if kappa == 1.0 else ripple)
    assert errors[0] < 0.05
    assert errors[1] < (5e-4 if kappa == 1.0 else 0.01)


@pytest.mark.parametrize("name", MODELS)
def test_one_piece_of_one_strip_is_the_uniform_sheet(name: str) -> None:
    tables = make_tables(**MODELS[name])
    piece = replace(ENDLESS, upper_face_m=tables.upper_face)
    kernel, model = Kernel(tables), PiecesModel(tables, [piece])
    wanted, found = kernel.step_many(*strokes()), model.step_many(*strokes())
    assert np.count_nonzero(wanted["stored_J"]) > 500
    for column in wanted.dtype.names or ():
        np.testing.assert_array_equal(found[column], wanted[column], err_msg=column)
    assert model.cracks == (kernel.crack,)
    assert kernel.crack > 0.01


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("border", [(0.007,), (0.007, 0.00701, 0.0072)])
def test_bonded_strips_of_equal_energy_are_one(name: str, border: tuple[float, ...]) -> None:
    tables = make_tables(**MODELS[name])
    strips = tuple(Strip(end, 0.6) for end in (*border, 1.0))
    whole = replace(ENDLESS, upper_face_m=tables.upper_face)
    one = PiecesModel(tables, [whole])
    more = PiecesModel(tables, [replace(whole, strips=strips)])
    wanted, found = one.step_many(*strokes()), more.step_many(*strokes())
    assert more.cracks == pytest.approx(one.cracks, abs=2e-8)
    for column in (*SUMS, "contact", "indentation"):
        allowed = 2e-5 if column in ("torque", "force") else 1e-4
        most = np.abs(wanted[column]).max()
        assert np.abs(found[column] - wanted[column]).max() <= allowed * most + 2e-8, column
    np.testing.assert_array_equal(found["flags"], wanted["flags"])


@pytest.mark.parametrize("name", [name for name in MODELS if name != "over the tip"])
def test_bonded_strips_are_one_also_where_a_step_holds_many_ripples(name: str) -> None:
    """A hand that leaps: whole ripples before a border and behind it fall into one step."""
    tables = make_tables(**MODELS[name])
    whole = replace(ENDLESS, upper_face_m=tables.upper_face)
    strips = tuple(Strip(0.004 * (k + 1), 0.6) for k in range(20))
    one, more = PiecesModel(tables, [whole]), PiecesModel(tables, [replace(whole, strips=strips)])
    wanted, found = one.step_many(*strokes(40)), more.step_many(*strokes(40))
    assert more.cracks == pytest.approx(one.cracks, abs=1e-7)
    for column in ("torque", "stored_J", "fracture_J", "arrest_J"):
        most = np.abs(wanted[column]).max()
        np.testing.assert_allclose(found[column], wanted[column], atol=2e-4 * most, err_msg=column)
    assert wanted["fracture_J"].max() > 5e-4


def falls(tables: ModelTables, *energies: float, face: float = FACE) -> bool:
    """Whether the runs of a piece with these strips are looked up, as the core prepared it."""
    strips = tuple(Strip(0.008 * (k + 1), energy) for k, energy in enumerate(energies))
    model = PiecesModel(tables, [Piece(0.0, face, 1.0, strips)])
    return bool(model._config.piece[0].release_falls)


def test_whether_a_run_is_looked_up_depends_on_all_energies_of_a_piece() -> None:
    nicked = make_tables(edge=nicked_edge(4e-4), kappa=0.7)
    assert not falls(nicked, 1.0)
    assert falls(nicked, 1000.0)  # released nowhere behind the nick
    assert not falls(nicked, 1000.0, 1.0)
    assert not falls(nicked, 1.0, 1000.0)
    assert falls(nicked, 1000.0, 0.0)  # what is not cut does not count
    assert falls(make_tables(), 1.0, 1000.0, 0.01, face=1e-3)


def test_along_a_nick_a_crack_stops_at_its_first_place() -> None:
    tables, energies = make_tables(edge=nicked_edge(3e-4)), (0.6, 0.3, 2.0, 0.6)
    assert not falls(tables, *energies)
    strips = tuple(Strip(0.003 * (k + 1), energy) for k, energy in enumerate(energies))
    model = PiecesModel(tables, [Piece(0.0, FACE, 1.0, strips)])
    out = model.step_many(np.linspace(0.8, 0.22, 8000), 0.0, -0.03)
    runs = (out["flags"] & int(StepFlag.ADVANCED)) != 0
    crack, release = out["contact"] - 0.03, -out["force"]
    for k, energy in enumerate(energies):
        here = runs & (crack > 0.003 * k + 1e-6) & (crack < 0.003 * (k + 1) - 1e-6)
        assert np.count_nonzero(here) > 100
        assert release[here].max() <= 1.001 * energy
    assert model.cut_through == (True,)


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_a_scale_multiplies_everything(scale: float) -> None:
    tables = make_tables(kappa=0.8, rate_damping=3.0)
    scaled = Piece(0.0, FACE, scale, tuple(Strip(s.end_m, scale * 0.6) for s in ENDLESS.strips))
    wanted = PiecesModel(tables, [ENDLESS]).step_many(*strokes())
    found = PiecesModel(tables, [scaled]).step_many(*strokes())
    for column in (*SUMS, "response"):  # a power of two: no rounding, so to the last bit
        np.testing.assert_array_equal(found[column], np.float32(scale) * wanted[column])
    np.testing.assert_array_equal(found["contact"], wanted["contact"])


def test_pieces_add_up() -> None:
    """Two half sheets, each of half the stiffness and energy, are one sheet; friction once."""
    tables = make_tables(render_friction=True)
    half = Piece(0.0, FACE, 0.5, (Strip(1.0, 0.3),))
    wanted = PiecesModel(tables, [ENDLESS]).step_many(*strokes())
    found = PiecesModel(tables, [half, half]).step_many(*strokes())
    for column in (*SUMS, "friction_torque"):
        np.testing.assert_array_equal(found[column], wanted[column], err_msg=column)


def test_no_torque_between_the_edges_of_a_hole() -> None:
    tables = make_tables()
    model = PiecesModel(tables, HOLE)
    opening = np.linspace(0.8, 0.22, 4000)
    out = model.step_many(opening, -0.3, -0.03)
    edge = out["contact"] - 0.03  # of the crack, once the piece before the hole is cut through
    first = int(np.argmax(model_cut(tables, HOLE[:1], opening)))
    second = first + int(np.argmax(out["torque"][first:] > 0.0))
    assert 100 < first < second - 50
    assert np.all(out["torque"][first:second] == 0.0)
    assert np.all(out["force"][first:second] == 0.0)
    assert np.all(out["stored_J"][first:second] == 0.0)
    # it comes back where the edge has come down to the face at the second piece's near edge
    assert edge[second] == pytest.approx(HOLE[1].begin_m, abs=1e-6)
    assert out["height"][second - 1] == pytest.approx(FACE, abs=2e-5)
    assert model.cut_through == (True, False)
    assert np.count_nonzero(out["torque"]) > 1000


def model_cut(
    tables: ModelTables, pieces: tuple[Piece, ...], opening: NDArray[np.float64]
) -> NDArray[np.bool_]:
    model, cut = PiecesModel(tables, pieces), []
    for angle in opening:
        model.step(float(angle), -0.3, -0.03)
        cut.append(model.cut_through[0])
    return np.array(cut)


@pytest.mark.parametrize("blades", [1, 2])
def test_the_torque_of_each_strip_is_its_energy_times_the_cracks_way(blades: int) -> None:
    """A straight edge through the pivot: tau = J x_c / sin(theta), 2 J x_c / sin(2 theta)."""
    tables = make_tables(
        edge=line_edge(0.0, 0.0),
        moving_blades=blades,
        response=power_response(2e3),
        opening_min=0.02,
    )
    energies = (0.6, 1.2, 0.3)
    strips = tuple(Strip(0.01 * (i + 1), energy) for i, energy in enumerate(energies))
    model = PiecesModel(tables, [Piece(0.0, 1e-3, 1.0, strips)])
    angle = np.linspace(0.2, 0.015, 20_000)
    out = model.step_many(angle, -0.1, -0.02)
    runs = (out["flags"] & int(StepFlag.ADVANCED)) != 0
    crack = out["contact"].astype(np.float64) - 0.02
    for i, energy in enumerate(energies):
        here = runs & (crack > 0.01 * i + 1e-3) & (crack < 0.01 * (i + 1) - 1e-4)
        theta, way = angle[here], out["contact"][here]
        closed = (
            energy * way / np.sin(theta) if blades == 2 else 2 * energy * way / np.sin(2 * theta)
        )
        assert np.count_nonzero(here) > 100
        np.testing.assert_allclose(out["torque"][here], closed, rtol=3e-4)
    assert model.cut_through == (True,)


def test_into_a_weaker_strip_the_crack_leaps_and_before_a_tougher_one_it_rests() -> None:
    tables = make_tables()
    strips = (Strip(0.01, 0.6), Strip(0.02, 0.2), Strip(0.04, 0.9))
    model = PiecesModel(tables, [replace(ENDLESS, strips=strips)])
    opening = np.linspace(0.8, 0.2, 12_000)
    cracks, out = [], []
    for angle in opening:
        out.append(model.step(float(angle), -0.3, -0.03))
        cracks.append(model.cracks[0])
    crack = np.array(cracks)
    lost = np.array([step.arrest_J for step in out])
    leap = int(np.argmax(lost))
    assert crack[leap - 1] == pytest.approx(0.01, abs=1e-5)
    assert crack[leap] > 0.0105
    assert np.count_nonzero(lost) == 1 + int(model.cut_through[0])
    assert np.count_nonzero(crack == np.float32(0.02)) > 100
    assert crack[-1] > 0.0201


def test_a_cut_piece_gives_no_force_until_the_sheet_is_fresh() -> None:
    tables = make_tables(render_friction=True)
    model = PiecesModel(tables, HOLE[:1])
    assert model.step_many(*strokes())["stored_J"].max() > 0.0
    assert model.cut_through == (True,)
    assert model.cracks == (np.float32(0.01),)
    opening = np.tile(np.linspace(0.8, 0.2, 50), 3)
    out = model.step_many(opening, -0.3, -0.03)
    assert np.all(out["torque"] == out["friction_torque"])
    assert np.all((out["stored_J"] == 0.0) & (out["response"] == 0.0))
    assert np.ptp(out["contact"]) < 5e-8  # where the edge stands over the far end
    assert model.step(math.nan, 0.0, 0.0).flags == StepFlag.INVALID
    model.reset()
    assert model.cut_through == (False,)
    assert model.step_many(opening, -0.3, -0.03)["stored_J"].max() > 0.0


def test_a_fresh_sheet_under_closed_blades_has_no_energy() -> None:
    model = PiecesModel(make_tables(), LAYER)
    for _ in range(3):
        out = model.step(0.25, 0.0, -0.03)
        assert out.torque == out.force == out.stored_J == 0.0
        assert out.indentation > 1e-3
    model.step(0.8, 0.0, -0.03)
    assert model.step(0.4, 0.0, -0.03).torque > 0.0


def test_what_is_shown_is_the_piece_of_the_largest_response() -> None:
    tables = make_tables(fracture_energy=0.0)
    low = Piece(0.0, FACE, 1.0, (Strip(0.05, 0.0),))
    high = Piece(0.002, 3e-4, 2.0, (Strip(0.05, 0.0),))
    model, alone = PiecesModel(tables, [low, high]), PiecesModel(tables, [high])
    other = PiecesModel(tables, [low])
    columns = (np.linspace(0.8, 0.4, 500), 0.0, -0.03)
    out, upper, lower = (m.step_many(*columns) for m in (model, alone, other))
    both = (upper["response"] > 0.0) & (lower["response"] > 0.0)
    assert np.count_nonzero(both) > 50
    larger = upper["response"] > lower["response"]
    for name in ("response", "contact", "height", "indentation"):
        wanted = np.where(larger, upper[name], lower[name])
        np.testing.assert_array_equal(out[name][both], wanted[both], err_msg=name)
    np.testing.assert_allclose(out["torque"], upper["torque"] + lower["torque"], rtol=1e-6)
