"""The section of a plate in space with the rig's plane, against points of the plate."""

from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.render.pose_section import pose_section
from tests.render.plate_motion import FLAT, section_by_points, turned

angles = st.tuples(*([st.floats(-0.4, 0.4)] * 3))
places = st.tuples(*([st.floats(-0.1, 0.1)] * 3))
FACE = 0.002


@pytest.mark.parametrize("blades", [1, 2])
@settings(max_examples=200)
@given(angle=angles, place=places)
def test_a_section_is_where_points_of_the_plate_meet_the_plane(
    blades: int, angle: tuple[float, ...], place: tuple[float, ...]
) -> None:
    rotation, translation = turned(np.array(angle)) @ FLAT, np.array(place)
    found = pose_section(rotation, translation, FACE, blades)
    assert found is not None
    wanted = section_by_points(rotation, translation, FACE, blades)
    np.testing.assert_allclose(astuple(found.section), wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("blades", [1, 2])
@settings(max_examples=100)
@given(angle=angles, place=places)
def test_slopes_are_those_of_the_section(
    blades: int, angle: tuple[float, ...], place: tuple[float, ...]
) -> None:
    """By a rotation vector in the rig's axes, applied after the rotation, then the translation."""
    rotation, translation = turned(np.array(angle)) @ FLAT, np.array(place)
    found = pose_section(rotation, translation, FACE, blades)
    assert found is not None
    for index, step in enumerate(1e-6 * np.eye(6)):
        up, down = (
            section_by_points(turned(s * step[:3]) @ rotation, place + s * step[3:], FACE, blades)
            for s in (1.0, -1.0)
        )
        slope = (np.array(up) - np.array(down)) / 2e-6
        np.testing.assert_allclose(found.slopes[:, index], slope, rtol=1e-5, atol=1e-7)


def test_yaw_moves_the_edge_by_how_far_the_plate_lies_beside_the_plane() -> None:
    """A plate whose origin is 50 mm aside, yawed by 5 degrees about the pivot's plane's normal."""
    yaw = turned(np.array([0.0, np.radians(5.0), 0.0]))
    found = pose_section(yaw @ FLAT, [0.03, FACE, 0.05], FACE, 1)
    assert found is not None
    section = found.section
    assert section.edge_x == pytest.approx(0.03 - 0.05 * np.tan(np.radians(5.0)))
    assert section.stretch == pytest.approx(1.0 / np.cos(np.radians(5.0)))
    assert (section.pitch, section.thickening) == (0.0, 1.0)


def test_roll_thickens_and_pitch_pitches() -> None:
    rolled = pose_section(turned(np.array([0.1, 0.0, 0.0])) @ FLAT, np.zeros(3), FACE, 1)
    pitched = pose_section(turned(np.array([0.0, 0.0, 0.1])) @ FLAT, np.zeros(3), FACE, 1)
    assert rolled is not None
    assert pitched is not None
    assert rolled.section.thickening == pytest.approx(1.0 / np.cos(0.1))
    assert pitched.section.pitch == pytest.approx(0.1)
    assert pitched.section.thickening == pytest.approx(1.0)


@pytest.mark.parametrize(
    "turn",
    [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (np.pi, 0.0, 0.0), (0.0, np.pi, 0.0)],
)
@pytest.mark.parametrize("blades", [1, 2])
def test_a_plate_that_stands_across_has_no_section(turn: tuple[float, ...], blades: int) -> None:
    assert pose_section(turned(np.array(turn)) @ FLAT, np.zeros(3), FACE, blades) is None
    assert pose_section(FLAT, [0.0, np.nan, 0.0], FACE, blades) is None
    assert pose_section(np.full((3, 3), np.inf), np.zeros(3), FACE, blades) is None
