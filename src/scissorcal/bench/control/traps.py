"""What goes wrong without each part of the filter: crippled filters, and their NEES."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from scissorcal.bench.control.objects import plate_of
from scissorcal.bench.control.pose_study import PoseRun, pose_runs
from scissorcal.bench.control.world import SPEED_M_PER_S, SPIN_RAD_PER_S, Scenario
from scissorcal.tracking.settings import (
    CameraErrors,
    ContactErrors,
    ForceErrors,
    PlateMotion,
    TrackingSettings,
)

AT_REST = PlateMotion(0.001e-3, math.radians(0.0002), 0.5)
"""This world's fixed plates do not creep; a recipe's 0.01 mm/s would be 0.028 mm after 8 s, more
than the 0.018 mm to which contacts locate the rim of a disc."""
MOVING = PlateMotion(SPEED_M_PER_S, SPIN_RAD_PER_S, 0.5)
FIXED_PLATE = Scenario("fixed")
FIXED_LONG = Scenario("fixed, 40 s", seconds=40.0)
MOVING_PLATE = Scenario("moving", moving=True)
BLACKOUT = Scenario("1 s without pictures", moving=True, blackout_s=1.0)
FLIPS = Scenario("flips in bursts", flips=0.2)


@dataclass(frozen=True)
class Trap:
    """A part that is left out, the scenario that needs it, and the filter without it."""

    left_out: str
    scenario: Scenario
    source: str
    crippled: TrackingSettings
    by_arrival: bool = False


def settings_for(scenario: Scenario) -> TrackingSettings:
    """The whole filter: it is told whether the plate moves, as a recipe tells it.

    The rig of this world has no constant error of place, and the filter is told so.
    """
    plate = MOVING if scenario.moving else AT_REST
    exact = ContactErrors(turn_bias_rad=0.0, place_bias_m=0.0)
    return TrackingSettings(plate=plate, contact=exact, force=ForceErrors(zero_sd_N=0.02))


def traps() -> tuple[Trap, ...]:
    """Each part of the filter that a scenario needs."""
    fixed, moving = settings_for(FIXED_PLATE), settings_for(MOVING_PLATE)
    no_bias = CameraErrors(turn_bias_rad=0.0, place_bias_m=0.0)
    contact = fixed.contact
    rigid = replace(contact, compliance_m_per_N=0.0, compliance_sd_m_per_N=0.0)
    raw, white = replace(contact, force_filter_s=0.0), replace(contact, slow_m=0.0)
    linear = replace(contact, bilinear_time_s=0.0)
    zero = replace(fixed.force, zero_sd_N=0.0)
    return (
        Trap("camera bias as a state", FIXED_PLATE, "contact", replace(fixed, camera=no_bias)),
        Trap("velocity of the plate", MOVING_PLATE, "contact", replace(moving, plate=AT_REST)),
        Trap("compliance of the plate", FIXED_PLATE, "contact", replace(fixed, contact=rigid)),
        Trap("filter of the regressed force", FIXED_LONG, "contact", replace(fixed, contact=raw)),
        Trap("slow error of the contact", FIXED_PLATE, "contact", replace(fixed, contact=white)),
        Trap("time of exposure", MOVING_PLATE, "contact", moving, by_arrival=True),
        Trap("bilinear term", BLACKOUT, "contact", replace(moving, contact=linear)),
        Trap("zero of the force sensor", FIXED_PLATE, "force", replace(fixed, force=zero)),
    )


def trap_runs(trap: Trap, seeds: Sequence[int]) -> tuple[list[PoseRun], list[PoseRun]]:
    """Runs of the crippled filter on a plane, and of the whole one in the same worlds."""
    plane, of = plate_of("plane"), (trap.source,)
    crippled = pose_runs(trap.scenario, plane, of, trap.crippled, seeds, by_arrival=trap.by_arrival)
    whole = pose_runs(trap.scenario, plane, of, settings_for(trap.scenario), seeds)
    return crippled[trap.source], whole[trap.source]
