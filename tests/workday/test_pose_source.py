"""The pose as the outer loop of 'control' asks for it: at its own time, or not tracked, and why."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.device import RigSession
from scissorcal.errors import DeviceError
from scissorcal.workday.tracking.feeds import idle_rig
from scissorcal.workday.tracking.sim_world import SimWorld
from scissorcal.workday.tracking.track_recorder import TrackPicture
from scissorcal.workday.tracking.tracking_camera import TrackedPose
from tests.workday.track_world import a_recipe, a_session, an_eye


def test_a_pose_is_predicted_for_the_time_that_it_is_asked_for() -> None:
    recipe = a_recipe("speed_mm_per_s = 5", "turn_deg_per_s = 1")
    world, eye = SimWorld(recipe, 2, rig=True), an_eye(recipe, 2)
    session = a_session(recipe, rig=True)
    seeing = True

    def due(now_s: float) -> Iterator[TrackPicture]:
        if seeing:
            for found in eye.locate(world.frames(now_s)):
                yield eye.picture(found)

    source = TrackedPose(session, due)
    with idle_rig(RigSession(world.link, recipe)) as motion:
        world.begin(motion)
        poses = []
        for step in range(36):
            seeing = step < 24
            samples = motion.step()
            now = world.link.virtual_time
            poses.append((now, source(now, samples)))
    assert poses[0][1] is None, "no picture came yet"
    now, seen = poses[20]
    assert seen is not None
    assert (seen.time, seen.tracked, seen.why) == (now, True, "")
    rotation, place = world.truth(now)
    assert np.abs(seen.translation - place).max() < 1e-3
    assert np.abs(seen.rotation - rotation).max() < 0.01
    assert np.abs(seen.velocity).max() > 1e-4, "it moves"
    lost = poses[-1][1]
    assert lost is not None
    assert not lost.tracked
    assert lost.why.startswith("neither pictures nor contacts came for 0.")
    assert lost.covariance[3, 3] > seen.covariance[3, 3]


@pytest.mark.parametrize(
    ("fails", "words"), [("camera", "was unplugged"), ("clock", "camera's clock")]
)
def test_a_camera_that_fails_is_a_lost_plate_although_the_tip_touches(
    fails: str, words: str
) -> None:
    recipe = a_recipe("speed_mm_per_s = 5", "turn_deg_per_s = 1")
    world, eye = SimWorld(recipe, 2, rig=True), an_eye(recipe, 2)
    session = a_session(recipe, rig=True)
    kept: list[TrackPicture] = []

    def due(now_s: float) -> Iterator[TrackPicture]:
        if len(kept) > 5 and fails == "camera":
            raise DeviceError("The camera was unplugged.")
        for found in eye.locate(world.frames(now_s)):
            picture = eye.picture(found)
            if len(kept) > 5:
                picture = replace(picture, stamp_s=kept[5].stamp_s)
            kept.append(picture)
            yield picture

    source = TrackedPose(session, due)
    with idle_rig(RigSession(world.link, recipe)) as motion:
        world.begin(motion)
        for _ in range(100):
            samples = motion.step()
            pose = source(world.link.virtual_time, samples)
            if source.failed and session.follower.state == "contacts":
                break
    assert session.follower.state == "contacts", "the tip goes on touching"
    assert pose is not None
    assert not pose.tracked
    assert words in pose.why
