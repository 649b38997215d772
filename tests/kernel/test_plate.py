"""A plate whose pose is estimated: its section in the model's step, its forces, and the servo."""

import json
import math
from dataclasses import astuple, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import (
    Kernel,
    LoopBlock,
    Mode,
    ModelTables,
    PassivityConfig,
    PlacedModel,
    PlateConfig,
    Pull,
    SampleFlag,
    Section,
    Servo,
    ServoConfig,
    State,
    StateFlag,
    StepFlag,
)
from tests.kernel.golden import FOLDER
from tests.kernel.golden_plate import FILE, NAMES, plate_cases, plate_vectors
from tests.kernel.reference_plate import Placed, ReferencePlate
from tests.kernel.test_golden import same, titles
from tests.kernel.test_loop import Device, Loop
from tests.kernel.zoo import make_tables

ENABLED = int(StateFlag.MOTOR_ENABLED)
FOLLOWED = PlateConfig(is_estimated=True)
CONFIG = ServoConfig(
    torque_limit=1.0, torque_slew=2000.0, force_limit=0.0, force_slew=0.0, plate=FOLLOWED
)
UPPER: dict[str, Any] = {"moving_blades": 1, "upper_face": 1e-4}
VECTORS = json.loads((FOLDER / FILE).read_text(encoding="utf-8"))

pitches = st.floats(-0.25, 0.25)
near = st.floats(-0.015, 0.005)
heights = st.floats(-2e-3, 3e-3)
stretches = st.floats(0.95, 1.1)


def test_stored_vectors_are_what_the_reference_gives() -> None:
    made = json.loads(json.dumps(plate_vectors()))
    assert same(made, VECTORS), "run: python -m tests.kernel.golden_plate, and review plate.json"


@pytest.mark.parametrize("case", VECTORS["cases"], ids=titles(VECTORS["cases"]))
def test_steps_on_a_moving_plate(case: dict[str, Any]) -> None:
    placed = PlacedModel(plate_cases()[case["title"]][0])
    got: dict[str, list[float]] = {}
    for k in range(len(case["opening"])):
        section = Section(*(case[name][k] for name in NAMES))
        out, pull = placed.step(section, *(case[n][k] for n in ("opening", "rate", "advance")))
        row = out._asdict() | {f"pull_{f.name}": getattr(pull, f.name) for f in fields(Pull)}
        for name, value in (row | {"crack": placed.crack}).items():
            got.setdefault(name, []).append(value)
    for name in (key.removeprefix("out_") for key in case if key.startswith("out_")):
        wanted = np.array(case[f"out_{name}"])
        error = np.abs(np.array(got[name]) - wanted).max()
        assert error <= VECTORS["tolerance"] * np.abs(wanted).max() + 1e-12, name
    assert max(np.abs(case["out_torque"])) > 0.02


@settings(max_examples=60)
@given(pitch=pitches, edge_x=near, edge_y=heights, stretch=stretches, crack=st.floats(0.0, 0.02))
def test_forces_are_the_gradient_of_the_stored_energy(
    pitch: float, edge_x: float, edge_y: float, stretch: float, crack: float
) -> None:
    """Against differences of an energy that is computed from points in the rig's frame."""
    tables = make_tables(**UPPER, fracture_energy=0.0)
    section = Section(*(float(np.float32(v)) for v in (edge_x, edge_y, pitch, stretch, 1.0)))
    opening, advance = float(np.float32(0.4)), float(np.float32(-0.02))
    placed, reference = PlacedModel(tables), ReferencePlate(tables)
    placed.reset(crack)
    out, pull = placed.step(section, opening, 0.0, advance)
    at = Placed.of(section, opening, advance)
    crack = placed.crack
    reach = 3e-6 + 2e-5 * abs(reference.depth(at, crack))
    assert out.indentation == pytest.approx(reference.depth(at, crack), abs=reach)
    if not 2e-5 < reference.depth(at, crack) < 1.9e-3:
        return
    scale = max(out.response, 0.05)
    names = {"opening": -out.torque, "advance": -out.force} | vars(pull)
    for name, value in names.items():
        wanted = reference.slope(at, crack, name)
        # an indentation in float32 is known to some nanometres
        assert value == pytest.approx(wanted, rel=2e-3, abs=2e-4 * scale), name


@given(gap=st.floats(-1.0, 1.0), opening=st.floats(0.2, 0.5))
def test_a_moved_plate_carries_its_crack(gap: float, opening: float) -> None:
    """Moved along with the pivot, plate and crack give the same torque."""
    tables = make_tables(**UPPER)
    here, there = PlacedModel(tables), PlacedModel(tables)
    for placed, by in ((here, 0.0), (there, 0.05 * gap)):
        for theta in np.linspace(0.6, opening, 40):
            out, _ = placed.step(Section(by, 1e-4), float(theta), 0.0, by - 0.015)
    again, _ = here.step(Section(0.0, 1e-4), opening, 0.0, -0.015)
    assert out.torque == pytest.approx(again.torque, rel=2e-3, abs=1e-6)
    assert there.crack == pytest.approx(here.crack, abs=1e-7)


@given(turn=st.floats(-0.3, 0.3))
def test_plate_and_blade_turned_about_the_pivot_give_the_same_torque(turn: float) -> None:
    tables = make_tables(**UPPER, fracture_energy=0.0)
    x, y = 0.015, 1e-4
    turned = Section(
        x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), turn
    )
    one, _ = PlacedModel(tables).step(Section(x, y), 0.4, 0.0, 0.0)
    two, _ = PlacedModel(tables).step(turned, 0.4 + turn, 0.0, 0.0)
    assert one.torque > 0.01
    assert two.torque == pytest.approx(one.torque, rel=2e-3)
    # a force along the advance becomes one along the turned axis and one across it
    across = one.response
    along = one.force * math.cos(turn) - across * math.sin(turn)
    assert two.force == pytest.approx(along, rel=2e-3, abs=1e-4)


@settings(max_examples=200)
@given(
    numbers=st.tuples(*([st.floats(width=32, allow_nan=True, allow_infinity=True)] * 5)),
    opening=st.floats(-4.0, 4.0),
    advance=st.floats(-1.0, 1.0),
    blades=st.sampled_from([1, 2]),
)
def test_any_sound_section_gives_finite_forces(
    numbers: tuple[float, ...], opening: float, advance: float, blades: int
) -> None:
    section = Section(*numbers)
    tables = make_tables(moving_blades=blades, kappa=0.8, rate_damping=5.0)
    if not section.is_sound(blades):
        return
    placed = PlacedModel(tables)
    out, pull = placed.step(section, opening, -3.0, advance)
    assert all(map(math.isfinite, (*out, *astuple(pull), placed.crack)))
    if out.flags & StepFlag.INVALID:
        assert out.torque == out.force == 0.0


@settings(max_examples=100)
@given(
    edge=st.floats(-0.3, 0.3),
    height=st.floats(-0.05, 0.05),
    pitch=st.floats(-1.0, 1.0),
    stretch=st.floats(0.5, 2.0),
    opening=st.floats(0.05, 1.2),
)
def test_places_at_the_extremes_stay_finite(
    edge: float, height: float, pitch: float, stretch: float, opening: float
) -> None:
    for blades in (1, 2):
        section = Section(edge, height, pitch if blades == 1 else 0.0, stretch, 1.5)
        assert section.is_sound(blades)
        placed = PlacedModel(make_tables(moving_blades=blades))
        for theta in (opening + 0.1, opening, opening - 0.05, opening):
            out, pull = placed.step(section, theta, -1.0, -0.02)
            assert all(map(math.isfinite, (*out, *astuple(pull), placed.crack)))
        assert placed.crack >= 0.0


def test_a_closed_path_of_blades_and_plate_gives_no_energy() -> None:
    """Opening, advance and all numbers of the section go round; nothing is cut."""
    tables = make_tables(**UPPER, fracture_energy=0.0)
    placed = PlacedModel(tables)
    turn = np.linspace(0.0, 2.0 * np.pi, 20001)
    columns = np.stack(
        [
            0.38 + 0.03 * np.sin(turn),
            -0.02 + 1e-3 * np.cos(turn + 1.0),
            -0.003 + 1e-3 * np.sin(turn + 2.0),
            1e-3 * (1.0 + np.cos(turn)),
            0.03 * np.sin(turn + 0.5),
            1.0 + 0.01 * np.cos(turn + 2.5),
        ]
    ).astype(np.float32)
    placed.reset(0.004)
    forces = []
    for opening, advance, edge_x, edge_y, pitch, stretch in columns.T.tolist():
        section = Section(edge_x, edge_y, pitch, stretch)
        out, pull = placed.step(section, opening, 0.0, advance)
        forces.append((-out.torque, -out.force, *astuple(pull)))
    middle = 0.5 * (np.array(forces)[1:] + np.array(forces)[:-1])
    steps = np.diff(columns.astype(np.float64), axis=1).T
    exchanged = np.sum(np.abs(np.sum(middle * steps, axis=1)))
    assert exchanged > 1e-3
    assert abs(np.sum(middle * steps)) < 2e-5 * exchanged
    # a path without the plate's share does not close: the test can fail
    assert abs(np.sum((middle * steps)[:, :2])) > 1e-2 * exchanged


def nominal(tables: ModelTables) -> Section:
    return Section(0.0, float(np.float32(tables.upper_face)))


@pytest.mark.parametrize("blades", [1, 2])
def test_in_its_own_place_the_plate_is_the_models(blades: int) -> None:
    tables = make_tables(moving_blades=blades, upper_face=1e-4, kappa=0.8, render_friction=True)
    kernel, placed = Kernel(tables), PlacedModel(tables)
    for theta in np.linspace(0.6, 0.25, 500):
        known = kernel.step(float(theta), -0.3, -0.015)
        out, _ = placed.step(nominal(tables), float(theta), -0.3, -0.015)
        assert out._replace(force=known.force) == known
        assert out.force == pytest.approx(known.force, rel=1e-6)
    assert kernel.crack == placed.crack > 0.0


def drive(servo: Servo, tick: int, opening: float, torque: float = 0.0) -> float:
    return servo.step(State(ENABLED, tick, 1000 * tick, opening, -0.015, torque, 0.0)).torque


@pytest.mark.parametrize("kappa", [1.0, 0.8])
def test_the_books_close_with_a_moving_plate(kappa: float) -> None:
    """120,000 ticks of strokes while the plate drifts, turns and is lost now and then."""
    tables = make_tables(**UPPER, kappa=kappa, render_friction=True)
    passivity = PassivityConfig(friction_width=2e-3)
    servo = Servo(tables, replace(CONFIG, torque_limit=0.2, ramp_s=0.3, passivity=passivity))
    rng = np.random.default_rng(5)
    section = nominal(tables)
    servo.place(section)
    servo.engage(Mode.RENDER)
    opening, rate, torque = 0.6, 0.0, 0.0
    exchanged = 0.0
    for tick in range(120_000):
        if tick % 10 == 0:
            t = 1e-3 * tick
            section = Section(
                1.5e-3 * math.sin(0.7 * t) + rng.normal(0.0, 2e-5),
                1e-4 + 3e-4 * math.sin(1.1 * t),
                0.06 * math.sin(0.5 * t),
                1.0 + 0.004 * math.sin(0.3 * t),
                1.0 + 0.004 * math.cos(0.3 * t),
            )
            lost = tick % 7000 < 150
            servo.place(section, not lost, 0.02)
        if tick % 12_000 == 0:
            servo.fresh_sheet(0.0)
        aim = 0.42 + 0.18 * math.cos(2 * math.pi * tick / 2000)
        for _ in range(10):
            push = 3.0 * (aim - opening) - 0.05 * rate
            rate += (torque + push - 0.004 * rate) / 5e-4 * 1e-4
            opening += rate * 1e-4
        torque = drive(servo, tick, opening)
        exchanged += abs(rate * torque) * 1e-3
    ledger = servo.ledger
    assert servo.stop_reason == 0
    assert servo.counters.plate_out_frames > 1000
    assert ledger.fracture_J > 0.02
    assert abs(ledger.plate_J) > 0.01 * ledger.fracture_J
    assert abs(ledger.unbooked_J) < 1e-3 * exchanged
    # without the plate's account they would not
    assert abs(ledger.unbooked_J + ledger.plate_J) > 5e-3 * exchanged


def resting_servo(ramp_s: float = 0.0, **changes: Any) -> tuple[Servo, float]:
    """A servo whose blades are pressed into a resting crack, and its torque."""
    tables = make_tables(**UPPER, fracture_energy=0.0)
    servo = Servo(tables, replace(CONFIG, ramp_s=ramp_s, **changes))
    servo.place(nominal(tables))
    servo.engage(Mode.RENDER)
    torque = [drive(servo, tick, 0.42) for tick in range(50)][-1]
    return servo, torque


def test_a_new_estimate_does_not_step_the_force() -> None:
    """The force goes to it in a straight line within 15 ms."""
    servo, before = resting_servo()
    servo.place(Section(-2e-4, 1.5e-4))
    torque = np.array([before, *(drive(servo, 50 + k, 0.42) for k in range(30))])
    change = torque[-1] - before
    assert abs(change) > 0.1 * before
    assert np.abs(np.diff(torque)).max() < 1.8 * abs(change) / 15.0
    assert np.all(torque[16:] == torque[-1])


def test_estimates_that_stop_let_the_force_fall_and_return() -> None:
    servo, _ = resting_servo(ramp_s=0.2)
    start, tick = 250, 50
    while tick < start:
        tick += 1
        torque = drive(servo, tick, 0.42)
        servo.place(Section(0.0, 1e-4))
    full = torque
    fallen = [drive(servo, tick + k, 0.42) for k in range(1, 251)]
    assert fallen[98] == full
    assert fallen[205] == 0.0
    assert np.diff(fallen).max() <= 0.0
    assert np.abs(np.diff(fallen)).max() < 1.2 * full / 100.0
    flags = int(servo.telemetry()["flags"][0])
    assert flags & SampleFlag.PLATE_OUT
    risen = []
    for k in range(251, 500):
        servo.place(Section(0.0, 1e-4))
        risen.append(drive(servo, tick + k, 0.42))
    assert risen[0] < 0.01 * full
    assert risen[-1] == pytest.approx(full, rel=1e-6)
    assert np.abs(np.diff(risen)).max() < 1.2 * full / 200.0
    assert not int(servo.telemetry()["flags"][0]) & SampleFlag.PLATE_OUT


def test_nothing_is_cut_unfelt() -> None:
    """Blades that close while the force has fallen move no crack until the plate is back."""
    tables = make_tables(**UPPER)
    servo = Servo(tables, replace(CONFIG, ramp_s=0.1))
    servo.place(nominal(tables), usable=False)
    servo.engage(Mode.RENDER)
    for tick in range(600):
        assert drive(servo, tick, 0.6 - 5e-4 * tick) == 0.0
    assert servo.crack == 0.0
    assert servo.ledger.fracture_J == 0.0
    torque = []
    for tick in range(600, 800):
        servo.place(nominal(tables))
        torque.append(drive(servo, tick, 0.3))
    assert servo.crack > 1e-3
    assert torque[0] < 0.02 * torque[-1]
    assert abs(servo.ledger.unbooked_J) < 1e-3 * servo.ledger.engaged_J


def test_a_known_plate_takes_no_estimates() -> None:
    tables = make_tables(**UPPER)
    servo = Servo(tables, replace(CONFIG, plate=PlateConfig()))
    servo.place(Section(0.05, 0.02), usable=False)
    servo.engage(Mode.RENDER)
    kernel = Kernel(tables)
    for tick in range(900):
        opening = float(np.float32(0.6 - 3e-4 * tick))
        torque = drive(servo, tick, opening)
        out = kernel.step(opening, 0.0, -0.015)
    assert torque == pytest.approx(out.torque, rel=1e-3)
    assert servo.counters.plate_out_frames == 0
    assert servo.ledger.plate_J == 0.0


@pytest.mark.parametrize("section", [Section(math.nan, 0.0), Section(0.0, 0.0, 1.2)])
def test_a_section_that_is_none_lets_the_force_fall(section: Section) -> None:
    servo, _ = resting_servo()
    assert not section.is_sound(1)
    servo.place(section)
    torque = [drive(servo, 50 + k, 0.42) for k in range(120)]
    assert torque[-1] == 0.0
    assert all(map(math.isfinite, torque))


@pytest.mark.parametrize("bad", [{"move_s": 0.0}, {"fall_s": math.inf}, {"face_low": math.nan}])
def test_settings_of_a_plate_are_checked(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        PlateConfig(is_estimated=True, **bad)


def test_a_block_carries_estimates() -> None:
    with_plate = LoopBlock.create(CONFIG, make_tables(**UPPER))
    try:
        with_plate.place(Section(0.01, 0.002, 0.03), usable=True, age_s=0.04)
        placed = with_plate.pointer.plate
        assert placed.turn == 2
        assert placed.placing.usable == 1
        assert placed.placing.age_us == 40_000
        assert placed.placing.section.pitch == pytest.approx(0.03)
    finally:
        with_plate.close()


def test_the_loop_renders_where_the_plate_is_placed() -> None:
    """Through shared memory, as a supervisor in another process places it."""
    device = Device()
    block = LoopBlock.create(
        replace(CONFIG, ramp_s=0.0, supervisor_ms=0, plate=replace(FOLLOWED, stale_us=60_000_000)),
        make_tables(**UPPER, fracture_energy=0.0),
    )
    try:
        loop = Loop(device, block)
        block.place(Section(-0.006, 1e-4))
        block.engage(Mode.RENDER)
        torque = [device.exchange(k, 0.42).torque for k in range(1, 30)]
        placed = PlacedModel(make_tables(**UPPER, fracture_energy=0.0))
        out, _ = placed.step(Section(-0.006, 1e-4), 0.42, 0.0, -0.02)
        assert torque[-1] == pytest.approx(out.torque, rel=1e-5)
        assert out.torque > 0.01
        block.place(Section(0.0, 1e-4), usable=False)
        torque = [device.exchange(k, 0.42).torque for k in range(30, 150)]
        assert torque[0] > 0.0 == torque[-1]
        assert block.counters.plate_out_frames > 100
        block.stop()
        loop.ended()
    finally:
        block.close()
        device.release()
