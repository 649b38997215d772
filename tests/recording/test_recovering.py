"""Interrupted captures are finished by the next command; nothing is ever deleted."""

import fcntl
import mmap
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from scissorcal.recording import (
    RecordingWriter,
    read_attachments,
    read_recording,
    recover,
)
from tests.recording.made import made_samples, written_live


def interrupted(folder: Path, name: str, samples: int = 2000, cut: int = 3) -> Path:
    """A capture as a kill leaves it: a .part without footer, cut within its last record."""
    path = written_live(folder / f"{name}.mcap", made_samples(samples))
    data = path.read_bytes()
    end = data.rindex(b"scissorcal.recording") - 20
    part = folder / f"{name}.mcap.part"
    part.write_bytes(data[: end - cut])
    path.unlink()
    return part


def test_an_interrupted_capture_becomes_a_finished_recording(tmp_path: Path) -> None:
    part = interrupted(tmp_path, "cut-1")
    before = part.read_bytes()
    as_it_lies = read_recording(part)
    (result,) = recover(tmp_path)
    assert result.status == "recovered"
    assert result.recording == tmp_path / "cut-1.mcap"
    assert result.kept == tmp_path / "cut-1.mcap.interrupted"
    assert result.kept.read_bytes() == before
    assert not part.exists()
    found = read_recording(result.recording)
    np.testing.assert_array_equal(found.samples, as_it_lies.samples)
    assert len(found.samples) == result.samples > 1800
    assert f"{result.samples} samples" in result.sentence
    assert "The hand rested." in found.notes
    assert f"The capture was interrupted after {result.samples} samples." in found.notes
    assert not any("not finished" in note for note in found.notes)
    assert found.recipe_toml == "x = 1\n"
    assert read_attachments(result.recording) == read_attachments(result.kept)


def test_a_second_call_does_nothing(tmp_path: Path) -> None:
    interrupted(tmp_path, "a")
    interrupted(tmp_path, "b")
    assert [result.status for result in recover(tmp_path)] == ["recovered", "recovered"]
    names = sorted(path.name for path in tmp_path.iterdir())
    assert recover(tmp_path) == ()
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_a_missing_folder_has_nothing_to_recover(tmp_path: Path) -> None:
    assert recover(tmp_path / "nowhere") == ()


@pytest.mark.parametrize("data", [b"", b"\x89MCAP0", b"nonsense"])
def test_a_capture_without_samples_is_renamed_and_reported(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.mcap.part").write_bytes(data)
    (result,) = recover(tmp_path)
    assert (result.status, result.recording) == ("empty", None)
    assert "a.mcap.part" in result.sentence
    assert result.kept.read_bytes() == data
    assert recover(tmp_path) == ()


def test_a_capture_killed_before_its_first_sample(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.mcap", "friction")
    data = writer.part.read_bytes()
    writer.close()
    (tmp_path / "b.mcap.part").write_bytes(data)
    (result,) = recover(tmp_path)
    assert result.status == "empty"
    assert "before its first sample" in result.sentence


def test_an_existing_file_is_not_overwritten(tmp_path: Path) -> None:
    elsewhere = written_live(tmp_path / "elsewhere.mcap", made_samples(300))
    part = interrupted(tmp_path, "a")
    other = elsewhere.rename(tmp_path / "a.mcap")
    before = other.read_bytes()
    part.with_name("a.mcap.interrupted").write_bytes(b"an older one")
    (result,) = recover(tmp_path)
    assert result.recording == tmp_path / "a-2.mcap"
    assert result.kept == tmp_path / "a-2.mcap.interrupted"
    assert other.read_bytes() == before
    assert part.with_name("a.mcap.interrupted").read_bytes() == b"an older one"


def test_an_interrupted_recovery_is_finished(tmp_path: Path) -> None:
    part = interrupted(tmp_path, "a")
    data = part.read_bytes()
    recover(tmp_path)
    # Killed between naming the new recording and putting the original aside.
    part.write_bytes(data)
    (tmp_path / "a.mcap.interrupted").unlink()
    (tmp_path / "a.mcap.recovery").write_bytes(b"half a draft")
    (result,) = recover(tmp_path)
    assert result.recording == tmp_path / "a.mcap"
    assert len(list(tmp_path.glob("*.mcap"))) == 1


def test_a_finished_part_is_recovered_without_loss(tmp_path: Path) -> None:
    path = written_live(tmp_path / "a.mcap", made_samples(500))
    path.rename(tmp_path / "a.mcap.part")
    (result,) = recover(tmp_path)
    assert result.samples == 500
    assert result.recording is not None
    assert not any("interrupted" in note for note in read_recording(result.recording).notes)


def test_a_running_capture_is_not_touched(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "friction") as writer:
        writer.append(made_samples(400))
        (result,) = recover(tmp_path)
        assert result.status == "busy"
        assert "still being written" in result.sentence
        writer.append(made_samples(400))
    assert len(read_recording(tmp_path / "a.mcap").samples) == 800


def test_a_recovery_that_renames_the_new_file_makes_the_writer_start_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    locked = fcntl.flock
    tries = []

    def recovered_meanwhile(descriptor: int, operation: int) -> None:
        tries.append(operation)
        if len(tries) == 1:
            (result,) = recover(tmp_path)
            assert result.status == "empty"
        locked(descriptor, operation)

    monkeypatch.setattr(fcntl, "flock", recovered_meanwhile)
    with RecordingWriter(tmp_path / "a.mcap", "friction") as writer:
        writer.append(made_samples(10))
    assert len(read_recording(tmp_path / "a.mcap").samples) == 10


CAPTURE = """
import mmap, struct, sys
from scissorcal.recording import RecordingWriter
from tests.recording.made import made_samples

samples = made_samples(10)
with open(sys.argv[2], "r+b") as stream:
    count = mmap.mmap(stream.fileno(), 8)
writer = RecordingWriter(sys.argv[1], "friction")
while True:
    writer.append(samples)
    count[:] = struct.pack("<Q", writer.sample_count)
    samples["sequence"] += 10
    samples["host_time_ns"] += 10_000_000
"""


def killed_capture(folder: Path, number: int, at_least: int) -> int:
    """Kill a capture that writes as fast as it can; return the samples it had appended."""
    counter = folder / f"count-{number}"
    counter.write_bytes(bytes(8))
    root = Path(__file__).parents[2]
    child = subprocess.Popen(
        [sys.executable, "-c", CAPTURE, str(folder / f"a-{number}.mcap"), str(counter)],
        cwd=root,
        env={**os.environ, "PYTHONPATH": f"{root}/src:{root}"},
    )
    with counter.open("r+b") as stream, mmap.mmap(stream.fileno(), 8) as count:
        while int.from_bytes(count[:], "little") < at_least:
            assert child.poll() is None, "the capture ended by itself"
            time.sleep(0.0005)
        child.send_signal(signal.SIGKILL)
        child.wait()
        return int.from_bytes(count[:], "little")


def test_a_killed_capture_loses_a_quarter_second_at_most(tmp_path: Path) -> None:
    rng = random.Random(11)
    for number in range(3):
        appended = killed_capture(tmp_path, number, rng.randrange(300, 6000))
        (result,) = recover(tmp_path)
        assert result.status == "recovered"
        assert result.recording is not None
        found = read_recording(result.recording)
        assert f"The capture was interrupted after {result.samples} samples." in found.notes
        sequence = found.samples["sequence"]
        np.testing.assert_array_equal(sequence, sequence[0] + np.arange(len(sequence)))
        assert appended - len(sequence) <= 250  # at 1 kHz
