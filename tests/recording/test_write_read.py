"""What is written comes back, in the promised time, and other programs can read it."""

import dataclasses
import errno
import io
import math
import os
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from scissorcal.errors import InputError, ScissorcalError
from scissorcal.recording import (
    SAMPLE_DTYPE,
    Joint,
    Recording,
    RecordingFacts,
    RecordingWriter,
    Stroke,
    content_hash,
    read_attachments,
    read_header,
    read_recording,
    write_recording,
)
from tests.recording.made import EPOCH_NS, made_recording, made_samples, written_live


def assert_same(found: Recording, expected: Recording) -> None:
    """Everything but where it was read from."""
    for field in dataclasses.fields(Recording):
        if field.name in ("source", "content_hash"):
            continue
        if field.name == "samples":
            np.testing.assert_array_equal(found.samples, expected.samples)
        elif field.name == "handle_radius_m":
            np.testing.assert_equal(found.handle_radius_m, expected.handle_radius_m)
        elif field.name == "strokes":
            assert repr(found.strokes) == repr(expected.strokes)  # a speed of NaN equals itself
        else:
            assert getattr(found, field.name) == getattr(expected, field.name), field.name


def test_a_recording_comes_back_as_it_was(tmp_path: Path) -> None:
    recording = made_recording()
    path = write_recording(recording, tmp_path / "a.mcap")
    found = read_recording(path)
    assert_same(found, recording)
    assert found.samples.dtype == SAMPLE_DTYPE
    assert found.source == str(path)
    assert found.content_hash == content_hash(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mcap"]


def test_small_batches_and_odd_numbers_come_back(tmp_path: Path) -> None:
    samples = made_samples(1234)
    samples["motor_torque"][:4] = [math.nan, math.inf, -math.inf, -0.0]
    samples["host_time_ns"][5:9] = -3  # a clock before the epoch
    path = written_live(tmp_path / "a.mcap", samples, batch=7)
    found = read_recording(path)
    assert found.samples.tobytes() == samples.tobytes()
    assert found.notes == ("The hand rested.",)
    assert math.isnan(found.handle_radius_m)
    (photograph,) = read_attachments(path)
    assert (photograph.name, photograph.media_type) == ("blade.jpg", "image/jpeg")
    assert photograph.data == bytes(range(256)) * 4


def test_a_linear_joint_and_no_samples(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    RecordingWriter(path, "friction", Joint("linear")).close()
    found = read_recording(path)
    assert found.joint == Joint("linear")
    assert len(found.samples) == 0
    assert found.notes == ()
    assert found.duration_s == 0.0


def test_an_independent_decoder_reads_the_same_numbers(tmp_path: Path) -> None:
    decoder = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is a dev extra")
    samples = made_samples(300)
    path = write_recording(
        Recording("friction", samples, joint=Joint("linear")), tmp_path / "a.mcap"
    )
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[decoder.DecoderFactory()])
        rows = [(message, decoded) for _, _, message, decoded in reader.iter_decoded_messages()]
        summary = reader.get_summary()
    assert len(rows) == len(samples)
    for name in SAMPLE_DTYPE.names or ():
        values = [getattr(decoded, name) for _, decoded in rows]
        np.testing.assert_array_equal(values, samples[name])
    assert [message.log_time for message, _ in rows] == samples["host_time_ns"].tolist()
    assert summary is not None
    assert summary.channels[1].topic == "/scissorcal/sample"
    assert summary.channels[1].metadata["unit.motor_torque"] == "N"
    assert b"float64 opening  # [m]" in summary.schemas[1].data


def on_disk(part: Path) -> int:
    """How many samples another process would find in a half-written capture."""
    try:
        return len(read_recording(part).samples)
    except InputError:
        return 0


@pytest.mark.parametrize("interval_ms", [1, 20, 124, 126, 249, 400])
def test_samples_wait_in_memory_for_at_most_a_quarter_second(
    tmp_path: Path, interval_ms: int
) -> None:
    samples = made_samples(800)
    samples["host_time_ns"] = EPOCH_NS + np.arange(800) * 1_000_000
    writer = RecordingWriter(tmp_path / "a.mcap", "friction")
    for start in range(0, 800, interval_ms):
        batch = samples[start : start + interval_ms]
        writer.append(batch)
        written = on_disk(writer.part)
        waiting = writer.sample_count - written
        if waiting:
            now = int(batch["host_time_ns"][-1])
            assert now - int(samples["host_time_ns"][written]) < 250_000_000
    writer.close()


def test_a_stream_that_stops_is_written_out_by_polling(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.mcap", "friction")
    writer.append(made_samples(50))
    assert on_disk(writer.part) == 0
    writer.poll(EPOCH_NS + 100_000_000)
    assert on_disk(writer.part) == 0
    writer.poll(EPOCH_NS + 200_000_000)
    assert on_disk(writer.part) == 50
    writer.close()


def test_a_clock_that_decreases_still_writes_out(tmp_path: Path) -> None:
    samples = made_samples(200)
    samples["host_time_ns"][100:] -= 3_600_000_000_000
    writer = RecordingWriter(tmp_path / "a.mcap", "friction")
    writer.append(samples[:100])
    writer.append(samples[100:101])
    assert on_disk(writer.part) == 101
    writer.close()


def test_a_constant_clock_is_chunked_by_size(tmp_path: Path) -> None:
    samples = made_samples(5000)
    samples["host_time_ns"] = 0
    path = write_recording(Recording("friction", samples), tmp_path / "a.mcap")
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) > 5
    np.testing.assert_array_equal(read_recording(path).samples, samples)


def test_existing_files_are_never_overwritten(tmp_path: Path) -> None:
    path = write_recording(made_recording(10), tmp_path / "a.mcap")
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"a\.mcap exists"):
        RecordingWriter(path, "friction")
    assert path.read_bytes() == before
    writer = RecordingWriter(tmp_path / "b.mcap", "friction")
    with pytest.raises(InputError, match=r"b\.mcap\.part exists"):
        RecordingWriter(tmp_path / "b.mcap", "friction")
    writer.append(made_samples(5))
    (tmp_path / "b.mcap").write_text("somebody else's")
    with pytest.raises(InputError, match="not overwritten"):
        writer.close()
    assert (tmp_path / "b.mcap").read_text() == "somebody else's"
    assert len(read_recording(writer.part).samples) == 5


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"No such file.*Make the folder .*nowhere"):
        RecordingWriter(tmp_path / "nowhere" / "a.mcap", "friction")


def test_a_capture_that_fails_keeps_what_it_has(tmp_path: Path) -> None:
    def capture() -> None:
        with RecordingWriter(tmp_path / "a.mcap", "friction") as writer:
            writer.append(made_samples(30))
            raise RuntimeError("the rig was unplugged")

    with pytest.raises(RuntimeError, match="unplugged"):
        capture()
    found = read_recording(tmp_path / "a.mcap")
    assert len(found.samples) == 30
    assert found.notes == ("The capture ended early after 30 samples: the rig was unplugged",)


def test_a_capture_that_fails_before_its_first_sample_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(RuntimeError, match="no rig"),
        RecordingWriter(tmp_path / "a.mcap", "friction"),
    ):
        raise RuntimeError("no rig")
    assert list(tmp_path.iterdir()) == []


class FullDisk(io.FileIO):
    """A file on a disk that has no room left after so many bytes."""

    room = 20_000

    def write(self, data: object) -> int:  # type: ignore[override]
        size = memoryview(data).nbytes  # type: ignore[arg-type]
        if self.tell() + size > self.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data)  # type: ignore[arg-type]


def test_a_full_disk_is_named_and_what_was_written_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Path.open

    def open_on_full_disk(self: Path, mode: str = "r", **options: object) -> object:
        if mode == "xb":
            return io.BufferedWriter(FullDisk(self, "x"))
        return opened(self, mode, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(Path, "open", open_on_full_disk)
    samples = made_samples(3000)
    writer = RecordingWriter(tmp_path / "a.mcap", "friction")

    def capture() -> None:
        with writer:
            for start in range(0, 3000, 20):
                writer.append(samples[start : start + 20])

    with pytest.raises(ScissorcalError, match=r"disk is full: .*a\.mcap\.part"):
        capture()
    with pytest.raises(ScissorcalError, match="is not finished"):
        writer.close()
    kept = read_recording(tmp_path / "a.mcap.part").samples
    assert len(kept) > 100
    np.testing.assert_array_equal(kept, samples[: len(kept)])


def test_samples_of_another_layout_are_refused(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "friction") as writer:
        with pytest.raises(ValueError, match="SAMPLE_DTYPE"):
            writer.append(np.zeros(3))  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="SAMPLE_DTYPE"):
            writer.append(made_samples(4).reshape(2, 2))


def test_strokes_are_found_from_motion_with_their_sheets(tmp_path: Path) -> None:
    samples = made_samples(4000, strokes=False)  # half a turn a second: 2 closing, 2 opening
    with RecordingWriter(
        tmp_path / "a.mcap", "cut", facts=RecordingFacts(min_travel=0.1)
    ) as writer:
        writer.mark_sheet(0)
        writer.append(samples[:2000])
        writer.mark_sheet(1)
        writer.append(samples[2000:])
    found = read_recording(tmp_path / "a.mcap")
    assert [(s.kind, s.sheet) for s in found.strokes] == [
        ("closing", 0),
        ("opening", 0),
        ("closing", 1),
        ("opening", 1),
    ]
    assert set(found.samples["stroke"]) == {0, 1, 2, 3}
    with pytest.raises(ValueError, match="not both"):
        RecordingWriter(
            tmp_path / "b.mcap",
            "cut",
            facts=RecordingFacts(strokes=(Stroke(0, "closing"),), min_travel=1),
        )


def test_strokes_that_are_stated_while_it_runs_survive_a_killed_capture(tmp_path: Path) -> None:
    strokes = (Stroke(0, "closing", 0.5, 0), Stroke(1, "opening", 1.0, 0))
    path = tmp_path / "cut.mcap"
    writer = RecordingWriter(path, "cut", facts=RecordingFacts(recipe_toml="a = 1\n"))
    writer.append(made_samples(50))
    writer.state_strokes(strokes[:1])
    writer.append(made_samples(50))
    writer.state_strokes(strokes)
    part = tmp_path / "killed.mcap"
    part.write_bytes(writer.part.read_bytes())
    killed = read_recording(part)
    assert killed.strokes == strokes
    assert killed.recipe_toml == "a = 1\n"
    writer.append(made_samples(50))
    writer.close()
    assert read_recording(path).strokes == read_header(path).strokes == strokes
