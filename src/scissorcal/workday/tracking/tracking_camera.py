"""A camera that follows the plate while the rig controls or renders, as a source of poses."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.motion import Motion
from scissorcal.device.session import RigSession
from scissorcal.errors import DeviceError, InputError
from scissorcal.recording import RecordingWriter
from scissorcal.tracking.plate_pose import PlatePose, SteadyPose
from scissorcal.vision.live import frames_of
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import RigOptions
from scissorcal.workday.rigs import SIM
from scissorcal.workday.tracking import feeds, inputs
from scissorcal.workday.tracking.feeds import CameraThread
from scissorcal.workday.tracking.session import TrackedRun, TrackSession, tracked_run
from scissorcal.workday.tracking.sim_world import CARRY_S, SimWorld
from scissorcal.workday.tracking.track_recorder import TrackChannels, TrackPicture

PATIENCE_S = 10.0
"""For so long a first pose is waited for."""
SETTLE_S = 0.5
"""From then on until the rig runs: 15 pictures at 30 Hz, which tell how the plate moves."""
MOST_AT_ONCE = 30
"""Pictures at a look: while a person is asked, none is taken, and all at once would hold the loop's
supervisor up."""
TAP = (
    "Motors off: tap the plate with the blade's tip at several places for {:g} s, then bring it to "
    "where it is cut."
)

Due = Callable[[float], Iterable[TrackPicture]]
"""Pictures that have come until a time of the clock that the source is asked with."""


class TrackingCamera:
    """The camera that a run names, with the simulated world that it shows where that is "sim".

    ``cut`` says that the run renders: nothing real is between the blades then, so contacts are
    taken from taps before it alone, and the pose has play (`SteadyPose`). Opened before anything
    moves. Raises InputError where camera and device do not show one plate; MissingError where the
    camera's fit or its place in the rig's frame is missing.
    """

    def __init__(
        self,
        engine: Engine,
        camera: str,
        rig: RigOptions,
        *,
        cut: bool = False,
    ) -> None:
        feeds.refuse_strange_pairs(camera, rig.device)
        if camera == SIM and rig.realtime:
            raise InputError(
                "--camera sim runs in virtual time, with the virtual rig: leave --realtime out."
            )
        recipe = engine.recipe
        self._engine, self._camera, self._cut = engine, camera, cut
        without = "state the pose with --pose"
        if cut:
            without = 'set plate_pose = "known" in [scene], and build the package again'
        self._eye = inputs.pose_finder(engine, recipe, camera, needs_rig=True, otherwise=without)
        self._about = inputs.track_about(engine, recipe, camera, self._eye)
        world = camera == SIM
        self._world = SimWorld(recipe, rig.seed, rig=True, cut=cut) if world else None
        self._track: TrackSession | None = None

    @property
    def world_rig(self) -> LockstepLink | None:
        """The rig of the simulated world; None where the camera is real."""
        return self._world.link if self._world else None

    @contextmanager
    def follow(
        self,
        session: RigSession,
        writer: RecordingWriter | None,
        *,
        taps_s: float = 0.0,
        held_N: float = 0.0,
    ) -> "Iterator[TrackedPose]":
        """Start the camera, look until there is a pose, and yield the source of poses.

        The motors are off meanwhile. For ``taps_s`` a person taps the plate with the blade's tip
        (the virtual hand does, and brings the plate to where it is cut). Where the rig itself holds
        ``held_N`` at the tip, less than half of it is no contact: blades that set off and stop
        feign a few tenths of a newton. Rows go to ``writer``.
        Raises DeviceError, nothing having moved, where the camera fails meanwhile, with its own
        sentence, and where no picture gave a pose within `PATIENCE_S`; later as `TrackedPose`.
        """
        feeds.refuse_without_carriage(session.link)
        virtual = self._world is not None
        base_ns, begun_s = (0, 0.0) if virtual else (time.time_ns(), time.monotonic())
        channels = TrackChannels(writer, base_ns) if writer is not None else None
        facts = inputs.track_facts(self._engine, self._about, session.link)
        facts = replace(facts, least_N=0.5 * held_N)
        track = TrackSession(self._engine.recipe, facts, recorder=channels, base_ns=base_ns)
        self._track = track
        with ExitStack() as stack:
            due = self._pictures(stack, begun_s)
            source = TrackedPose(track, due, begun_s, steady=self._cut)
            with feeds.idle_rig(session) as motion:
                if taps_s:
                    session.operator.say(TAP.format(taps_s))
                self._look(motion, source, track, taps_s)
            track.follower.restart_rig()
            track.follower.touching = not self._cut
            yield source
            track.finish()

    def tracked(self) -> TrackedRun:
        """What became of it; after `follow`."""
        assert self._track is not None
        return tracked_run(self._track, f"camera {self._about.source}")

    def _pictures(self, stack: ExitStack, begun_s: float) -> Due:
        eye, world = self._eye, self._world
        if world is not None:
            return lambda now_s: map(eye.picture, eye.locate(world.frames(now_s)))
        thread = CameraThread(frames_of(self._camera), eye.locate)
        stack.enter_context(closing(thread))

        def due(now_s: float) -> Iterable[TrackPicture]:
            for located in thread.due()[-MOST_AT_ONCE:]:
                picture = eye.picture(located)
                yield replace(picture, arrived_s=picture.arrived_s - begun_s)

        return due

    def _look(
        self, motion: Motion, source: "TrackedPose", track: TrackSession, taps_s: float
    ) -> None:
        """Feed the source with the motors off: through the taps, and until there is a pose."""
        world = self._world
        if world is not None:
            world.begin(motion, taps=taps_s > 0.0)
            if not self._cut:
                world.keep_plate()
        track.follower.touching = taps_s > 0.0
        begun = motion.now_s
        _feed(motion, source, begun + taps_s)
        track.follower.touching = False
        if world is not None and self._cut:
            world.take_out(motion)
            _feed(motion, source, motion.now_s + (CARRY_S if taps_s else 0.0))
        while not track.started and motion.now_s - begun < taps_s + PATIENCE_S:
            _ask(motion, source)
        if not track.started:
            raise DeviceError(
                f"There is no pose of the plate after {PATIENCE_S:g} s, so nothing was moved. "
                f"{track.why_waiting()} Check that the camera sees the plate's target."
            )
        _feed(motion, source, motion.now_s + SETTLE_S)


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
        estimate = session.follower.estimate(now_s - self._begun_s)
        if estimate is None:
            return None
        old = min(estimate.picture_age_s, estimate.contact_age_s)
        tracked = not self.failed and session.follower.state != "coasting"
        why = self.failed or f"neither pictures nor contacts came for {old:.1f} s"
        pose = PlatePose(
            time=now_s,
            rotation=estimate.rotation,
            translation=estimate.place_m,
            covariance=estimate.covariance,
            velocity=estimate.rates[3:],
            turn_rate=estimate.rates[:3],
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


def _feed(motion: Motion, source: TrackedPose, until_s: float) -> None:
    while motion.now_s < until_s:
        _ask(motion, source)


def _ask(motion: Motion, source: TrackedPose) -> None:
    """Pass on a block of samples; a camera that fails before anything moves ends the run."""
    source(motion.now_s, motion.step())
    if source.failed:
        raise DeviceError(source.failed)
