"""The virtual rig with a plate, its truth beside it, and a path to follow."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from scissorcal.control import follow
from scissorcal.control.control_result import ControlResult
from scissorcal.control.follow import Job, control
from scissorcal.control.mechanics import RigMechanics
from scissorcal.control.path_file import SurfacePoints
from scissorcal.control.settings import Material
from scissorcal.device import (
    LockstepLink,
    Operator,
    RigSession,
    Specimen,
    VirtualRig,
    load_specimen,
    true_parameters,
)
from scissorcal.kernel import ControlFlag, HybridFlag
from scissorcal.model import AxisLaw, BladePoint, FrictionLaw, Plane, Surface
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import Estimate, ProbeResult
from scissorcal.tracking import PlatePose, PoseSource, fixed_pose, level_plate

PLATE: dict[str, Any] = {"place_mm": (20.0, 10.0, 0.0), "extent_mm": (-20.0, 150.0)}
FLAT = Plane()
LAW = ("coulomb", "viscous", "stribeck", "angle")
DELAY_S = 1.2e-3
"""Of the virtual rig: a tick until a command acts, and its motor's lag, less the half tick by which
a held effort counts as late anyway."""


def specimen(**plate: Any) -> Specimen:
    """Office paper's rig with a plate."""
    base = load_specimen("office-paper").model_dump()
    return Specimen.model_validate({**base, "plate": {**PLATE, **plate}})


def mechanics(truth: Specimen) -> RigMechanics:
    """The rig as a perfect fit would have it."""
    values = true_parameters(truth)
    law = {name: value for name, value in values.items() if name.startswith(LAW)}
    blade, advance = truth.blade, truth.mechanism.advance
    length = 1e-3 * blade.length_mm
    offset = 1e-3 * blade.offset_mm + length * math.tan(math.radians(blade.taper_deg))
    centre = math.radians(truth.mechanism.friction.angle_center_deg)
    carriage = FrictionLaw({"coulomb": advance.coulomb_N, "viscous": advance.viscous_N_s_per_m})
    return RigMechanics(
        tip=BladePoint(length, offset, blade.moving_blades),
        opening=AxisLaw(values["inertia"], FrictionLaw(law, centre), values["offset"]),
        advance=AxisLaw(advance.mass_kg, carriage),
        friction_sd=4e-4,
        delay_s=DELAY_S,
        torque_sd=1e-3,
    )


def probed(truth: Specimen) -> ProbeResult:
    """What a probe of this rig finds, as far as gains take it."""
    return ProbeResult(
        device="virtual",
        identity="",
        made_at="2026-01-01T00:00:00+00:00",
        delay_s=Estimate(DELAY_S, 1e-4),
        inertia_kg_m2=Estimate(truth.mechanism.inertia_kg_m2, 5e-6),
        coulomb_Nm=Estimate(0.015, 1e-3),
        viscous_Nm_s_per_rad=Estimate(0.002, 1e-3),
    )


def points(*x_mm: float, force: float = 2.0, speed: float = 10.0) -> SurfacePoints:
    """A path along x (mm) with one force (N) and one speed (mm/s)."""
    n = len(x_mm)
    return SurfacePoints(
        x=1e-3 * np.array(x_mm),
        y=np.full(n, np.nan),
        force=np.full(n, force),
        speed=np.full(n, 1e-3 * speed),
        lines=np.arange(n) + 2,
        source="path.csv",
    )


@dataclass
class Truth:
    """What the virtual rig did, tick by tick from the start."""

    normal_N: list[float] = field(default_factory=list)
    opening: list[float] = field(default_factory=list)
    tip: list[tuple[float, float]] = field(default_factory=list)
    torque: list[float] = field(default_factory=list)


@dataclass
class Run:
    """A run of control on the virtual rig: link, truth and, once it is done, result and samples."""

    link: LockstepLink
    truth: Truth
    job: Job
    rig: RigMechanics
    result: ControlResult | None = None
    samples: Any = None

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Error of the true force and of the estimated one, N, while the path goes on."""
        rows = self.samples
        flags = rows["flags"].astype(int)
        on = (flags & int(HybridFlag.CONTACT) != 0) & (flags & int(ControlFlag.LETS_GO) == 0)
        on &= rows["force_aim"] >= 0.99 * rows["force_wanted"]
        on &= rows["index"] > 0.0
        true = np.array(self.truth.normal_N)[rows["sequence"][on].astype(int) - 1]
        return true - rows["force_wanted"][on], rows["force"][on] - true


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def posed(truth: Specimen, *, lower_mm: float = 0.0, turned_deg: float = 0.0) -> PoseSource:
    """The plate's pose, wrong by so much."""
    assert truth.plate is not None
    x, y, z = truth.plate.place_mm
    pose = level_plate((x, y - lower_mm, z), truth.plate.pitch_deg + turned_deg)
    return fixed_pose(*pose)


def seen(run: LockstepLink, *, every_s: float = 0.03, late_s: float = 0.02) -> PoseSource:
    """A tracker that sees the true plate now and then, and how it moves, a little late."""
    kept: list[PlatePose] = []

    def pose() -> PlatePose:
        contact = run.rig.plate
        if contact is None:
            plate = run.rig.specimen.plate
            assert plate is not None
            at = level_plate(plate.place_mm, plate.pitch_deg)
            return PlatePose(run.virtual_time, *at, np.zeros((6, 6)))
        axes = np.array(contact._axes_now()).T
        return PlatePose(run.virtual_time, axes, np.array(contact.place), np.zeros((6, 6)))

    def source(now_s: float, samples: Any) -> PlatePose | None:
        if not kept or now_s - kept[-1].time >= every_s:
            new = pose()
            if kept:
                passed = new.time - kept[-1].time
                passed = max(passed, 1e-6)
                new = replace(new, velocity=(new.translation - kept[-1].translation) / passed)
            kept.append(new)
        ready = [one for one in kept if one.time <= now_s - late_s] or kept[:1]
        return ready[-1]

    return source


def prepare(
    path: SurfacePoints,
    model: Surface = FLAT,
    source: PoseSource | None = None,
    *,
    seed: int = 1,
    peak_N: float = 1.0,
    each: Callable[[VirtualRig], None] | None = None,
    link: LockstepLink | None = None,
    **plate: Any,
) -> Run:
    """A virtual rig with a plate, and a job on it; ``each`` is called at each of its ticks."""
    link = link or LockstepLink(specimen(**plate), np.random.default_rng(seed))
    truth = link.rig.specimen
    assert truth.plate is not None
    kept = Truth()
    tick = link.rig.tick

    def watched(*args: Any) -> Any:
        measured = tick(*args)
        contact = link.rig.plate
        if each is not None:
            each(link.rig)
        kept.normal_N.append(0.0 if contact is None else contact.normal_N)
        kept.opening.append(link.rig.opening)
        kept.torque.append(measured.motor_torque)
        return measured

    link.rig.tick = watched  # type: ignore[method-assign]
    material = Material(1e3 * truth.plate.stiffness_N_per_mm, truth.plate.friction, peak_N)
    job = Job(path, model, source or posed(truth), material, 0.15)
    return Run(link, kept, job, mechanics(truth))


def go(run: Run, monkeypatch: Any, **how: Any) -> Run:
    """Follow the path, and keep the telemetry."""
    figures = follow.control_figures

    def kept(samples: Any, *rest: Any) -> Any:
        run.samples = samples
        return figures(samples, *rest)

    monkeypatch.setattr(follow, "control_figures", kept)
    recipe = builtin_recipe("paper-80gsm")
    probe = probed(run.link.rig.specimen)
    operator = Operator(confirm=how.pop("confirm", None))
    session = RigSession(run.link, recipe, operator, probe)
    run.result = control(session, run.rig, run.job, **how)
    return run
