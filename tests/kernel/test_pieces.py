"""A plate made of pieces: exact cases, an independent reference, books, servo and loop."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scissorcal.kernel import (
    Kernel,
    LoopBlock,
    Mode,
    ModelTables,
    PassivityConfig,
    Piece,
    PiecesModel,
    PlateConfig,
    Servo,
    ServoConfig,
    State,
    StateFlag,
    StepFlag,
    Strip,
    largest_overlap,
)
from tests.kernel.golden import FOLDER, single
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
from tests.kernel.test_loop import Device, Loop
from tests.kernel.test_model import nicked_edge
from tests.kernel.zoo import line_edge, make_tables, power_response, straight

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


@pytest.mark.parametrize("kappa", [1.0, 0.7])
@pytest.mark.parametrize("pieces", [HOLE, LAYER, STRIPS], ids=["hole", "layer", "strips"])
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


def test_along_a_nick_a_crack_stops_at_its_first_place() -> None:
    """Whether a run may look its end up is found for each piece: by its face and its energies."""
    tables = make_tables(edge=nicked_edge(6e-4), kappa=0.7)
    energies = (0.6, 0.2, 1.0, 0.4)
    strips = tuple(Strip(0.008 * (k + 1), energy) for k, energy in enumerate(energies))
    found = PiecesModel(tables, [Piece(0.0, FACE, 1.0, strips)])
    scanned = PiecesModel(tables, [Piece(0.0, FACE, 1.0, strips)])
    assert not found._config.piece[0].release_falls
    assert PiecesModel(make_tables(), LAYER)._config.piece[1].release_falls
    scanned._config.piece[0].release_falls = 0
    columns = strokes()
    assert found.step_many(*columns).tobytes() == scanned.step_many(*columns).tobytes()
    # a face so low, and an energy so small, that the nick lies over no place where a crack stops
    low = PiecesModel(tables, [Piece(0.0, FACE, 1.0, (Strip(1.0, 0.0),))])
    assert low._config.piece[0].release_falls == 1


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


# --- properties ------------------------------------------------------------------------------

lengths = st.floats(5e-4, 0.01)
energies = st.floats(0.02, 2.0)


@st.composite
def plates(draw: st.DrawFn) -> list[Piece]:
    """Up to 6 pieces of up to 5 strips, anywhere along the cut, at various heights."""
    pieces = []
    for _ in range(draw(st.integers(1, 6))):
        begin = draw(st.floats(-0.005, 0.02))
        parts = draw(st.lists(st.tuples(lengths, energies), min_size=1, max_size=5))
        ends = begin + np.cumsum([length for length, _ in parts])
        strips = tuple(
            Strip(float(end), energy) for end, (_, energy) in zip(ends, parts, strict=True)
        )
        scale = draw(st.sampled_from([0.1, 0.5, 1.0, 3.0, 30.0]))
        pieces.append(Piece(begin, draw(st.floats(2e-5, 4e-4)), scale, strips))
    return pieces


@st.composite
def hands(draw: st.DrawFn) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Opening and advance along a few straight ways, from wide open."""
    openings = [0.9, *draw(st.lists(st.floats(0.2, 0.9), min_size=1, max_size=5))]
    advances = [-0.03, *draw(st.lists(st.floats(-0.03, -0.01), min_size=5, max_size=5))]
    knots = np.arange(len(openings))
    at = np.linspace(0.0, knots[-1], 1 + 1500 * knots[-1])
    return np.interp(at, knots, openings), np.interp(at, knots, advances[: len(knots)])


@settings(max_examples=60, deadline=None)
@given(plates(), hands(), st.sampled_from([1.0, 0.9, 0.5]), st.sampled_from([1, 2]))
def test_the_hands_work_is_in_the_books(
    pieces: list[Piece],
    way: tuple[NDArray[np.float64], NDArray[np.float64]],
    kappa: float,
    blades: int,
) -> None:
    """Work = what is stored + fracture + arrest, along any way of small steps."""
    opening, advance = (column.astype(np.float32).astype(np.float64) for column in way)
    model = PiecesModel(make_tables(kappa=kappa, moving_blades=blades), pieces)
    out = model.step_many(opening, 0.0, advance)
    assert np.all(out["flags"] & int(StepFlag.INVALID) == 0)
    assert np.all(out["arrest_J"] >= 0.0)
    assert np.all(out["fracture_J"] >= 0.0)
    assert all(np.isfinite(out[name]).all() for name in SUMS)
    torque, force = out["torque"].astype(np.float64), out["force"].astype(np.float64)
    work = -np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(opening))
    work -= np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(advance))
    spent = np.cumsum(out["fracture_J"] + out["arrest_J"], dtype=np.float64)[1:]
    left = work - spent - out["stored_J"][1:]
    # a step in which a crack runs is booked at its end: half a step's work for each of them
    run = (
        np.abs(np.diff(opening)) * np.abs(torque).max()
        + np.abs(np.diff(advance)) * np.abs(force).max()
    )
    most = run.max() * (1 + np.count_nonzero(out["arrest_J"]))
    assert np.abs(left).max() <= 0.5 * most + 2e-4 * spent[-1] + 1e-8


@settings(max_examples=60, deadline=None)
@given(plates(), st.integers(0, 2**32 - 1), st.sampled_from([1.0, 0.8]))
def test_no_step_books_more_than_was_there(pieces: list[Piece], seed: int, kappa: float) -> None:
    """Wild leaps of the hand: what a step books was stored, at its pose, with the old cracks."""
    rng = np.random.default_rng(seed)
    tables = make_tables(kappa=kappa)
    model = PiecesModel(tables, pieces)
    model.step(0.95, 0.0, -0.03)
    before = model.cracks
    for _ in range(60):
        opening = float(np.float32(rng.uniform(0.15, 0.9)))
        advance = float(np.float32(rng.uniform(-0.03, -0.015)))
        cut, out = model.cut_through, model.step(opening, float(rng.normal()), advance)
        assert out.arrest_J >= 0.0
        assert out.fracture_J >= 0.0
        assert all(math.isfinite(value) for value in out)
        assert all(b >= a for a, b in zip(before, model.cracks, strict=True))
        assert all(b >= a for a, b in zip(cut, model.cut_through, strict=True))
        there = energy_pressed(tables, pieces, before, cut, opening, advance)
        assert out.stored_J + out.fracture_J + out.arrest_J <= there * (1 + 1e-5) + 1e-9
        before = model.cracks


def energy_pressed(
    tables: ModelTables,
    pieces: list[Piece],
    cracks: tuple[float, ...],
    cut: tuple[bool, ...],
    opening: float,
    advance: float,
) -> float:
    """What all pieces would store here if no crack had moved."""
    total = 0.0
    for piece, crack, through in zip(pieces, cracks, cut, strict=True):
        if through:
            continue
        kernel = Kernel(replace(tables, upper_face=piece.upper_face_m, fracture_energy=0.0))
        kernel.reset(crack)
        total += piece.scale * kernel.step(opening, 0.0, advance).stored_J
    return total


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Strip(math.nan, 0.6), "finite place"),
        (lambda: Strip(0.01, -0.1), "fracture energy"),
        (lambda: Strip(0.01, math.inf), "fracture energy"),
        (lambda: Piece(0.0, 0.0, 1.0, (Strip(0.01, 0.6),)), "upper face"),
        (lambda: Piece(0.0, 1e-4, 0.0, (Strip(0.01, 0.6),)), "scale"),
        (lambda: Piece(0.0, 1e-4, 1e300, (Strip(0.01, 0.6),)), "scale"),
        (lambda: Piece(0.0, 1e-4, math.nan, (Strip(0.01, 0.6),)), "scale"),
        (lambda: Piece(math.inf, 1e-4, 1.0, (Strip(0.01, 0.6),)), "begin"),
        (lambda: Piece(0.0, 1e-4, 1.0, ()), "at least one strip"),
        (lambda: Piece(0.01, 1e-4, 1.0, (Strip(0.01, 0.6),)), "ascend"),
        (lambda: Piece(0.0, 1e-4, 1.0, (Strip(0.02, 0.6), Strip(0.01, 0.6))), "ascend"),
        (lambda: Piece(0.0, 1e-4, 1e-30, (Strip(0.02, 1e20),)), "overflows"),
        (lambda: PiecesModel(make_tables(), []), "at least one"),
        (lambda: PiecesModel(make_tables(), [ENDLESS] * 17), "16 pieces"),
        (
            lambda: PiecesModel(
                make_tables(),
                [replace(ENDLESS, strips=tuple(Strip(0.001 * k, 0.6) for k in range(1, 66)))],
            ),
            "64 strips",
        ),
        (lambda: Servo(None, CONFIG, pieces=[ENDLESS]), "tables"),
        (lambda: LoopBlock.create(CONFIG, None, pieces=[ENDLESS]), "tables"),
        (lambda: LoopBlock.create(CONFIG, make_tables(), pieces=[]), "at least one"),
    ],
)
def test_what_is_not_sound_is_refused_with_a_sentence(make: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


def test_pieces_on_an_estimated_plate_are_refused() -> None:
    config = replace(CONFIG, plate=PlateConfig(is_estimated=True))
    with pytest.raises(ValueError, match="estimated pose"):
        Servo(make_tables(), config, pieces=HOLE)
    with pytest.raises(ValueError, match="estimated pose"):
        LoopBlock.create(config, make_tables(), pieces=HOLE)


def test_the_largest_overlap() -> None:
    sheet, layer = LAYER
    assert largest_overlap(LAYER) == sheet.scale + layer.scale
    assert largest_overlap(HOLE, 3e-3) == 1.0
    assert largest_overlap(HOLE, 4.1e-3) == 2.0
    assert largest_overlap(LAYER, 0.0, each=[5.0, 7.0]) == 12.0
    with pytest.raises(ValueError, match="one number"):
        largest_overlap(LAYER, each=[1.0])
    with pytest.raises(ValueError, match="reach"):
        largest_overlap(LAYER, math.nan)


# --- servo and loop --------------------------------------------------------------------------


def drive(servo: Servo, tick: int, opening: float, torque: float = 0.0) -> float:
    return servo.step(State(ENABLED, tick, 1000 * tick, opening, -0.03, torque, 0.0)).torque


def test_the_servo_renders_the_pieces() -> None:
    tables = make_tables(kappa=0.8)
    servo = Servo(tables, replace(CONFIG, ramp_s=0.0), pieces=HOLE)
    servo.engage(Mode.RENDER)
    model = PiecesModel(tables, HOLE)
    tick = 0
    for _ in range(2):
        compared = 0
        for angle in (*np.linspace(0.8, 0.22, 1500), *np.linspace(0.22, 0.8, 200)):
            tick += 1
            torque = drive(servo, tick, single(angle))
            assert torque == pytest.approx(model.step(single(angle), 0.0, -0.03).torque, abs=1e-7)
            compared += torque > 0.0
        assert compared > 500
        assert model.cut_through[0]
        assert servo.crack == max(model.cracks)
        servo.fresh_sheet()
        model.reset()


@pytest.mark.parametrize("kappa", [1.0, 0.8])
@pytest.mark.parametrize("pieces", [HOLE, LAYER, STRIPS], ids=["hole", "layer", "strips"])
def test_the_ledger_closes_over_strokes_of_a_hand(pieces: tuple[Piece, ...], kappa: float) -> None:
    """40,000 ticks of strokes of a hand that feels the torque, on fresh sheets; friction too."""
    tables = make_tables(kappa=kappa, render_friction=True)
    passivity = PassivityConfig(friction_width=2e-3)
    servo = Servo(tables, replace(CONFIG, ramp_s=0.3, passivity=passivity), pieces=pieces)
    servo.engage(Mode.RENDER)
    opening, rate, torque, exchanged = 0.8, 0.0, 0.0, 0.0
    for tick in range(40_000):
        if tick % 8_000 == 4_000:
            servo.fresh_sheet()
        aim = 0.5 + 0.3 * math.cos(2 * math.pi * tick / 4_000)
        for _ in range(10):
            push = 6.0 * (aim - opening) - 0.1 * rate
            rate += (torque + push - 0.004 * rate) / 5e-4 * 1e-4
            opening += rate * 1e-4
        torque = drive(servo, tick, opening)
        exchanged += abs(rate * torque) * 1e-3
    ledger = servo.ledger
    assert servo.stop_reason == 0
    assert ledger.fracture_J > 0.02
    assert ledger.arrest_J > 1e-4
    assert abs(ledger.unbooked_J) < 3e-3 * exchanged


def test_a_sheet_of_another_kind_needs_no_reset_of_the_block() -> None:
    """The loop, on a block in shared memory, renders its pieces; a fresh sheet resets them."""
    device = Device()
    tables = make_tables()
    settings_of_loop = replace(CONFIG, ramp_s=0.0, supervisor_ms=0)
    block = LoopBlock.create(settings_of_loop, tables, pieces=HOLE)
    try:
        loop = Loop(device, block)
        block.engage(Mode.RENDER)
        model = PiecesModel(tables, HOLE)
        opening = [single(angle) for angle in np.linspace(0.8, 0.35, 300)]
        for k, angle in enumerate(opening, start=1):
            torque = device.exchange(k, angle).torque
            wanted = model.step(angle, 0.0, -0.02).torque
        assert torque == pytest.approx(wanted, rel=1e-5)
        assert wanted > 0.01
        cut = block.crack
        assert cut > 0.01
        block.fresh_sheet()
        assert device.exchange(301, 0.8).torque == 0.0
        assert block.crack == 0.0
        block.stop()
        loop.ended()
    finally:
        block.close()
        device.release()


def test_a_uniform_sheet_is_stepped_as_before() -> None:
    """Without pieces the servo's commands are those of the model, to the last bit."""
    tables = make_tables(kappa=0.8, friction_opening=straight(0.0, 0.0))
    servo = Servo(tables, replace(CONFIG, ramp_s=0.0))
    servo.engage(Mode.RENDER)
    kernel = Kernel(tables)
    for tick, angle in enumerate(np.linspace(0.8, 0.3, 500)):
        torque = drive(servo, tick, single(angle))
        assert torque == kernel.step(single(angle), 0.0, -0.03).torque
    assert servo.crack == kernel.crack > 0.01
