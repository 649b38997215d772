"""A joint pushed by a motor, simulated in C along a record."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel._kernel import ffi, lib

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """Inertia, dry friction with presliding of two lengths, viscous friction, load, motor lag.

    Units are SI and radians; ``rise`` is what dry friction is more at rest than in motion, which
    falls by exp(-(rate / rise_rate)^2); ``carrying`` (N m) moves the blades without a motor.
    """

    inertia: float
    opening: float
    closing: float
    rise: float
    rise_rate: float
    viscous: float
    fine: float
    slow: float
    slow_share: float
    bristle: float
    carrying: float
    carrying_slope: float
    turn: float
    motor_lag: float


_NAMES = tuple(entry.name for entry in fields(Joint))


def follow_joint(
    joint: Joint, times: Array, rests: Array, switches: Array, torques: Array, step_s: float
) -> Array:
    """Places (rad) at ``times`` (n,), as sc_joint.h says.

    ``rests`` (n,) is finite where the joint stands, ``torques`` (m,) act from ``switches`` (m,) on.
    """
    struct = ffi.new("sc_joint *", {name: getattr(joint, name) for name in _NAMES})
    places = np.empty(len(times))
    arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (times, rests, switches, torques)]
    buffers = [ffi.from_buffer("double[]", a) for a in arrays]
    lib.sc_joint_follow(
        struct,
        buffers[0],
        buffers[1],
        len(times),
        buffers[2],
        buffers[3],
        len(torques),
        step_s,
        ffi.from_buffer("double[]", places),
    )
    return places
