"""How a loop ran: whether its commands came in time, what was lost, and what the device latched."""

from scissorcal.device.faults import fault_sentence
from scissorcal.device.motion import MotionReport
from scissorcal.device.timing import Percentiles
from scissorcal.verdicts import STATED, Check, Verdict

MOST_FAULTS_PER_S = 0.1
LOOP = "whether commands reach the motors in time"
DEADLINE, MISSES, FAULTS, SUPERVISION = (
    {
        scope: Check(f"{scope} {name}", f"{LOOP}: {what}", at_most=limit)
        for scope in ("render", "control")
    }
    for name, what, limit in (
        ("deadline", "99 % of the latencies, us", STATED),
        ("misses", "share of lost frames", 0.01),
        ("faults", "faults that the device latched", STATED),
        ("supervision", "frames with damping only", 0.0),
    )
)


def loop_verdicts(
    scope: str, report: MotionReport, latency: Percentiles | None, tick_us: int
) -> tuple[Verdict, ...]:
    """Judge how a loop ran; ``latency`` is in microseconds, None in virtual time."""
    return (
        _deadline(scope, latency, tick_us),
        _complete(scope, report, tick_us),
        _faultless(scope, report, tick_us),
        _supervised(scope, report),
    )


def _deadline(scope: str, latency: Percentiles | None, tick_us: int) -> Verdict:
    if latency is None:
        why = "Virtual time has no latency."
        return DEADLINE[scope].not_evaluated(why, threshold=float(tick_us))
    why = f"99 % of the commands left within {latency.p99:.0f} us of their frame (tick {tick_us})."
    remedy = f"{why} Run 'scissorcal device doctor' to find what is slow."
    return DEADLINE[scope].judge(latency.p99, why, remedy, threshold=tick_us)


def _complete(scope: str, report: MotionReport, tick_us: int) -> Verdict:
    counters = report.counters
    share = counters.misses / max(1, counters.frames + counters.misses)
    why = f"{counters.misses} of {counters.frames + counters.misses} frames were lost."
    remedy = (
        f"{why} Check the cable and the baud rate; 'scissorcal device doctor' measures the port."
    )
    worst_us = report.interval.worst if report.interval else 0.0
    if report.stalls and report.stalls * worst_us >= counters.misses * tick_us:
        remedy = (
            f"{why} The loop was without frames {report.stalls} times, for up to "
            f"{1e-3 * worst_us:.0f} ms: this computer was held up by other work, and what was sent "
            "meanwhile was lost, or the device paused. Close programs that load this computer."
        )
    return MISSES[scope].judge(share, why, remedy)


def _faultless(scope: str, report: MotionReport, tick_us: int) -> Verdict:
    """Whether the device braked by itself too often."""
    counters = report.counters
    allowed = 1.0 + MOST_FAULTS_PER_S * counters.frames * tick_us * 1e-6
    why = f"The device latched a fault {counters.faults} times ({allowed:.3g} allowed)."
    if counters.faults:
        late = "If nothing else caused them, commands were too late: 'scissorcal device doctor'."
        why += " After each the force was ramped up from zero. "
        why += fault_sentence(report.fault_cause) or late
    return FAULTS[scope].judge(counters.faults, why, threshold=allowed)


def _supervised(scope: str, report: MotionReport) -> Verdict:
    count = report.counters.fallback_frames
    never = "The supervising process never missed its heartbeat."
    missed = (
        f"{count} frames had damping only, because the supervising process missed its "
        "heartbeat: close programs that load the processor."
    )
    return SUPERVISION[scope].judge(count, never, missed)
