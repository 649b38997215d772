"""A plate's pose by pictures, by contacts as well, and by filters that lack a part."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from benchmarks.consistency import nees
from benchmarks.control.plates import Plate, plate_of
from benchmarks.control.world import (
    SPEED_M_PER_S,
    SPIN_RAD_PER_S,
    Picture,
    Scenario,
    World,
    make_world,
)

from scissorcal.model.surface import Surface
from scissorcal.tracking.plate_pose import pose_error
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import (
    CameraErrors,
    ContactErrors,
    ForceErrors,
    PlateMotion,
    TrackingSettings,
)
from scissorcal.tracking.tracker import PoseTracker

SOURCES = ("vision", "contact", "force")
"""What the filter is told: pictures alone, contacts as well, and the force's direction too."""
AT_REST = PlateMotion(0.001e-3, math.radians(0.0002), 0.5)
"""This world's fixed plates do not creep; a recipe's 0.01 mm/s would be 0.028 mm after 8 s, more
than the 0.018 mm to which contacts locate the rim of a disc."""
MOVING = PlateMotion(SPEED_M_PER_S, SPIN_RAD_PER_S, 0.5)
FIXED_PLATE = Scenario("fixed")
FIXED_LONG = Scenario("fixed, 40 s", seconds=40.0)
MOVING_PLATE = Scenario("moving", moving=True)
BLACKOUT = Scenario("1 s without pictures", moving=True, blackout_s=1.0)
FLIPS = Scenario("mirrored poses in bursts", flips=0.2)


@dataclass(frozen=True)
class PoseRun:
    """Errors at the end of one run: along the normal under the tip, across it, and NEES."""

    normal_m: float
    across_m: float
    nees: float


@dataclass(frozen=True)
class Filter:
    """What the tracker is told; ``by_arrival`` stamps each picture with the time it arrived at."""

    settings: TrackingSettings
    source: str = "contact"
    by_arrival: bool = False

    def run(self, world: World, surface: Surface) -> PoseRun:
        """Feed pictures and contacts in the order of their arrival; judge the last pose."""
        tracker, waiting = PoseTracker(surface, self.settings), list(world.pictures)
        for index, time in enumerate(world.times_s.tolist()):
            while waiting and waiting[0].arrives_s <= time:
                tracker.picture(camera_pose(waiting.pop(0), self.by_arrival))
            if self.source == "vision":
                continue
            vectors = (None, None)
            if self.source == "force":
                vectors = (world.force_vector_N[index], world.velocity_m_per_s[index])
            tracker.contact(time, world.point_m[index], float(world.force_N[index]), *vectors)
        return _judge(world, tracker)


def settings_for(scenario: Scenario) -> TrackingSettings:
    """The whole filter: it is told whether the plate moves, as a recipe tells it.

    The rig of this world has no constant error of place, and the filter is told so.
    """
    plate = MOVING if scenario.moving else AT_REST
    exact = ContactErrors(turn_bias_rad=0.0, place_bias_m=0.0)
    return TrackingSettings(plate=plate, contact=exact, force=ForceErrors(zero_sd_N=0.02))


def camera_pose(picture: Picture, by_arrival: bool = False) -> CameraPose:
    """A picture as the filter takes it."""
    at = picture.arrives_s if by_arrival else picture.exposed_s
    return CameraPose(at, picture.rotation, picture.place_m, picture.covariance, picture.certain)


def pose_runs(
    scenario: Scenario, plate: Plate, filters: Mapping[str, Filter], seed: int
) -> dict[str, PoseRun]:
    """One run of each filter in the world of a seed."""
    world = make_world(scenario, plate.shape, plate.path, np.random.default_rng(seed))
    return {name: filters[name].run(world, plate.surface) for name in filters}


def trap_runs(name: str, seed: int) -> dict[str, PoseRun]:
    """Runs on a plane without a part of the filter, one of `TRAPS`, and with it."""
    scenario, crippled = TRAPS[name]
    whole = Filter(settings_for(scenario), crippled.source)
    return pose_runs(scenario, plate_of("plane"), {"without": crippled, "with": whole}, seed)


def _judge(world: World, tracker: PoseTracker) -> PoseRun:
    """Compare the estimate at the end with the truth."""
    estimate = tracker.estimate(float(world.times_s[-1]))
    rotation, place = world.rotation[-1], world.place_m[-1]
    error = pose_error(estimate.rotation, estimate.place_m, rotation, place)
    normal = world.normal[-1]
    # The surface point under the tip, carried by the estimated pose instead of the true one.
    local = rotation.T @ (world.touched_m[-1] - place)
    away = estimate.place_m + estimate.rotation @ local - world.touched_m[-1]
    along = float(normal @ away)
    across = float(np.linalg.norm(away - along * normal))
    return PoseRun(along, across, nees(error, estimate.covariance))


def _traps() -> dict[str, tuple[Scenario, Filter]]:
    fixed, moving = settings_for(FIXED_PLATE), settings_for(MOVING_PLATE)
    contact = fixed.contact
    no_bias = replace(fixed, camera=CameraErrors(turn_bias_rad=0.0, place_bias_m=0.0))
    rigid = replace(contact, compliance_m_per_N=0.0, compliance_sd_m_per_N=0.0)
    raw, white = replace(contact, force_filter_s=0.0), replace(contact, slow_m=0.0)
    linear = replace(moving, contact=replace(contact, bilinear_time_s=0.0))
    no_zero = replace(fixed, force=replace(fixed.force, zero_sd_N=0.0))
    return {
        "camera bias as a state": (FIXED_PLATE, Filter(no_bias)),
        "velocity of a moving plate": (MOVING_PLATE, Filter(replace(moving, plate=AT_REST))),
        "compliance of the plate": (FIXED_PLATE, Filter(replace(fixed, contact=rigid))),
        "low-pass of the regressed force (40 s)": (
            FIXED_LONG,
            Filter(replace(fixed, contact=raw)),
        ),
        "slow error of the contact": (FIXED_PLATE, Filter(replace(fixed, contact=white))),
        "time of exposure": (MOVING_PLATE, Filter(moving, by_arrival=True)),
        "second-order terms, 1 s without pictures": (BLACKOUT, Filter(linear)),
        "zero of the force sensor (force rows)": (FIXED_PLATE, Filter(no_zero, "force")),
    }


TRAPS = _traps()
"""Each part of the filter, a scenario that needs it, and the filter without it."""
