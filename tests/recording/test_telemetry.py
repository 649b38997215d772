"""Channels beside the samples: written, read by this program and by MCAP's, recovered."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from scissorcal.kernel import CONTROL_DTYPE
from scissorcal.recording import (
    RecordingWriter,
    read_header,
    read_recording,
    read_telemetry,
    recover,
)
from scissorcal.recording.layout import CONTROL
from tests.recording.made import made_samples


def rows(first: int, count: int) -> np.ndarray:
    found = np.zeros(count, dtype=CONTROL.dtype)
    found["sequence"] = np.arange(first, first + count)
    found["force"] = 2.0 + 0.01 * np.arange(count)
    found["stage"] = -1
    return found


def write(path: Path, *, close: bool = True) -> np.ndarray:
    """Samples and telemetry in turns; returns the telemetry."""
    samples = made_samples(1_000)
    writer = RecordingWriter(path, "control")
    written = []
    for block in range(20):
        part = samples[50 * block : 50 * block + 50]
        writer.append(part)
        if 5 <= block < 15:
            own = rows(50 * block, 50)
            writer.append_telemetry(CONTROL, own, part["host_time_ns"].astype(np.int64))
            written.append(own)
        if block == 9:
            writer.note("halfway")
    if close:
        writer.close()
    else:
        writer._mcap.flush()
        writer._stream.close()
    return np.concatenate(written)


def test_a_row_is_what_the_servo_writes() -> None:
    assert [(n, k) for n, k, _, _ in CONTROL.fields] == [
        (name, CONTROL_DTYPE[name].str) for name in CONTROL_DTYPE.names or ()
    ]
    assert CONTROL.dtype.itemsize == CONTROL_DTYPE.itemsize == 64


def test_telemetry_comes_back_and_leaves_the_samples_alone(tmp_path: Path) -> None:
    path = tmp_path / "control-1.mcap"
    written = write(path)
    found = read_telemetry(path, CONTROL)
    for name in CONTROL.dtype.names or ():
        assert np.array_equal(found[name], written[name])
    recording = read_recording(path)
    assert len(recording.samples) == 1_000
    assert recording.notes == ("halfway",)
    assert read_header(path).sample_count == 1_000
    times = recording.samples["host_time_ns"][250:750]
    assert np.array_equal(found["host_time_ns"], times)


def test_the_mcap_library_reads_both_channels(tmp_path: Path) -> None:
    path = tmp_path / "control-1.mcap"
    written = write(path)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        messages = list(reader.iter_messages(CONTROL.topic))
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.channel_message_counts == {1: 1_000, 2: 500}
    assert {channel.topic for channel in summary.channels.values()} == {
        "/scissorcal/sample",
        CONTROL.topic,
    }
    data = b"".join(message.data[4:] for _, _, message in messages)
    assert np.array_equal(np.frombuffer(data, CONTROL.dtype), written)
    assert messages[0][0].data.decode().splitlines()[4].startswith("float32 force")  # type: ignore[union-attr]


def test_an_interrupted_recording_keeps_its_telemetry(tmp_path: Path) -> None:
    written = write(tmp_path / "control-1.mcap", close=False)
    (result,) = recover(tmp_path)
    assert result.status == "recovered"
    assert result.recording is not None
    found = read_telemetry(result.recording, CONTROL)
    assert np.array_equal(found["sequence"], written["sequence"])
    assert len(read_recording(result.recording).samples) == 1_000


def test_a_recording_without_telemetry_has_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "cut-1.mcap"
    with RecordingWriter(path, "cut") as writer:
        writer.append(made_samples(10))
    assert len(read_telemetry(path, CONTROL)) == 0


def test_rows_of_another_size_are_refused(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "control-1.mcap", "control") as writer:
        with pytest.raises(ValueError, match="dtype"):
            writer.append_telemetry(CONTROL, np.zeros(3), np.zeros(3, dtype=np.int64))
        writer.append(made_samples(3))
