"""Thresholds of what the servo watches on a rig, from its identity and the recipe's limits."""

import math

from scissorcal.kernel import Capability, Identity, WatchConfig
from scissorcal.recording.probe import UNKNOWN_REST, RestFacts

SWING_RAD_PER_S = 0.5
"""Chosen: five times a hand's tremor (8 to 12 Hz, below 0.1 rad/s at the blades)."""
SWING_TORQUE_SHARE = 0.1
SWING_HZ = 8.0
"""No hand makes strokes that fast: voluntary to and fro of a joint ends at 5 to 6 Hz."""

DELAY_MORE_S = 0.00025
"""The work of a torque is taken at so much more than the probe's delay. Both sides then bear an
error of 0.5 ms either way: loops are found, and teeth are not taken for one (decision 176)."""

HELD_UP_S = 0.002
"""Captures keep 45 degrees at a crossover of 45 Hz at most, which 2.8 ms use up."""

LET_GO_SHARE = 0.3
"""Of the damping at which a loop of this inertia, delay and tick swings by itself."""

RUNAWAY_RAD_PER_S = 1.0
"""Chosen: far below the strokes of a capture that a reversed motor would end in (25 rad/s), far
above what friction's reversal or the sheet's springing back adds within 8 ms."""

RUNAWAY_M_PER_S = 0.1
"""A little more than the speed at which captures move the carriage."""

STILL_RAD = 0.02
"""Three times by how far a reference leads blades that stick before they move (6 mrad)."""
STILL_M = 0.005
"""A quarter of the error at which tracking is lost."""
STILL_TORQUE_SHARE = 0.15
"""Of the device's limit: ten times the breakaway of scissors with a motor of 1 N m."""
REST_BREAKAWAYS = 2.0
"""Friction of scissors varies by up to a half along the blades, and the probe meets one place."""
REST_NOISE_SDS = 5.0
"""White noise of 0.2 of this is left of means over 30 ms; slow noise is left whole."""
JITTER_S = 0.2
"""At 500 Hz 100 readings; noise of more than a step gives two equal ones with at most 0.5."""

LEAST_RATIO = 0.7
MOST_RATIO = 1.4
"""A torque constant is known to 10 %, cogging and lag add as much; half and double are beyond."""
RATIO_TORQUE_SHARE = 0.01
"""Of the device's limit: the friction of scissors is about 0.015 N m, with a motor of 1 N m."""

STOP_MARGIN_RAD = 0.1
"""Twice by how much the opening may exceed a stop before it is taken for implausible."""

CLOCK_SHARE = 0.02
HOST_CLOCK_SHARE = 0.05
"""Crystals differ by 0.01 %, ceramic resonators by 0.5 %; a computer that is busy reads 2 s within
0.1 s."""


def watches_of(
    identity: Identity,
    torque_limit: float,
    held_at_limit_s: float,
    rest: RestFacts = UNKNOWN_REST,
) -> WatchConfig:
    """The watches over one rig, of which commands stay within ``torque_limit`` (N m).

    ``rest`` is what a probe found of blades at rest. A served virtual rig stands still while
    its computer is busy, so its clock is not compared with the computer's.
    """
    sensor = bool(identity.capabilities & Capability.HANDLE_FORCE_SENSOR)
    virtual = bool(identity.capabilities & Capability.SIMULATOR)
    return WatchConfig(
        held_s=held_at_limit_s,
        swing_rate=SWING_RAD_PER_S,
        swing_torque=SWING_TORQUE_SHARE * torque_limit,
        swing_Hz=SWING_HZ,
        swing_inertia=_known_inertia(rest),
        swing_delay_ticks=_swing_delay_ticks(identity, rest),
        held_up_ticks=max(2.0, HELD_UP_S * 1e6 / identity.tick_us),
        runaway_rate=RUNAWAY_RAD_PER_S,
        runaway_speed=RUNAWAY_M_PER_S,
        still_rad=STILL_RAD,
        still_m=STILL_M,
        still_torque=STILL_TORQUE_SHARE * identity.torque_limit,
        rest_torque=_rest_torque(identity, rest),
        rest_share=MOST_RATIO - 1.0,
        jitter_s=JITTER_S if rest.jitters else 0.0,
        least_ratio=LEAST_RATIO,
        most_ratio=MOST_RATIO,
        ratio_torque=RATIO_TORQUE_SHARE * identity.torque_limit,
        clock_share=CLOCK_SHARE,
        host_clock_share=0.0 if virtual else HOST_CLOCK_SHARE,
        stop_low=identity.opening_min,
        stop_high=identity.opening_max,
        stop_margin=STOP_MARGIN_RAD,
        handle_radius=identity.handle_radius if sensor else 0.0,
        handle_zero=rest.handle_zero_N if sensor else 0.0,
    )


def let_go_damping(identity: Identity, rest: RestFacts) -> float:
    """The damping (N m s/rad) while a servo lets go of what it holds; 0 where no probe tells it.

    A share of inertia / (delay + tick): with a delay d and a tick T damping alone is stable below
    about inertia / (d + T / 2).
    """
    inertia = _known_inertia(rest)
    return LET_GO_SHARE * inertia / ((rest.delay_s or 0.0) + identity.tick_us * 1e-6)


def _swing_delay_ticks(identity: Identity, rest: RestFacts) -> float:
    return ((rest.delay_s or 0.0) + DELAY_MORE_S) * 1e6 / identity.tick_us


def _known_inertia(rest: RestFacts) -> float:
    """The inertia, where the delay is known as well: neither is of use alone."""
    known = rest.inertia_kg_m2 is not None and rest.delay_s is not None
    return (rest.inertia_kg_m2 or 0.0) if known else 0.0


def _rest_torque(identity: Identity, rest: RestFacts) -> float:
    """The imbalance of motor and hand (N m) that friction does not hold, with its noise."""
    if rest.breakaway_Nm is None:
        return STILL_TORQUE_SHARE * identity.torque_limit
    noise = math.hypot(rest.torque_noise_Nm, identity.handle_radius * rest.force_noise_N)
    return REST_BREAKAWAYS * rest.breakaway_Nm + REST_NOISE_SDS * noise
