"""A joint pushed by a motor, simulated in C along a record."""

from dataclasses import dataclass, fields

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib


@dataclass(frozen=True)
class Joint:
    """Inertia, dry friction with presliding of two lengths, viscous friction, load, motor lag.

    Units are SI and radians; ``rise`` is what dry friction is more at rest than in motion, which
    falls by exp(-(rate / rise_rate)^2); ``carrying`` (N m) moves the blades without a motor.
    ``stop`` is 1 (-1) for blades that rest on a stop and leave it only to larger (smaller) places,
    and ``stop_stiffness`` (N m/rad) how it gives.
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
    stop: float = 0.0
    stop_stiffness: float = 50.0


def follow_joint(
    joint: Joint, times: Array, rests: Array, switches: Array, torques: Array, step_s: float
) -> Array:
    """Places (rad) of one joint at ``times`` (n,), as `follow_joints` has those of several."""
    values = np.array([[getattr(joint, entry.name) for entry in fields(Joint)]])
    return np.asarray(follow_joints(values, times, rests, switches, torques, step_s)[0])


def follow_joints(
    joints: Array, times: Array, rests: Array, switches: Array, torques: Array, step_s: float
) -> Array:
    """Places (rad) of joints (k, fields of `Joint`) at ``times`` (n,): (k, n), as sc_joint.h says.

    ``rests`` (n,) is finite where the joints stand, ``torques`` (m,) act from ``switches`` (m,) on.
    At most 16 joints; all take the steps that the first one needs. Raises ValueError for more, or
    for arrays of other shapes.
    """
    if len(joints) > lib.SC_JOINTS:
        raise ValueError(f"at most {lib.SC_JOINTS} joints can be followed at once")
    if joints.shape[1] != len(fields(Joint)) or len(rests) != len(times):
        raise ValueError(f"a joint has {len(fields(Joint))} values, and each time a rest")
    if len(switches) != len(torques):
        raise ValueError("each switch has a torque")
    places = np.empty((len(joints), len(times)))
    arrays = [
        np.ascontiguousarray(a, dtype=np.float64) for a in (joints, times, rests, switches, torques)
    ]
    buffers = [ffi.from_buffer("double[]", a) for a in arrays]
    lib.sc_joint_follow(
        ffi.cast("sc_joint *", buffers[0]),
        len(joints),
        buffers[1],
        buffers[2],
        len(times),
        buffers[3],
        buffers[4],
        len(torques),
        step_s,
        ffi.from_buffer("double[]", places),
    )
    return places
