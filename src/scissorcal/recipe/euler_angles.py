"""Euler angles of a rotation, in degrees: the second notation of what a quaternion holds.

Intrinsic z-y'-x'': yaw about z, pitch about the turned y, roll about the twice turned x, so that
R = Rz(yaw) Ry(pitch) Rx(roll). The same angles, applied in the order roll, pitch, yaw about the
axes x, y, z that stay (extrinsic x-y-z), give the same rotation: this is roll-pitch-yaw.

At a pitch of 90 or -90 degrees only yaw - roll or yaw + roll is determined. Programs therefore
compute with the quaternion; it counts where both are given.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ConfigDict, Field

from scissorcal.aliases import Array
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Quaternion = tuple[float, float, float, float]
Degrees = Annotated[float, Field(strict=True)]
Convention = Literal["intrinsic z-y'-x'' (extrinsic roll-pitch-yaw x-y-z)"]

CONVENTION: Convention = "intrinsic z-y'-x'' (extrinsic roll-pitch-yaw x-y-z)"
DECIMALS = 2
"""Of printed angles, in degrees: the sd of a good pose is 0.05 degrees."""
HALF_DIGIT_DEG = 0.5 * 10.0**-DECIMALS
"""Nearer to 90 degrees the pitch is printed as 90.00, and the printed angles are those of the
singularity itself."""
LEAST_SDS = 3.0
"""Standard deviations of the rotation by which the x axis must differ from the pole. Its horizontal
part has length s = cos(pitch) and errors of sd r s in both directions, so that the variance of the
yaw is r^2 + r^4 + ...: from r = 1/3 down the linear sd is at most 6 % too small. The pole then lies
outside the set that holds the axis with probability 1 - exp(-9/2) = 0.989."""
ROUNDED_LENGTH = 1e-4
"""How far four components of four decimals may be from a length of one."""
AGREE_DEG = 3.0 * HALF_DIGIT_DEG + math.degrees(2.0 * ROUNDED_LENGTH)
"""How far both notations of one rotation may be apart: three printed angles, each off by half of
its last digit, and a quaternion of four decimals."""
LARGEST_DEG = 360.0
NO_QUATERNION: Quaternion = (0.0, 0.0, 0.0, 0.0)
_LOCK = 2e-7
"""Rotation.as_euler sets the roll to 0 within 1e-7 rad of the singularity, with a warning; here it
is 0 within 2e-7, without. The rotation changes by at most twice that."""


class RotationError(InputError, ValueError):
    """Numbers that are no rotation, or two different ones."""


@dataclass(frozen=True)
class EulerAngles:
    """Yaw, pitch and roll of a rotation in degrees; ``convention`` states their order.

    ``sd_deg`` are their standard deviations where a covariance is known and they are determined.
    ``note`` is empty, or a sentence on what is determined near a pitch of 90 or -90 degrees.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    yaw_deg: Degrees
    pitch_deg: Degrees
    roll_deg: Degrees
    convention: Convention = CONVENTION
    sd_deg: tuple[float, float, float] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        """Refuse what are no angles in degrees: RotationError."""
        for name, value in zip(("yaw", "pitch", "roll"), self._degrees, strict=True):
            if not abs(value) <= LARGEST_DEG:
                raise RotationError(
                    f"A {name} of {value:g} degrees is none: give -{LARGEST_DEG:g} to "
                    f"{LARGEST_DEG:g} degrees."
                )

    @staticmethod
    def of(quaternion: Sequence[float], covariance: Array | None = None) -> "EulerAngles":
        """The angles of a unit quaternion (w, x, y, z).

        ``covariance`` (3, 3) or (6, 6) is that of a rotation vector in the outer axes (rad) first.

        >>> EulerAngles.of((0.5**0.5, -(0.5**0.5), 0.0, 0.0)).words  # a level plate on the rig
        'yaw 0.00, pitch 0.00, roll -90.00 deg'
        """
        yaw, pitch, roll = (float(value) for value in euler_deg(quaternion))
        turn = None if covariance is None else np.asarray(covariance, dtype=np.float64)[:3, :3]
        reach = float(singular_within_deg(turn))
        if 90.0 - abs(pitch) <= reach:
            return EulerAngles(yaw, pitch, roll, note=_note(yaw, pitch, roll, reach))
        sds = None if turn is None else _sds_deg(yaw, pitch, turn)
        return EulerAngles(yaw, pitch, roll, sd_deg=sds)

    @property
    def quaternion(self) -> Quaternion:
        """The unit quaternion (w, x, y, z), w >= 0."""
        from scipy.spatial.transform import Rotation

        return _quaternion(Rotation.from_euler("ZYX", self._degrees, degrees=True))

    @property
    def words(self) -> str:
        """The angles as they are printed."""
        yaw, pitch, roll = self.printed
        return f"yaw {yaw}, pitch {pitch}, roll {roll} deg"

    @property
    def printed(self) -> tuple[str, str, str]:
        """Yaw, pitch and roll alone, for a table."""
        yaw, pitch, roll = (_printed(value) for value in self._degrees)
        return yaw, pitch, roll

    @property
    def _degrees(self) -> tuple[float, float, float]:
        return self.yaw_deg, self.pitch_deg, self.roll_deg


def quaternion_words(quaternion: Sequence[float]) -> str:
    """A quaternion as it is printed, with as many decimals as a pose is read with.

    >>> quaternion_words((0.5**0.5, -(0.5**0.5), 0.0, 0.0))
    'w 0.707107, x -0.707107, y 0.000000, z 0.000000'
    """
    pairs = zip("wxyz", quaternion, strict=True)
    return ", ".join(f"{name} {round(value, 6) + 0.0:.6f}" for name, value in pairs)


def euler_deg(quaternions: ArrayLike) -> Array:
    """Yaw, pitch and roll (..., 3) in degrees of unit quaternions (..., 4) as w, x, y, z.

    The roll is 0 at the singularity. What is no unit quaternion has angles that are NaN.
    """
    from scipy.spatial.transform import Rotation

    given = np.asarray(quaternions, dtype=np.float64)
    flat = given.reshape(-1, 4)
    angles = np.full((len(flat), 3), np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        unit = np.abs(np.linalg.norm(flat, axis=1) - 1.0) <= ROUNDED_LENGTH
    known = np.flatnonzero(unit)
    if known.size:
        turns = Rotation.from_quat(flat[known][:, [1, 2, 3, 0]])
        matrices = turns.as_matrix()
        level = np.hypot(matrices[:, 0, 0], matrices[:, 1, 0])
        free = level > _LOCK
        if free.any():
            angles[known[free]] = turns[free].as_euler("ZYX", degrees=True)
        for at, matrix, small in zip(known[~free], matrices[~free], level[~free], strict=True):
            yaw, pitch = np.arctan2(-matrix[0, 1], matrix[1, 1]), np.arctan2(-matrix[2, 0], small)
            angles[at] = np.degrees(yaw), np.degrees(pitch), 0.0
    return angles.reshape(*given.shape[:-1], 3)


def singular_within_deg(covariance: Array | None) -> Array:
    """Distance of the pitch from 90 degrees below which yaw and roll alone are not determined.

    ``covariance`` (..., 3, 3) is that of a rotation vector in the outer axes (rad). Only its turns
    about x and y move the x axis where that is vertical.
    """
    if covariance is None:
        return np.asarray(HALF_DIGIT_DEG)
    with np.errstate(invalid="ignore", over="ignore"):
        xx, yy, xy = covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
        largest = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
        reach = np.minimum(LEAST_SDS * np.sqrt(np.maximum(largest, 0.0)), 1.0)
    return np.asarray(np.maximum(np.degrees(np.arcsin(reach)), HALF_DIGIT_DEG))


def angles_alone(known: dict[str, Any]) -> Quaternion:
    """The quaternion of a record that states ``euler_angles`` alone; zeros where it has neither."""
    angles: EulerAngles | None = known.get("euler_angles")
    return angles.quaternion if angles else NO_QUATERNION


def one_rotation(
    quaternion: Sequence[float] | None, angles: EulerAngles | None, whose: str
) -> Quaternion:
    """The unit quaternion (w, x, y, z) of a rotation in either notation, or in both.

    ``whose`` names the rotation in the sentence of a RotationError, which is raised where neither
    is given, the quaternion has not a length of one, or both are given and differ.
    """
    if quaternion is None or tuple(quaternion) == NO_QUATERNION:
        if angles is None:
            raise RotationError(
                f"{whose[0].upper()}{whose[1:]} has no rotation: give the quaternion "
                "(w, x, y, z), or yaw, pitch and roll in degrees."
            )
        return angles.quaternion
    length = math.hypot(*quaternion)
    if not abs(length - 1.0) <= ROUNDED_LENGTH:
        raise RotationError(
            f"The quaternion of {whose} has length {length:.6g}; that of a rotation has length 1. "
            "Check its four numbers (w, x, y, z)."
        )
    w, x, y, z = (float(part) / length for part in quaternion)
    if angles is not None:
        apart = _apart_deg((w, x, y, z), angles.quaternion)
        if apart > AGREE_DEG:
            raise RotationError(
                f"Quaternion and Euler angles of {whose} differ by {apart:.2f} deg "
                f"({AGREE_DEG:.2f} deg is rounding): they are two rotations. The quaternion's "
                f"angles are {EulerAngles.of((w, x, y, z)).words}. {_likely((w, x, y, z), angles)}"
                "Give one of them, or correct the other."
            )
    return w, x, y, z


def _likely(quaternion: Quaternion, angles: EulerAngles) -> str:
    """The slip by which both would be one rotation, in a sentence; else nothing."""
    from scipy.spatial.transform import Rotation

    yaw, pitch, roll = angles.yaw_deg, angles.pitch_deg, angles.roll_deg
    w, x, y, z = quaternion
    given = angles.quaternion
    read = {
        "the quaternion was given as (x, y, z, w)": ((z, w, x, y), given),
        "the quaternion is of the inverse rotation": ((w, -x, -y, -z), given),
        "the angles are in radians": (
            quaternion,
            _quaternion(Rotation.from_euler("ZYX", [yaw, pitch, roll])),
        ),
        "the angles are intrinsic x-y'-z''": (
            quaternion,
            _quaternion(Rotation.from_euler("XYZ", [roll, pitch, yaw], degrees=True)),
        ),
    }
    for words, pair in read.items():
        if _apart_deg(*pair) <= AGREE_DEG:
            return f"They agree if {words}. "
    return ""


def _quaternion(turn: "Rotation") -> Quaternion:
    x, y, z, w = turn.as_quat(canonical=True).tolist()
    return w, x, y, z


def _apart_deg(a: Quaternion, b: Quaternion) -> float:
    """The angle of the turn from first unit quaternion to the second."""
    first, second = np.array(a), np.array(b)
    near = min(float(np.linalg.norm(first - second)), float(np.linalg.norm(first + second)))
    return math.degrees(4.0 * math.asin(min(0.5 * near, 1.0)))


def _sds_deg(yaw: float, pitch: float, covariance: Array) -> tuple[float, float, float]:
    """Standard deviations of yaw, pitch and roll: a small turn is their sum about z, y' and x''."""
    psi, theta = math.radians(yaw), math.radians(pitch)
    forward = np.array([math.cos(psi), math.sin(psi), 0.0])
    axes = np.array(
        [
            [0.0, 0.0, 1.0],
            [-forward[1], forward[0], 0.0],
            [*(math.cos(theta) * forward[:2]), -math.sin(theta)],
        ]
    ).T
    slope = np.linalg.inv(axes)
    variances = np.maximum(np.diag(slope @ covariance @ slope.T), 0.0)
    yaw_sd, pitch_sd, roll_sd = np.degrees(np.sqrt(variances)).tolist()
    return yaw_sd, pitch_sd, roll_sd


def _note(yaw: float, pitch: float, roll: float, reach: float) -> str:
    name, sign, value = ("difference", "-", yaw - roll) if pitch > 0 else ("sum", "+", yaw + roll)
    value = (value + 180.0) % 360.0 - 180.0
    why = (
        "half of the last printed digit"
        if reach <= HALF_DIGIT_DEG
        else f"{LEAST_SDS:g} standard deviations of the pose"
    )
    return (
        f"The pitch is {_printed(pitch)} deg, within {reach:.2g} deg ({why}) of "
        f"{math.copysign(90.0, pitch):g} deg: only the {name} yaw {sign} roll = {_printed(value)} "
        "deg is determined, not yaw and roll alone; the quaternion counts."
    )


def _printed(degrees: float) -> str:
    """To `DECIMALS`, without a sign before zero."""
    return f"{round(degrees, DECIMALS) + 0.0:.{DECIMALS}f}"
