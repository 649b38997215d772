"""Captures through a port and the servo's own process, with a rig that waits for both.

What needs the rig to go on without them is in test_capture_port.py, in real time.
"""

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device.capture import capture, open_writer, servo_config
from scissorcal.device.link import open_link
from scissorcal.device.paths import PathBuilder
from scissorcal.device.port_motion import PortMotion, open_motion
from scissorcal.device.session import RigSession
from scissorcal.device.sim.sensors import Faults
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, Mode, StateFlag, StopReason
from scissorcal.recording import read_recording
from tests.device.in_step import in_step, patient
from tests.device.recipes import changed

RECIPE = changed(
    "paper-80gsm",
    capture__friction={"speeds_rad_per_s": (3.0,), "repeats": 1, "excitation_s": 0.2},
    capture__cut={"speeds_rad_per_s": (0.8,), "strokes_per_sheet": 1, "sheets": 1},
    rig__control={"opening_kp_Nm_per_rad": 2.0, "opening_kd_Nm_s_per_rad": 0.03},
)


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    patient(monkeypatch)


def test_a_capture_through_a_port_has_every_sample(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with in_step() as rig, open_link(rig.port) as link:
        with open_writer(RigSession(link, RECIPE), "friction", path) as writer:
            report = capture(RigSession(link, RECIPE), "friction", writer)
        assert link.configure(ConfigKey.STREAM, 0.0) == 0.0, "the port is free again"
    recording = read_recording(path)
    samples = recording.samples
    assert len(samples) == report.sample_count
    assert np.all(np.diff(samples["sequence"].astype(np.int64)) == 1)
    assert np.all(np.diff(samples["device_time_us"].astype(np.int64)) > 0)
    for stroke in recording.strokes:
        assert np.sum(samples["stroke"] == stroke.index) > 100
    assert report.motion.counters.misses == 0
    assert report.motion.counters.fallback_frames == 0
    assert report.motion.latency is not None
    assert report.motion.lag.ticks.worst == 1.0
    assert report.motion.lag.sentence in recording.notes
    assert np.all(samples["latency_ns"] > 0)
    assert not samples["flags"][-1] & int(StateFlag.MOTOR_ENABLED)


def test_a_sheet_is_loaded_while_the_loop_runs(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with (
        in_step(seed=2) as rig,
        open_link(rig.port) as link,
        open_writer(RigSession(link, RECIPE), "cut", path) as writer,
    ):
        capture(RigSession(link, RECIPE), "cut", writer)
    recording = read_recording(path)
    assert [(s.kind, s.sheet) for s in recording.strokes] == [("closing", 0), ("opening", 0)]
    closing = recording.samples[recording.samples["stroke"] == 0]
    assert closing["motor_torque"][len(closing) // 2 : -len(closing) // 5].mean() < -0.03


def test_an_unplugged_rig_is_a_device_error_and_its_samples_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with (
        in_step(faults=Faults(unplug_s=1.0)) as rig,
        open_link(rig.port) as link,
        pytest.raises(DeviceError, match="unplugged"),
        open_writer(RigSession(link, RECIPE), "friction", path) as writer,
    ):
        capture(RigSession(link, RECIPE), "friction", writer)
    recording = read_recording(path)
    sequence = recording.samples["sequence"].astype(np.int64)
    assert np.all(np.diff(sequence) == 1)
    assert sequence[-1] == pytest.approx(1000, abs=2), "up to its last sample"
    assert "ended early" in recording.notes[-1]


def test_a_killed_servo_is_detected_and_the_motors_are_released() -> None:
    with (
        in_step() as rig,
        open_link(rig.port) as link,
        open_motion(link, servo_config(RECIPE, link.identity)) as motion,
    ):
        assert isinstance(motion, PortMotion)
        path = PathBuilder(*motion.position, motion.tick_s)
        path.rest(20.0)
        blocks = motion.track(path.reference())
        while motion.mode is not Mode.TRACK:
            next(blocks)
        assert motion.pid is not None
        os.kill(motion.pid, signal.SIGKILL)
        with pytest.raises(DeviceError, match=r"killed by signal 9\. Without commands"):
            for _ in blocks:
                pass
        link.flush()
        rig.pass_ticks(1)
        assert link.state().flags & StateFlag.MOTOR_ENABLED, "it was killed in its path"
        rig.pass_ticks(20)
        link.flush()
        rig.pass_ticks(1)
        assert not link.state().flags & StateFlag.MOTOR_ENABLED


def test_a_pause_keeps_the_servo_alive_and_the_motors_off() -> None:
    with (
        in_step() as rig,
        open_link(rig.port) as link,
        open_motion(link, servo_config(RECIPE, link.identity)) as motion,
    ):
        before = rig.rig.opening
        with motion.paused():
            passed = np.concatenate(list(motion.idle(0.1)))
        samples = np.concatenate(list(motion.idle(0.2)))
        assert motion.report().counters.fallback_frames == 0
        assert motion.stop_reason is StopReason.NONE
        assert len(passed) > 0
        assert len(samples) >= 200
        assert not np.any(samples["flags"] & int(StateFlag.MOTOR_ENABLED))
        assert rig.rig.opening == pytest.approx(before, abs=0.01)
