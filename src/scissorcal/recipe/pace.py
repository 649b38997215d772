"""How fast a capture moves between its strokes, and how long a movement takes.

A plan of a capture is made from these, and so is what it costs, before there is a rig.
"""

import math

LEAST_RAMP_S = 0.03
DWELL_S = 0.1
SETTLE_S = 0.3

TURN_ACCELERATION = 20.0
"""Peak acceleration of a stroke's ramps, rad/s^2."""

APPROACH_SPEED = 0.3
ADVANCE_SPEED = 0.08
ADVANCE_ACCELERATION = 0.8
OPENING_SPEED = 1.0
"""Speed at which the blades open again after a cut, rad/s; at most the scene's."""


def ramp_time(speed: float, acceleration: float) -> float:
    """Seconds of one ramp from rest to ``speed`` with a peak of ``acceleration``."""
    return max(LEAST_RAMP_S, math.pi * speed / (2.0 * acceleration))


def ramp_way(speed: float, acceleration: float) -> float:
    """Displacement of one ramp from rest to ``speed``."""
    return 0.5 * speed * ramp_time(speed, acceleration)


def glide_speed(length: float, speed: float, acceleration: float) -> float:
    """Cruising speed over a length, slower than ``speed`` where it is too short to reach that."""
    return min(speed, length / LEAST_RAMP_S, math.sqrt(2.0 * acceleration * length / math.pi))


def glide_time(length: float, speed: float, acceleration: float) -> float:
    """Seconds from rest to rest over a length, ramps included."""
    if length == 0.0:
        return 0.0
    cruise = glide_speed(length, speed, acceleration)
    return ramp_time(cruise, acceleration) + length / cruise
