"""What is neglected where two moving blades are taken to hold a plate in their middle."""

import math

import numpy as np
import pytest

from scissorcal.kernel import PlacedModel
from scissorcal.render.pose_section import pose_section
from tests.kernel.zoo import make_tables
from tests.render.plate_motion import FLAT, turned
from tests.render.two_blades import Held, TwoBlades

NEAR_M = 0.02


def both(
    pitch_deg: float, height_m: float, opening: float, thickness_m: float, support: float
) -> tuple[float, float]:
    """Running torque of the kernel's plate, and of one that two blades hold where it is."""
    tables = make_tables(upper_face=0.5 * thickness_m)
    pitch = math.radians(pitch_deg)
    rotation = turned(np.array([0.0, 0.0, pitch])) @ FLAT
    middle = np.array([0.0, height_m, 0.0])
    found = pose_section(
        rotation, middle + rotation @ np.array([0.0, 0.0, 0.5 * thickness_m]), tables.upper_face, 2
    )
    assert found is not None
    assert found.height_m == pytest.approx(height_m, abs=1e-12)
    assert found.pitch_rad == pytest.approx(pitch)
    ours = PlacedModel(tables).torque(found.section, opening, -NEAR_M, 0.0)
    held = TwoBlades(tables, thickness_m, support)
    return ours, held.running_torque(Held(opening, pitch, NEAR_M, height_m))[0]


@pytest.mark.parametrize("opening", [0.3, 0.5])
@pytest.mark.parametrize("thickness_m", [1e-4, 2e-3])
@pytest.mark.parametrize(
    ("pitch_deg", "height_m", "most"),
    [(0.0, 0.0, 2e-5), (0.0, 0.01, 2e-5), (5.0, 0.0, 1e-3), (5.0, 0.005, 1e-3), (10.0, 0.0, 4e-3)],
)
def test_a_plate_that_gives_way_is_rendered_as_it_is(
    pitch_deg: float, height_m: float, most: float, thickness_m: float, opening: float
) -> None:
    """Height does not matter, and pitch by less than half a percent up to 10 degrees."""
    ours, true = both(pitch_deg, height_m, opening, thickness_m, 0.0)
    assert true > 0.02
    assert abs(ours / true - 1.0) < most


@pytest.mark.parametrize(("support", "least", "most"), [(10.0, 0.0, 0.012), (100.0, 0.05, 0.1)])
def test_a_support_that_holds_the_plate_off_the_middle_is_felt(
    support: float, least: float, most: float
) -> None:
    """By 1 % for each 10 N/m at 5 degrees and some mm, which is not rendered."""
    ours, true = both(5.0, 0.005, 0.3, 1e-4, support)
    assert least <= 1.0 - ours / true < most
