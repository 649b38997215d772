"""What a rendering did: watched while it runs; latency, losses, energy, and verdicts."""

import math
import time
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.device.loop_verdicts import loop_verdicts
from scissorcal.device.motion import MotionReport, Samples
from scissorcal.device.session import ShowProgress
from scissorcal.device.timing import FeltLag, LoopRights, Percentiles, TimeHistogram
from scissorcal.kernel import EnergyLedger, SampleFlag, StateFlag
from scissorcal.recording import RecordingWriter, TurningPoints
from scissorcal.render.admission import Admission
from scissorcal.render.pose_placer import PoseReport
from scissorcal.verdicts import STATED, TORQUE, Check, Verdict

ACCEPT = "--accept-derated"
MOST_CREATED = 0.1
NEGLIGIBLE_J = 5e-3
"""Below, an energy error is that of torque sensors: 1 mN m over a few radians of strokes."""
REMEDY = (
    "Check that torque and opening have the same sense ('scissorcal device probe'); a shorter "
    "delay or more damping lowers it."
)
ADMISSION = Check(
    "render admission", "stability: rendered stiffness over the rig's limit in a hand", at_most=1.0
)
FELT_TORQUE = Check(
    "render felt torque",
    f"{TORQUE}its change by what the rig cannot render stably, rms over the scene's strokes",
    at_most=STATED,
)
PLATE_POSE = Check(
    "render plate pose", f"{TORQUE}share of time without full force for want of a pose", at_most=0.1
)
"""Chosen: a person waits for a second in ten without asking what is wrong."""
PASSIVITY = Check(
    "render passivity", "energy beyond the model's, which is felt as buzzing: J", at_most=STATED
)
MOTOR_SENSE = Check(
    "render motor sense", "sense of motor and force sensor: energy from the rig, J", at_most=STATED
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
    the content hash of what was rendered, ``admission`` how much of its stiffness,
    ``accepted_derated`` whether a felt torque beyond the scene's tolerance was accepted by a
    person, and ``plate`` how an estimated plate was followed (None where its pose is known).
    ``warnings`` are sentences for the person at the rig.
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
    accepted_derated: bool
    plate: PoseReport | None
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
    report: MotionReport,
    latency: Percentiles | None,
    tick_us: int,
    admission: Admission,
    plate: PoseReport | None = None,
    *,
    accepted: bool = False,
) -> tuple[Verdict, ...]:
    """Judge a rendering: admitted, felt, on time, complete, without faults, supervised, passive.

    An estimated ``plate`` is judged, too, by how long it was known well enough. ``accepted``: a
    person wants the rendering although its torque is felt beyond the scene's tolerance.
    """
    return (
        _admitted(admission),
        felt_verdict(admission, accepted),
        *loop_verdicts("render", report, latency, tick_us),
        _passive(report.ledger),
        _motor_sense(report.ledger),
        *((_plate_pose(plate),) if plate else ()),
    )


def _admitted(admission: Admission) -> Verdict:
    """Whether what was rendered is within what the rig renders stably."""
    why = " ".join(admission.reasons)
    if not admission.evaluated:
        return ADMISSION.not_evaluated(f"{why} {' '.join(admission.cures)}")
    allowed = admission.allowed_in_hand
    share = admission.rendered / allowed if allowed > 0.0 else math.inf
    return ADMISSION.judge(share, why)


def felt_verdict(admission: Admission, accepted: bool = False) -> Verdict:
    """Whether what is felt of an admitted rendering is the package's torque, to the tolerance.

    Beyond it the check fails, or, where a person ``accepted`` that, decides nothing and states it.
    """
    share, tolerance = admission.felt_share, admission.tolerance
    if not admission.evaluated:
        why = "What this rig changes of the felt torque is not known, as its friction is not."
        return FELT_TORQUE.not_evaluated(f"{why} {' '.join(admission.cures)}")
    why = (
        f"Softer response, weaker damping and friction near rest change the felt torque by "
        f"{share:.1%} (rms over the scene's closing strokes), the scene's tolerance is "
        f"{tolerance * 100:.3g} %."
    )
    if admission.is_felt and accepted:
        return FELT_TORQUE.not_evaluated(
            f"Accepted by a person ({ACCEPT}): {why}", share, threshold=tolerance
        )
    cures = "No encoder, delay or damping cures it alone: narrow the scene."
    if admission.felt_cures:
        cures = f"What would cure it, each by itself: {' '.join(admission.felt_cures)}"
    remedy = f"{why} {cures} Or accept it ({ACCEPT})."
    return FELT_TORQUE.judge(share, why, remedy, threshold=tolerance)


def _plate_pose(plate: PoseReport) -> Verdict:
    """Whether the force was there for most of the time, for want of the plate's pose or not."""
    share = plate.out_s / plate.seconds if plate.seconds > 0.0 else 1.0
    why = (
        f"For {share:.0%} of the time the plate's pose was not known well enough, and the force "
        f"fell ({plate.falls} times, {plate.estimates} estimates)."
    )
    return PLATE_POSE.judge(share, why, " ".join((why, *plate.sentences)))


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
    return PASSIVITY.judge(ledger.created_J, why, remedy, threshold=allowed)


def _motor_sense(ledger: EnergyLedger) -> Verdict:
    """Whether the motor pushes as it says: what hand and motor give, the rig's friction takes.

    A device that reports its command for its torque shows a reversed motor here alone.
    """
    if ledger.hand_J == 0.0:
        why = "No sensor measured the hand's work, so the motor's own sense was not checked."
        return MOTOR_SENSE.not_evaluated(why)
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
    return MOTOR_SENSE.judge(-ledger.rig_J, why, remedy, threshold=allowed)


LOOK_EVERY_S = 0.25
AT_REST_S = 0.5
REST_SHARE = 0.1
OPENED_SHARE = 0.5


class Watch:
    """Records what is rendered, and decides when it is finished.

    ``device_limit`` (N m) is the limit of a device that renders by itself: what it states of its
    torque counts then, not the commands of this computer.

    The work for a block depends on the block alone, and memory grows by one number a stroke: an
    hour of rendering costs at its end what it costs at its beginning. ``travel`` (rad) is the
    least that counts as a stroke; ``wanted`` strokes end the rendering, None leaves that to the
    time; ``tell`` gets the share of ``seconds`` that has passed.
    """

    def __init__(
        self,
        travel: float,
        writer: RecordingWriter | None,
        tell: ShowProgress,
        seconds: float,
        device_limit: float | None = None,
    ) -> None:
        self.wanted: int | None = None
        self.frames = 0
        self.limited = 0
        self.largest_torque = 0.0
        self._latency = TimeHistogram()
        self._strokes = TurningPoints(travel)
        self._travel = travel
        self._writer = writer
        self._tell = tell
        self._device_limit = device_limit
        self._seconds = seconds
        self._began = self._looked_at = -np.inf
        self._lowest, self._highest = np.inf, -np.inf
        self._changed_at = self._now = -np.inf
        self._opening = np.nan
        self._recent: deque[tuple[float, float, float]] = deque()  # end, lowest and highest opening

    @property
    def strokes(self) -> int:
        """Closings of the blades so far."""
        return self._strokes.closings

    @property
    def still_s(self) -> float:
        """For how long the opening has not changed by a single count, away from the stops."""
        return max(0.0, self._now - self._changed_at) if self._recent else 0.0

    @property
    def latency(self) -> Percentiles | None:
        """Latency in us of the rendering so far; None in virtual time."""
        return self._latency.percentiles_us() if self._latency.total else None

    def take(self, samples: Samples) -> bool:
        """Take a block of the rendering; True once all strokes are done."""
        self.record(samples)
        if len(samples) == 0:
            return False
        self.frames += len(samples)
        torque, limited = self._torque(samples)
        self.limited += int(np.count_nonzero(limited))
        self.largest_torque = max(self.largest_torque, float(np.max(np.abs(torque))))
        sent = samples["latency_ns"]
        self._latency.add(sent[sent > 0])
        now = float(samples["device_time_us"][-1]) * 1e-6
        if self._began == -np.inf:
            self._began = float(samples["device_time_us"][0]) * 1e-6
        valid = samples[(samples["flags"] & int(SampleFlag.INVALID)) == 0]
        if len(valid):
            self._follow(now, valid)
        if now - self._looked_at < LOOK_EVERY_S or not self._recent:
            return False
        self._looked_at = now
        return self._look(now)

    def _torque(self, samples: Samples) -> tuple[Array, NDArray[np.bool_]]:
        """The torque (n,) that is rendered, and where it or the force met a limit."""
        if self._device_limit is None:
            met = int(SampleFlag.TORQUE_LIMITED | SampleFlag.FORCE_LIMITED)
            return samples["torque_command"], (samples["flags"] & met) != 0
        torque = samples["motor_torque"]
        return torque, np.abs(torque) >= np.float32(self._device_limit)

    def record(self, samples: Samples) -> None:
        """Record a block of any mode."""
        if self._writer is None:
            return
        if len(samples):
            self._writer.append(samples)
        else:
            self._writer.poll(time.time_ns())

    def _follow(self, now: float, samples: Samples) -> None:
        opening = samples["opening"]
        changes = np.diff(opening, prepend=self._opening) != 0.0
        changes |= (samples["flags"] & int(StateFlag.OPENING_AT_STOP)) != 0
        if changes.any():
            last = np.flatnonzero(changes)[-1]
            self._changed_at = float(samples["device_time_us"][last]) * 1e-6
        self._now = now
        self._strokes.feed(opening)
        low, high = float(opening.min()), float(opening.max())
        self._lowest, self._highest = min(self._lowest, low), max(self._highest, high)
        self._recent.append((now, low, high))
        while self._recent[0][0] <= now - AT_REST_S:
            self._recent.popleft()
        self._opening = float(opening[-1])

    def _look(self, now: float) -> bool:
        """Tell how far it is; True once the last stroke is made and the blades rest, open."""
        passed = (now - self._began) / self._seconds
        if self.wanted is None:
            self._tell(min(passed, 1.0), f"rendering, {self.strokes} strokes so far")
            return False
        share = max(passed, self.strokes / max(1, self.wanted))
        self._tell(min(share, 1.0), f"rendering, stroke {self.strokes} of {self.wanted}")
        low = min(block[1] for block in self._recent)
        high = max(block[2] for block in self._recent)
        resting = high - low < REST_SHARE * self._travel
        span = self._highest - self._lowest
        opened = self._opening > self._lowest + OPENED_SHARE * span
        return self.strokes >= self.wanted and resting and opened
