"""A joint pushed by a motor, simulated in C along a record."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

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


def presliding_path(opening: Array, length: float) -> Array:
    """How far dry friction has built up since the last reversal, between -1 and 1, shape (n,).

    The same as :func:`scissorcal.model.presliding_state` of ``opening`` (n,) in order of time and
    ``length`` in its unit, to rounding. ValueError where ``length`` is not positive.

    >>> presliding_path(np.array([0.0, 1.0, 0.9, 0.8, -1.0]), 0.1).round(3)
    array([ 1.   ,  1.   , -0.264, -0.729, -1.   ])
    """
    if not length > 0.0:
        raise ValueError(f"length must be positive, not {length}")
    path = np.ascontiguousarray(opening, dtype=np.float64)
    state = np.empty(len(path))
    lib.sc_presliding(
        ffi.cast("double *", ffi.from_buffer(path)),
        len(path),
        float(length),
        ffi.cast("double *", ffi.from_buffer(state)),
    )
    return state


def estimated_rates(opening: ArrayLike, tick_us: int, cutoff_Hz: float) -> Array:
    """Rates (n,) that the servo has at each of the openings (n,), one in each tick.

    By the servo's own C: backward differences behind a first-order low-pass at ``cutoff_Hz``
    (0: none), 0 at the first place. Raises ValueError unless a tick takes at least 1 us.

    >>> estimated_rates([0.0, 0.001, 0.002], tick_us=1000, cutoff_Hz=0.0).round(3)
    array([0., 1., 1.])
    """
    if tick_us < 1:
        raise ValueError(f"a tick takes at least 1 us, not {tick_us}")
    places = np.asarray(opening, dtype=np.float32)
    rates = np.empty(places.size)
    motion = ffi.new("sc_motion *")
    for index, place in enumerate(places.tolist()):
        passed_us = tick_us if index else 0
        lib.sc_motion_update(motion, cutoff_Hz, passed_us, place, 0.0)
        rates[index] = motion.opening_rate
    return rates
