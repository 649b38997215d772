"""The plate that the tip touches: its force, its friction, its motion, and its energy books."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from scissorcal.device.sim.plate_contact import PlateContact
from scissorcal.device.sim.rig import VirtualRig
from scissorcal.device.sim.specimen import Specimen, TouchedPlate
from tests.device.sim.build import NO_FRICTION, QUIET, specimen

LEVEL: dict[str, Any] = {"place_mm": (0.0, 10.0, 0.0), "extent_mm": (0.0, 150.0)}
STILL = 1e-9
"""A step so short that neither rate nor time matters."""


def contact_of(step_s: float = STILL, **plate: Any) -> PlateContact:
    truth = specimen(plate={**LEVEL, **plate})
    assert truth.plate is not None
    return PlateContact(truth.blade, truth.plate, step_s)


def opening_at(height: float) -> float:
    """Opening at which the base specimen's tip stands so high, by bisection."""
    low, high = 0.0, 1.2
    edge = -8e-3 + 75e-3 * math.tan(math.radians(2.0))
    for _ in range(80):
        middle = 0.5 * (low + high)
        beta = 0.5 * middle
        above = 75e-3 * math.sin(beta) + edge * math.cos(beta) > height
        low, high = (low, middle) if above else (middle, high)
    return low


def distance(plate: TouchedPlate, point: np.ndarray) -> float:
    """Signed distance of a point from the surface, in the plate's frame, by SciPy's rotations."""
    turn = Rotation.from_euler(
        "ZYX", [plate.pitch_deg, plate.yaw_deg, plate.roll_deg], degrees=True
    )
    level = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    inside = (turn.as_matrix() @ level).T @ (point - 1e-3 * np.asarray(plate.place_mm))
    if plate.surface == "plane":
        return float(inside[2])
    radius = 1e-3 * (plate.radius_mm or 0.0)
    away = inside + np.array([0.0, 0.0, radius])
    if plate.surface == "cylinder":
        away[1] = 0.0
    return float(np.linalg.norm(away) - radius)


@pytest.mark.parametrize("surface", ["plane", "cylinder", "sphere"])
def test_a_frictionless_plate_gives_the_gradient_of_its_energy(surface: str) -> None:
    angles = {"pitch_deg": 7.0, "yaw_deg": 3.0, "roll_deg": -5.0, "friction": 0.0}
    shape = {"surface": surface, "radius_mm": None if surface == "plane" else 40.0}
    contact = contact_of(damping_N_s_per_m=0.0, **shape, **{**angles, "extent_mm": (-9.0, 99.0)})
    truth = specimen(plate={**LEVEL, **shape, **angles}).plate
    assert truth is not None

    def energy(opening: float, advance: float) -> float:
        depth = -distance(truth, np.array([*contact.tip(opening, advance), 0.0]))
        return 0.5e4 * max(depth, 0.0) ** 2

    opening, advance, h = opening_at(9.6e-3), -0.07, 1e-7
    torque, force = contact.push(opening, advance, 0.0, 0.0)
    assert contact.depth_m > 1e-4
    assert contact.stored_energy(opening, advance) == pytest.approx(
        energy(opening, advance), rel=1e-6
    )
    by_opening = (energy(opening + h, advance) - energy(opening - h, advance)) / (2 * h)
    by_advance = (energy(opening, advance + h) - energy(opening, advance - h)) / (2 * h)
    assert torque == pytest.approx(-by_opening, rel=1e-5)
    assert force == pytest.approx(-by_advance, rel=1e-5)


def test_a_level_plate_pushes_up_by_stiffness_and_damping() -> None:
    contact = contact_of()
    opening = opening_at(9.8e-3)
    rate = -0.5
    torque, force = contact.push(opening, 0.0, rate, 0.0)
    (x, _), moving = contact.tip(opening, 0.0), 2.0
    sinking = -rate * x / moving
    assert contact.normal_N == pytest.approx(1e4 * 0.2e-3 + 10.0 * sinking, rel=1e-6)
    assert torque == pytest.approx(contact.normal_N * x / moving, rel=1e-6)
    assert force == pytest.approx(0.0, abs=1e-6)


def test_friction_holds_up_to_its_level_and_slides_beyond() -> None:
    contact = contact_of(step_s=1e-4, damping_N_s_per_m=0.0)
    opening = opening_at(9.8e-3)
    forces = [contact.push(opening, 1e-6 * i, 0.0, 0.01)[1] for i in range(100)]
    most = 0.2 * 2.0  # mu N
    assert forces[9] == pytest.approx(-1e4 * 10 * 1e-6, rel=1e-6)
    assert forces[-1] == pytest.approx(-most, rel=1e-3)
    slid = 100e-6 - most / 1e4
    assert contact.friction_J == pytest.approx(most * slid, rel=1e-3)


def test_the_touch_begins_from_above_alone() -> None:
    contact = contact_of()
    low = opening_at(9.5e-3)
    reach = contact.tip(low, 0.0)[0]
    assert contact.push(low, -reach - 1e-3, 0.0, 0.0) == (0.0, 0.0)
    assert contact.push(low, -reach + 1e-3, 0.0, 0.0) == (0.0, 0.0)  # came in from the side
    assert contact.blocked(low, -reach + 1e-3)
    contact.push(opening_at(11e-3), -reach + 1e-3, 0.0, 0.0)
    assert contact.push(low, -reach + 1e-3, 0.0, 0.0)[0] > 0.0
    contact.push(low, -reach - 1e-3, 0.0, 0.0)  # off the near edge again: what was stored is lost
    assert contact.stored_energy(low, 0.0) == 0.0
    assert contact.damping_J + contact.friction_J == pytest.approx(0.5e4 * (0.5e-3) ** 2, rel=1e-6)


def test_a_moving_plate_carries_a_tip_that_holds_still() -> None:
    """Raised by 0.1 mm under a held tip it puts in the elastic energy; sideways it drags."""
    raised = contact_of(step_s=1e-4, step_mm=(0.0, 0.1, 0.0), step_at_s=0.0, damping_N_s_per_m=0.0)
    opening = opening_at(10.0e-3)
    for _ in range(1_000):
        raised.push(opening, 0.0, 0.0, 0.0)
    assert raised.normal_N == pytest.approx(1.0, rel=1e-6)
    assert raised.carried_J == pytest.approx(0.5 * 1e4 * (0.1e-3) ** 2, rel=0.02)
    drawn = contact_of(step_s=1e-4, drift_mm_per_s=(10.0, 0.0, 0.0))
    for _ in range(1_000):
        force = drawn.push(opening_at(9.9e-3), 0.0, 0.0, 0.0)[1]
    assert force == pytest.approx(0.2 * drawn.normal_N, rel=1e-6)
    assert drawn.place[0] == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "plate",
    [
        {"pitch_deg": 6.0},
        {"surface": "cylinder", "radius_mm": 60.0, "place_mm": (50.0, 12.0, 0.0),
         "extent_mm": (-40.0, 40.0)},
        {"surface": "sphere", "radius_mm": 50.0, "place_mm": (50.0, 12.0, 4.0), "roll_deg": 5.0,
         "extent_mm": (-30.0, 30.0)},
        {"drift_mm_per_s": (4.0, 3.0, 0.0)},
        {"sway_mm": (1.0, 0.5, 0.2), "sway_turn_deg": 1.0, "sway_Hz": 0.5},
        {"step_mm": (3.0, 1.0, 0.0), "step_turn_deg": 4.0, "step_at_s": 0.6},
    ],
)  # fmt: skip
def test_the_energies_balance_on_a_plate(plate: dict) -> None:
    wide = {"extent_mm": (-150.0, 250.0)}
    mechanism = {"torque_offset_Nm": 3e-4, "advance": {"viscous_N_s_per_m": 60.0}}
    truth = specimen(plate={**LEVEL, **wide, **plate}, mechanism=mechanism)
    rig = VirtualRig(truth, np.random.default_rng(3))
    rig.joint.place, rig.carriage.place = math.radians(45.0), -0.04
    assert rig.load_plate()
    touched, deepest = 0, 0.0
    for tick in range(3_000):
        rig.tick(-0.09 + 0.04 * math.sin(0.02 * tick), 4.0 * math.sin(0.02 * tick))
        assert rig.plate is not None
        touched += rig.plate.normal_N > 0.0
        deepest = max(deepest, rig.plate.depth_m)
        book = rig.energy
        given_to_it = book.motor + book.hand + book.offset + book.touch
        assert rig.kinetic_energy == pytest.approx(
            given_to_it - book.friction - book.stops, abs=1e-12
        )
        lost = book.touch_damping + book.touch_friction
        in_plate = rig.stored_energy + lost - book.carried
        assert -book.touch == pytest.approx(in_plate, abs=4e-3 * (lost + abs(book.carried)) + 1e-5)
    assert touched > 1_000
    assert 1e-4 < deepest < 5e-3
    assert rig.energy.touch_friction > 1e-4
    before = rig.energy
    rig.remove_material()
    assert rig.stored_energy == 0.0
    after = rig.energy
    assert after.touch_friction == before.touch_friction
    assert after.touch_damping >= before.touch_damping


def test_blades_thrown_at_a_springy_plate_come_back_as_fast() -> None:
    truth = specimen(
        mechanism={"friction": NO_FRICTION, "advance": {"coulomb_N": 1e3}},
        motor={"cogging_Nm": 0.0},
        sensors=QUIET,
        plate={**LEVEL, "damping_N_s_per_m": 0.0, "friction": 0.0},
    )
    rig = VirtualRig(truth, np.random.default_rng(1))
    assert rig.load_plate()
    assert rig.plate is not None
    rig.joint.rate = -2.0
    peak = 0.0
    for _ in range(400):
        rig.tick(0.0, 0.0)
        peak = max(peak, rig.plate.normal_N)
        if rig.rate > 0.0 and rig.plate.normal_N == 0.0:
            break
    assert rig.rate == pytest.approx(2.0, rel=5e-3)
    lever = rig.plate.tip(opening_at(10e-3), 0.0)[0] / 2.0
    mass = 2e-4 / lever**2
    assert peak == pytest.approx(2.0 * lever * math.sqrt(1e4 * mass), rel=0.03)


def test_a_plate_is_refused_where_there_is_none_or_the_tip_blocks_it() -> None:
    without = VirtualRig(specimen(), np.random.default_rng(1))
    assert not without.load_plate()
    rig = VirtualRig(specimen(plate=LEVEL), np.random.default_rng(1))
    rig.joint.place, rig.carriage.place = math.radians(9.0), 0.0
    assert not rig.load_plate()
    rig.joint.place, rig.carriage.place = math.radians(50.0), -0.02
    assert rig.load_sheet()
    assert rig.load_plate()
    assert rig.cut is None
    assert rig.load_sheet()
    assert rig.plate is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"surface": "sphere"}, "radius_mm"),
        ({"radius_mm": 30.0}, "radius_mm"),
        ({"extent_mm": (5.0, 5.0)}, "extent_mm"),
        ({"friction": float("nan")}, "friction"),
    ],
)
def test_impossible_plates_are_refused(change: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        specimen(plate={**LEVEL, **change})


@settings(max_examples=40)
@given(data=st.data())
def test_no_plate_and_command_give_a_number_that_is_not_finite(
    data: st.DataObject,
) -> None:
    angle = st.floats(-45, 45)
    plate = {
        **LEVEL,
        "surface": data.draw(st.sampled_from(["plane", "cylinder", "sphere"])),
        "pitch_deg": data.draw(angle),
        "yaw_deg": data.draw(angle),
        "roll_deg": data.draw(angle),
        "stiffness_N_per_mm": data.draw(st.floats(0.1, 200)),
        "damping_N_s_per_m": data.draw(st.floats(0, 200)),
        "friction": data.draw(st.floats(0, 1)),
        "drift_mm_per_s": (data.draw(st.floats(-1e3, 1e3)), 5.0, 0.0),
        "step_turn_deg": data.draw(angle),
        "step_at_s": 0.1,
        "extent_mm": (-100.0, 100.0),
    }
    plate["radius_mm"] = None if plate["surface"] == "plane" else data.draw(st.floats(1, 1e3))
    truth: Specimen = specimen(plate=plate)
    rig = VirtualRig(truth, np.random.default_rng(data.draw(st.integers(0, 99))))
    rig.joint.place = math.radians(50.0)
    rig.load_plate()
    for tick in range(300):
        torque = -0.5 if tick % 90 < 60 else 0.4
        measured = rig.tick(torque, 20.0 if tick % 70 < 35 else -20.0)
        assert all(math.isfinite(value) for value in measured[:4])
