"""A verdict on each of the doctor's measurements, with the remedy where one failed."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.verdicts import Status, Verdict

ROUND_TRIP_LIMIT_TICKS = 4.0
INTERVAL_LIMIT_TICKS = 3.0
LOST_LIMIT_PERCENT = 0.1
LATENESS_LIMIT_MS = 0.5
DRIFT_LIMIT_PPM = 500.0
TIMER_LIMIT_NS = 1000.0
ADAPTER_LIMIT_MS = 1.0


@dataclass(frozen=True)
class Percentiles:
    """Middle and tail of a set of times, in milliseconds."""

    p50: float
    p99: float
    p999: float
    worst: float

    @classmethod
    def of(cls, seconds: NDArray[np.float64]) -> "Percentiles":
        if len(seconds) == 0:
            return cls(math.nan, math.nan, math.nan, math.nan)
        quantiles = np.quantile(1e3 * seconds, [0.5, 0.99, 0.999, 1.0])
        return cls(*(float(value) for value in quantiles))


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


def judge(m: Measurements, port: str) -> tuple[Verdict, ...]:
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


def adapter_timer_path(port: str, sys_root: Path = Path("/sys")) -> Path:
    """Return the file in which Linux keeps the latency timer of a USB serial adapter."""
    return sys_root / "bus/usb-serial/devices" / Path(port).resolve().name / "latency_timer"


def _verdict(
    scope: str, check: str, passed: bool, value: float, threshold: float, good: str, remedy: str
) -> Verdict:
    status: Status = "pass" if passed else "fail"
    return Verdict(scope, check, status, value, threshold, good if passed else f"{good} {remedy}")


def _round_trip(m: Measurements) -> Verdict:
    limit = ROUND_TRIP_LIMIT_TICKS * m.tick_ms
    return _verdict(
        "device.port",
        "round trip",
        m.round_trip.p99 <= limit and m.unanswered == 0,
        m.round_trip.p99,
        limit,
        f"Round trip: median {m.round_trip.p50:.2f} ms, 99 % within {m.round_trip.p99:.2f} ms; "
        f"{m.unanswered} of {m.round_trips} unanswered.",
        "Connect the device directly (no hub), set the adapter's latency timer to 1 ms, and close "
        "programs that load the processor.",
    )


def _intervals(m: Measurements) -> Verdict:
    limit = INTERVAL_LIMIT_TICKS * m.tick_ms
    return _verdict(
        "device.port",
        "frame intervals",
        m.interval.p99 <= limit,
        m.interval.p99,
        limit,
        f"{m.frames} frames: median interval {m.interval.p50:.2f} ms, 99 % within "
        f"{m.interval.p99:.2f} ms, 99.9 % within {m.interval.p999:.2f} ms, longest "
        f"{m.interval.worst:.1f} ms.",
        "Frames arrive in batches: set the adapter's latency timer to 1 ms, and close programs "
        "that load the processor.",
    )


def _losses(m: Measurements, port: str) -> Verdict:
    share = 100.0 * m.lost / max(m.lost + m.frames, 1)
    return _verdict(
        "device.port",
        "lost frames",
        share <= LOST_LIMIT_PERCENT and m.garbled == 0,
        share,
        LOST_LIMIT_PERCENT,
        f"{m.lost} frames lost ({share:.2g} %) and {m.garbled} garbled on {port}.",
        "Use a shorter, shielded cable, and the baud rate that the device is built for.",
    )


def _adapter(m: Measurements, port: str) -> Verdict:
    if m.adapter_timer_ms is None:
        return Verdict(
            "device.port",
            "latency timer",
            "not_evaluated",
            None,
            ADAPTER_LIMIT_MS,
            f"{port} has no USB adapter with a latency timer.",
        )
    return _verdict(
        "device.port",
        "latency timer",
        m.adapter_timer_ms <= ADAPTER_LIMIT_MS,
        m.adapter_timer_ms,
        ADAPTER_LIMIT_MS,
        f"The adapter delays data by up to {m.adapter_timer_ms:g} ms.",
        f"Run: echo 1 | sudo tee {adapter_timer_path(port)}",
    )


def _drift(m: Measurements) -> Verdict:
    if not math.isfinite(m.drift_ppm):
        return Verdict(
            "device.clock",
            "drift",
            "not_evaluated",
            None,
            DRIFT_LIMIT_PPM,
            "Too few frames arrived to compare the clocks.",
        )
    if m.simulated:
        return Verdict(
            "device.clock",
            "drift",
            "not_evaluated",
            m.drift_ppm,
            DRIFT_LIMIT_PPM,
            f"The clock of a virtual rig stops while this computer is busy "
            f"({m.drift_ppm:.0f} ppm now), so its drift is not judged.",
        )
    direction = "faster" if m.drift_ppm > 0 else "slower"
    return _verdict(
        "device.clock",
        "drift",
        abs(m.drift_ppm) - 2 * m.drift_se_ppm <= DRIFT_LIMIT_PPM,
        m.drift_ppm,
        DRIFT_LIMIT_PPM,
        f"The device's clock runs {abs(m.drift_ppm):.0f} ppm {direction} than this computer's "
        f"(standard error {m.drift_se_ppm:.0f} ppm).",
        "Check the device's oscillator, and that its microseconds are microseconds: rates and "
        "accelerations are computed from them.",
    )


def _timer(m: Measurements) -> Verdict:
    return _verdict(
        "host.timer",
        "resolution",
        m.timer_resolution_ns <= TIMER_LIMIT_NS,
        m.timer_resolution_ns,
        TIMER_LIMIT_NS,
        f"This computer's clock counts in steps of {m.timer_resolution_ns:g} ns.",
        "Use a kernel with high-resolution timers (CONFIG_HIGH_RES_TIMERS).",
    )


def _scheduler(m: Measurements) -> Verdict:
    return _verdict(
        "host.scheduler",
        "wake-up lateness",
        m.lateness.p99 <= LATENESS_LIMIT_MS,
        m.lateness.p99,
        LATENESS_LIMIT_MS,
        f"A wait of 1 ms ends {m.lateness.p50:.2f} ms late in the middle, 99 % within "
        f"{m.lateness.p99:.2f} ms, at worst {m.lateness.worst:.1f} ms.",
        "Close other programs, choose the processor's performance governor, and grant real-time "
        "priority (see there).",
    )


def _rights(m: Measurements) -> Verdict:
    if m.realtime_priority > 0:
        why = f"Real-time priority up to {m.realtime_priority} is granted."
        return Verdict(
            "host.scheduler", "real-time rights", "pass", float(m.realtime_priority), 1.0, why
        )
    return Verdict(
        "host.scheduler",
        "real-time rights",
        "not_evaluated",
        0.0,
        1.0,
        "Real-time priority is not granted; it is only needed where other programs load the "
        "processor. To grant it, put '@dialout - rtprio 50' into "
        "/etc/security/limits.d/scissorcal.conf and log in again.",
    )
