"""The result of a rendering: latency, losses, energy, and verdicts."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.device.motion import MotionReport
from scissorcal.device.timing import FeltLag, LoopRights, Percentiles
from scissorcal.kernel import EnergyLedger
from scissorcal.render.admission import Admission
from scissorcal.verdicts import Verdict, judge, not_evaluated

SCOPE = "render"
MOST_MISSED = 0.01
MOST_CREATED = 0.1
MOST_FAULTS_PER_S = 0.1
NEGLIGIBLE_J = 5e-3
"""Below, an energy error is that of torque sensors: 1 mN m over a few radians of strokes."""
REMEDY = (
    "Check that torque and opening have the same sense ('scissorcal device probe'); a shorter "
    "delay or more damping lowers it."
)


@dataclass(frozen=True)
class AppliedLimits:
    """The tightest of recipe's, package's and device's limits, which the loop kept to.

    ``force_N`` is 0 where the scene renders no translation force: the advance motor is off then.
    """

    torque_Nm: float
    torque_slew_Nm_per_s: float
    force_N: float
    force_slew_N_per_s: float
    engagement_ramp_s: float
    held_at_limit_s: float


@dataclass(frozen=True)
class RenderResult:
    """Figures of a rendering. Counts are frames, ``seconds`` the device's time spent rendering.

    ``latency`` (us) runs from a frame's arrival to the command's departure, ``interval`` (us)
    between frames by the host's clock; both None in virtual time. ``lag`` is what the hand feels
    of all delays, ``rights`` what the system granted the loop (None in virtual time).
    ``misses`` are lost frames, ``garbled`` garbled ones, ``stalls`` pauses
    of more than five ticks, ``unsent`` commands that the line did not accept, ``overrun`` samples
    that this process read too late. ``limited_share`` is the share of rendering frames in which
    torque or force met its limit. ``strokes`` counts closings of the blades, ``package_hash`` is
    the content hash of what was rendered, ``admission`` how much of its stiffness. ``warnings`` are
    sentences for the person at the rig.
    """

    seconds: float
    frames: int
    strokes: int
    latency: Percentiles | None
    interval: Percentiles | None
    lag: FeltLag
    rights: LoopRights | None
    misses: int
    garbled: int
    stalls: int
    unsent: int
    overrun: int
    faults: int
    fallback_frames: int
    limited_share: float
    largest_torque_Nm: float
    ledger: EnergyLedger
    limits: AppliedLimits
    admission: Admission
    package_hash: str
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]


def latency_of(latency_ns: ArrayLike) -> Percentiles | None:
    """Percentiles in microseconds of the times from a frame's arrival to the command's departure.

    ``latency_ns`` is a recording's column: 0 where no command was sent, which does not count.
    Each percentile is a latency that occurred: the smallest that the share of frames does not
    exceed. None where no command has a latency, as in virtual time.

    >>> latency_of([0, 20_000, 30_000, 40_000, 1_000_000])
    Percentiles(p50=30.0, p99=1000.0, p999=1000.0, worst=1000.0)
    """
    sent = np.asarray(latency_ns, dtype=np.int64)
    sent = sent[sent > 0]
    if sent.size == 0:
        return None
    return Percentiles.of(sent / 1000, "inverted_cdf")


def render_verdicts(
    report: MotionReport, latency: Percentiles | None, tick_us: int, admission: Admission
) -> tuple[Verdict, ...]:
    """Judge a rendering: admitted, on time, complete, without faults, supervised, passive."""
    return (
        _admitted(admission),
        _deadline(latency, tick_us),
        _complete(report),
        _faultless(report, tick_us),
        _supervised(report),
        _passive(report.ledger),
        _motor_sense(report.ledger),
    )


def _deadline(latency: Percentiles | None, tick_us: int) -> Verdict:
    if latency is None:
        why = "Virtual time has no latency."
        return not_evaluated(SCOPE, "deadline", why, float(tick_us))
    why = f"99 % of the commands left within {latency.p99:.0f} us of their frame (tick {tick_us})."
    remedy = f"{why} Run 'scissorcal device doctor' to find what is slow."
    return judge(SCOPE, "deadline", latency.p99, tick_us, why, remedy)


def _complete(report: MotionReport) -> Verdict:
    counters = report.counters
    share = counters.misses / max(1, counters.frames + counters.misses)
    why = f"{counters.misses} of {counters.frames + counters.misses} frames were lost."
    remedy = (
        f"{why} Check the cable and the baud rate; 'scissorcal device doctor' measures the port."
    )
    return judge(SCOPE, "misses", share, MOST_MISSED, why, remedy)


def _faultless(report: MotionReport, tick_us: int) -> Verdict:
    """Whether the device braked by itself too often."""
    counters = report.counters
    allowed = 1.0 + MOST_FAULTS_PER_S * counters.frames * tick_us * 1e-6
    why = f"The device latched a fault {counters.faults} times ({allowed:.3g} allowed)."
    if counters.faults:
        why += (
            " After each the force was ramped up from zero. If nothing else caused them, commands "
            "were too late: run 'scissorcal device doctor'."
        )
    return judge(SCOPE, "faults", counters.faults, allowed, why)


def _supervised(report: MotionReport) -> Verdict:
    count = report.counters.fallback_frames
    never = "The supervising process never missed its heartbeat."
    missed = (
        f"{count} frames had damping only, because the supervising process missed its "
        "heartbeat: close programs that load the processor."
    )
    return judge(SCOPE, "supervision", count, 0.0, never, missed)


def _admitted(admission: Admission) -> Verdict:
    """Whether what was rendered is within what the rig renders stably."""
    why = " ".join(admission.reasons)
    if not admission.evaluated:
        return not_evaluated(SCOPE, "admission", f"{why} {' '.join(admission.cures)}")
    allowed = admission.allowed_in_hand
    share = admission.rendered / allowed if allowed > 0.0 else math.inf
    return judge(SCOPE, "admission", share, 1.0, why)


def _passive(ledger: EnergyLedger) -> Verdict:
    """Whether the loop gave out more energy than the rig's share of it, which is felt as buzzing.

    What the ramp put into pressed material and what limits kept back is not the loop's.
    """
    taken = ledger.absorbed_J
    allowed = max(NEGLIGIBLE_J, MOST_CREATED * taken)
    why = (
        f"Energy error {max(ledger.created_J, 0.0):.2g} J (limit {allowed:.2g} J): the motors "
        f"delivered {ledger.delivered_J:.3g} J, the model absorbed {taken:.3g} J"
    )
    if ledger.injected_J < 0.0:
        why += f", and added damping took {-ledger.injected_J:.2g} J"
    why += "."
    remedy = f"{why} {REMEDY}"
    return judge(SCOPE, "passivity", ledger.created_J, allowed, why, remedy)


def _motor_sense(ledger: EnergyLedger) -> Verdict:
    """Whether the motor pushes as it says: what hand and motor give, the rig's friction takes.

    A device that reports its command for its torque shows a reversed motor here alone.
    """
    if ledger.hand_J == 0.0:
        why = "No sensor measured the hand's work, so the motor's own sense was not checked."
        return not_evaluated(SCOPE, "motor sense", why)
    exchanged = abs(ledger.hand_J) + abs(ledger.delivered_J)
    allowed = max(NEGLIGIBLE_J, MOST_CREATED * exchanged)
    why = (
        f"The hand gave {ledger.hand_J:.3g} J and the motors {ledger.delivered_J:.3g} J, so that "
        f"the rig took {ledger.rig_J:.2g} J."
    )
    remedy = (
        f"{why} A rig cannot give energy: the motor pushes against its stated sense, or the force "
        "sensor's sign or radius is wrong. Run 'scissorcal device probe'."
    )
    return judge(SCOPE, "motor sense", -ledger.rig_J, allowed, why, remedy)
