"""A recording is followed while it is written: by any process, whole, cut or damaged."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from scissorcal.prototype.rig_feed import COLUMNS, Look, QUIET_s, RigFeed
from scissorcal.recording import POSE, RecordingFollower, create_locked, recover
from tests.guard import GUARD_S

from .made import a_writer, samples_of


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def feed(tmp_path: Path, clock: Clock) -> Iterator[RigFeed]:
    made = RigFeed(tmp_path / "captures", clock)
    yield made
    made.close()


def looks(feed: RigFeed, clock: Clock, seconds: float) -> Iterator[Look]:
    """Look forty times a second."""
    for _ in range(round(40 * seconds)):
        clock.now_s += 0.025
        yield feed.look()


def said(found: list[Look]) -> list[str]:
    return [look.sentence for look in found if look.sentence]


def rows_of(found: list[Look]) -> dict[str, "np.ndarray[tuple[int]]"]:
    both = np.concatenate([look.rows for look in found])
    return dict(zip(COLUMNS, both.T, strict=True))


def test_a_rendering_is_followed_from_its_first_sample_to_its_end(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    assert not said(list(looks(feed, clock, 0.5)))
    found = []
    with a_writer(tmp_path) as writer:
        for number in range(20):
            writer.append(samples_of(50 * number, 50))
            found += looks(feed, clock, 0.05)
    found += looks(feed, clock, 1.0)
    assert said(found) == ["Following render-1.mcap.", "render-1.mcap is complete."]
    shown = rows_of(found)
    number = np.arange(0, 1000, 4)
    assert np.allclose(shown["time_s"], number / 1000.0)
    assert np.allclose(shown["opening_rad"], 0.5 + 0.1 * np.sin(number / 500.0))
    assert np.allclose(shown["advance_m"], 1e-6 * number)
    assert np.allclose(shown["torque_Nm"], 0.001 * number)
    assert np.allclose(shown["force_N"], 0.25)
    assert sum(look.lost for look in found) == 0


def test_in_a_capture_the_torque_is_what_resists_motor_and_hand(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    with a_writer(tmp_path, "cut", "cut-1.mcap") as writer:
        samples = samples_of(0, 400)
        samples["handle_force"][200:] = np.nan  # no sensor
        samples["opening"][100] = np.inf
        writer.append(samples)
        writer.poll(10**12)
        found = list(looks(feed, clock, 1.0))
    shown = rows_of(found)
    number = np.delete(np.arange(0, 400, 4), 25)  # JSON has no infinity
    hand = np.where(number < 200, 0.07 * 2.0, 0.0)
    kept = np.isin(np.round(1000 * shown["time_s"]), number)
    assert kept.sum() == len(number)
    assert np.allclose(shown["torque_Nm"][kept], hand - 0.001 * number)
    assert np.allclose(shown["force_N"], -0.25)
    assert np.isfinite(np.concatenate(list(shown.values()))).all()


def test_a_long_recording_is_joined_at_its_end(tmp_path: Path, clock: Clock, feed: RigFeed) -> None:
    with a_writer(tmp_path) as writer:
        for number in range(600):
            writer.append(samples_of(100 * number, 100))
        part = writer.part
        with RecordingFollower(part) as follower:
            samples = follower.read()
            assert samples["sequence"][0] == 0
            assert samples["sequence"][-1] > 59000
            assert len(samples) < 6000
            assert not len(follower.read())
            assert follower.is_written
        shown = rows_of(list(looks(feed, clock, 1.0)))
    assert shown["time_s"][-1] > 59.5
    assert np.all(np.diff(shown["time_s"]) > 0.0)


def test_a_tracked_pose_is_shown_beside_the_samples(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    row = np.zeros(1, POSE.dtype)
    row["quaternion"], row["translation"] = (1.0, 0.0, 0.0, 0.0), (0.01, 0.02, 0.03)
    with a_writer(tmp_path, "track", "track-1.mcap") as writer:
        writer.append_telemetry(POSE, row, np.array([10], dtype=np.int64))
        writer.poll(10**9)
        poses = [look.pose for look in looks(feed, clock, 1.0) if look.pose]
    assert poses == [(1.0, 0.0, 0.0, 0.0, 0.01, 0.02, 0.03)]


OTHER = """
import sys, time
from pathlib import Path
from tests.prototype.made import a_writer, samples_of
with a_writer(Path(sys.argv[1])) as writer:
    for number in range(100):
        writer.append(samples_of(50 * number, 50))
        print("written", flush=True)
        if number == 30:
            sys.stdin.readline()
"""


def another(tmp_path: Path) -> "subprocess.Popen[str]":
    """A process that writes a recording, and waits for a line in the midst of it."""
    pipe = subprocess.PIPE
    root = Path(__file__).parents[2]
    words = [sys.executable, "-c", OTHER, str(tmp_path)]
    process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True, cwd=root)
    assert process.stdout is not None
    for _ in range(31):
        assert process.stdout.readline() == "written\n"
    return process


@pytest.mark.slow
def test_a_recording_of_another_process_is_followed_through_its_new_name(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    with another(tmp_path) as process:
        found = list(looks(feed, clock, 1.0 + 2 * QUIET_s))
        assert said(found) == ["Following render-1.mcap."]
        process.communicate("go on\n", timeout=GUARD_S)
    found += looks(feed, clock, 5.0)
    assert said(found)[1:] == ["render-1.mcap is complete."]
    assert rows_of(found)["time_s"][-1] == pytest.approx(4.996)
    assert (tmp_path / "captures" / "render-1.mcap").exists()


def test_a_killed_writer_is_said_and_its_recording_is_still_recovered(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    with another(tmp_path) as process:
        found = list(looks(feed, clock, 1.0))
        process.kill()
        process.communicate(timeout=GUARD_S)
    found += looks(feed, clock, 2 * QUIET_s)
    assert len(said(found)) == 2
    assert "ended without closing it" in said(found)[1]
    assert not said(list(looks(feed, clock, 1.0)))
    (recovered,) = recover(tmp_path / "captures")
    assert recovered.status == "recovered"


def test_an_interrupted_recording_of_before_is_not_followed_but_the_next_one_is(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    with another(tmp_path) as process:
        process.kill()
        process.communicate(timeout=GUARD_S)
    old = tmp_path / "captures" / "render-1.mcap.part"
    os.utime(old, (time.time() - 100.0,) * 2)
    assert not said(list(looks(feed, clock, 1.0)))
    with a_writer(tmp_path, name="render-2.mcap") as writer:
        writer.append(samples_of(0, 100))
        assert said(list(looks(feed, clock, 1.0))) == ["Following render-2.mcap."]


def test_one_that_its_command_removed_is_said_and_the_next_one_is_followed(
    tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    found: list[Look] = []

    def fail() -> None:
        with a_writer(tmp_path):
            found.extend(looks(feed, clock, 0.5))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    found += looks(feed, clock, 0.5)
    assert said(found)[0] == "Following render-1.mcap."
    assert "removed: its command ended before anything" in said(found)[1]
    with a_writer(tmp_path, name="render-2.mcap") as writer:
        writer.append(samples_of(0, 100))
        assert said(list(looks(feed, clock, 1.0))) == ["Following render-2.mcap."]


@pytest.mark.parametrize("what", ["noise", "empty", "another format", "cut", "pipe", "folder"])
def test_what_is_no_recording_does_not_end_the_looking(
    what: str, tmp_path: Path, clock: Clock, feed: RigFeed
) -> None:
    captures = tmp_path / "captures"
    captures.mkdir()
    path = captures / "render-1.mcap"
    part = captures / "render-1.mcap.part"
    held = None
    if what == "pipe":
        os.mkfifo(part)
    elif what == "folder":
        part.mkdir()
    else:
        held = create_locked(path, part)
        rng = np.random.default_rng(3)
        noise = rng.integers(0, 256, 5000, dtype=np.uint8).tobytes()
        texts = {"noise": b"\x89MCAP0\r\n" + noise, "empty": b"", "cut": b"\x89MCAP0\r\n\x06"}
        held.write(texts.get(what, noise))
        held.flush()
    found = list(looks(feed, clock, 1.0))
    assert not sum(len(look.rows) for look in found)
    if what in ("noise", "another format"):
        assert len(said(found)) == 2
        assert "cannot be followed any more" in said(found)[1]
    if held is not None:
        held.close()
    found = list(looks(feed, clock, 2 * QUIET_s))
    with a_writer(tmp_path, name="render-2.mcap") as writer:
        writer.append(samples_of(0, 400))
        found = list(looks(feed, clock, 1.0))
    assert "Following render-2.mcap." in said(found)
    assert sum(len(look.rows) for look in found)


def test_a_damaged_chunk_is_left_out_and_the_rest_is_followed(tmp_path: Path) -> None:
    with a_writer(tmp_path) as writer:
        for number in range(20):
            writer.append(samples_of(100 * number, 100))
        whole = writer.part.read_bytes()
    at = whole.index(b"zstd", len(whole) // 2) + 40  # within the samples of a chunk
    broken = tmp_path / "captures" / "broken.mcap.part"
    broken.write_bytes(
        whole[:at] + bytes(byte ^ 0xFF for byte in whole[at : at + 8]) + whole[at + 8 :]
    )
    with RecordingFollower(broken) as follower:
        numbers = follower.read()["sequence"]
    assert 1000 < len(numbers) < 2000
    assert numbers[-1] > 1700
