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
    that time, None while there is none. ``begun_s`` is that clock's time at 0 s of the session's.
    A pose that rests on neither pictures nor contacts any more is not ``tracked``, and says why;
    so is one whose camera ``due`` has reported as failed. With ``steady`` the pose rests while only
    the noise of pictures moves it (`SteadyPose`), as a rendering needs it.
    """

    def __init__(
        self, session: TrackSession, due: Due, begun_s: float = 0.0, *, steady: bool = False
    ) -> None:
        self._session = session
        self._due = due
        self._begun_s = begun_s
        self._steady = SteadyPose() if steady else None
        self._failed = ""

    def __call__(self, now_s: float, samples: NDArray[np.void]) -> PlatePose | None:
        """The plate's pose at ``now_s``. Raises DeviceError where a clock fails."""
        session = self._session
        session.take_samples(samples)
        for picture in self._pictures(now_s):
            session.take_picture(picture)
        found = session.follower.estimate(now_s - self._begun_s)
        if found is None:
            return None
        old = min(found.picture_age_s, found.contact_age_s)
        tracked = session.follower.state != "coasting"
        why = self._failed or f"neither pictures nor contacts came for {old:.1f} s"
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

    def _pictures(self, now_s: float) -> Iterable[PlatePicture]:
        """Those that are due; a camera that fails is a plate that is lost, not a rig that fails."""
        if self._failed:
            return ()
        try:
            return list(self._due(now_s))
        except DeviceError as error:
            self._failed = str(error)
            return ()
