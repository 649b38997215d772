"""A track's sources of events: threads, sources that do not fit, devices without a carriage."""

import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scissorcal.errors import DeviceError, InputError
from scissorcal.recording import SAMPLE_DTYPE
from scissorcal.vision import Frame, LocatedFrame, timed
from scissorcal.workday.tracking import feeds
from scissorcal.workday.tracking.feeds import (
    CameraThread,
    live_feed,
    refuse_strange_pairs,
    refuse_without_carriage,
)
from scissorcal.workday.tracking.track_recorder import TrackPicture
from tests.guard import GUARD_S


def a_frame(number: int, rate_Hz: float = 30.0, stamp_s: float = float("nan")) -> Frame:
    return Frame(number, number / 30.0, None, 100, stamp_s, rate_Hz=rate_Hz)


def seen(frames: Iterable[Frame]) -> Iterator[LocatedFrame]:
    for frame in frames:
        yield LocatedFrame(frame, "no target", None, 0, None)


def wait_for(thread: CameraThread, wanted: int) -> list[LocatedFrame]:
    found: list[LocatedFrame] = []
    while len(found) < wanted and not thread.ended:
        found += thread.due(0.05)
    return found


def test_pictures_that_nobody_has_time_for_are_left_out() -> None:
    """While the first is located twenty come: of those, the newest is the next."""
    first_in, go_on = threading.Event(), threading.Event()

    def camera() -> Iterator[Frame]:
        yield a_frame(0)
        first_in.wait()
        for number in range(1, 21):
            yield a_frame(number)
        go_on.set()

    def slow(frames: Iterable[Frame]) -> Iterator[LocatedFrame]:
        for found in seen(frames):
            if found.frame.number == 0:
                first_in.set()
                go_on.wait()
            yield found

    thread = CameraThread(camera(), slow)
    found = wait_for(thread, 2)
    thread.close()
    assert [one.frame.number for one in found] == [0, 20]
    assert thread.left_out == 19


def test_what_ends_a_camera_is_raised_after_its_last_picture() -> None:
    def camera() -> Iterator[Frame]:
        yield a_frame(0)
        raise DeviceError("The camera is gone.")

    thread = CameraThread(camera(), seen)
    while not thread.ended:
        thread.due(0.05)
    with pytest.raises(DeviceError, match="is gone"):
        thread.due()
    thread.close()


def test_a_feed_ends_with_what_ended_its_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the camera fails while its last picture is being located."""
    monkeypatch.setattr(feeds, "NO_PICTURE_S", GUARD_S)
    failing = threading.Event()

    def camera() -> Iterator[Frame]:
        yield a_frame(0)
        failing.wait()
        raise DeviceError("The camera is gone.")

    def slow(frames: Iterable[Frame]) -> Iterator[LocatedFrame]:
        for found in seen(frames):
            failing.set()
            time.sleep(0.05)
            yield found

    class Eye:
        locate = staticmethod(slow)

        @staticmethod
        def picture(found: LocatedFrame) -> TrackPicture:
            return TrackPicture(found.frame.number, 0.0, time.monotonic(), "no target", 0)

    with ExitStack() as stack, pytest.raises(DeviceError, match="is gone"):
        for _ in live_feed(stack, Eye(), camera(), None).events:  # type: ignore[arg-type]
            pass


def test_samples_and_pictures_of_a_running_rig_come_as_one_stream(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A picture stands at its time since the feed began, behind the samples that came before."""
    monkeypatch.setattr(feeds, "time", SimpleNamespace(monotonic=lambda: 50.0, time_ns=lambda: 7))
    taken = threading.Semaphore(1)

    def camera() -> Iterator[Frame]:
        for number in range(3):
            assert taken.acquire(timeout=GUARD_S)
            yield a_frame(number)

    class Eye:
        locate = staticmethod(seen)

        @staticmethod
        def picture(found: LocatedFrame) -> TrackPicture:
            return TrackPicture(found.frame.number, 0.0, 50.25 + found.frame.number, "no target", 0)

    motion: Any = SimpleNamespace(step=lambda: np.zeros(50, SAMPLE_DTYPE))
    blocks, times = 0, []
    with ExitStack() as stack:
        feed = live_feed(stack, Eye(), camera(), motion)  # type: ignore[arg-type]
        assert feed.base_ns == 7
        for event in feed.events:
            if not isinstance(event, TrackPicture):
                assert len(event) == 50
                blocks += 1
                continue
            assert blocks > len(times)
            times.append(event.arrived_s)
            taken.release()
            if len(times) == 3:
                break
    assert times == [0.25, 1.25, 2.25]


def test_a_camera_that_stops_beside_a_rig_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(50, 1000))
    monkeypatch.setattr(
        feeds, "time", SimpleNamespace(monotonic=lambda: float(next(clock)), time_ns=lambda: 7)
    )
    eye: Any = SimpleNamespace(locate=seen)
    motion: Any = SimpleNamespace(step=lambda: np.zeros(50, SAMPLE_DTYPE))
    with ExitStack() as stack, pytest.raises(DeviceError, match="no picture for 5 s"):
        for _ in live_feed(stack, eye, iter(()), motion).events:
            pass


def test_a_camera_that_hangs_does_not_hold_up_the_end() -> None:
    release = threading.Event()

    def camera() -> Iterator[Frame]:
        yield a_frame(0)
        release.wait()

    thread = CameraThread(camera(), seen)
    assert len(wait_for(thread, 1)) == 1
    assert not thread.ended
    closing = threading.Thread(target=thread.close)
    closing.start()
    release.set()
    closing.join(GUARD_S)
    assert not closing.is_alive()


@pytest.mark.parametrize(
    ("camera", "device", "words"),
    [
        ("none", "none", "Name a camera"),
        ("sim", "/dev/ttyUSB0", "do not show the same plate"),
        ("0", "sim", "do not show the same plate"),
        ("plate.mp4", "/dev/ttyUSB0", "was recorded at another time"),
    ],
)
def test_sources_that_do_not_fit_are_refused(camera: str, device: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        refuse_strange_pairs(camera, device)


@pytest.mark.parametrize(
    ("camera", "device"),
    [("0", "none"), ("0", "/dev/ttyUSB0"), ("none", "sim"), ("sim", "sim"), ("a.mp4", "none")],
)
def test_sources_that_fit_are_taken(camera: str, device: str) -> None:
    refuse_strange_pairs(camera, device)


def test_a_device_without_a_carriage_is_named() -> None:
    identity = SimpleNamespace(name="scissors", advance_min=0.0, advance_max=0.0)
    link: Any = SimpleNamespace(identity=identity)
    with pytest.raises(DeviceError, match=r"device scissors has no carriage.*--device none"):
        refuse_without_carriage(link)
    identity.advance_max = 0.1
    refuse_without_carriage(link)


@pytest.mark.parametrize("rate_Hz", [0.0, float("inf"), 1e6, -30.0])
def test_a_video_without_a_rate_is_refused(rate_Hz: float) -> None:
    with pytest.raises(InputError, match=r"plate\.mp4 states a frame rate of"):
        next(timed([a_frame(0, rate_Hz)], "plate.mp4"))


def test_a_video_whose_stamps_contradict_its_rate_is_refused() -> None:
    frames = [a_frame(number, 30.0, 0.1 + number / 15.0) for number in range(30)]
    with pytest.raises(InputError, match="rate of 30 per second, and its time stamps have 15"):
        list(timed(frames, "plate.mp4"))
    right = [a_frame(number, 30.0, 0.1 + number / 30.0) for number in range(30)]
    assert len(list(timed(right, "plate.mp4"))) == 30
    unstamped = [a_frame(number, 30.0, 0.0) for number in range(30)]
    assert len(list(timed(unstamped, "plate.mp4"))) == 30


def test_a_live_camera_has_no_rate_to_be_wrong() -> None:
    live = [Frame(n, 0.03 * n, None, None, float("nan"), time.monotonic()) for n in range(20)]
    assert len(list(timed(live, "0"))) == 20
    assert np.isnan(live[0].rate_Hz)
