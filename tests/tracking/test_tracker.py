"""The tracker: late pictures, gates, restarts, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.control.pose_run import settings_for
from benchmarks.control.world import Scenario, World, circle, make_world, plane
from scipy.spatial.transform import Rotation

from scissorcal.errors import InputError
from scissorcal.model import Plane
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import ForceErrors, TrackingSettings
from scissorcal.tracking.tracker import Outcome, PoseTracker

MOVING = Scenario("moving", moving=True, seconds=2.0)


def a_world(seed: int = 1, scenario: Scenario = MOVING) -> World:
    return make_world(scenario, plane, circle(10e-3), np.random.default_rng(seed))


def pose_at(time_s: float, rotation: np.ndarray, place: np.ndarray) -> CameraPose:
    return CameraPose(time_s, rotation, place, 1e-7 * np.eye(6))


def test_late_pictures_give_what_pictures_in_order_give() -> None:
    """Rewind and replay is exact: the order of arrival changes nothing but rounding."""
    world, settings = a_world(), settings_for(MOVING)
    late, sorted_rows = PoseTracker(Plane(), settings), PoseTracker(Plane(), settings)
    events = [(picture.exposed_s, picture.arrives_s, picture) for picture in world.pictures]
    rows = list(zip(world.times_s.tolist(), world.point_m, world.force_N.tolist(), strict=True))

    def feed(tracker: PoseTracker, order: list[tuple[float, object]]) -> None:
        for _, row in order:
            if isinstance(row, tuple):
                tracker.contact(*row)
            else:
                picture = row
                tracker.picture(
                    CameraPose(
                        picture.exposed_s, picture.rotation, picture.place_m, picture.covariance
                    )
                )

    # The first picture comes before every contact in both orders: a filter starts from it.
    first, *others = sorted(events, key=lambda event: event[0])
    begin = [(0.0, first[2])]
    contacts = [(row[0], row) for row in rows if row[0] > first[1]]
    by_arrival = contacts + [(arrives, picture) for _, arrives, picture in others if arrives < 1.99]
    by_exposure = contacts + [
        (exposed, picture) for exposed, arrives, picture in others if arrives < 1.99
    ]
    feed(late, begin + sorted(by_arrival, key=lambda event: event[0]))
    feed(sorted_rows, begin + sorted(by_exposure, key=lambda event: event[0]))
    estimate, wanted = late.estimate(2.0), sorted_rows.estimate(2.0)
    assert estimate.counts.pictures == wanted.counts.pictures > 40
    np.testing.assert_allclose(estimate.rotation, wanted.rotation, atol=1e-12)
    np.testing.assert_allclose(estimate.place_m, wanted.place_m, atol=1e-12)
    np.testing.assert_allclose(estimate.covariance, wanted.covariance, rtol=1e-7, atol=1e-16)


def test_there_is_no_pose_before_a_certain_picture() -> None:
    tracker = PoseTracker(Plane())
    with pytest.raises(InputError, match="no pose of the plate yet"):
        tracker.estimate()
    doubtful = replace(pose_at(0.0, np.eye(3), np.zeros(3)), certain=False)
    assert tracker.picture(doubtful)[0] is Outcome.WAITING
    assert tracker.contact(0.0, np.zeros(3), 2.0)[0] is Outcome.WAITING
    assert tracker.picture(pose_at(0.0, np.eye(3), np.zeros(3)))[0] is Outcome.RESTARTED
    assert tracker.estimate().counts.pictures == 1


def test_a_mirrored_picture_is_refused_and_a_run_of_them_starts_again() -> None:
    tracker = PoseTracker(Plane(), settings_for(Scenario("fixed")))
    flipped = Rotation.from_rotvec([0.9, 0.0, 0.0]).as_matrix()
    for step in range(30):
        tracker.picture(pose_at(0.03 * step, np.eye(3), np.zeros(3)))
    outcomes = [
        tracker.picture(pose_at(0.9 + 0.03 * step, flipped, np.zeros(3)))[0] for step in range(16)
    ]
    assert outcomes == [Outcome.REFUSED] * 15 + [Outcome.RESTARTED]
    assert tracker.estimate().counts.restarts == 1
    np.testing.assert_allclose(tracker.estimate().rotation, flipped, atol=1e-12)


def test_one_picture_in_between_ends_a_run_of_refusals() -> None:
    tracker = PoseTracker(Plane(), settings_for(Scenario("fixed")))
    flipped = Rotation.from_rotvec([0.9, 0.0, 0.0]).as_matrix()
    for step in range(200):
        turned = flipped if step % 14 else np.eye(3)
        tracker.picture(pose_at(0.03 * step, turned, np.zeros(3)))
    counts = tracker.estimate().counts
    assert (counts.restarts, counts.refused_pictures) == (0, 200 - 15)


def test_contacts_away_from_the_surface_are_refused_and_start_it_again() -> None:
    tracker = PoseTracker(Plane(), settings_for(Scenario("fixed")))
    for step in range(30):
        tracker.picture(pose_at(0.03 * step, np.eye(3), np.zeros(3)))
    for step in range(100):
        outcome, nis = tracker.contact(0.9 + 0.01 * step, np.array([0.0, 0.0, 0.01]), 2.0)
        assert outcome is Outcome.REFUSED
        assert nis > 100.0
    assert tracker.estimate().counts.refused_contacts == 100
    assert tracker.picture(pose_at(1.91, np.eye(3), np.zeros(3)))[0] is Outcome.RESTARTED


def test_a_picture_older_than_the_horizon_is_counted_and_left_out() -> None:
    tracker = PoseTracker(Plane(), settings_for(Scenario("fixed")))
    for step in range(100):
        tracker.picture(pose_at(0.03 * step, np.eye(3), np.zeros(3)))
    outcome, _ = tracker.picture(pose_at(1.0, np.eye(3), np.zeros(3)))
    assert outcome is Outcome.TOO_LATE
    assert tracker.estimate().counts.late_pictures == 1


def test_forces_from_before_a_restart_are_forgotten() -> None:
    """States stay in the order of their times."""
    settings = TrackingSettings(force=ForceErrors(zero_sd_N=0.05, every_s=0.1))
    tracker = PoseTracker(Plane(), settings)
    tracker.picture(pose_at(0.0, np.eye(3), np.zeros(3)))
    push, still = np.array([0.0, 0.0, 2.0]), np.zeros(3)
    for number in range(1, 8):
        tracker.contact(0.01 * number, np.zeros(3), 2.0, push, still)
    tracker._restart = True
    tracker.picture(pose_at(0.14, np.eye(3), np.zeros(3)))
    for number in range(15, 40):
        tracker.contact(0.01 * number, np.zeros(3), 2.0, push, still)
    assert tracker._times == sorted(tracker._times)
    assert [state.time_s for state in tracker._states] == pytest.approx(tracker._times)


def test_a_light_touch_is_no_contact() -> None:
    tracker = PoseTracker(Plane(), settings_for(Scenario("fixed")))
    tracker.picture(pose_at(0.0, np.eye(3), np.zeros(3)))
    assert tracker.contact(0.1, np.zeros(3), 0.1)[0] is Outcome.NO_CONTACT


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_that_are_not_finite_are_refused(bad: float) -> None:
    tracker = PoseTracker(Plane())
    with pytest.raises(InputError, match="not finite"):
        tracker.contact(0.0, np.array([0.0, bad, 0.0]), 2.0)
    with pytest.raises(InputError, match="not finite"):
        tracker.picture(pose_at(0.0, np.eye(3), np.array([bad, 0.0, 0.0])))


@pytest.mark.parametrize("rows", [2_000, pytest.param(20_000, marks=pytest.mark.slow)])
def test_minutes_of_pictures_keep_a_rotation_and_a_covariance(rows: int) -> None:
    """A spinning plate over many rows: the matrix stays a rotation, the covariance positive."""
    tracker = PoseTracker(Plane(), settings_for(MOVING))
    for step in range(rows):
        turn = Rotation.from_rotvec([0.0, 0.0, 0.003 * step]).as_matrix()
        tracker.picture(pose_at(0.03 * step, turn, np.zeros(3)))
    estimate = tracker.estimate()
    assert estimate.counts.refused_pictures == 0
    assert np.abs(estimate.rotation @ estimate.rotation.T - np.eye(3)).max() < 1e-12
    assert np.all(np.linalg.eigvalsh(estimate.covariance) > 0.0)


def test_euler_angles_fail_where_the_filter_does_not() -> None:
    """At a pitch of 89 deg and beyond, small errors of yaw and roll grow without bound.

    Two attitudes 0.1 deg apart near the pole differ by up to 90 deg of yaw; the filter follows a
    plate through the pole with errors of its noise.
    """
    pitch = np.radians([80.0, 89.0, 89.9, 89.99])
    small = np.radians(0.1)
    leaps = []
    for angle in pitch:
        attitude = Rotation.from_euler("ZYX", [0.3, angle, 0.2])
        nudged = Rotation.from_rotvec([small, 0.0, 0.0]) * attitude
        yaw = nudged.as_euler("ZYX")[0] - attitude.as_euler("ZYX")[0]
        leaps.append(abs(math.remainder(yaw, 2.0 * math.pi)) / small)
    assert leaps[0] < 6.0 < 30.0 < leaps[1] < leaps[2] < leaps[3]
    tracker = PoseTracker(Plane(), settings_for(MOVING))
    rng = np.random.default_rng(0)
    errors = []
    for step in range(300):
        attitude = Rotation.from_euler("ZYX", [0.3, np.radians(75.0 + 0.1 * step), 0.2])
        turned = Rotation.from_rotvec(math.sqrt(1e-7) * rng.standard_normal(3)) * attitude
        tracker.picture(pose_at(0.03 * step, turned.as_matrix(), np.zeros(3)))
        away = Rotation.from_matrix(tracker.estimate().rotation) * attitude.inv()
        errors.append(away.magnitude())
    assert tracker.estimate().counts.refused_pictures == 0
    assert max(errors[20:]) < np.radians(0.4)
