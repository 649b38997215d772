"""Press on a plate's surface and follow a path along it: the outer loop, on a motion."""

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.control.control_result import (
    ControlResult,
    control_figures,
    control_verdicts,
)
from scissorcal.control.mechanics import RigMechanics
from scissorcal.control.path_file import SurfacePoints
from scissorcal.control.settings import (
    LIFT_M,
    MUST_ASK,
    Material,
    Settings,
    control_settings,
    put_plate,
)
from scissorcal.control.surface_path import (
    ContourMap,
    Foot,
    TimedPath,
    contour_at,
    foot_of,
    map_contour,
    start_foot,
    time_path,
)
from scissorcal.device.capture import servo_config
from scissorcal.device.capture_gains import Probed, capture_gains
from scissorcal.device.lockstep_motion import Exchanging
from scissorcal.device.motion import LoopTask, Motion, Samples
from scissorcal.device.paths import PathBuilder, Reference
from scissorcal.device.port_motion import open_motion
from scissorcal.device.session import RigSession, is_simulator, refuse_nobody
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import CONTROL_DTYPE, ConfigKey, ControlFlag
from scissorcal.model.surface import Surface
from scissorcal.recipe.pace import APPROACH_SPEED, TURN_ACCELERATION
from scissorcal.recording import RecordingWriter
from scissorcal.recording.telemetry import CONTROL
from scissorcal.tracking.plate_pose import PlatePose, PoseSource

EVERY_S = 0.01
HIGHER_M = 5e-3
"""By how much the tip passes over the highest place of the path on its way to the start."""
HANDLE_N = 1.0
LIFT_WAIT_S = 2.0
STALE_S = 0.1
MOST_GAP_SD_M = 7e-4
"""A third of the gap within which the tip looks for the surface."""


@dataclass(frozen=True, eq=False)
class Job:
    """What shall be done: a path on a surface, where the plate stands, and what it is made of.

    ``points`` state force and speed throughout; ``length_m`` is the plate's along its x axis.
    ``tracked`` says that the source looks for a plate that is in its place already, because
    `ask_for_plate` asked for it: then its pose is asked for again before the tip is lowered.
    """

    points: SurfacePoints
    surface: Surface
    source: PoseSource
    material: Material
    length_m: float
    tracked: bool = False


def control(
    session: RigSession, rig: RigMechanics, job: Job, writer: RecordingWriter | None = None
) -> ControlResult:
    """Press along the plate's normal and follow a path on its surface, with both axes of the rig.

    The tip is moved over the path's start, lowered until it touches, and follows the path while it
    presses; then it is lifted. The inner loop runs in C (docs/control.md); here the pose source is
    asked about 100 times a second, and what follows from it goes to the servo: without a pose the
    tip is lifted, the path waits, and after 2 s the run ends. On a simulator the specimen's plate
    is put in; elsewhere a person is asked for it, unless the job says that it is tracked in
    its place. ``writer`` records samples and telemetry.

    Raises InputError, before anything moves, for a path, force or stiffness that cannot be had, and
    where nobody can be asked; DeviceError where no pose comes, where a tracked one is lost before
    the tip is lowered, or the rig fails. The motors are released in any case.
    """
    link, recipe, identity = session.link, session.recipe, session.identity
    if not job.tracked:
        refuse_nobody(identity, session.operator.confirm, MUST_ASK)
    # Stiff ones, without material: sweeps of friction give up stiffness for damping. By the mean of
    # the delay, as the gains of contact are (decision 136).
    probed = Probed.of(session.probe)
    probed = None if probed is None else replace(probed, delay_sd_s=0.0)
    gains = capture_gains(recipe, identity, "friction-advance", probed)
    now_s = link.virtual_time if isinstance(link, Exchanging) else time.monotonic()
    pose = _pose_now(job.source, now_s, "nothing was moved")
    contour = map_contour(job.points, job.surface, pose, job.length_m)
    path = time_path(job.points, contour, identity.tick_us * 1e-6)
    settings = control_settings(
        rig, identity, recipe.limits, job.material, path, gains.rate_cutoff_Hz
    )
    seconds = len(path.place) * identity.tick_us * 1e-6
    config = servo_config(recipe, identity, seconds, gains, session.rest)
    watch = replace(config.watch, rest_torque=0.0)  # pressing blades rest under any torque
    config = replace(config, watch=watch, supervisor_ms=200)
    run = _Run(session, rig, job, path, settings, writer)
    task = LoopTask(control=settings.config, longest_reference=len(path.place))
    with open_motion(link, config, task, every_s=EVERY_S) as motion:
        start = start_foot(job.points, contour, job.surface, pose)
        _prepare(motion, rig, run)
        _move_over(motion, rig, contour, start, run)
        if job.tracked and not session.simulated:
            start = _start_again(motion, rig, run)
        else:
            put_plate(motion, session.operator.confirm)
        _lower(motion, rig, start, run)
        run.follow(motion)
        if session.simulated:
            motion.configure(ConfigKey.MATERIAL, 0.0)
        report = motion.report()
    figures = control_figures(
        run.telemetry(), identity.tick_us * 1e-6, run.share, len(path.place), path.way
    )
    wanted = float(job.points.force.max())
    return ControlResult(
        figures=figures,
        wanted_N=wanted,
        stiffness_N_per_mm=1e-3 * job.material.stiffness_N_per_m,
        masses_kg=settings.masses_kg,
        gains=settings.gains,
        report=report,
        verdicts=control_verdicts(figures, wanted, settings.config, job.material.peak_N, report),
        warnings=tuple(run.warnings.values()),
    )


class _Run:
    """The outer loop's state: what it sends, records, and tells."""

    def __init__(
        self,
        session: RigSession,
        rig: RigMechanics,
        job: Job,
        path: TimedPath,
        settings: Settings,
        writer: RecordingWriter | None,
    ) -> None:
        self.job, self._rig, self._contour, self._path = job, rig, path.contour, path
        self._settings = settings
        self._writer, self._tell = writer, session.operator.progress
        self._rows: list[NDArray[np.void]] = []
        self._clock = 0, 0
        self.share = 1.0
        self.warnings: dict[str, str] = {}

    def telemetry(self) -> NDArray[np.void]:
        """Samples of CONTROL so far."""
        return np.concatenate([np.zeros(0, dtype=CONTROL_DTYPE), *self._rows])

    def take(self, samples: Samples, sentence: str) -> None:
        """Record a block of any mode."""
        if self._writer is not None and len(samples):
            self._writer.append(samples)
        self._tell(self._done(), sentence)

    def follow(self, motion: Motion) -> None:
        """Run CONTROL until the path's end, lift the tip, and end."""
        path = self._path
        motion.set_path(path.place, path.rate, path.force, path.stage)
        self._send(motion, np.zeros(0, dtype=np.void), lift=False)
        lifting_s = math.inf
        last = 0
        for samples in motion.control():
            rows = motion.control_samples()
            self._keep(samples, rows)
            self._send(motion, samples, lift=math.isfinite(lifting_s))
            if len(rows):
                last = int(rows["flags"][-1])
            self.take(samples, self._doing(last, math.isfinite(lifting_s)))
            if last & int(ControlFlag.DONE) and math.isinf(lifting_s):
                lifting_s = 0.0
            lifting_s += len(samples) * motion.tick_s
            if math.isfinite(lifting_s) and (
                (last & int(ControlFlag.LIFTED)) or lifting_s > LIFT_WAIT_S
            ):
                break
        for samples in motion.idle(0.1):
            self.take(samples, "motors off")

    def _send(self, motion: Motion, samples: Samples, *, lift: bool) -> None:
        now = motion.now_s
        pose = self.job.source(now, samples)
        foot = self._foot(motion, pose, now)
        if pose is None or foot is None:
            return
        self.share = foot.share
        place = self._contour.place_of(foot)
        motion.send_contour(contour_at(foot, place, pose, lift))

    def _foot(self, motion: Motion, pose: PlatePose | None, now: float) -> Foot | None:
        """The contour below the tip, None (and a sentence) where the pose does not give it."""
        if pose is None:
            return None
        if not pose.tracked or now - pose.time > STALE_S:
            why = pose.why or f"the last pose is {now - pose.time:.2f} s old"
            self._note("lost", f"The plate's pose was lost ({why}): the tip was lifted.")
            return None
        pose = pose.at(now)
        place = self._rig.tip.place(motion.position)
        foot = foot_of(self.job.surface, pose, float(place[0]), float(place[1]))
        if foot is None:
            self._note("left", "The tip left the surface: it was lifted.")
            return None
        sd = _gap_sd(pose, foot)
        if sd > MOST_GAP_SD_M:
            self._note(
                "uncertain",
                f"The plate's pose left the surface's place uncertain by {1e3 * sd:.2f} mm, and "
                f"{1e3 * MOST_GAP_SD_M:g} mm are allowed: the tip was lifted.",
            )
            return None
        return foot

    def _note(self, kind: str, sentence: str) -> None:
        if kind not in self.warnings:
            self.warnings[kind] = sentence
            if self._writer is not None:
                self._writer.note(sentence)

    def _keep(self, samples: Samples, rows: NDArray[np.void]) -> None:
        """Keep telemetry; it is recorded at the host's times of the samples of the same ticks."""
        self._rows.append(rows)
        if len(samples):
            self._clock = int(samples["host_time_ns"][-1]), int(samples["sequence"][-1])
        if self._writer is not None and len(rows):
            at_ns, sequence = self._clock
            behind = (rows["sequence"].astype(np.int64) - sequence + 2**31) % 2**32 - 2**31
            times = at_ns + behind * round(1e9 * self._settings.config.tick_s)
            self._writer.append_telemetry(CONTROL, rows.astype(CONTROL.dtype), times)

    def _done(self) -> float:
        for rows in reversed(self._rows):
            if len(rows):
                return min(float(rows["index"][-1]) / max(len(self._path.place) - 1, 1), 1.0)
        return 0.0

    def _doing(self, flags: int, lifting: bool) -> str:
        if lifting:
            return "lifting the tip"
        if flags & int(ControlFlag.LETS_GO):
            return "waiting for the plate's pose, the tip lifted"
        return f"following the path of {1e3 * self._path.way:.1f} mm"


def _pose_now(source: PoseSource, now_s: float, so: str) -> PlatePose:
    """The pose by which a path is laid, or its start approached."""
    pose = source(now_s, np.zeros(0, dtype=np.void))
    if pose is None or not pose.tracked:
        why = f" ({pose.why})" if pose is not None and pose.why else ""
        raise DeviceError(
            f"There is no pose of the plate{why}, so {so}: check the camera and that "
            "it sees the plate's target, or state the pose."
        )
    return pose


def _gap_sd(pose: PlatePose, foot: Foot) -> float:
    """Standard deviation (m) of the surface's height at a foot, by the pose's covariance."""
    reach = np.array((*foot.point, 0.0)) - pose.translation
    normal = np.array((*foot.normal, 0.0))
    slope = np.concatenate([np.cross(reach, normal), normal])
    return math.sqrt(max(float(slope @ pose.covariance @ slope), 0.0))


def _prepare(motion: Motion, rig: RigMechanics, run: _Run) -> None:
    """See, with the motors off, that nobody holds the handles."""
    if is_simulator(motion.identity):
        motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
        motion.configure(ConfigKey.MATERIAL, 0.0)
    for samples in motion.idle(0.3):
        run.take(samples, "motors off, looking whether the handles are free")
        _refuse_held(samples, rig)


def _move_over(
    motion: Motion, rig: RigMechanics, contour: ContourMap, start: Foot, run: _Run
) -> None:
    """Bring the tip over the path's start, higher than anything on it."""
    top = max(foot.point[1] for foot in contour.feet) + LIFT_M + HIGHER_M
    opening = rig.opening_at(top)
    most = motion.identity.opening_max - math.radians(0.5)
    opening = most if opening is None else min(opening, most)
    advance = rig.advance_at(start.point[0], rig.opening_at(start.point[1]) or 0.0)
    still = Reference(
        np.array([opening]), np.zeros(1), np.array([advance]), np.full(1, -1, dtype=np.int32)
    )
    for samples in motion.track(still):
        run.take(samples, "moving the tip over the path's start")


def _start_again(motion: Motion, rig: RigMechanics, run: _Run) -> Foot:
    """Where the path starts by the pose that the source has now, and the tip moved over it.

    The plate may have gone on since its first pose. Raises DeviceError where the pose is lost or
    too uncertain, InputError where the path cannot be reached any more; the tip is not lowered.
    """
    job = run.job
    pose = _pose_now(job.source, motion.now_s, "the tip was not lowered")
    contour = map_contour(job.points, job.surface, pose, job.length_m)
    start = start_foot(job.points, contour, job.surface, pose)
    sd = _gap_sd(pose, start)
    if sd > MOST_GAP_SD_M:
        raise DeviceError(
            f"The plate's pose leaves the surface's place uncertain by {1e3 * sd:.2f} mm, and "
            f"{1e3 * MOST_GAP_SD_M:g} mm are allowed, so the tip was not lowered: check that the "
            "camera sees the plate's target while the blades are over the plate."
        )
    _move_over(motion, rig, contour, start, run)
    return start


def _lower(motion: Motion, rig: RigMechanics, start: Foot, run: _Run) -> None:
    """Lower the tip to just above the path's start."""
    opening, advance = motion.position
    above = rig.opening_at(start.point[1] + LIFT_M)
    if above is None:
        raise InputError(
            f"The path's start is {1e3 * start.point[1]:.1f} mm above the pivot, where the blade's "
            "tip does not reach: put the plate nearer to the blades."
        )
    builder = PathBuilder(opening, advance, motion.tick_s)
    builder.open_to(above, APPROACH_SPEED, TURN_ACCELERATION)
    builder.rest(0.1)
    for samples in motion.track(builder.reference()):
        run.take(samples, "lowering the tip")


def _refuse_held(samples: Samples, rig: RigMechanics) -> None:
    if not len(samples):
        return
    force = float(np.mean(samples["handle_force"])) - rig.handle_zero_N
    if not abs(force) <= HANDLE_N:
        raise DeviceError(
            f"A force of {force:.1f} N acts on the handles: nobody may hold them while the rig "
            "presses, since the force at the tip is known from the motor's torque alone. Let go, "
            "and start again; a sensor that has no zero is shown by 'scissorcal device probe'."
        )
