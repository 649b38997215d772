"""Thresholds of what the servo watches on a rig, from its identity and the recipe's limits."""

from scissorcal.kernel import Capability, Identity, WatchConfig

SWING_RAD_PER_S = 0.5
"""Chosen: five times a hand's tremor (8 to 12 Hz, below 0.1 rad/s at the blades)."""
SWING_TORQUE_SHARE = 0.1
SWING_HZ = 8.0
"""No hand makes strokes that fast: voluntary to and fro of a joint ends at 5 to 6 Hz."""

RUNAWAY_RAD_PER_S = 1.0
"""Chosen: far below the strokes of a capture that a reversed motor would end in (25 rad/s), far
above what friction's reversal or the sheet's springing back adds within 8 ms."""

STILL_RAD = 0.03
"""The default gains answer it with 0.2 N m: ten times the breakaway of scissors."""
STILL_M = 0.005
"""A quarter of the error at which tracking is lost."""
STILL_TORQUE_SHARE = 0.1
STILL_TORQUE_Nm = 0.05
"""At least, however low the limit: three times the dry friction of scissors, under which blades
rest."""

LEAST_RATIO = 0.7
MOST_RATIO = 1.4
"""A torque constant is known to 10 %, cogging and lag add as much; half and double are beyond."""
RATIO_TORQUE_SHARE = 0.01
"""The friction of scissors is about 0.015 N m, 1.5 % of the limit of a motor of 1 N m."""

CLOCK_SHARE = 0.02
HOST_CLOCK_SHARE = 0.05
"""Crystals differ by 0.01 %, ceramic resonators by 0.5 %; a computer that is busy reads 2 s within
0.1 s."""


def watches_of(identity: Identity, torque_limit: float, held_at_limit_s: float) -> WatchConfig:
    """The watches over one rig, of which commands stay within ``torque_limit`` (N m).

    A served virtual rig stands still while its computer is busy, so its clock is not compared with
    the computer's.
    """
    sensor = bool(identity.capabilities & Capability.HANDLE_FORCE_SENSOR)
    virtual = bool(identity.capabilities & Capability.SIMULATOR)
    return WatchConfig(
        held_s=held_at_limit_s,
        swing_rate=SWING_RAD_PER_S,
        swing_torque=SWING_TORQUE_SHARE * torque_limit,
        swing_Hz=SWING_HZ,
        runaway_rate=RUNAWAY_RAD_PER_S,
        still_rad=STILL_RAD,
        still_m=STILL_M,
        still_torque=max(STILL_TORQUE_SHARE * torque_limit, STILL_TORQUE_Nm),
        least_ratio=LEAST_RATIO,
        most_ratio=MOST_RATIO,
        ratio_torque=RATIO_TORQUE_SHARE * torque_limit,
        clock_share=CLOCK_SHARE,
        host_clock_share=0.0 if virtual else HOST_CLOCK_SHARE,
        handle_radius=identity.handle_radius if sensor else 0.0,
    )
