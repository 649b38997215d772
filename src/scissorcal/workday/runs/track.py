"""Track a workspace's plate: its pose from pictures and contacts, live, into a recording."""

import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from scissorcal.device.link import Link
from scissorcal.device.motion import Motion
from scissorcal.device.session import RigSession, rig_facts
from scissorcal.errors import InputError, ScissorcalError
from scissorcal.recipe.load import read_text
from scissorcal.recipe.plate_surface import LONGEST_DELAY_MS
from scissorcal.recipe.schema import Recipe
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.live import STATES, State, camera_number, frames_of, timed
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import NONE, TrackOptions
from scissorcal.workday.rigs import SIM, open_session
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.tracking import feeds, inputs
from scissorcal.workday.tracking.feeds import Feed
from scissorcal.workday.tracking.session import Tell, TrackedRun, TrackSession, tracked_run
from scissorcal.workday.tracking.sim_world import SimWorld
from scissorcal.workday.tracking.track_recorder import (
    PoseFinder,
    TrackPicture,
    TrackRecorder,
    read_track,
)
from scissorcal.workday.workspace import Workspace

PATIENCE_S = 10.0
"""Without a pose to start from for so long, a track ends and says why."""
SIM_CAMERA_S, SIM_RIG_S = 2.4, 6.0


@dataclass(frozen=True)
class TrackResult(TrackedRun):
    """A finished track: its recording (None where one was followed again), its pose at the end, and
    what became of pictures and contacts.

    ``states`` counts pictures; ``longest_gap_s`` is the longest time between two pictures with a
    pose, or to either end. ``quaternion`` (w, x, y, z), ``translation_m`` and ``covariance`` (6, 6)
    are the pose at the last row in ``frame``; sd are those of its worst axis.
    """

    path: Path | None
    frame: Literal["rig", "camera"]
    rig: str
    seconds: float
    states: dict[State, int]
    longest_gap_s: float
    travel_mm: float
    quaternion: tuple[float, float, float, float]
    translation_m: tuple[float, float, float]
    covariance: tuple[tuple[float, ...], ...]
    notes: tuple[str, ...]

    @property
    def pose(self) -> Pose:
        """The pose at the last row, with its covariance."""
        return Pose(self.quaternion, self.translation_m, np.array(self.covariance))

    @property
    def drop_outs(self) -> int:
        """Pictures without a pose."""
        return self.pictures - self.poses


def track_plate(
    workspace: Workspace, options: TrackOptions = TrackOptions(), tell: Tell | None = None
) -> TrackResult:
    """Follow the plate by a camera, by contacts of a rig's blade tip, or by both, and record it.

    The rig's motors stay off: a person moves the handles (or the virtual hand does). Without a
    camera the pose of the fit of the plate is the start. "sim" ends by itself. ``tell`` is called
    after each picture and each block of samples. Into captures/track-<stamp>.mcap go samples,
    pictures and the pose after each of them, within a quarter of a second, so that a killed track
    keeps them.

    Raises InputError, and keeps nothing, where no pose was found within `PATIENCE_S` or the sources
    do not fit together; MissingError where a fit or the rig's frame is missing; DeviceError where
    camera, rig or a clock fails.

    >>> from scissorcal.workday.workspace import find_workspace
    >>> options = TrackOptions("0", "/dev/ttyUSB0", seconds=10)
    >>> track = track_plate(find_workspace(), options)  # doctest: +SKIP
    >>> track.state, track.sd_mm  # doctest: +SKIP
    ('fused', 0.08)
    """
    engine = Engine.of(workspace)
    recipe = _with_delay(engine.recipe, options.camera_delay_ms)
    if options.camera.endswith(".mcap"):
        return _again(engine, recipe, Path(options.camera), tell)
    feeds.refuse_strange_pairs(options.camera, options.device)
    with _opened(engine, recipe, options) as opened:
        return _follow(engine, opened, options, tell)


class _Opened(NamedTuple):
    """Everything that a track is fed from, and the recipe that it follows."""

    recipe: Recipe
    feed: Feed
    eye: PoseFinder | None
    link: Link | None
    default_s: float | None


@contextmanager
def _opened(engine: Engine, recipe: Recipe, options: TrackOptions) -> Iterator[_Opened]:
    """Open camera and device, or the simulated world of both."""
    camera, device = options.camera, options.device
    eye = None
    if camera != NONE:
        eye = inputs.pose_finder(engine, recipe, camera, needs_rig=device != NONE)
    with ExitStack() as stack:
        if SIM in (camera, device):
            world = SimWorld(recipe, options.seed, rig=device == SIM)
            if device != SIM and eye is not None:
                yield _Opened(recipe, feeds.sim_feed(world, eye), eye, None, SIM_CAMERA_S)
                return
            motion = stack.enter_context(feeds.idle_rig(RigSession(world.link, recipe)))
            feed = feeds.sim_rig_feed(world, motion, eye)
            yield _Opened(recipe, feed, eye, world.link, SIM_RIG_S)
            return
        link: Link | None = None
        on: Motion | None = None
        if device != NONE:
            session = stack.enter_context(open_session(recipe, options.rig))
            link = session.link
            feeds.refuse_without_carriage(link)
            on = stack.enter_context(feeds.idle_rig(session))
        frames = frames_of(camera) if camera != NONE else None
        if eye is not None and frames is not None and camera_number(camera) is None:
            feed = feeds.video_feed(timed(frames, camera), eye)
            yield _Opened(recipe, feed, eye, None, None)
            return
        yield _Opened(recipe, feeds.live_feed(stack, eye, frames, on), eye, link, None)


def _follow(
    engine: Engine, opened: _Opened, options: TrackOptions, tell: Tell | None
) -> TrackResult:
    workspace, recipe, link, eye = engine.workspace, opened.recipe, opened.link, opened.eye
    about = inputs.track_about(engine, recipe, options.camera, eye)
    known = inputs.known_pose(engine) if eye is None else None
    base_ns = opened.feed.base_ns
    recorder = TrackRecorder(
        workspace.new_recording("track"),
        read_text(workspace.recipe_path),
        _facts(link, recipe),
        link.identity.handle_radius if link else math.nan,
        base_ns,
    )
    try:
        facts = inputs.track_facts(engine, about, link, recipe=recipe)
        track = TrackSession(recipe, facts, recorder=recorder, base_ns=base_ns, tell=tell)
        _feed(track, opened.feed, options.seconds or opened.default_s, known)
    except BaseException as error:
        kept = recorder.close(keep=recorder.estimates > 0, note=f"The track ended early: {error}")
        if isinstance(error, ScissorcalError) and kept is not None:
            error.kept = (kept,)
        raise
    for sentence in _notes(track):
        recorder.note(sentence)
    path = recorder.close(keep=track.started)
    if not track.started:
        source = Path(options.camera).name if options.camera != NONE else "The rig"
        raise InputError(f"{source}: {track.why_waiting()} Nothing was kept.")
    rig = f"{link.identity.name} {link.identity.serial}" if link else ""
    return _result(track, path, rig)


def _again(engine: Engine, recipe: Recipe, path: Path, tell: Tell | None) -> TrackResult:
    """Follow what a track was given once more, by the recipe as it is now; record nothing."""
    given = read_track(path)
    inputs.refuse_other_camera(path, given, load_result(engine, "camera"))
    about = replace(given.about, camera_delay_ms=recipe.plate.tracking.camera_delay_ms)
    radius_m = given.handle_radius_m if len(given.samples) else None
    facts = inputs.track_facts(engine, about, radius_m=radius_m, recipe=recipe)
    track = TrackSession(recipe, facts, base_ns=given.base_ns, tell=tell)
    _feed(track, feeds.recorded_feed(given), None, None)
    if not track.started:
        raise InputError(f"{path.name}: {track.why_waiting()}")
    return _result(track, None, str(given.device.get("name", "")))


def _feed(
    session: TrackSession,
    feed: Feed,
    seconds: float | None,
    known: inputs.KnownPose | None,
) -> None:
    """Pass on events until the time is over, the stream ends, or no pose comes."""

    first = math.nan
    with suppress(KeyboardInterrupt):
        for event in feed.events:
            if isinstance(event, TrackPicture):
                first = event.arrived_s if math.isnan(first) else first
                if seconds is not None and event.arrived_s - first >= seconds:
                    break
                session.take_picture(event)
            else:
                session.take_samples(event)
                if known is not None and not session.started:
                    session.start_known(*known)
            late = seconds is not None and session.elapsed_s >= seconds
            if late or (not session.started and session.elapsed_s >= PATIENCE_S):
                break
    session.finish()


def _result(session: TrackSession, path: Path | None, rig: str) -> TrackResult:
    estimate = session.follower.now()
    assert estimate is not None
    pose = Pose.from_matrix(estimate.rotation, estimate.place_m)
    return TrackResult(
        **vars(tracked_run(session, session.about.source)),
        path=path,
        frame=session.about.frame,
        rig=rig,
        seconds=session.elapsed_s,
        states={state: session.states[state] for state in STATES},
        longest_gap_s=max(session.gaps, default=0.0),
        travel_mm=1e3 * session.travel_m,
        quaternion=pose.quaternion,
        translation_m=pose.translation_m,
        covariance=tuple(tuple(row) for row in estimate.covariance.tolist()),
        notes=_notes(session),
    )


def _notes(session: TrackSession) -> tuple[str, ...]:
    """Sentences on clocks, stamps and the camera's delay."""
    follower = session.follower
    said = [clock.sentence for clock in (follower.camera, follower.rig) if clock and clock.known]
    if session.unstamped:
        said.append(
            "The camera states no time of its pictures, so times of arrival were used: what varies "
            "in their delivery counts as motion."
        )
    if session.delay is not None:
        said.append(session.delay.sentence)
    return tuple(said)


def _with_delay(recipe: Recipe, camera_delay_ms: float | None) -> Recipe:
    if camera_delay_ms is None:
        return recipe
    if not abs(camera_delay_ms) <= LONGEST_DELAY_MS:
        raise InputError(
            f"--camera-delay-ms {camera_delay_ms:g} is no camera's delay: give a number of "
            f"milliseconds from {-LONGEST_DELAY_MS:g} to {LONGEST_DELAY_MS:g}."
        )
    tracking = recipe.plate.tracking.model_copy(update={"camera_delay_ms": camera_delay_ms})
    plate = recipe.plate.model_copy(update={"tracking": tracking})
    return recipe.model_copy(update={"plate": plate})


def _facts(link: Link | None, recipe: Recipe) -> dict[str, Any]:
    return {} if link is None else rig_facts(link.identity, recipe.rig.motor_sign, None)
