"""A plate's pose as it is typed, in both notations."""

import numpy as np
import pytest

from scissorcal.device import TouchedPlate, plate_pose
from scissorcal.errors import InputError
from scissorcal.tracking import level_plate
from scissorcal.workday.tracking.stated_pose import stated_pose

SAME = (
    "20,10,4",
    "x=20,y=10,yaw=4,pitch=0,roll=-90",
    " x=20, y=10, z=0, roll=-90, pitch=0, yaw=4",
    "x=20,y=10,qw=0.706676,qx=-0.706676,qy=-0.024678,qz=0.024678",
    "x=20,y=10,qw=-0.7067,qx=0.7067,qy=0.0247,qz=-0.0247",
    "x=20,y=10,qw=0.706676,qx=-0.706676,qy=-0.024678,qz=0.024678,yaw=4,pitch=0,roll=-90",
)


@pytest.mark.parametrize("text", SAME)
def test_one_pose_in_every_notation(text: str) -> None:
    turn, place = level_plate((20.0, 10.0, 0.0), 4.0)
    found = stated_pose(text)
    assert found.translation_m == pytest.approx(tuple(place))
    assert found.matrix == pytest.approx(turn, abs=2e-4)


def test_a_specimens_angles_are_those_of_the_conventions_table() -> None:
    """yaw = pitch_deg, pitch = yaw_deg, roll = roll_deg - 90."""
    plate = TouchedPlate(place_mm=(20.0, 10.0, 1.0), pitch_deg=12.0, yaw_deg=-20.0, roll_deg=30.0)
    axes, _ = plate_pose(plate, 0.0)
    found = stated_pose("x=20,y=10,z=1,yaw=12,pitch=-20,roll=-60")
    assert pytest.approx(np.array(axes), abs=1e-9) == found.matrix.T


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x=1,y=2", "has no rotation"),
        ("x=1,yaw=0,pitch=0,roll=-90", "lacks y"),
        ("x=1,y=2,yaw=0,pitch=0", "lacks roll"),
        ("x=1,y=2,qw=1,qx=0", "lacks qy and qz"),
        ("x=1,y=2,yaw=0,pitch=0,tilt=3", "unknown 'tilt'"),
        ("x=1,y=2,yaw=0,yaw=1,pitch=0,roll=0", "is none"),
        ("x=1,y=2,yaw=0,pitch=nan,roll=0", "is none"),
        ("x=1,y=2,yaw=,pitch=1,roll=0", "is none"),
        ("x=1,y=2,yaw=400,pitch=0,roll=0", "400 degrees is none"),
        ("x=1,y=2,yaw=0.05,pitch=0,roll=-1.5708", r"88 deg away.* radians .* by 3 deg"),
        ("x=0.02,y=0.01,z=0,yaw=0,pitch=0,roll=-90", r"in m\? 0\.02 m = 20 mm"),
        ("0.15,0.05,4", r"in m\? 0\.15 m = 150 mm"),
        ("20000,10000,4", "is 20000 mm"),
        ("x=1,y=2,qw=1,qx=1,qy=0,qz=0", r"length 1\.41421"),
        ("x=1,y=2,qw=1,qx=0,qy=0,qz=0,yaw=0,pitch=0,roll=-90", r"differ by 90\.00 deg"),
    ],
)
def test_what_is_no_pose_is_refused_with_the_reason(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        stated_pose(text)


@pytest.mark.parametrize("text", ["0,0,4", "0.3,0,4", "2000,0,4", "-5,-150,0", "1e-12,0,0"])
def test_a_place_that_is_uncommon_is_kept(text: str) -> None:
    assert stated_pose(text).translation_m[0] == pytest.approx(1e-3 * float(text.split(",")[0]))
