"""Control by force and by place, with the pose from vision, from the fused filter, and as it is."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from benchmarks.control.arm import (
    AXES,
    COULOMB_N,
    MASS_KG,
    MOTOR_LAG_S,
    STEP_M,
    TICK_S,
    VISCOUS_N_S_PER_M,
    Arm,
)
from benchmarks.control.plates import Plate
from benchmarks.control.pose_run import camera_pose, settings_for
from benchmarks.control.world import (
    COMPLIANCE,
    COMPLIANCE_SPREAD,
    CONTACT_HZ,
    FORCE_N,
    FORCE_NOISE_N,
    FORCE_ZERO_N,
    SLOW_M,
    SLOW_S,
    WHITE_M,
    Scenario,
    pictures_of,
    plate_motion,
    slow_process,
)
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array
from scissorcal.control.contact_loop import ContactLoop
from scissorcal.control.gains import FORCE_KP, HybridGains, choose_gains, friction_rates
from scissorcal.kernel.hybrid import Hybrid, HybridConfig, NormalLaw, hybrid_inputs
from scissorcal.tracking.plate_pose import cross
from scissorcal.tracking.tracker import PoseEstimate, PoseTracker

POSES = ("vision", "contact", "true")
"""Where control takes the pose from; with contact the filter has pictures as well."""
SECONDS = 12.0
SETTLED_S = 6.0
"""Errors count from then on: the tip has touched, and has been all along its path once."""
LEARN_S = 1.0
"""Time of pictures before the tip moves."""
START_ABOVE_M = 3e-3
RATE_CUTOFF_HZ = 400.0
SURFACE_CUTOFF_HZ = 100.0
"""Five times as fast as the lightest normal swings on the material (19 Hz)."""
APPROACH_PER_S = 2.0
"""The gap is known to 1 mm by vision; from 2.6 mm on the approach has its own speed."""
TOUCH_TICKS = 100
SOFTNESS = 0.04
"""Stiffness of soft position control, as a share of the stiff one's."""
FORCE_MOST_N = 6.0
EFFORT_N = 40.0
PEAK_N = 1.0
FRICTION, ASSUMED_FRICTION = (0.1, 0.2), 0.15
APPROACH_M_PER_S = 8e-3
"""Speed at which the wanted gap of control by place falls to its aim."""


@dataclass(frozen=True)
class ControlRun:
    """One run, after it has settled: errors as rms, along the path in metres, of the force in N.

    ``touch_N`` is the largest force beyond the wanted one within 0.1 s of the first touch,
    ``touch_bound_N`` the approach's speed times sqrt(k m) on top of the force at which touching
    begins.
    """

    force_rms_N: float
    path_rms_m: float
    touch_N: float
    touch_bound_N: float
    contact_share: float

    @property
    def touch_ratio(self) -> float:
        """Peak of the touch over its bound."""
        return self.touch_N / self.touch_bound_N


@dataclass(frozen=True)
class _TruePose:
    """What control takes of a filter's estimate, as it is."""

    rotation: Array
    place_m: Array
    rates: Array
    compliance_m_per_N: float
    contact_offset_m: float


def control_run(scenario: Scenario, plate: Plate, law: str, source: str, seed: int) -> ControlRun:
    """Follow the plate's path at 2.5 N for 12 s and judge it by the truth.

    Control at 1 kHz in C, pose and contact rows at 100 Hz, pictures at 33 Hz and late. The same
    seed draws the same plate, camera and sensors for every law and source.
    """
    run = _Run(replace(scenario, seconds=SECONDS), plate, law, source, seed)
    for tick in range(round(SECONDS / TICK_S)):
        run.tick(tick)
    return run.judge()


class _Run:
    """A control run from tick to tick."""

    def __init__(self, scenario: Scenario, plate: Plate, law: str, source: str, seed: int) -> None:
        motion_rng, picture_rng, rng = np.random.default_rng([seed, 3]).spawn(3)
        motion = plate_motion(scenario, motion_rng)
        self.pictures = pictures_of(scenario, motion, picture_rng)
        assert plate.probe is not None
        self.plate, self.source, self.probe = plate, source, plate.probe
        self.tracker = PoseTracker(plate.surface, settings_for(scenario))
        count = round(scenario.seconds / TICK_S)
        self.times: Array = TICK_S * np.arange(count + 1, dtype=np.float64)
        self.rotation, self.place = motion(self.times)
        self.compliance = COMPLIANCE * (1.0 + COMPLIANCE_SPREAD * rng.standard_normal())
        phase, rate = rng.uniform(0.0, 2.0 * np.pi), 2.0 * np.pi * rng.uniform(0.25, 0.35)
        path = plate.path(np.maximum(self.times - LEARN_S, 0.0), phase, rate)
        self.wanted, self.outward = plate.shape(*path)
        start = self.wanted[0] + START_ABOVE_M * self.outward[0]
        tip = self.place[0] + self.rotation[0] @ start
        self.arm = Arm(tip, self.compliance, rng.uniform(*FRICTION))
        self.slow = slow_process(count + 1, TICK_S, SLOW_S, rng) * SLOW_M
        self.white = WHITE_M * rng.standard_normal((count + 1, 3))
        zero = FORCE_ZERO_N * rng.standard_normal()
        self.noise = zero + FORCE_NOISE_N * rng.standard_normal(count + 1)
        self.gains = make_gains()
        self.hybrid = Hybrid(config_of(self.gains, law))
        self.mass = contact_loops()[0].mass_kg
        self.inputs = hybrid_inputs(
            dt=TICK_S,
            inertia=np.diag(MASS_KG),
            dry_friction=COULOMB_N,
            jacobian=AXES,
            force_wanted=FORCE_N,
            surface_friction=ASSUMED_FRICTION,
            compliance=COMPLIANCE,
        )
        self.before = self.arm.measured
        self.measured_rate = np.zeros(3)
        self.pose: _TruePose | PoseEstimate | None = None
        self.forces, self.errors, self.aims = np.zeros(count), np.zeros(count), np.zeros(count + 1)

    def tick(self, tick: int) -> None:
        time, arm = float(self.times[tick]), self.arm
        rotation, place = self.rotation[tick], self.place[tick]
        next_rotation, next_place = self.rotation[tick + 1], self.place[tick + 1]
        local = rotation.T @ (arm.tip - place)
        carried = (next_place + next_rotation @ local - arm.tip) / TICK_S
        distance, normal = self.probe(local)
        normal = rotation @ normal
        measured, force = self._measure(tick, normal)
        if tick % round(1.0 / CONTACT_HZ / TICK_S) == 0:
            self._look(time, tick, measured + self.white[tick], force)
        effort = self._effort(tick, measured, force)
        arm.tick(effort, -distance, normal, carried)
        self.forces[tick] = arm.reaction_N
        apart = arm.tip - next_place - next_rotation @ self.wanted[tick + 1]
        aside = next_rotation @ self.outward[tick + 1]
        apart = apart - aside * (aside @ apart)
        if self.plate.axis is not None:
            along = next_rotation @ self.plate.axis
            apart = apart - along * (along @ apart)
        self.errors[tick] = float(np.linalg.norm(apart))

    def judge(self) -> ControlRun:
        ticks = round(SETTLED_S / TICK_S)
        late = self.forces[ticks:]
        touched = np.flatnonzero(self.forces > 0.0)
        first = int(touched[0]) if len(touched) else 0
        bound = self.gains.approach_speed * math.sqrt(self.mass / self.compliance)
        return ControlRun(
            force_rms_N=float(np.sqrt(np.mean((late - FORCE_N) ** 2))),
            path_rms_m=float(np.sqrt(np.mean(self.errors[ticks:] ** 2))),
            touch_N=float((self.forces - self.aims[:-1])[first : first + TOUCH_TICKS].max()),
            touch_bound_N=bound + self.hybrid.config.touch_force,
            contact_share=float(np.mean(late > 0.0)),
        )

    def _measure(self, tick: int, normal: Array) -> tuple[Array, float]:
        """The tip by encoders, off by the slow error, and the measured force."""
        joints = self.arm.measured
        rate = (joints - self.before) / TICK_S
        self.before = joints
        passed = 2.0 * math.pi * RATE_CUTOFF_HZ * TICK_S
        self.measured_rate = self.measured_rate + passed / (1.0 + passed) * (
            rate - self.measured_rate
        )
        point = AXES @ joints + normal * self.slow[tick]
        return point, self.arm.reaction_N + float(self.noise[tick])

    def _look(self, time: float, tick: int, point: Array, force: float) -> None:
        """The outer loop: pictures that have arrived, a contact row, and the pose for control."""
        while self.pictures and self.pictures[0].arrives_s <= time:
            self.tracker.picture(camera_pose(self.pictures.pop(0)))
        if self.source == "contact" and self.hybrid.touching:
            self.tracker.contact(time, point, force)
        if self.source == "true":
            self.pose = self._true_pose(tick)
        elif self.tracker.started:
            self.pose = self.tracker.estimate(time)

    def _true_pose(self, tick: int) -> _TruePose:
        """With mean rates over the 10 ms until the next one."""
        ahead = min(tick + 10, len(self.times) - 1)
        rotation, place = self.rotation[tick], self.place[tick]
        turn = Rotation.from_matrix(self.rotation[ahead] @ rotation.T).as_rotvec()
        rates = np.concatenate([turn, self.place[ahead] - place]) / 10e-3
        return _TruePose(rotation, place, rates, self.compliance, self.slow[tick])

    def _effort(self, tick: int, point: Array, force: float) -> Array:
        pose = self.pose
        if pose is None or self.times[tick] < LEARN_S:
            return np.zeros(3)
        away = point - pose.place_m
        here = self.plate.surface.at(pose.rotation.T @ away)
        steep = float(np.linalg.norm(here.gradient))
        normal = pose.rotation @ here.gradient / steep
        spin, speed = pose.rates[:3], pose.rates[3:]
        carried = speed + cross(spin, away)
        rate = AXES @ self.measured_rate
        slide = pose.rotation.T @ (rate - carried)
        ticks = (max(tick - 1, 0), tick, tick + 1)
        before, path, after = (pose.place_m + pose.rotation @ self.wanted[at] for at in ticks)
        path_rate = (after - before) / (2.0 * TICK_S) + carried
        bend = (after - 2.0 * path + before) / TICK_S**2
        row = self.inputs[0]
        row["rate"] = self.measured_rate
        row["bias"] = VISCOUS_N_S_PER_M * self.measured_rate
        row["point"], row["normal"], row["gap"] = point, normal, here.level / steep
        row["surface_velocity"] = carried
        row["surface_acceleration"] = -float(slide @ here.hessian @ slide) / steep
        row["force"] = force
        # Control by place gives way to the contact's force; its aim lies so much deeper.
        softness = 1.0 / (self.mass * self.hybrid.config.normal_kp)
        aim = pose.contact_offset_m - (pose.compliance_m_per_N + softness) * FORCE_N
        fallen = START_ABOVE_M - APPROACH_M_PER_S * (float(self.times[tick]) - LEARN_S)
        row["gap_wanted"] = max(aim, fallen)
        row["gap_rate_wanted"] = -APPROACH_M_PER_S if fallen > aim else 0.0
        row["path"], row["path_rate"], row["path_acceleration"] = path, path_rate, bend
        command = self.hybrid.step(self.inputs)[0]
        self.mass = float(command["mass"]) or self.mass
        self.aims[tick + 1] = command["force_aim"]
        return np.asarray(command["effort"], dtype=np.float64)


def contact_loops() -> list[ContactLoop]:
    """What the law meets along a normal of any direction: the lightest and the heaviest mass."""
    mobilities = np.linalg.eigvalsh(AXES @ np.diag(1.0 / MASS_KG) @ AXES.T)
    return [
        ContactLoop(
            stiffness_N_per_m=1.0 / COMPLIANCE,
            mass_kg=1.0 / float(mobility),
            viscous_N_s_per_m=0.0,
            delay_s=TICK_S,
            motor_lag_s=MOTOR_LAG_S,
            tick_s=TICK_S,
            rate_cutoff_Hz=RATE_CUTOFF_HZ,
            surface_cutoff_Hz=SURFACE_CUTOFF_HZ,
            step_m=STEP_M,
            stiffness_factor=1.5,
        )
        for mobility in (mobilities[0], mobilities[-1])
    ]


@cache
def make_gains() -> HybridGains:
    """Gains for the benchmark's arm and material."""
    return choose_gains(contact_loops(), peak_N=PEAK_N, force_kp=FORCE_KP)


def config_of(gains: HybridGains, law: str) -> HybridConfig:
    """The law of a name; soft position control has a 25th of the stiff one's stiffness."""
    chosen = gains.settings()
    if law == "soft position":
        chosen["normal_kp"] *= SOFTNESS
        chosen["normal_kd"] *= math.sqrt(SOFTNESS)
    return HybridConfig(
        axes=3,
        normal_law=NormalLaw.FORCE if law == "hybrid" else NormalLaw.POSITION,
        surface_cutoff_Hz=SURFACE_CUTOFF_HZ,
        approach_rate=APPROACH_PER_S,
        force_most=FORCE_MOST_N,
        friction_rate=friction_rates(gains, MASS_KG.tolist(), COULOMB_N.tolist()),
        effort_limit=(EFFORT_N, EFFORT_N, EFFORT_N),
        **chosen,
    )
