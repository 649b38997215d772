"""The loop on a pseudo-terminal, against a device that another thread plays in step with it."""

import contextlib
import os
import pty
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from scissorcal.kernel import (
    Command,
    Config,
    ConfigEcho,
    FrameDecoder,
    Histogram,
    LoopBlock,
    Mode,
    SampleFlag,
    ServoConfig,
    State,
    StopReason,
    decode,
    encode,
    run_loop,
)
from scissorcal.recording import SAMPLE_DTYPE
from tests.guard import GUARD_S
from tests.kernel.zoo import make_tables

CONFIG = ServoConfig(
    torque_limit=0.5,
    torque_slew=100.0,
    force_limit=10.0,
    force_slew=5000.0,
    ramp_s=0.05,
    damping_Nm_s_per_rad=0.05,
    opening_kp=1.0,
    opening_error_limit=1.0,
    supervisor_ms=0,
)
NEVER_ms = 2 * round(1e3 * GUARD_S)
"""A limit on silence that no test reaches: its device sends when it gets a processor."""


class Device:
    """A device on the master's end of a pty that moves only when it is told to."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        for end in (self.master, self.slave):
            tty.setraw(end)
        os.set_blocking(self.master, False)
        self.decoder = FrameDecoder()
        self.commands: list[Command] = []
        self.configs: list[Config] = []
        self.echoes = True

    def state(self, sequence: int, opening: float = 0.6) -> bytes:
        return encode(State(1, sequence, 1000 * sequence, opening, -0.02, 0.0, 0.0))

    def write(self, frame: bytes) -> None:
        os.write(self.master, frame)

    def hear(self) -> None:
        """Take whatever the host has sent so far."""
        try:
            data = os.read(self.master, 65536)
        except (BlockingIOError, OSError):
            return
        for payload in self.decoder.feed(data):
            message = decode(payload)
            if isinstance(message, Command):
                self.commands.append(message)
            elif isinstance(message, Config):
                self.configs.append(message)
                if self.echoes:
                    self.write(encode(ConfigEcho(0, message.key, message.nonce, message.value)))

    def exchange(self, sequence: int, opening: float = 0.6) -> Command:
        """Send a state and wait for its answer."""
        self.write(self.state(sequence, opening))
        self.wait(lambda: bool(self.commands) and self.commands[-1].echo_sequence == sequence)
        return self.commands[-1]

    def wait(self, done: Callable[[], bool]) -> None:
        until = time.monotonic() + GUARD_S
        while not done():
            assert time.monotonic() < until, "the loop gave no answer"
            self.hear()
            time.sleep(1e-4)

    def close(self) -> None:
        if self.master >= 0:
            os.close(self.master)
            self.master = -1

    def release(self) -> None:
        self.close()
        os.close(self.slave)


class Loop(threading.Thread):
    """A loop in a thread, on a block of its own mapping, as another process would have it."""

    def __init__(self, device: Device, block: LoopBlock) -> None:
        super().__init__(daemon=True)
        self.fd = device.slave
        self.block = LoopBlock.attach(os.dup(block.fileno()))
        self.reason: StopReason | None = None
        self.start()

    def run(self) -> None:
        self.reason = run_loop(self.fd, self.block)

    def ended(self) -> StopReason:
        self.join(GUARD_S)
        assert self.reason is not None, "the loop did not end"
        return self.reason


@pytest.fixture
def device() -> Iterator[Device]:
    device = Device()
    yield device
    device.release()


@pytest.fixture
def block() -> Iterator[LoopBlock]:
    block = LoopBlock.create(
        CONFIG, make_tables(), reference_capacity=500, silence_limit_ms=NEVER_ms
    )
    yield block
    block.close()


def test_it_answers_every_state_and_records_it(device: Device, block: LoopBlock) -> None:
    before_ns = time.time_ns()
    loop = Loop(device, block)
    block.engage(Mode.RENDER)
    for k in range(1, 201):
        command = device.exchange(k, 0.7 - 5e-4 * k)
        assert command.flags == 1
    block.stop()
    assert loop.ended() is StopReason.ASKED
    assert block.stop_reason is StopReason.ASKED
    assert not block.running
    samples = block.read()
    assert samples.dtype == SAMPLE_DTYPE
    assert samples["sequence"].tolist() == list(range(1, 201))
    assert samples["device_time_us"].tolist() == [1000 * k for k in range(200)]
    np.testing.assert_allclose(samples["opening"], 0.7 - 5e-4 * np.arange(1, 201), atol=1e-7)
    np.testing.assert_allclose(samples["force_command"][60:], -0.6, rtol=0.01)
    assert np.all(np.diff(samples["host_time_ns"]) > 0)
    assert before_ns - 10**9 < samples["host_time_ns"][0] < time.time_ns() + 10**9
    assert np.all(samples["latency_ns"] > 0)
    assert block.latency.total == 200
    assert block.interval.total == 199
    assert block.counters.frames == 200
    assert block.counters.misses == 0
    assert block.line.answers == 203
    assert block.ledger.fracture_J > 0
    assert block.crack > 0
    assert len(block.read()) == 0


def test_its_last_commands_release_the_motors(device: Device, block: LoopBlock) -> None:
    loop = Loop(device, block)
    block.engage(Mode.RENDER)
    for k in range(1, 101):
        device.exchange(k, 0.7 - 1e-4 * k)
    assert device.commands[-1].force < -0.5
    said = len(device.commands)
    block.stop()
    assert loop.ended() is StopReason.ASKED
    device.wait(lambda: len(device.commands) >= said + 3)
    assert device.commands[-3:] == [Command(0, 100, 0.0, 0.0)] * 3


def test_garbled_frames_are_counted_and_skipped(device: Device, block: LoopBlock) -> None:
    loop = Loop(device, block)
    for k in range(1, 61):
        if k % 4 == 0:
            frame = bytearray(device.state(k))
            frame[7] ^= 0x20
            device.write(bytes(frame))
        else:
            device.exchange(k)
    device.write(b"\0garbage\0")
    device.exchange(61)
    block.stop()
    assert loop.ended() is StopReason.ASKED
    assert block.line.garbled == 16
    assert block.counters.frames == 46
    assert block.counters.misses == 15
    samples = block.read()
    assert (samples["flags"] & SampleFlag.AFTER_GAP > 0).sum() == 15


def test_queued_states_are_all_recorded_and_only_the_newest_is_answered(
    device: Device, block: LoopBlock
) -> None:
    for k in range(1, 21):
        device.write(device.state(k))
    loop = Loop(device, block)
    device.wait(lambda: bool(device.commands) and device.commands[-1].echo_sequence == 20)
    block.stop()
    loop.ended()
    samples = block.read()
    assert len(samples) == 20
    assert (samples["latency_ns"] > 0).sum() == block.line.answers - 3
    assert samples["latency_ns"][-1] > 0


def test_an_unplugged_device_is_a_hangup(device: Device, block: LoopBlock) -> None:
    loop = Loop(device, block)
    for k in range(1, 11):
        device.exchange(k)
    device.close()
    assert loop.ended() is StopReason.HANGUP
    assert len(block.read()) == 10
    assert "unplugged" in block.stop_reason.sentence


def test_a_device_that_stops_sending_ends_the_loop(device: Device) -> None:
    block = LoopBlock.create(CONFIG, silence_limit_ms=150)
    device.write(device.state(1))  # before the loop listens, so that it is never late
    assert Loop(device, block).ended() is StopReason.SILENCE
    assert block.counters.frames == 1
    block.close()


def test_a_device_that_never_sends_ends_the_loop(device: Device) -> None:
    block = LoopBlock.create(CONFIG, silence_limit_ms=50)
    assert Loop(device, block).ended() is StopReason.SILENCE
    block.close()


def unsupervised() -> LoopBlock:
    """A block whose supervisor has to send a heartbeat every 30 ms."""
    config = ServoConfig(
        torque_limit=0.5,
        torque_slew=100.0,
        force_limit=10.0,
        force_slew=100.0,
        damping_Nm_s_per_rad=0.1,
        supervisor_ms=30,
    )
    return LoopBlock.create(config, make_tables(), silence_limit_ms=NEVER_ms)


def test_a_missing_heartbeat_ends_the_loop_and_releases_the_motors(device: Device) -> None:
    block = unsupervised()
    loop = Loop(device, block)
    block.engage(Mode.RENDER)
    device.write(device.state(1))
    assert loop.ended() is StopReason.SUPERVISOR_LOST
    device.wait(lambda: bool(device.commands) and device.commands[-1].flags == 0)
    assert device.commands[-1].torque == 0
    block.close()


@pytest.mark.realtime
def test_a_missing_heartbeat_means_damping_before_the_stop(device: Device) -> None:
    """In steps of the servo: test_a_missing_heartbeat_leaves_damping_then_stops."""
    block = unsupervised()
    loop = Loop(device, block)
    block.engage(Mode.RENDER)
    for k in range(1, 21):
        block.beat()
        device.exchange(k, 0.7 - 1e-4 * k)
    assert block.mode is Mode.RENDER
    k = 21
    end_s = time.monotonic() + GUARD_S
    while block.mode is not Mode.DAMP and block.stop_reason is StopReason.NONE:
        assert time.monotonic() < end_s
        device.exchange(k, 0.7 - 1e-4 * k)
        k += 1
    assert block.mode is Mode.DAMP
    last = k + 50
    while k < last:
        k += 1
        device.exchange(k, 0.7 - 1e-4 * k)
    assert device.commands[-1].torque == pytest.approx(0.01, rel=0.01)
    while block.stop_reason is StopReason.NONE:
        assert time.monotonic() < end_s
        k += 1
        device.write(device.state(k))
        device.hear()
        time.sleep(1e-3)
    assert loop.ended() is StopReason.SUPERVISOR_LOST
    block.close()


def test_a_full_line_does_not_block_the_loop(device: Device, block: LoopBlock) -> None:
    """A device that sends but never reads: commands are dropped and counted, samples kept."""
    loop = Loop(device, block)
    sequence = 0
    until = time.monotonic() + GUARD_S
    while block.line.unsent == 0:
        assert time.monotonic() < until
        sequence += 1
        with contextlib.suppress(BlockingIOError):  # full in this direction too: lost, as it were
            device.write(device.state(sequence))
        time.sleep(5e-5)
    block.stop()
    assert loop.ended() is StopReason.ASKED
    assert block.counters.frames > 100
    device.hear()
    assert device.decoder.garbled == 0


def test_it_tracks_a_reference_given_while_it_runs(device: Device, block: LoopBlock) -> None:
    loop = Loop(device, block)
    device.exchange(1)
    block.set_reference(
        np.full(300, 0.7), np.zeros(300), np.full(300, -0.02), np.repeat([4, 5, 6], 100)
    )
    block.engage(Mode.TRACK)
    for k in range(2, 152):
        command = device.exchange(k)
    assert block.track_index == 149
    assert command.torque == pytest.approx(0.1, rel=1e-3)
    with pytest.raises(ValueError, match="cannot change"):
        block.set_reference([0.7], [0.0], [0.0], [0])
    block.engage(Mode.IDLE)
    device.exchange(152)
    block.set_reference([0.7], [0.0], [0.0], [0])
    block.stop()
    loop.ended()
    strokes = block.read()["stroke"]
    assert strokes.tolist() == [-1] + [4] * 100 + [5] * 50 + [-1]


def test_a_setting_is_sent_and_its_echo_returned(device: Device, block: LoopBlock) -> None:
    loop = Loop(device, block)
    answers: list[ConfigEcho | None] = []
    asking = threading.Thread(target=lambda: answers.append(block.configure(2, 50.0, GUARD_S)))
    asking.start()
    k = 0
    while asking.is_alive():
        k += 1
        device.exchange(k)
    assert answers == [ConfigEcho(0, 2, 1, 50.0)]
    device.echoes = False
    asking = threading.Thread(target=lambda: answers.append(block.configure(2, 60.0, 0.3)))
    asking.start()
    while asking.is_alive():
        k += 1
        device.exchange(k)
    assert answers[1] is None
    assert block.line.other_frames == 1
    block.stop()
    loop.ended()


CHILD = """
import sys
from scissorcal.kernel import LoopBlock, run_loop
block = LoopBlock.attach(int(sys.argv[1]))
sys.exit(int(run_loop(int(sys.argv[2]), block)))
"""


def test_another_process_runs_it(device: Device, block: LoopBlock) -> None:
    fds = (block.fileno(), device.slave)
    child = subprocess.Popen([sys.executable, "-c", CHILD, *map(str, fds)], pass_fds=fds)
    block.engage(Mode.RENDER)
    for k in range(1, 101):
        device.exchange(k, 0.7 - 1e-4 * k)
    assert block.running
    block.stop()
    assert child.wait(GUARD_S) == int(StopReason.ASKED)
    assert len(block.read()) == 100
    assert block.line.lost_samples == 0


def test_samples_that_were_not_read_in_time_are_counted_as_lost(
    device: Device, block: LoopBlock
) -> None:
    loop = Loop(device, block)
    for k in range(1, 6):
        device.exchange(k)
    assert len(block.read(2)) == 2
    assert block.read(2)["sequence"].tolist() == [3, 4]
    block.stop()
    loop.ended()
    block.pointer.written = 2**16  # as if the ring had gone round
    assert len(block.read()) > 30_000
    assert block.line.lost_samples == 2**16 - 4 - (32768 - 1)


def test_memory_without_a_block_is_refused(block: LoopBlock) -> None:
    with tempfile.TemporaryFile() as file:
        os.ftruncate(file.fileno(), 100)
        with pytest.raises(ValueError, match="too few"):
            LoopBlock.attach(file.fileno())
    with tempfile.TemporaryFile() as file:
        os.ftruncate(file.fileno(), os.fstat(block.fileno()).st_size)
        with pytest.raises(ValueError, match="no block of this version"):
            LoopBlock.attach(file.fileno())
    other = LoopBlock.attach(os.dup(block.fileno()))
    other.pointer.version += 1
    with pytest.raises(ValueError, match="no block of this version"):
        LoopBlock.attach(block.fileno())
    other.close()


def test_a_block_without_tables_refuses_to_render(device: Device) -> None:
    block = LoopBlock.create(CONFIG)
    with pytest.raises(ValueError, match="RENDER needs"):
        block.engage(Mode.RENDER)
    with pytest.raises(ValueError, match="TRACK needs"):
        block.engage(Mode.TRACK)
    with pytest.raises(ValueError, match="does not fit this block"):
        block.set_reference([0.5], [0.0], [0.0], [0])
    block.close()


def test_invalid_parameters_do_not_run(device: Device, block: LoopBlock) -> None:
    block.pointer.config.torque_limit = float("nan")
    assert run_loop(device.slave, block) is StopReason.BAD_BLOCK
    assert block.stop_reason is StopReason.BAD_BLOCK


def test_quantiles_are_upper_bounds_within_an_eighth() -> None:
    edges = np.array([0.0, 1.125, 1.25, np.inf])
    histogram = Histogram(edges, np.array([50, 49, 1], dtype=np.uint64), 7.0)
    assert histogram.quantile(0.5) == 1.125
    assert histogram.quantile(0.99) == 1.25
    assert histogram.quantile(1.0) == 7.0
    empty = Histogram(edges, np.zeros(3, dtype=np.uint64), 0.0)
    assert np.isnan(empty.quantile(0.5))
    with pytest.raises(ValueError, match="between 0 and 1"):
        histogram.quantile(1.5)
