"""Captures on a pseudo-terminal in real time and the servo's own process; what may go wrong.

The same without a clock: test_in_step.py for port and process, test_capture.py in virtual time.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device.capture import capture, open_writer, servo_config
from scissorcal.device.coverage import coverage_of
from scissorcal.device.link import open_link
from scissorcal.device.paths import PathBuilder
from scissorcal.device.port_motion import PortMotion, open_motion
from scissorcal.device.recorder import Recorder
from scissorcal.device.session import RigSession
from scissorcal.device.sim.process import SimProcess
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, Mode, StateFlag, StopReason
from scissorcal.recording import read_recording, recover
from tests.device.recipes import changed

pytestmark = pytest.mark.realtime

RECIPE = changed(
    "paper-80gsm",
    capture__friction={"speeds_rad_per_s": (1.5,), "repeats": 1, "excitation_s": 0.5},
    capture__cut={"speeds_rad_per_s": (0.8,), "strokes_per_sheet": 1, "sheets": 1},
    rig__control={"opening_kp_Nm_per_rad": 2.0, "opening_kd_Nm_s_per_rad": 0.03},
)

CAPTURE_UNTIL_KILLED = """
import sys
from pathlib import Path
from scissorcal.device.capture import capture, open_writer
from scissorcal.device.link import open_link
from scissorcal.device.session import Operator, RigSession
from scissorcal.recipe.library import builtin_recipe

recipe = builtin_recipe("paper-80gsm")
with open_link(sys.argv[1]) as link:
    with open_writer(RigSession(link, recipe), "friction", Path(sys.argv[2])) as writer:
        operator = Operator(progress=lambda *_: print(writer.sample_count, flush=True))
        capture(RigSession(link, recipe, operator), "friction", writer)
"""


def test_a_capture_through_a_port_has_everything(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        with open_writer(RigSession(link, RECIPE), "friction", path) as writer:
            report = capture(RigSession(link, RECIPE), "friction", writer)
        assert link.configure(ConfigKey.STREAM, 0.0) == 0.0, "the port is free again"
    recording = read_recording(path)
    samples = recording.samples
    assert len(samples) == report.sample_count
    for stroke in recording.strokes:
        assert np.sum(samples["stroke"] == stroke.index) > 300
    device, host = samples["device_time_us"] * 1e-6, samples["host_time_ns"] * 1e-9
    assert np.all(np.diff(device) > 0)
    assert np.all(np.diff(host) >= 0)
    assert abs(host[-1] - time.time()) < 60
    assert report.motion.counters.frames >= len(samples)
    assert report.motion.latency is not None
    assert report.motion.latency.p50 > 0
    assert report.motion.lag.ticks.worst >= report.motion.lag.ticks.p50 >= 1.0
    assert report.motion.lag.transport_ms > 0.0
    assert report.motion.lag.sentence in recording.notes
    assert np.sum(samples["latency_ns"] > 0) > 0.5 * len(samples)
    assert not samples["flags"][-1] & int(StateFlag.MOTOR_ENABLED)


def test_a_sheet_is_loaded_while_the_loop_runs(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with (
        SimProcess("office-paper", seed=2) as sim,
        open_link(sim.port) as link,
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
        SimProcess("office-paper", seed=1, faults=("unplug=1.5",)) as sim,
        open_link(sim.port) as link,
        pytest.raises(DeviceError, match="unplugged"),
        open_writer(RigSession(link, RECIPE), "friction", path) as writer,
    ):
        capture(RigSession(link, RECIPE), "friction", writer)
    recording = read_recording(path)
    assert len(recording.samples) > 500
    assert "ended early" in recording.notes[-1]


def test_a_killed_servo_is_detected_and_the_motors_are_released() -> None:
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        with open_motion(link, servo_config(RECIPE, link.identity)) as motion:
            assert isinstance(motion, PortMotion)
            path = PathBuilder(*motion.position, motion.tick_s)
            path.open_to(0.8, 0.2, 20.0)
            blocks = motion.track(path.reference())
            while motion.mode is not Mode.TRACK:
                next(blocks)
            assert motion.pid is not None
            os.kill(motion.pid, signal.SIGKILL)
            with pytest.raises(DeviceError, match=r"killed by signal 9\. Without commands"):
                for _ in blocks:
                    pass
        link.configure(ConfigKey.STREAM, 1.0)
        link.flush()
        assert not link.state().flags & StateFlag.MOTOR_ENABLED


def test_a_capture_survives_a_stalled_computer(tmp_path: Path) -> None:
    """Servo and supervisor stand still for 0.2 s in a stroke; the device latches, and goes on."""
    path = tmp_path / "capture.mcap"
    with (
        SimProcess("office-paper", seed=1) as sim,
        open_link(sim.port) as link,
        open_writer(RigSession(link, RECIPE), "friction", path) as writer,
        open_motion(link, servo_config(RECIPE, link.identity)) as motion,
    ):
        assert isinstance(motion, PortMotion)
        recorder = Recorder(writer, coverage_of(RECIPE, link.identity, "friction"))
        way = PathBuilder(*motion.position, motion.tick_s)
        way.open_to(0.8, 1.0, 20.0)
        way.open_to(0.3, 1.0, 20.0)
        stalled = False
        for samples in motion.track(way.reference()):
            recorder.take(samples, motion.garbled)
            if motion.mode is Mode.TRACK and not stalled:
                assert motion.pid is not None
                os.kill(motion.pid, signal.SIGSTOP)
                time.sleep(0.2)
                os.kill(motion.pid, signal.SIGCONT)
                stalled = True
        assert stalled
        assert motion.stop_reason is StopReason.NONE
        assert motion.position[0] == pytest.approx(0.3, abs=0.05)
    assert recorder.tally.faults >= 1
    assert any("COMMANDS_LOST" in note for note in read_recording(path).notes)


def test_a_stalled_computer_is_not_taken_for_a_silent_device() -> None:
    with (
        SimProcess("office-paper", seed=1) as sim,
        open_link(sim.port) as link,
        open_motion(link, servo_config(RECIPE, link.identity)) as motion,
    ):
        assert isinstance(motion, PortMotion)
        assert motion.pid is not None
        next(motion.idle(0.1))
        everybody = (motion.pid, sim.pid)
        for pid in everybody:
            os.kill(pid, signal.SIGSTOP)
        time.sleep(1.3)  # longer than a device may be silent
        for pid in everybody:
            os.kill(pid, signal.SIGCONT)
        assert sum(len(samples) for samples in motion.idle(0.3)) > 200
        assert motion.stop_reason is StopReason.NONE


def test_a_missing_heartbeat_leaves_damping_only() -> None:
    with (
        SimProcess("office-paper", seed=1) as sim,
        open_link(sim.port) as link,
        open_motion(link, servo_config(RECIPE, link.identity)) as motion,
    ):
        path = PathBuilder(*motion.position, motion.tick_s)
        path.rest(20.0)
        blocks = motion.track(path.reference())
        while motion.mode is not Mode.TRACK:
            next(blocks)
        time.sleep(1.5)
        assert motion.mode is Mode.DAMP
        with pytest.raises(DeviceError, match="fell back to damping"):
            for _ in blocks:
                pass


def test_a_pause_keeps_the_servo_alive_and_the_motors_off() -> None:
    with SimProcess("office-paper", seed=1) as sim, open_link(sim.port) as link:
        config = servo_config(RECIPE, link.identity)
        with open_motion(link, config) as motion:
            with motion.paused():
                time.sleep(1.2)
            samples = np.concatenate(list(motion.idle(0.2)))
        assert motion.report().counters.fallback_frames == 0
        assert len(samples) < 500
        assert not np.any(samples["flags"] & int(StateFlag.MOTOR_ENABLED))


def test_a_killed_capture_loses_less_than_half_a_second(tmp_path: Path) -> None:
    path = tmp_path / "capture.mcap"
    with SimProcess("office-paper", seed=1) as sim:
        victim = subprocess.Popen(
            [sys.executable, "-c", CAPTURE_UNTIL_KILLED, sim.port, str(path)],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert victim.stdout is not None
        appended = 0
        while appended < 1500:
            appended = int(victim.stdout.readline())
        victim.kill()
        rest = victim.communicate()[0].split()
        appended = int(rest[-1]) if rest else appended
        with open_link(sim.port, timeout=10.0) as link:  # the servo has let go of the port
            link.configure(ConfigKey.STREAM, 1.0)
            link.flush()
            assert not link.state().flags & StateFlag.MOTOR_ENABLED
    assert len(recover(tmp_path)) == 1
    recording = read_recording(path)
    assert len(recording.samples) > appended - 500
    assert any("interrupted" in note for note in recording.notes)
