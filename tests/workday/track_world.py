"""Tracks in simulated worlds whose camera and rig frame are off as their covariances say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from benchmarks.consistency import nees

from scissorcal.aliases import Array
from scissorcal.calibration import plate_target
from scissorcal.device import Motion, RigSession
from scissorcal.model import BladePoint, Plane
from scissorcal.recipe import PlatePriors, Recipe, parse_recipe, read_text, recipe_path
from scissorcal.tracking import TipContacts, pose_error
from scissorcal.vision import SIM_LENS, Camera, Pose, RigPose, sim_plate_scene
from scissorcal.workday.tracking.feeds import idle_rig, sim_feed, sim_rig_feed
from scissorcal.workday.tracking.session import RigDrive, TrackFacts, TrackSession
from scissorcal.workday.tracking.sim_world import SimCamera, SimWorld
from scissorcal.workday.tracking.track_recorder import (
    PoseFinder,
    TrackAbout,
    TrackPicture,
    TrackRecorder,
)

CAMERA_SDS = np.array([0.8, 0.8, 0.6, 0.6, 1e-3, 3e-3, 1e-4, 1e-4, 1e-3])
RIG_SDS = np.array([5e-4, 5e-4, 5e-4, 1e-4, 1e-4, 2e-4])
TEXT = read_text(recipe_path("paper-80gsm"))


def a_recipe(*lines: str) -> Recipe:
    """The recipe for paper with lines of plate.tracking."""
    return parse_recipe("\n".join([TEXT, "[plate.tracking]", *lines]))


def an_eye(recipe: Recipe, seed: int) -> PoseFinder:
    """A fitted camera and rig frame for the rendered scene, off by draws of their covariances."""
    rng = np.random.default_rng([seed, 77])
    lens = SIM_LENS
    true = np.array([lens.focal_px, lens.focal_px, *lens.centre_px, *lens.distortion])
    camera = Camera.of(
        true + CAMERA_SDS * rng.standard_normal(9), lens.width, lens.height, np.diag(CAMERA_SDS**2)
    )
    scene = sim_plate_scene(recipe, seed).camera_rig
    away = RIG_SDS * rng.standard_normal(6)
    turn = Pose.from_rotation_vector(away[:3], np.zeros(3)).matrix
    seen = Pose.from_matrix(turn @ scene.rotation, scene.shift_m + away[3:], np.diag(RIG_SDS**2))
    rig = RigPose(seen, seen, 0.1, (), np.zeros((6, 9)))
    priors = PlatePriors(print_scale_sd_percent=0.0)
    return PoseFinder(camera, plate_target(recipe), rig, priors)


def tip_of(recipe: Recipe) -> BladePoint:
    """The true tip of the specimen, from its numbers."""
    offset = -8e-3 + 75e-3 * np.tan(np.radians(2.0))
    return BladePoint(75e-3, float(offset), recipe.rig.moving_blades)


def a_session(
    recipe: Recipe, *, rig: bool, recorder: TrackRecorder | None = None, surface: object = None
) -> TrackSession:
    delay = recipe.plate.tracking.camera_delay_ms
    about = TrackAbout("sim", "rig", "a" * 16, SIM_LENS.width, SIM_LENS.height, delay)
    facts = TrackFacts(Plane(), about, friction_known=False)
    if rig:
        facts = replace(facts, drive=RigDrive(0.06), contacts=TipContacts(tip_of(recipe)))
    return TrackSession(recipe, facts, recorder=recorder)


def tracked(
    recipe: Recipe, seed: int, seconds: float, *, rig: bool, camera: SimCamera | None = None
) -> tuple[TrackSession, SimWorld, float]:
    """Follow a world for so long; the session, the world, and the host's time at the end."""
    world, eye = SimWorld(recipe, seed, rig=rig, camera=camera), an_eye(recipe, seed)
    session = a_session(recipe, rig=rig)
    if not rig:
        last = 0.0
        for picture in sim_feed(world, eye).events:
            assert isinstance(picture, TrackPicture)
            if picture.arrived_s > seconds:
                break
            session.take_picture(picture)
            last = picture.arrived_s
        return session, world, last
    with idle_rig(RigSession(world.link, recipe)) as motion:
        run_rig(session, world, motion, eye, seconds)
    return session, world, world.link.virtual_time


def run_rig(
    session: TrackSession, world: SimWorld, motion: Motion, eye: PoseFinder, seconds: float
) -> None:
    for event in sim_rig_feed(world, motion, eye).events:
        if isinstance(event, TrackPicture):
            session.take_picture(event)
        else:
            session.take_samples(event)
        if session.elapsed_s >= seconds:
            return


def score(session: TrackSession, world: SimWorld, host_s: float) -> tuple[float, Array]:
    """NEES and error (6,) of the pose at the last row, against the world's truth."""
    estimate = session.follower.tracker.estimate()
    clock = session.follower.rig
    if clock is not None:
        at = clock.fit.host(estimate.time_s)
    else:
        from scissorcal.workday.tracking.sim_world import CAMERA_DRIFT, CAMERA_OFFSET_S

        delay = 1e-3 * session.about.camera_delay_ms
        at = (estimate.time_s + delay - CAMERA_OFFSET_S) / (1.0 + CAMERA_DRIFT)
    error = pose_error(estimate.rotation, estimate.place_m, *world.truth(at))
    return nees(error, estimate.covariance), error


def recorder_at(path: Path) -> TrackRecorder:
    return TrackRecorder(path, TEXT, {"name": "sim"}, 0.06, 0)
