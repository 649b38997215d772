"""Contacts of the tip from samples: place, force by the balance of the opening axis, gaps."""

import numpy as np
import pytest

from scissorcal.model import AxisLaw, BladePoint, FrictionLaw, Plane
from scissorcal.tracking.rows import EVERY_S, CameraPose, TipContact, TipContacts
from scissorcal.tracking.tracker import Outcome, PoseTracker

TIP = BladePoint(station_m=0.075, offset_m=-0.005, moving_blades=2)
UP = np.array([0.0, 1.0, 0.0])
INERTIA, COULOMB, VISCOUS, OFFSET = 2e-4, 0.013, 0.002, 3e-4
AXIS = AxisLaw(
    INERTIA, FrictionLaw({"coulomb": COULOMB, "viscous": VISCOUS}), OFFSET, rest_rate=0.02
)


def samples(seconds: float, force: float, normal: np.ndarray = UP) -> tuple[np.ndarray, ...]:
    """Samples of blades that close and open while a tip is pressed by ``force`` along a normal."""
    time = 1e-3 * np.arange(round(seconds * 1e3))
    turn = 2.0 * np.pi * 0.5 * time
    opening, rate = 0.4 + 0.1 * np.cos(turn), -0.1 * np.pi * np.sin(turn)
    acceleration = -0.1 * np.pi**2 * np.cos(turn)
    advance = 0.01 * np.sin(turn)
    beta = opening / 2.0
    x = 0.075 * np.cos(beta) + 0.005 * np.sin(beta)
    y = 0.075 * np.sin(beta) - 0.005 * np.cos(beta)
    lever = 0.5 * (-y * normal[0] + x * normal[1])
    friction = COULOMB * np.sign(rate) + VISCOUS * rate
    drive = INERTIA * acceleration + friction + OFFSET - lever * force
    return time, opening, advance, drive


def moving(found: list[TipContact]) -> list[TipContact]:
    """Contacts at which the blades slide: while they turn round, friction is not known."""
    return [one for one in found if abs(np.sin(np.pi * one.time_s)) > 0.3]


@pytest.mark.parametrize("force", [0.0, 2.0])
@pytest.mark.parametrize("tilt_deg", [0.0, 25.0])
def test_the_force_is_that_of_the_balance(force: float, tilt_deg: float) -> None:
    angle = np.radians(tilt_deg)
    normal = np.array([-np.sin(angle), np.cos(angle), 0.0])
    found = TipContacts(TIP, AXIS).take(*samples(4.0, force, normal), normal)
    assert len(moving(found)) > 250
    errors = [one.force_N - force for one in moving(found)]
    assert np.abs(errors).max() < 2e-3


def test_the_place_is_the_tips() -> None:
    time, opening, advance, drive = samples(1.0, 2.0)
    found = TipContacts(TIP, AXIS).take(time, opening, advance, drive, UP)
    for one in found:
        at = round(one.time_s * 1e3)
        beta = 0.5 * opening[at]
        x = advance[at] + 0.075 * np.cos(beta) + 0.005 * np.sin(beta)
        assert one.point_m == pytest.approx(
            [x, 0.075 * np.sin(beta) - 0.005 * np.cos(beta), 0.0], abs=2e-5
        )
    steps = np.diff([one.time_s for one in found])
    assert steps == pytest.approx(EVERY_S, abs=1e-9)


@pytest.mark.parametrize("block", [1, 7, 50, 333])
def test_blocks_of_any_size_give_the_same_contacts(block: int) -> None:
    rows = samples(0.7, 1.0)
    whole = TipContacts(TIP, AXIS).take(*rows, UP)
    contacts = TipContacts(TIP, AXIS)
    parts = [
        one
        for start in range(0, len(rows[0]), block)
        for one in contacts.take(*(row[start : start + block] for row in rows), UP)
    ]
    assert [one.time_s for one in parts] == [one.time_s for one in whole]
    assert [one.force_N for one in parts] == pytest.approx([one.force_N for one in whole])


def test_a_gap_is_no_motion() -> None:
    """Blades that moved while samples were missing did not accelerate by it."""
    time, opening, advance, drive = samples(2.0, 1.0)
    kept = (time < 0.5) | (time > 1.3)
    found = TipContacts(TIP, AXIS).take(time[kept], opening[kept], advance[kept], drive[kept], UP)
    assert max(abs(one.force_N) for one in found) < 1.8
    assert not [one for one in found if 0.48 < one.time_s < 1.32]


def test_without_an_identified_axis_friction_is_taken_for_force() -> None:
    found = moving(TipContacts(TIP).take(*samples(4.0, 2.0), UP))
    off = max(abs(one.force_N - 2.0) for one in found)
    assert 0.9 * COULOMB / 0.0375 < off < 1.5 * COULOMB / 0.0375


def test_a_normal_along_the_blades_motion_gives_no_force() -> None:
    assert TipContacts(TIP, AXIS).take(*samples(0.5, 1.0), np.array([1.0, 0.0, 0.0])) == []


def test_blades_that_stand_in_the_air_touch_nothing() -> None:
    """Dry friction holds what presses on the handles: 0.35 N at a tip that touches nothing."""
    time = 1e-3 * np.arange(200)
    held = 0.9 * COULOMB
    still = np.full(200, 0.6)
    found = TipContacts(TIP, AXIS).take(time, still, 0.0 * time, OFFSET - held + 0.0 * time, UP)
    tracker = PoseTracker(Plane())
    tracker.picture(CameraPose(0.0, np.eye(3), np.zeros(3), 1e-8 * np.eye(6)))
    assert len(found) > 10
    for one in found:
        assert one.force_N > 0.3
        outcome, _ = tracker.contact(one.time_s, one.point_m, one.force_N, hidden_N=one.hidden_N)
        assert outcome is Outcome.NO_CONTACT
    pressed = TipContacts(TIP, AXIS).take(
        time, still, 0.0 * time, OFFSET - held - 2.0 * 0.034 + 0.0 * time, UP
    )
    assert all(one.force_N - one.hidden_N > 1.5 for one in pressed)
