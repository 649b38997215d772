"""A plate's tracked pose in a recording: read back by this program and by a decoder of ROS."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mcap.reader import make_reader
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.recipe import EulerAngles
from scissorcal.recording import (
    RecordingWriter,
    export_channel,
    read_header,
    read_recording,
    read_telemetry,
    recover,
    summary,
)
from scissorcal.recording.layout import (
    CHANNELS,
    FRAME,
    PICTURE,
    POSE,
    TelemetryChannel,
    frame_rows,
)
from scissorcal.recording.table_export import channel_columns
from tests.recording.made import EPOCH_NS, made_samples

COUNT = 60


def made_rows(channel: TelemetryChannel, count: int = COUNT, seed: int = 0) -> NDArray[np.void]:
    """Rows of random numbers: every number of every field differs."""
    rng = np.random.default_rng(seed)
    rows = np.zeros(count, dtype=channel.dtype)
    for name in channel.dtype.names or ():
        shape = rows[name].shape
        if rows[name].dtype.kind == "u":
            rows[name] = rng.integers(0, 2**32, shape)
        elif rows[name].dtype.kind == "f":
            rows[name] = rng.standard_normal(shape)
    return rows


def written(path: Path, *, samples: bool, close: bool = True) -> NDArray[np.int64]:
    """A track of 60 estimates and 20 pictures at 30 Hz; returns the estimates' times."""
    poses, pictures = made_rows(POSE), made_rows(PICTURE, 20, 1)
    times = EPOCH_NS + 33_000_000 * np.arange(COUNT)
    writer = RecordingWriter(path, "track")
    if samples:
        writer.append(made_samples(1_000, strokes=False))
    for at in range(COUNT):
        now = times[at : at + 1]
        writer.append_telemetry(POSE, poses[at : at + 1], now)
        writer.append_telemetry(FRAME, frame_rows("rig", poses[at : at + 1], now), now)
        if at % 3 == 0:
            writer.append_telemetry(PICTURE, pictures[at // 3 : at // 3 + 1], now)
    if close:
        writer.close()
    else:
        writer._stream.close()
    return times


@pytest.mark.parametrize("channel", CHANNELS.values(), ids=lambda channel: channel.topic)
def test_fields_lie_where_cdr_puts_them(channel: TelemetryChannel) -> None:
    """At multiples of their size, so that no padding is needed; text is a multiple of 4 bytes."""
    for name in channel.dtype.names or ():
        kind, offset = channel.dtype.fields[name][:2]  # type: ignore[index]
        assert offset % (4 if kind.base.kind == "S" else kind.base.itemsize) == 0, name


@pytest.mark.parametrize("samples", [False, True])
def test_numbers_come_back_as_they_were(tmp_path: Path, samples: bool) -> None:
    path = tmp_path / "track-1.mcap"
    times = written(path, samples=samples)
    for channel, rows in ((POSE, made_rows(POSE)), (PICTURE, made_rows(PICTURE, 20, 1))):
        found = read_telemetry(path, channel)
        for name in channel.dtype.names or ():
            np.testing.assert_array_equal(found[name], rows[name])
    np.testing.assert_array_equal(read_telemetry(path, POSE)["host_time_ns"], times)
    recording = read_recording(path)
    assert recording.kind == "track"
    assert len(recording.samples) == 1_000 * samples == read_header(path).sample_count
    assert recording.beside == {POSE.topic: 60, FRAME.topic: 60, PICTURE.topic: 20}
    assert recording.notes == ()
    assert summary(recording).samples == 1_000 * samples


@pytest.mark.parametrize("parent", ["rig", "camera"])
def test_a_decoder_of_ros_reads_every_channel(tmp_path: Path, parent: str) -> None:
    """Code that shares nothing with ours, as Foxglove has it: by the schemas in the file."""
    ros = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is a dev extra")
    path = tmp_path / "track-1.mcap"
    poses, pictures = made_rows(POSE, 5), made_rows(PICTURE, 5)
    times = EPOCH_NS + 1_234_567 * np.arange(1, 6)
    with RecordingWriter(path, "track") as writer:
        writer.append_telemetry(POSE, poses, times)
        writer.append_telemetry(PICTURE, pictures, times)
        writer.append_telemetry(FRAME, frame_rows(parent, poses, times), times)
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[ros.DecoderFactory()], validate_crcs=True)
        decoded = [(s.name, m.log_time, data) for s, _, m, data in reader.iter_decoded_messages()]
    assert len(decoded) == 15
    for channel, rows in ((POSE, poses), (PICTURE, pictures)):
        found = [data for name, _, data in decoded if name == channel.schema_name]
        for name in channel.dtype.names or ():
            np.testing.assert_array_equal([getattr(one, name) for one in found], rows[name])
    frames = [data for name, _, data in decoded if name == "foxglove_msgs/msg/FrameTransform"]
    for frame, pose, time in zip(frames, poses, times.tolist(), strict=True):
        assert (frame.parent_frame_id, frame.child_frame_id) == (parent, "plate")
        assert frame.timestamp.sec * 1_000_000_000 + frame.timestamp.nanosec == time
        place, turn = frame.translation, frame.rotation
        np.testing.assert_array_equal([place.x, place.y, place.z], pose["translation"])
        np.testing.assert_array_equal([turn.w, turn.x, turn.y, turn.z], pose["quaternion"])


def test_constants_name_the_numbers() -> None:
    assert "uint32 OUTCOME_TOO_LATE=4\n" in POSE.definition
    assert "uint32 STATE_NO_TARGET=3\n" in PICTURE.definition
    assert "float64[36] covariance" in POSE.definition


@pytest.mark.parametrize("samples", [False, True])
def test_a_killed_track_keeps_all_but_its_last_moments(tmp_path: Path, samples: bool) -> None:
    """Rows older than a quarter of a second are in the file, also where no rig sends samples."""
    written(tmp_path / "track-1.mcap", samples=samples, close=False)
    (result,) = recover(tmp_path)
    assert result.status == "recovered"
    assert result.recording is not None
    kept = read_telemetry(result.recording, POSE)
    missing = COUNT - len(kept)
    if not samples:
        assert 0 <= missing * 0.033 <= 0.25
        assert "rows beside samples" in result.sentence
    rows = made_rows(POSE)
    np.testing.assert_array_equal(kept["covariance"], rows["covariance"][: len(kept)])
    frames = read_telemetry(result.recording, FRAME)
    np.testing.assert_array_equal(frames["translation"], kept["translation"][: len(frames)])


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_rows_are_exported_with_their_units(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / "track-1.mcap"
    times = written(path, samples=False)
    table = export_channel(path, "pose", tmp_path / f"poses{suffix}")
    found = pd.read_csv(table) if suffix == ".csv" else pd.read_parquet(table)
    rows = made_rows(POSE)
    np.testing.assert_array_equal(found["host_time_ns"], times)
    np.testing.assert_array_equal(found["quaternion_w"], rows["quaternion"][:, 0])
    np.testing.assert_array_equal(found["translation_z_m"], rows["translation"][:, 2])
    np.testing.assert_array_equal(found["covariance_1_6"], rows["covariance"][:, 5])
    np.testing.assert_array_equal(found["contact_force_N"], rows["contact_force"])
    np.testing.assert_array_equal(found["compliance_m_per_N"], rows["compliance"])
    assert len(found.columns) == 5 + 2 + 4 + 3 + 36 + 6 + 1 + 3 + 3 + 1 + 4
    with pytest.raises(InputError, match="exists"):
        export_channel(path, "pose", table)


def test_exported_poses_have_euler_angles_and_tell_where_they_are_singular() -> None:
    rows = np.zeros(4, dtype=[*POSE.dtype.descr, ("host_time_ns", "<i8")])
    rows["quaternion"] = [EulerAngles(30.0, p, 20.0).quaternion for p in (0.0, 89.0, 89.999, 90.0)]
    rows["covariance"] = (np.diag([1e-4] * 6) ** 2).ravel()
    rows["covariance"][1] = (np.diag([1e-2] * 6) ** 2).ravel()
    found = channel_columns(POSE, rows)
    assert found["yaw_and_roll_determined"].tolist() == [1, 0, 0, 0]
    assert found["pitch_deg"] == pytest.approx([0.0, 89.0, 89.999, 90.0])
    assert found["yaw_deg"][:3] == pytest.approx([30.0] * 3)
    pictures = np.zeros(1, dtype=[*PICTURE.dtype.descr, ("host_time_ns", "<i8")])
    pictures["quaternion"], pictures["other_quaternion"] = np.nan, (1.0, 0.0, 0.0, 0.0)
    seen = channel_columns(PICTURE, pictures)
    assert np.isnan(seen["roll_deg"]).all()
    assert (seen["other_roll_deg"], seen["other_yaw_and_roll_determined"]) == (0.0, 1)


def test_a_channel_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    path = tmp_path / "track-1.mcap"
    written(path, samples=False)
    with pytest.raises(InputError, match=r"no rows of 'control'.* pose, picture"):
        export_channel(path, "control", tmp_path / "a.csv")
    with pytest.raises(InputError, match=r"no channel 'tip'.*: sample, control, pose, picture"):
        export_channel(path, "tip", tmp_path / "a.csv")


def test_names_of_frames_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="24 bytes"):
        frame_rows("somewhere-else", made_rows(POSE, 1), np.zeros(1, dtype=np.int64))


def test_channels_keep_the_names_that_recorded_files_have() -> None:
    assert [(topic, CHANNELS[topic].schema_name) for topic in CHANNELS] == [
        ("/scissorcal/control", "scissorcal/msg/Control"),
        ("/scissorcal/plate/pose", "scissorcal/msg/PlatePose"),
        ("/scissorcal/plate/picture", "scissorcal/msg/PlatePicture"),
        ("/scissorcal/plate/frame", "foxglove_msgs/msg/FrameTransform"),
    ]
