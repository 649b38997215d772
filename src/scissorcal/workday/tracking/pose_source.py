"""A running track as 'control' and a rendering ask for it: the plate's pose at a time, or none."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import DeviceError
from scissorcal.tracking.plate_pose import PlatePose
from scissorcal.tracking.steady import SteadyPose
from scissorcal.workday.tracking.pictures import PlatePicture
from scissorcal.workday.tracking.session import TrackSession

Due = Callable[[float], Iterable[PlatePicture]]
"""Pictures that have come until a time of the clock that the source is asked with."""


class TrackedPose:
    """A `scissorcal.tracking.plate_pose.PoseSource`: call it with the time (s) and new samples.

    It feeds the session with both samples and pictures, and answers with the pose predicted for
    that time, None while there is none. ``failed`` is the sentence of what ended the camera, empty
    while it runs. ``begun_s`` is that clock's time at 0 s of the session's.
    A pose that rests on neither pictures nor contacts any more is not ``tracked``, and says why;
    so is one whose camera or camera's clock has failed, whatever contacts still come. With
    ``steady`` the pose rests while only the noise of pictures moves it (`SteadyPose`), as a
    rendering needs it.
    """

    def __init__(
        self, session: TrackSession, due: Due, begun_s: float = 0.0, *, steady: bool = False
    ) -> None:
        self._session = session
        self._due = due
        self._begun_s = begun_s
        self._steady = SteadyPose() if steady else None
        self.failed = ""

    def __call__(self, now_s: float, samples: NDArray[np.void]) -> PlatePose | None:
        """The plate's pose at ``now_s``. Raises DeviceError where the rig's clock fails."""
        session = self._session
        session.take_samples(samples)
        self._look(now_s)
        found = session.follower.estimate(now_s - self._begun_s)
        if found is None:
            return None
        old = min(found.picture_age_s, found.contact_age_s)
        tracked = not self.failed and session.follower.state != "coasting"
        why = self.failed or f"neither pictures nor contacts came for {old:.1f} s"
        pose = PlatePose(
            time=now_s,
            rotation=found.rotation,
            translation=found.place_m,
            covariance=found.covariance,
            velocity=found.rates[3:],
            turn_rate=found.rates[:3],
            tracked=tracked,
            why="" if tracked else why,
        )
        if self._steady is not None and session.follower.pictures:
            return self._steady.held(pose, session.follower.picture_noise)
        return pose

    def _look(self, now_s: float) -> None:
        """Take what is due; a camera that fails is a plate that is lost, not a rig that fails."""
        if self.failed:
            return
        try:
            for picture in self._due(now_s):
                self._session.take_picture(picture)
        except DeviceError as error:
            self.failed = str(error)
