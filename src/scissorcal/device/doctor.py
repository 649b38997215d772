"""The doctor: measure port, clocks and scheduler, with a verdict on each."""

import math
import os
import select
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array, Integers, Progress
from scissorcal.device.link import PortLink
from scissorcal.device.loop_verdicts import LOOP
from scissorcal.device.ports import adapter_timer_ms, adapter_timer_path
from scissorcal.device.timing import Percentiles
from scissorcal.errors import DeviceError
from scissorcal.kernel import Capability, ConfigKey, State
from scissorcal.recording.recording import missing_frames
from scissorcal.verdicts import STATED, Check, Verdict

ROUND_TRIPS = 100
SLEEPS = 500
DRIFT_CHUNKS = 24
U32 = 2**32
KEEP_STREAMING_S = 0.5


@dataclass(frozen=True)
class Measurements:
    """What the doctor measured; times in ms unless the name says otherwise.

    ``drift_ppm`` is how much faster the device's clock runs than the host's, with its standard
    error ``drift_se_ppm``. ``adapter_timer_ms`` is None where there is no such adapter.
    """

    simulated: bool
    tick_ms: float
    round_trip: Percentiles
    round_trips: int
    unanswered: int
    interval: Percentiles
    frames: int
    lost: int
    garbled: int
    drift_ppm: float
    drift_se_ppm: float
    adapter_timer_ms: float | None
    lateness: Percentiles
    timer_resolution_ns: float
    realtime_priority: int


class Examination(NamedTuple):
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


ROUND_TRIP_LIMIT_TICKS = 4.0
INTERVAL_LIMIT_TICKS = 3.0
LEAST_BRAKE_MS, MOST_BRAKE_MS = 10.0, 1000.0
ROUND_TRIP = Check("device.port round trip", f"{LOOP}: 99 % of the answers, ms", at_most=STATED)
FRAME_INTERVALS = Check(
    "device.port frame intervals", f"{LOOP}: 99 % of the intervals, ms", at_most=STATED
)
LOST_FRAMES = Check("device.port lost frames", f"{LOOP}: frames lost, %", at_most=0.1)
LATENCY_TIMER = Check(
    "device.port latency timer", f"{LOOP}: ms that the adapter holds data back", at_most=1.0
)
DRIFT = Check(
    "device.clock drift",
    "rates and accelerations: error of the device's clock beyond two standard errors, ppm",
    at_most=500.0,
)
RESOLUTION = Check(
    "host.timer resolution", f"{LOOP}: steps of this computer's clock, ns", at_most=1000.0
)
LATENESS = Check("host.scheduler wake-up lateness", f"{LOOP}: 99 % of the delays, ms", at_most=0.5)
RIGHTS = Check("host.scheduler real-time rights", f"{LOOP}: priority that is granted", at_least=1.0)


BUSY = (
    "The virtual rig runs on this computer, which other programs kept busy, so this says nothing "
    "of a rig: close them, and run 'scissorcal device doctor --device sim' again."
)


def _judge(
    check: Check, m: Measurements, value: float, found: str, bad: str, limit: float | None = None
) -> Verdict:
    """Judge a time; that of a virtual rig is not evaluated where it is too long."""
    verdict = check.judge(value, found, bad, threshold=limit)
    if m.simulated and verdict.status == "fail":
        return check.not_evaluated(f"{found} {BUSY}", value, threshold=limit)
    return verdict


def diagnose(m: Measurements, port: str) -> tuple[Verdict, ...]:
    """Turn measurements into verdicts; ``why`` of a failed one names the remedy."""
    return (
        _round_trip(m),
        _intervals(m),
        _losses(m, port),
        _adapter(m, port),
        _drift(m),
        _timer(m),
        _scheduler(m),
        _rights(m),
    )


def brake_after_ms(m: Measurements) -> float:
    """Shortest BRAKE_AFTER_MS that this computer, as loaded as now, is unlikely to miss.

    Twice the worst wake-up and round trip that were measured, since a longer run meets worse ones
    than 500 waits do, and a tick; rounded up to 5 ms, between 10 (below which a desktop system
    brakes for nothing) and 1000.
    """
    late = [value for value in (m.lateness.worst, m.round_trip.worst) if math.isfinite(value)]
    needed = 2.0 * sum(late) + m.tick_ms
    return min(max(5.0 * math.ceil(needed / 5.0), LEAST_BRAKE_MS), MOST_BRAKE_MS)


def _round_trip(m: Measurements) -> Verdict:
    limit = ROUND_TRIP_LIMIT_TICKS * m.tick_ms
    found = (
        f"Round trip: median {m.round_trip.p50:.2f} ms, 99 % within {m.round_trip.p99:.2f} ms; "
        f"{m.unanswered} of {m.round_trips} unanswered."
    )
    bad = (
        f"{found} Connect the device directly (no hub){_timer_too(m)}, and close programs that "
        "load the processor."
    )
    if m.unanswered and not (m.simulated and _held_up(m)):
        return ROUND_TRIP.verdict("fail", m.round_trip.p99, bad, threshold=limit)
    if m.unanswered:
        return ROUND_TRIP.not_evaluated(f"{found} {BUSY}", m.round_trip.p99, threshold=limit)
    return _judge(ROUND_TRIP, m, m.round_trip.p99, found, bad, limit)


def _timer_too(m: Measurements) -> str:
    """The remedy of an adapter that collects bytes, where there is one."""
    return "" if m.adapter_timer_ms is None else ", set the adapter's latency timer to 1 ms"


def _intervals(m: Measurements) -> Verdict:
    found = (
        f"{m.frames} frames: median interval {m.interval.p50:.2f} ms, 99 % within "
        f"{m.interval.p99:.2f} ms, 99.9 % within {m.interval.p999:.2f} ms, longest "
        f"{m.interval.worst:.1f} ms."
    )
    return _judge(
        FRAME_INTERVALS,
        m,
        m.interval.p99,
        found,
        f"{found} Frames arrive in batches{_timer_too(m)}: close programs that load the processor.",
        INTERVAL_LIMIT_TICKS * m.tick_ms,
    )


def _losses(m: Measurements, port: str) -> Verdict:
    share = 100.0 * m.lost / max(m.lost + m.frames, 1)
    found = f"{m.lost} frames lost ({share:.2g} %) and {m.garbled} garbled on {port}."
    bad = f"{found} Use a shorter, shielded cable, and the baud rate that the device is built for."
    if m.lost and _held_up(m):
        bad = (
            f"{found} No frame was read for {m.interval.worst:.0f} ms: this computer was held up, "
            "or the device paused. Close programs that load this computer, and measure again."
        )
    if m.garbled:
        return LOST_FRAMES.verdict("fail", share, bad)
    if not _held_up(m):  # a virtual rig can lose frames on its line, too
        return LOST_FRAMES.judge(share, found, bad)
    return _judge(LOST_FRAMES, m, share, found, bad)


def _held_up(m: Measurements) -> bool:
    """Whether nothing was read for as long as all lost frames take: no line did that."""
    return m.interval.worst >= m.lost * m.tick_ms


def _adapter(m: Measurements, port: str) -> Verdict:
    delay_ms = m.adapter_timer_ms
    if delay_ms is None:
        why = f"{port} has no USB adapter with a latency timer."
        return LATENCY_TIMER.not_evaluated(why)
    found = f"The adapter delays data by up to {delay_ms:g} ms."
    bad = f"{found} Run: echo 1 | sudo tee {adapter_timer_path(port)}"
    return LATENCY_TIMER.judge(delay_ms, found, bad)


def _drift(m: Measurements) -> Verdict:
    """Judge what of the drift two standard errors do not explain."""
    if not math.isfinite(m.drift_ppm):
        why = "Too few frames arrived to compare the clocks."
        return DRIFT.not_evaluated(why)
    if m.simulated:
        why = (
            f"The clock of a virtual rig stops while this computer is busy "
            f"({m.drift_ppm:.0f} ppm now), so its drift is not judged."
        )
        return DRIFT.not_evaluated(why, m.drift_ppm)
    direction = "faster" if m.drift_ppm > 0 else "slower"
    found = (
        f"The device's clock runs {abs(m.drift_ppm):.0f} ppm {direction} than this computer's "
        f"(standard error {m.drift_se_ppm:.0f} ppm)."
    )
    return DRIFT.judge(
        max(abs(m.drift_ppm) - 2.0 * m.drift_se_ppm, 0.0),
        found,
        f"{found} Check the device's oscillator, and that its microseconds are microseconds: "
        "rates and accelerations are computed from them.",
    )


def _timer(m: Measurements) -> Verdict:
    found = f"This computer's clock counts in steps of {m.timer_resolution_ns:g} ns."
    return RESOLUTION.judge(
        m.timer_resolution_ns,
        found,
        f"{found} Use a kernel with high-resolution timers (CONFIG_HIGH_RES_TIMERS).",
    )


def _scheduler(m: Measurements) -> Verdict:
    found = (
        f"A wait of 1 ms ends {m.lateness.p50:.2f} ms late in the middle, 99 % within "
        f"{m.lateness.p99:.2f} ms, at worst {m.lateness.worst:.1f} ms."
    )
    return _judge(
        LATENESS,
        m,
        m.lateness.p99,
        found,
        f"{found} Close other programs, choose the processor's performance governor, and grant "
        "real-time priority (see there).",
    )


def _rights(m: Measurements) -> Verdict:
    if m.realtime_priority > 0:
        why = f"Real-time priority up to {m.realtime_priority} is granted."
        return RIGHTS.judge(m.realtime_priority, why)
    why = (
        "Real-time priority is not granted; it is only needed where other programs load the "
        "processor. To grant it, put '@dialout - rtprio 50' into "
        "/etc/security/limits.d/scissorcal.conf and log in again."
    )
    return RIGHTS.not_evaluated(why, 0.0)
