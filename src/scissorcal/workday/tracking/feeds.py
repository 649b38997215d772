"""Where a track's pictures and samples come from, as one stream in the order of their arrival."""

import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.capture import servo_config
from scissorcal.device.link import Link
from scissorcal.device.motion import Motion
from scissorcal.device.port_motion import open_motion
from scissorcal.device.session import RigSession
from scissorcal.errors import DeviceError, InputError
from scissorcal.vision.live import Frame, LocatedFrame, camera_number
from scissorcal.workday.tracking.sim_world import SimWorld
from scissorcal.workday.tracking.track_recorder import PoseFinder, RecordedTrack, TrackPicture

CLOSE_S = 2.0


class CameraThread:
    """Reads pictures as they come, and locates the newest one whenever the last is done.

    A picture that nobody has time for is left out (``left_out`` counts them): a queue of old ones
    would make all that follow late. OpenCV releases the interpreter's lock while it works, so both
    threads run beside the caller's. What ends them is raised by :meth:`due`.
    """

    def __init__(
        self, frames: Iterable[Frame], locate: Callable[[Iterable[Frame]], Iterator[LocatedFrame]]
    ) -> None:
        self.left_out = 0
        self._newest: Frame | None = None
        self._ended = False
        self._closing = False
        self._error: BaseException | None = None
        self._news = threading.Condition()
        self._found: queue.SimpleQueue[LocatedFrame] = queue.SimpleQueue()
        self._threads = [
            threading.Thread(target=self._run, args=(self._read, frames), daemon=True),
            threading.Thread(target=self._run, args=(self._locate, locate), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def ended(self) -> bool:
        """Whether no picture will come any more, and all were handed out."""
        return self._found.empty() and not self._threads[1].is_alive()

    def due(self, wait_s: float = 0.0) -> list[LocatedFrame]:
        """Located pictures since the last call, oldest first; waits so long for the first one.

        Raises what ended the camera.
        """
        located: list[LocatedFrame] = []
        with suppress(queue.Empty):
            located.append(self._found.get(timeout=wait_s) if wait_s else self._found.get_nowait())
            while True:
                located.append(self._found.get_nowait())
        if not located and self._error is not None and self.ended:
            raise self._error
        return located

    def close(self) -> None:
        """Stop reading; a camera that hangs is left to end with the process."""
        with self._news:
            self._closing = True
            self._news.notify_all()
        for thread in self._threads:
            thread.join(CLOSE_S)

    def _run(self, work: Callable[..., None], given: object) -> None:
        try:
            work(given)
        except BaseException as error:  # noqa: BLE001 - raised again where the pictures are used
            self._error = self._error or error
        finally:
            with self._news:
                self._ended = True
                self._news.notify_all()

    def _read(self, frames: Iterable[Frame]) -> None:
        for frame in frames:
            with self._news:
                if self._closing:
                    return
                self.left_out += self._newest is not None
                self._newest = frame
                self._news.notify_all()

    def _locate(self, locate: Callable[[Iterable[Frame]], Iterator[LocatedFrame]]) -> None:
        for located in locate(self._fresh()):
            self._found.put(located)

    def _fresh(self) -> Iterator[Frame]:
        while True:
            with self._news:
                while self._newest is None and not (self._ended or self._closing):
                    self._news.wait()
                frame, self._newest = self._newest, None
                if frame is None or self._closing:
                    return
            yield frame


Event = TrackPicture | NDArray[np.void]
"""A picture, or a block of the rig's samples."""

BLOCK_S = 0.05
NO_PICTURE_S = 5.0
"""A camera that gives none for so long has stopped."""


class Feed(NamedTuple):
    """A stream of events; ``base_ns`` is the computer's clock at 0 s of the pictures' times."""

    events: Iterator[Event]
    base_ns: int


def recorded_feed(track: RecordedTrack) -> Feed:
    """What a track was given, again."""
    return Feed(_recorded(track), track.base_ns)


def video_feed(frames: Iterator[object], eye: PoseFinder) -> Feed:
    """The pictures of a video, one after the other."""
    pictures = (eye.picture(located) for located in eye.locate(frames))  # type: ignore[arg-type]
    return Feed(pictures, time.time_ns())


def sim_feed(world: SimWorld, eye: PoseFinder) -> Feed:
    """What the rendered camera of a simulated world sees, without a rig."""
    pictures = (eye.picture(located) for located in eye.locate(world.frames()))
    return Feed(pictures, time.time_ns())


def sim_rig_feed(world: SimWorld, motion: Motion, eye: PoseFinder | None) -> Feed:
    """A virtual rig in virtual time, and what the camera of the same world sees."""
    return Feed(_sim_rig(world, motion, eye), 0)


def live_feed(
    stack: ExitStack,
    eye: PoseFinder | None,
    frames: Iterator[object] | None,
    motion: Motion | None,
) -> Feed:
    """A running camera, a rig on a port, or both, in real time. ``stack`` closes the camera."""
    base_ns, begun = time.time_ns(), time.monotonic()
    camera = None
    if eye is not None and frames is not None:
        camera = CameraThread(frames, eye.locate)  # type: ignore[arg-type]
        stack.enter_context(closing(camera))
    return Feed(_live(camera, eye, motion, begun), base_ns)


def idle_rig(session: RigSession) -> AbstractContextManager[Motion]:
    """Start the servo with the motors off: the rig only tells where it is."""
    return open_motion(session.link, servo_config(session.recipe, session.identity))


def refuse_without_carriage(link: Link) -> None:
    """DeviceError where the tip's place along the cut is not measured."""
    identity = link.identity
    if identity.advance_min < identity.advance_max:
        return
    raise DeviceError(
        f"The device {identity.name} has no carriage: it states no range of advance, so the tip's "
        "place along the cut is not known. Track without it (--device none), or with a rig that "
        "has one."
    )


def refuse_strange_pairs(camera: str, device: str) -> None:
    """InputError where camera and device do not show one plate, or nothing is named."""
    if camera == "none" and device == "none":
        raise InputError("Name a camera (--camera), a device (--device), or both.")
    if (camera == "sim") != (device == "sim") and "none" not in (camera, device):
        raise InputError(
            f"--camera {camera} and --device {device} do not show the same plate: the simulated "
            "camera goes with the simulated rig. Give both as sim, or one of them as none."
        )

    if device != "none" and camera not in ("none", "sim") and camera_number(camera) is None:
        raise InputError(
            f"{camera} was recorded at another time than the rig on {device} is: its pictures "
            "cannot be put at the rig's time. Give a camera's number, or --device none."
        )


def _recorded(track: RecordedTrack) -> Iterator[Event]:
    samples, pictures = track.samples, list(track.pictures)
    host = 1e-9 * (samples["host_time_ns"] - track.base_ns).astype(np.float64)
    first, last = (host[0], host[-1]) if len(host) else (0.0, 0.0)
    edges = np.arange(first + BLOCK_S, last + BLOCK_S, BLOCK_S)
    for block in np.split(samples, np.searchsorted(host, edges)):
        if not len(block):
            continue
        yield block
        until = 1e-9 * float(block["host_time_ns"][-1] - track.base_ns)
        while pictures and pictures[0].arrived_s <= until:
            yield pictures.pop(0)
    yield from pictures


def _sim_rig(world: SimWorld, motion: Motion, eye: PoseFinder | None) -> Iterator[Event]:
    world.begin(motion)
    while True:
        yield motion.step()
        if eye is not None:
            for located in eye.locate(world.frames(world.link.virtual_time)):
                yield eye.picture(located)


def _live(
    camera: CameraThread | None, eye: PoseFinder | None, motion: Motion | None, begun: float
) -> Iterator[Event]:
    last = time.monotonic()
    while True:
        if motion is not None:
            yield motion.step()
        if camera is None or eye is None:
            continue
        due = camera.due(0.0 if motion is not None else BLOCK_S)
        last = time.monotonic() if due else last
        for located in due:
            picture = eye.picture(located)
            yield replace(picture, arrived_s=picture.arrived_s - begun)
        if not due and camera.ended and motion is None:
            return  # `due` has raised what ended the camera, if anything did
        if time.monotonic() - last > NO_PICTURE_S:
            raise DeviceError(
                f"The camera has given no picture for {NO_PICTURE_S:g} s: check its cable, and "
                "that no other program uses it."
            )
