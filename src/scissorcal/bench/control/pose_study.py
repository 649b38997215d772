"""Pose errors of vision alone, with contact, and with the force's direction, over many worlds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.bench.control.objects import Plate
from scissorcal.bench.control.world import Scenario, World, make_world
from scissorcal.model.surface import Surface
from scissorcal.tracking.consistency import nees, pose_error
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import TrackingSettings
from scissorcal.tracking.tracker import PoseTracker

SOURCES = ("vision", "contact", "force")
"""What the filter is told: pictures alone, contacts as well, and the force's direction too."""


@dataclass(frozen=True)
class PoseRun:
    """Errors at the end of one run: along the normal under the tip, across it, and of the pose."""

    normal_m: float
    tangent_m: float
    yaw_rad: float
    tilt_rad: float
    nees: float
    restarts: int


def follow(
    world: World,
    surface: Surface,
    settings: TrackingSettings,
    source: str,
    *,
    by_arrival: bool = False,
) -> PoseTracker:
    """Feed a tracker in the order in which pictures and contacts arrive.

    ``by_arrival`` takes each picture for one of the time at which it arrived.
    """
    tracker = PoseTracker(surface, settings)
    waiting = list(world.pictures)
    for index, time in enumerate(world.times_s.tolist()):
        while waiting and waiting[0].arrives_s <= time:
            seen = waiting.pop(0)
            at = seen.arrives_s if by_arrival else seen.exposed_s
            tracker.picture(
                CameraPose(at, seen.rotation, seen.place_m, seen.covariance, seen.certain)
            )
        if source == "vision":
            continue
        vectors = (None, None)
        if source == "force":
            vectors = (world.force_vector_N[index], world.velocity_m_per_s[index])
        tracker.contact(time, world.point_m[index], float(world.force_N[index]), *vectors)
    return tracker


def judge_run(world: World, tracker: PoseTracker) -> PoseRun:
    """Compare the estimate at the end with the truth."""
    found = tracker.estimate(float(world.times_s[-1]))
    rotation, place = world.rotation[-1], world.place_m[-1]
    error = pose_error(found.rotation, found.place_m, rotation, place)
    normal = world.normal[-1]
    # The surface point under the tip, carried by the estimated pose instead of the true one.
    local = rotation.T @ (world.touched_m[-1] - place)
    away = found.place_m + found.rotation @ local - world.touched_m[-1]
    along = float(normal @ away)
    return PoseRun(
        normal_m=along,
        tangent_m=float(np.linalg.norm(away - along * normal)),
        yaw_rad=float(normal @ error[:3]),
        tilt_rad=float(np.linalg.norm(error[:3] - normal * (normal @ error[:3]))),
        nees=nees(error, found.covariance),
        restarts=found.counts.restarts,
    )


def pose_runs(
    scenario: Scenario,
    plate: Plate,
    sources: Sequence[str],
    settings: TrackingSettings,
    seeds: Sequence[int],
    *,
    by_arrival: bool = False,
) -> dict[str, list[PoseRun]]:
    """One run per source and seed; a seed draws the same world for every source and setting."""
    runs: dict[str, list[PoseRun]] = {source: [] for source in sources}
    for seed in seeds:
        world = make_world(scenario, plate.shape, plate.path, np.random.default_rng(seed))
        for source in sources:
            tracker = follow(world, plate.surface, settings, source, by_arrival=by_arrival)
            runs[source].append(judge_run(world, tracker))
    return runs
