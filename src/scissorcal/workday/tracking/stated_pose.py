"""A plate's pose in the rig's frame, as it is typed."""

import math

from scissorcal.errors import InputError
from scissorcal.recipe.euler_angles import EulerAngles, one_rotation
from scissorcal.recipe.unlikely import EVERYDAY, MARGIN, bounds
from scissorcal.tracking.plate_pose import level_plate
from scissorcal.vision.geometry.pose import Pose

_PLACE, _ANGLES, _QUATERNION = "xyz", ("yaw", "pitch", "roll"), ("qw", "qx", "qy", "qz")
PRESSED_WITHIN_DEG = 60.0
"""Of a normal to the rig's plane on which a tip presses (`control.contours.LEAST_SHARE`)."""
_KEYS = (*_PLACE, *_ANGLES, *_QUATERNION)


def stated_pose(text: str) -> Pose:
    """A pose by its place (mm) and its rotation, by Euler angles (degrees) or a quaternion.

    "x=20,y=10,z=0,yaw=4,pitch=0,roll=-90" and "x=20,y=10,z=0,qw=1,qx=0,qy=0,qz=0" are poses in
    space; z is 0 where it is not given. "20,10,4" is short for a plate that lies level on the rig's
    plane and rises by 4 degrees along the cut: that turn about the rig's z is its yaw.

    Raises InputError where the text is no pose, both rotations are given and differ, or the place
    or angles are in another unit.

    >>> stated_pose("20,10,4").euler_angles.words
    'yaw 4.00, pitch 0.00, roll -90.00 deg'
    """
    pose = _by_keys(text) if "=" in text else _short(text)
    _refuse_other_unit(pose, text)
    return pose


def _short(text: str) -> Pose:
    numbers = [_number(part) for part in text.split(",")]
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise _no_pose(text)
    x, y, rise = (*numbers, 0.0)[:3]
    return Pose.from_matrix(*level_plate((x, y, 0.0), rise))


def _by_keys(text: str) -> Pose:
    given: dict[str, float] = {}
    for part in text.split(","):
        key, _, value = part.partition("=")
        key, number = key.strip(), _number(value)
        if key not in _KEYS:
            raise InputError(
                f"The pose '{text[:100]}' has the unknown '{key[:20]}'. Its keys are x, y, z (mm), "
                "yaw, pitch, roll (degrees) or qw, qx, qy, qz."
            )
        if key in given or not math.isfinite(number):
            raise _no_pose(text)
        given[key] = number
    for keys in (("x", "y"), _ANGLES, _QUATERNION):
        lacking = [key for key in keys if key not in given]
        if lacking and (len(lacking) < len(keys) or keys == ("x", "y")):
            raise InputError(
                f"The pose '{text[:100]}' lacks {' and '.join(lacking)}: give "
                f"{', '.join(keys)} together."
            )
    quaternion = [given[key] for key in _QUATERNION] if "qw" in given else None
    angles = None
    if "yaw" in given:
        angles = EulerAngles(given["yaw"], given["pitch"], given["roll"])
        _refuse_radians(angles, text)
    turn = one_rotation(quaternion, angles, "the stated pose")
    x, y, z = (1e-3 * given.get(key, 0.0) for key in _PLACE)
    return Pose(turn, (x, y, z))


def _refuse_other_unit(pose: Pose, text: str) -> None:
    """Refuse a place that would be everyday in m, or that no plate has, as recipes refuse it."""
    size = 1e3 * max(map(abs, pose.translation_m))
    place, most = EVERYDAY["plate_place"], bounds("plate.place_mm")[1]
    near, far = place.ends
    is_in_m = near / MARGIN <= size <= far * MARGIN
    if size <= most and not is_in_m:
        return
    slip = f" Was it in m? {size:g} m = {1e3 * size:g} mm." if is_in_m else ""
    raise InputError(
        f"The largest coordinate of the pose '{text[:100]}' is {size:g} mm, far from the everyday "
        f"{1e3 * near:g} to {1e3 * far:g} mm ({place.why}).{slip} Give x, y and z in mm."
    )


def _refuse_radians(angles: EulerAngles, text: str) -> None:
    """Refuse angles by which the face looks past the blades, but not if they are radians."""
    numbers = (angles.yaw_deg, angles.pitch_deg, angles.roll_deg)
    if any(abs(value) > 2.0 * math.pi for value in numbers):
        return
    yaw, pitch, roll = (math.degrees(value) for value in numbers)
    faces = _face_deg(angles), _face_deg(EulerAngles(yaw, pitch, roll))
    if faces[0] > PRESSED_WITHIN_DEG >= faces[1]:
        raise InputError(
            f"The pose '{text[:100]}' turns the plate's face {faces[0]:.0f} deg away from the "
            f"blades; in radians its angles would turn it by {faces[1]:.0f} deg. Give degrees."
        )


def _face_deg(angles: EulerAngles) -> float:
    """Angle between the plate's z, out of its face, and the rig's y, towards the blades."""
    up = Pose(angles.quaternion, (0.0, 0.0, 0.0)).matrix[1, 2]
    return math.degrees(math.acos(min(1.0, max(-1.0, up))))


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _no_pose(text: str) -> InputError:
    return InputError(
        f"The pose '{text[:100]}' is none: give X_MM,Y_MM,RISE_DEG, such as 20,10,4, the place of "
        "the plate's origin in the rig's plane and its turn about the pivot's axis; or each number "
        "by its name, such as x=20,y=10,z=0,yaw=4,pitch=0,roll=-90."
    )
