"""The doctor: measure port, clocks and scheduler, with a verdict on each."""

import math
import os
import select
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.aliases import Array, Integers, Progress
from scissorcal.device.diagnosis import Measurements, adapter_timer_path, brake_after_ms, diagnose
from scissorcal.device.link import PortLink
from scissorcal.device.timing import Percentiles
from scissorcal.errors import DeviceError
from scissorcal.kernel import Capability, ConfigKey, State
from scissorcal.recording.recording import missing_frames
from scissorcal.verdicts import Verdict

ROUND_TRIPS = 100
SLEEPS = 500
DRIFT_CHUNKS = 24
U32 = 2**32
KEEP_STREAMING_S = 0.5


@dataclass(frozen=True)
class Examination:
    """Measurements and the verdicts on them."""

    measurements: Measurements
    verdicts: tuple[Verdict, ...]

    @property
    def brake_after_ms(self) -> float:
        """What the device should wait for a command until it brakes, by these measurements."""
        return brake_after_ms(self.measurements)


def examine(link: PortLink, seconds: float = 5.0, progress: Progress | None = None) -> Examination:
    """Receive frames for ``seconds``, measure this machine, and judge both.

    No motor is enabled. Raises DeviceError if the device stops answering.
    """
    tell = progress or (lambda done, sentence: None)
    tell(0.0, "measuring the round trip")
    trips = np.array([link.round_trip() for _ in range(ROUND_TRIPS)])
    tell(0.2, f"receiving frames for {seconds:g} s")
    arrival, device_us, sequence, garbled = _listen(link, seconds)
    tell(0.8, "measuring timer and scheduler")
    answered = trips[np.isfinite(trips)]
    drift, error = clock_drift(arrival, device_us)
    measured = Measurements(
        simulated=bool(link.identity.capabilities & Capability.SIMULATOR),
        tick_ms=link.identity.tick_us * 1e-3,
        round_trip=Percentiles.of(1e3 * answered),
        round_trips=len(trips),
        unanswered=int(len(trips) - len(answered)),
        interval=Percentiles.of(1e3 * np.diff(arrival)),
        frames=len(arrival),
        lost=int(missing_frames(sequence).sum()),
        garbled=garbled,
        drift_ppm=drift,
        drift_se_ppm=error,
        adapter_timer_ms=adapter_timer_ms(link.name),
        lateness=Percentiles.of(1e3 * _lateness()),
        timer_resolution_ns=1e9 * time.clock_getres(time.CLOCK_MONOTONIC),
        realtime_priority=_realtime_priority(),
    )
    tell(1.0, "done")
    return Examination(measured, diagnose(measured, link.name))


def clock_drift(arrival_s: Array, device_us: Integers) -> tuple[float, float]:
    """How much faster the device's clock runs than the host's, in ppm, with its standard error.

    Frames are late, never early, so a line is fitted to the earliest frame of each chunk.
    ``arrival_s`` and ``device_us`` (unwrapped), both (n,). NaN for fewer than 100 frames.
    """
    if len(arrival_s) < 100:
        return math.nan, math.nan
    host = arrival_s - arrival_s[0]
    device = (device_us - device_us[0]) * 1e-6
    ahead = device - host
    best = [
        int(chunk[np.argmax(ahead[chunk])])
        for chunk in np.array_split(np.arange(len(host)), DRIFT_CHUNKS)
    ]
    x, y = host[best] - host[best].mean(), ahead[best]
    slope = float(x @ (y - y.mean()) / (x @ x))
    left = y - y.mean() - slope * x
    error = math.sqrt(float(left @ left) / (len(x) - 2) / float(x @ x))
    return 1e6 * slope, 1e6 * error


def adapter_timer_ms(port: str, sys_root: Path = Path("/sys")) -> float | None:
    """Latency timer (ms) of the USB adapter behind a port, None where there is none."""
    path = adapter_timer_path(port, sys_root)
    try:
        return float(path.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def _listen(link: PortLink, seconds: float) -> tuple[Array, Integers, Integers, int]:
    """Arrival (s), device clock (us, unwrapped) and sequence of frames; and garbled frames."""
    arrivals: list[float] = []
    states: list[State] = []
    link.configure(ConfigKey.STREAM, 1.0)
    link.flush()
    end = time.perf_counter() + seconds
    try:
        while (left := end - time.perf_counter()) > 0:
            link.keep_streaming()
            for message in link.receive(min(left, KEEP_STREAMING_S)):
                if isinstance(message, State):
                    arrivals.append(time.perf_counter())
                    states.append(message)
            if not states:
                raise DeviceError(
                    f"{link.name} sends no state after STREAM = 1: restart the device."
                )
    finally:
        garbled = link.garbled
        link.configure(ConfigKey.STREAM, 0.0)
    clock = np.array([state.device_us for state in states], dtype=np.int64)
    unwrapped = clock + U32 * np.cumsum(np.diff(clock, prepend=clock[0]) < -(U32 // 2))
    sequence = np.array([state.sequence for state in states], dtype=np.int64)
    cut_by_flush = 1
    return np.array(arrivals), unwrapped, sequence, max(garbled - cut_by_flush, 0)


def _lateness() -> Array:
    """How late this process wakes from waits of 1 ms, in seconds."""
    late = np.empty(SLEEPS)
    for index in range(SLEEPS):
        start = time.perf_counter()
        select.select([], [], [], 1e-3)
        late[index] = time.perf_counter() - start - 1e-3
    return np.maximum(late, 0.0)


def _realtime_priority() -> int:
    """Highest real-time priority that this process may have; 0 where the system grants none."""
    if not hasattr(os, "sched_setscheduler"):
        return 0
    import resource

    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return 0
    os.sched_setscheduler(0, policy, parameters)
    highest = os.sched_get_priority_max(os.SCHED_FIFO)
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[1]
    unlimited = os.geteuid() == 0 or limit == resource.RLIM_INFINITY
    return highest if unlimited else min(limit, highest)
