"""A track while it runs: what is fed to the follower, recorded, counted and told."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model.surface import Surface
from scissorcal.recipe.schema import Recipe
from scissorcal.tracking.follow import ContactSource, FollowedRow, PoseFollower
from scissorcal.tracking.judge import (
    DelayFit,
    TrackFigures,
    measure_delay,
    track_figures,
    track_verdicts,
)
from scissorcal.tracking.rows import CameraPose
from scissorcal.tracking.settings import CameraErrors, TrackingSettings, settings_of
from scissorcal.tracking.tracker import Outcome, PoseEstimate
from scissorcal.verdicts import Verdict
from scissorcal.vision.live import STATES, State
from scissorcal.workday.tracking.track_recorder import TrackAbout, TrackChannels, TrackPicture

UNKNOWN_FRICTION_N = 1.0
"""Least force of a contact where friction of the pivot was not fitted: three times what 13 mN m of
it make at half a blade's lever."""


@dataclass(frozen=True)
class RigDrive:
    """What turns samples into the drive of the opening, in N m: handle radius and sensor zeros."""

    handle_radius_m: float
    torque_zero_Nm: float = 0.0
    handle_zero_N: float = 0.0

    def of(self, samples: NDArray[np.void]) -> Array:
        """Torque that opens the blades, shape (n,)."""
        radius = 0.0 if math.isnan(self.handle_radius_m) else self.handle_radius_m
        motor = samples["motor_torque"] - self.torque_zero_Nm
        return np.asarray(motor - radius * (samples["handle_force"] - self.handle_zero_N))


@dataclass(frozen=True, eq=False)
class TrackMark:
    """How a track is, for a person who watches: after each picture and each block of samples."""

    seconds: float
    done: float
    state: str
    picture: State | None
    estimate: PoseEstimate | None
    nis: float
    outcomes: Counter[tuple[str, Outcome]]


Tell = Callable[[TrackMark], None]


@dataclass(frozen=True, eq=False)
class TrackFacts:
    """What a track builds on: the plate's surface, the camera, the rig and its contacts.

    ``drive`` is None without a rig. Contacts below ``least_N`` are none, whatever the recipe says;
    ``friction_known`` says whether friction of the opening was fitted, ``calibrated`` whether the
    camera's fit has a covariance.
    """

    surface: Surface
    about: TrackAbout
    drive: RigDrive | None = None
    contacts: ContactSource | None = None
    friction_known: bool = True
    calibrated: bool = True
    least_N: float = 0.0


@dataclass(frozen=True)
class TrackedRun:
    """What became of pictures and contacts in a run, with the pose's state at its end.

    ``poses`` of ``pictures`` had one; ``sd_mm`` and ``sd_deg`` are those of the pose's worst axis,
    NaN without a pose.
    """

    source: str
    state: str
    pictures: int
    poses: int
    sd_mm: float
    sd_deg: float
    figures: TrackFigures
    verdicts: tuple[Verdict, ...]

    @property
    def facts(self) -> dict[str, Any]:
        """Its figures for an answer in JSON."""
        return {name: value for name, value in asdict(self).items() if name != "verdicts"}

    @property
    def sentence(self) -> str:
        """The pictures and contacts in one line."""
        counts = self.figures.contacts
        return (
            f"tracked by {self.source}: {self.poses} poses in {self.pictures} pictures, "
            f"{self.figures.pictures.refused} refused; {counts.used} contacts used, "
            f"{counts.refused} refused; {self.figures.restarts} restarts; the plate is known to "
            f"{self.sd_mm:.2g} mm and {self.sd_deg:.2g} deg"
        )


class TrackSession:
    """Feeds a `PoseFollower` with pictures and samples, and keeps books of what came of them.

    ``about`` is completed by the first picture with a pose: what all pictures share is known from
    then on. ``base_ns`` is the computer's clock at 0 s of the times of pictures.
    """

    def __init__(
        self,
        recipe: Recipe,
        facts: TrackFacts,
        *,
        recorder: TrackChannels | None = None,
        base_ns: int = 0,
        tell: Tell | None = None,
    ) -> None:
        about, drive = facts.about, facts.drive
        self.about = about
        self.states: Counter[State] = Counter()
        self.gaps: list[float] = []
        self.travel_m = 0.0
        self.elapsed_s = 0.0
        self.unstamped = 0
        self.delay: DelayFit | None = None
        self._recipe = recipe
        self._drive = drive
        self._recorder = recorder
        self._base_ns = base_ns
        self._tell = tell
        self._calibrated = facts.calibrated
        self._least_N = max(facts.least_N, 0.0 if facts.friction_known else UNKNOWN_FRICTION_N)
        self._picture: State | None = None
        self._nis = math.nan
        self._begun_s = self._seen_s = math.nan
        self._first: Array | None = None
        self._surface = facts.surface
        self._used = self._settings(None)
        self.follower = PoseFollower(
            facts.surface,
            self._used,
            camera_delay_s=1e-3 * about.camera_delay_ms,
            rig=drive is not None,
            contacts=facts.contacts,
        )

    @property
    def started(self) -> bool:
        """Whether there is a pose."""
        return self.follower.tracker.started

    def take_samples(self, samples: NDArray[np.void]) -> None:
        """Record samples of the rig, and follow the contacts in them."""
        if self._drive is None or not len(samples):
            return
        if self._recorder is not None:
            self._recorder.samples(samples)
        host = 1e-9 * (samples["host_time_ns"] - self._base_ns).astype(np.float64)
        self._pass(float(host[-1]))
        rows = self.follower.samples(
            1e-6 * samples["device_time_us"].astype(np.float64),
            host,
            samples["opening"],
            samples["advance"],
            self._drive.of(samples),
        )
        for row in rows:
            self._keep(row, float(host[-1]))
        self._say(math.nan)

    def take_picture(self, picture: TrackPicture) -> None:
        """Record a picture, and follow the pose in it."""
        self._pass(picture.arrived_s)
        self.states[picture.state] += 1
        self._picture = picture.state
        stamp = picture.stamp_s
        if math.isnan(stamp):
            stamp, self.unstamped = picture.arrived_s, self.unstamped + 1
        row = None
        if picture.seen is not None:
            self._look(picture)
            sighting = picture.seen.pose
            pose = CameraPose(
                stamp,
                sighting.matrix,
                np.array(sighting.translation_m),
                picture.seen.noise,
                certain=picture.state == "seen",
            )
            row = self.follower.picture(pose, picture.arrived_s)
            self._gap(picture.arrived_s)
        else:
            self.follower.blank(stamp)
        if self._recorder is not None:
            self._recorder.picture(picture, math.nan if row is None else row.time_s)
        if row is not None:
            self._keep(row, picture.arrived_s)
        self._say(picture.done)

    def start_known(self, rotation: Array, place_m: Array, covariance: Array) -> None:
        """Begin with a pose from elsewhere; nothing while the rig has sent no time."""
        if not self.started:
            self._used = replace(self._used, camera=CameraErrors(0.0, 0.0))
            self.follower.assume(self._used)
            if self._recorder is not None:
                self._recorder.about(self.about)
        row = self.follower.start(rotation, place_m, covariance)
        if row is not None:
            self._keep(row, self.elapsed_s)

    def finish(self) -> None:
        """Close the last gap between pictures with a pose, and measure the camera's delay."""
        if self.started and self.states.total():
            self._gap(self._begun_s + self.elapsed_s)
        follower = self.follower
        if self._drive is not None and follower.pictures:
            touched = [
                row
                for row in follower.contacts
                if row.force_N - row.hidden_N >= self._used.contact.least_force_N
            ]
            self.delay = measure_delay(self._surface, self._used, list(follower.pictures), touched)

    def why_waiting(self) -> str:
        """Why there is no pose, as a sentence."""
        count = self.states.total()
        if not count:
            return "The camera gave no picture."
        counts = {state: self.states[state] for state in STATES if self.states[state]}
        causes = ", ".join(f"in {n} {STATES[state]}" for state, n in counts.items())
        return (
            f"None of {count} pictures gave a pose of the plate's target to start from ({causes})."
        )

    def _look(self, picture: TrackPicture) -> None:
        """Take from the first picture with a pose what all pictures share."""
        sighting = picture.seen
        if sighting is None or self.started or self.about.shared is not None:
            return
        # corners' errors that repeat from picture to picture are as large as their noise at most
        shared = sighting.shared + sighting.noise
        self.about = replace(self.about, shared=tuple(tuple(row) for row in shared.tolist()))
        self._used = self._settings(shared)
        self.follower.assume(self._used)
        if self._recorder is not None:
            self._recorder.about(self.about)

    def _settings(self, shared: Array | None) -> TrackingSettings:
        if shared is None and self.about.shared is not None:
            shared = np.array(self.about.shared)
        settings = settings_of(self._recipe, shared if self._calibrated else None)
        least = max(settings.contact.least_force_N, self._least_N)
        return replace(settings, contact=replace(settings.contact, least_force_N=least))

    def _keep(self, row: FollowedRow, host_s: float) -> None:
        if row.outcome in (Outcome.USED, Outcome.REFUSED):
            self._nis = row.nis
        if row.estimate is not None:
            place = row.estimate.place_m
            self._first = place if self._first is None else self._first
            self.travel_m = max(self.travel_m, float(np.linalg.norm(place - self._first)))
        if self._recorder is not None:
            self._recorder.estimate(row, host_s)

    def _pass(self, host_s: float) -> None:
        if math.isnan(self._begun_s):
            self._begun_s = self._seen_s = host_s
        self.elapsed_s = max(self.elapsed_s, host_s - self._begun_s)

    def _gap(self, host_s: float) -> None:
        self.gaps.append(host_s - self._seen_s)
        self._seen_s = host_s

    def _say(self, done: float) -> None:
        if self._tell is None:
            return
        follower = self.follower
        estimate = follower.now()
        self._tell(
            TrackMark(
                self.elapsed_s,
                done,
                follower.state,
                self._picture,
                estimate,
                self._nis,
                follower.outcomes,
            )
        )


def tracked_run(track: TrackSession, source: str) -> TrackedRun:
    """Sum up a session whose pictures came from ``source``."""
    figures = track_figures(track.follower, track.delay)
    estimate = track.follower.now()
    sd_mm = sd_deg = math.nan
    if estimate is not None:
        sds = np.sqrt(np.diag(estimate.covariance))
        sd_mm, sd_deg = 1e3 * float(sds[3:].max()), math.degrees(float(sds[:3].max()))
    return TrackedRun(
        source=source,
        state=track.follower.state,
        pictures=track.states.total(),
        poses=track.states["seen"] + track.states["ambiguous"],
        sd_mm=sd_mm,
        sd_deg=sd_deg,
        figures=figures,
        verdicts=track_verdicts(figures),
    )
