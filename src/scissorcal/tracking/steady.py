"""A pose that rests while nothing but its noise moves it."""

from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.tracking.plate_pose import PlatePose
from scissorcal.tracking.rotation import pose_error, rotation_of

PLAY_SDS = 6.0
"""Of the noise of a picture's pose, as its six numbers have it together. With 4, 8 and 12 a plate
at rest is rendered alike (docs/decisions/145-a-rendered-pose-has-play.md)."""


class SteadyPose:
    """Follows a pose with play, as a slack linkage does.

    It rests while the estimate e stays within sqrt(e^T N^-1 e) <= `PLAY_SDS`, with N (6, 6) the
    noise of one picture, and is drawn along by what goes beyond. A crack that runs out at each step
    of the edge into it does not run back, so a small noise from estimate to estimate would cut; an
    offset as small changes the torque by about as much as it is itself. The covariance grows by
    that of an offset which is uniform within the play, `PLAY_SDS`^2 / 8 of N.

    >>> pose = PlatePose(0.0, np.eye(3), np.zeros(3), 1e-8 * np.eye(6))
    >>> steady, noise = SteadyPose(), 1e-10 * np.eye(6)
    >>> first = steady.held(pose, noise)
    >>> steady.held(replace(pose, translation=np.array([5e-5, 0.0, 0.0])), noise).translation
    array([0., 0., 0.])
    >>> moved = steady.held(replace(pose, translation=np.array([1e-3, 0.0, 0.0])), noise)
    >>> moved.translation.round(6)
    array([0.00094, 0.     , 0.     ])
    """

    def __init__(self) -> None:
        self._at: tuple[Array, Array] | None = None

    def held(self, pose: PlatePose, noise: Array) -> PlatePose:
        """The pose with its play; ``noise`` (6, 6) is of a rotation vector (rad) and place (m)."""
        if self._at is None:
            self._at = pose.rotation, pose.translation
        rotation, place = self._at
        error = pose_error(rotation, place, pose.rotation, pose.translation)
        away = float(np.sqrt(error @ np.linalg.solve(noise, error)))
        if away > PLAY_SDS:
            step = (1.0 - PLAY_SDS / away) * error
            rotation, place = rotation_of(step[:3]) @ rotation, place + step[3:]
            self._at = rotation, place
        wider = pose.covariance + PLAY_SDS**2 / 8.0 * noise
        return replace(pose, rotation=rotation, translation=place, covariance=wider)
