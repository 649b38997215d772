"""Pieces of a plate: their books along any way, what is refused, the servo and the loop."""

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
from tests.kernel.golden import single
from tests.kernel.golden_pieces import FACE, HOLE, LAYER, STRIPS
from tests.kernel.test_loop import Device, Loop
from tests.kernel.zoo import make_tables, straight

ENABLED = int(StateFlag.MOTOR_ENABLED)
CONFIG = ServoConfig(torque_limit=1.0, torque_slew=2000.0, force_limit=0.0, force_slew=0.0)
ENDLESS = Piece(0.0, FACE, 1.0, (Strip(1.0, 0.6),))
SUMS = ("torque", "force", "stored_J", "fracture_J", "arrest_J")

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


@settings(max_examples=60)
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


@settings(max_examples=60)
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
