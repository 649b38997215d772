"""Processor time of a frame in the C loop: from the frame's arrival to the answer's departure."""

import contextlib
import os
import socket
import threading
import time

import numpy as np

from scissorcal.bench.trade.rendered import Stroke
from scissorcal.errors import ScissorcalError
from scissorcal.kernel import (
    LoopBlock,
    Mode,
    ModelTables,
    ServoConfig,
    State,
    StateFlag,
    encode,
    run_loop,
)
from scissorcal.recipe.schema import Limits

FRAMES = 1500
PATIENCE_S = 20.0


def frame_time_s(
    tables: ModelTables, stroke: Stroke, rate_Hz: float, limits: Limits, frames: int = FRAMES
) -> float:
    """Seconds of processor time that the loop takes for a frame, as a mean over ``frames``.

    The loop runs in a thread, in C and without the GIL, on one end of a socket; a device on the
    other end sends the next state of ``stroke`` when the answer to the last has come. What counts
    is the thread's processor time, waiting excluded: wake-up, reading, decoding, the servo with the
    model's step, encoding and writing. Frames follow each other without pause, so that processor
    caches are warm; a port's driver takes more time. Raises ScissorcalError where the loop ends
    before the last frame, or this system has none.
    """
    tick_us = round(1e6 / rate_Hz)
    host, device = socket.socketpair()
    device.settimeout(PATIENCE_S)
    block = LoopBlock.create(_config(limits, tick_us), tables)
    block.fresh_sheet(stroke.contact_m)
    block.engage(Mode.RENDER)
    loop = _Loop(host, block)
    loop.start()
    try:
        for frame in _states(stroke, tick_us, frames):
            device.sendall(frame)
            _await_answer(device)
    except OSError as error:
        if loop.refusal:
            raise loop.refusal from None
        reason = block.stop_reason.sentence
        raise ScissorcalError(f"The loop ended early, so its time is unknown. {reason}") from error
    finally:
        block.stop()
        device.close()
        loop.join(PATIENCE_S)
        host.close()
        block.close()
    return loop.processor_s / frames


class _Loop(threading.Thread):
    """The loop in a thread, and how much processor time it took."""

    def __init__(self, host: socket.socket, block: LoopBlock) -> None:
        super().__init__(daemon=True)
        self._host = host
        self._block = LoopBlock.attach(os.dup(block.fileno()))
        self.processor_s = float("nan")
        self.refusal: ScissorcalError | None = None

    def run(self) -> None:
        before = time.thread_time()
        try:
            run_loop(self._host.fileno(), self._block)
            self.processor_s = time.thread_time() - before
        except ScissorcalError as error:
            self.refusal = error
        with contextlib.suppress(OSError):  # the device's end may be closed
            self._host.shutdown(socket.SHUT_RDWR)
        self._block.close()


def _await_answer(device: socket.socket) -> None:
    """Wait for the end of a frame; ConnectionError where the loop has ended instead."""
    answer = b""
    while not answer.endswith(b"\0"):
        answer = device.recv(256)
        if not answer:
            raise ConnectionError("the loop has ended")


def _config(limits: Limits, tick_us: int) -> ServoConfig:
    """The servo as a rendering has it, without a supervisor, which here would be the caller."""
    return ServoConfig(
        torque_limit=limits.torque_Nm,
        torque_slew=limits.torque_slew_Nm_per_s,
        force_limit=limits.force_N,
        force_slew=limits.force_slew_N_per_s,
        ramp_s=limits.engagement_ramp_s,
        supervisor_ms=0,
        tick_us=tick_us,
    )


def _states(stroke: Stroke, tick_us: int, count: int) -> list[bytes]:
    """The first states of the stroke, repeated where it is shorter, from its middle on."""
    ticks = np.arange(count)
    time_s = (0.4 * stroke.duration_s + ticks * tick_us * 1e-6) % stroke.duration_s
    opening, _ = stroke.at(np.asarray(time_s, dtype=np.float64))
    return [
        encode(
            State(StateFlag.MOTOR_ENABLED, k + 1, (k + 1) * tick_us, float(place), 0.0, 0.0, 0.0)
        )
        for k, place in zip(ticks.tolist(), opening, strict=True)
    ]
