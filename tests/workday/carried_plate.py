"""A plate that is tapped, carried between the blades and moved while they cut, and is tracked."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device import RigSession, Samples, Specimen, load_specimen
from scissorcal.kernel import ConfigKey, SampleFlag
from scissorcal.model import AxisLaw, Plane
from scissorcal.package import ModelPackage
from scissorcal.recipe import Recipe, parse_recipe
from scissorcal.recording import read_recording
from scissorcal.render import (
    Rendering,
    RenderResult,
    VirtualStrokes,
    open_writer,
    render,
    rendered_tables,
)
from scissorcal.tracking import PlatePose, TipContacts, pose_error
from scissorcal.vision import SIM_LENS, Frame, PicturePose, Pose
from scissorcal.workday.tracking.feeds import idle_rig
from scissorcal.workday.tracking.inputs import REST_RATE_RAD_PER_S
from scissorcal.workday.tracking.session import RigDrive, TrackFacts, TrackSession
from scissorcal.workday.tracking.sim_world import CAMERA_DRIFT, CAMERA_OFFSET_S, SimCamera, SimWorld
from scissorcal.workday.tracking.track_recorder import PoseFinder, TrackAbout, TrackPicture
from scissorcal.workday.tracking.tracking_camera import Due, TrackedPose
from tests.control.virtual import mechanics
from tests.render.plate_motion import Move, true_torque
from tests.workday.track_world import TEXT, an_eye

TAPPED_MM = (20.0, 12.0, 12.0)
"""Where the tip reaches the plate: above it the blades can close no farther than 12 degrees."""
TAPS_S, CARRY_S, WAIT_S = 6.0, 1.5, 1.0
TAPS_RAD_PER_S = 0.4
BEGINS_S, TAKES_S = 7.2, 1.0
"""Within the third closing stroke of the rendering, while the crack runs."""
STROKES = VirtualStrokes(count=4, rate_rad_per_s=0.5)
SECONDS = 20.0
RAMPED_S = 4.0
"""The first stroke is ramped in."""


@dataclass(frozen=True)
class Case:
    """One way of tracking: how the plate is taken to move, the camera, contacts, the scene."""

    name: str
    speed_mm_per_s: float = 20.0
    turn_deg_per_s: float = 5.0
    frames_Hz: float = 30.0
    jitter_s: float = 0.04
    noise: float = 1.0
    taps: bool = True
    tolerance_percent: float = 7.0
    rendered: bool = False
    steady: bool = True
    contact_bias_mm: float = 0.0
    contact_bias_deg: float = 0.0
    """Of the rig's places, as stated; those of this virtual rig have none."""

    @property
    def recipe(self) -> Recipe:
        """Paper on an estimated plate, cut by one moving blade, without friction."""
        lines = (
            "[plate.tracking]",
            f"speed_mm_per_s = {self.speed_mm_per_s}",
            f"turn_deg_per_s = {self.turn_deg_per_s}",
            f"contact_bias_mm = {self.contact_bias_mm}",
            f"contact_bias_deg = {self.contact_bias_deg}",
        )
        recipe = parse_recipe("\n".join([TEXT, *lines]))
        scene = recipe.scene.model_copy(
            update={
                "simplify": False,
                "plate_pose": "estimated",
                "render_friction": False,
                "tolerance_percent": self.tolerance_percent,
            }
        )
        rig = recipe.rig.model_copy(update={"moving": "upper"})
        return recipe.model_copy(update={"scene": scene, "rig": rig})


class CarriedPlate:
    """Where the plate is at a time of the host's clock: tapped, carried, and moved in the cut."""

    def __init__(self, upper_face_m: float) -> None:
        start = (0.0, upper_face_m, 0.012)
        away = tuple((a - 1e3 * b) * 1e-3 for a, b in zip(TAPPED_MM, start, strict=True))
        self._start, self._away = start, np.array(away)
        self.tapped_until_s = self.moves_at_s = math.inf

    @property
    def carried(self) -> Move:
        """From where it is tapped to between the blades."""
        place = tuple((np.array(self._start) + self._away).tolist())
        by = tuple((-self._away).tolist())
        return Move(place, by_m=by, begins_s=self.tapped_until_s, takes_s=CARRY_S)  # type: ignore[arg-type]

    @property
    def moved(self) -> Move:
        """By 10 mm along the cut and 5 degrees of pitch, about a point between the blades."""
        return Move(
            self._start,
            by_m=(-0.01, 0.0, 0.0),
            turn_rad=(0.0, 0.0, math.radians(5.0)),
            about_m=(0.06, 0.0, 0.0),
            begins_s=self.moves_at_s,
            takes_s=TAKES_S,
        )

    def pose(self, time_s: float) -> tuple[Array, Array]:
        """Rotation (3, 3) and translation (3,)."""
        if time_s < self.tapped_until_s + CARRY_S:
            return self.carried.pose(time_s)
        return self.moved.pose(time_s)


class CarriedWorld(SimWorld):
    """A simulated world whose plate is carried; the rig's own plate stands where it is tapped."""

    def __init__(self, case: Case, seed: int, upper_face_m: float) -> None:
        recipe = case.recipe
        base = load_specimen(str(recipe.specimen)).model_dump()
        base["blade"]["moving"] = "upper"
        base["plate"] = {"place_mm": TAPPED_MM, "extent_mm": (-50.0, 150.0)}
        self.specimen = Specimen.model_validate(base)
        camera = SimCamera(case.frames_Hz, case.jitter_s)
        super().__init__(recipe, seed, rig=True, specimen=self.specimen, camera=camera)
        self.plate = CarriedPlate(upper_face_m)

    def truth(self, host_s: float) -> tuple[Array, Array]:
        return self.plate.pose(host_s)


@dataclass
class StatedPictures:
    """Pictures that are not rendered: their poses err as one rendered picture says."""

    world: CarriedWorld
    eye: PoseFinder
    seed: int
    scale: float

    def __post_init__(self) -> None:
        first = Frame(0, 0.0, self.world.image(0.0), None, 0.0, 0.0)
        seen = self.eye.picture(next(iter(self.eye.locate([first])))).seen
        assert seen is not None
        self.noise, self.shared = self.scale**2 * seen.noise, seen.shared
        self._rng = np.random.default_rng([self.seed, 99])
        self._off = np.linalg.cholesky(self.shared) @ self._rng.standard_normal(6)
        self._root = np.linalg.cholesky(self.noise)
        self.world.image = lambda exposed: np.ones((1, 1, 3), dtype=np.uint8)  # type: ignore[method-assign]

    def __call__(self, now_s: float) -> Iterator[TrackPicture]:
        for frame in self.world.frames(now_s):
            times = (frame.number, frame.stamp_s, frame.arrived_s)
            if not frame.image.any():
                yield TrackPicture(*times, "blank", 0)
                continue
            exposed = (frame.stamp_s - CAMERA_OFFSET_S) / (1.0 + CAMERA_DRIFT)
            rotation, place = self.world.truth(exposed)
            error = self._off + self._root @ self._rng.standard_normal(6)
            turn = Pose.from_rotation_vector(error[:3], np.zeros(3)).matrix
            pose = Pose.from_matrix(turn @ rotation, place + error[3:], self.noise + self.shared)
            yield TrackPicture(
                *times, "seen", 60, seen=PicturePose(pose, None, self.noise, self.shared)
            )


@dataclass
class Watched:
    """A source that keeps what it answered, with the true pose's error."""

    source: TrackedPose
    world: CarriedWorld
    rows: list[tuple[float, Array, Array]] = field(default_factory=list)

    def __call__(self, now_s: float, samples: Samples) -> PlatePose | None:
        pose = self.source(now_s, samples)
        if pose is not None:
            error = pose_error(pose.rotation, pose.translation, *self.world.truth(now_s))
            self.rows.append((now_s, error, pose.covariance))
        return pose


@dataclass(frozen=True)
class Run:
    """A rendering, the torque that it should have had, and how the pose was known."""

    result: RenderResult
    samples: Samples
    true: Array
    moves_at_s: float
    poses: list[tuple[float, Array, Array]]
    session: TrackSession

    @property
    def windows(self) -> dict[str, tuple[float, float]]:
        """Before, during and after the move; the first stroke is ramped in."""
        begins, ends = self.moves_at_s, self.moves_at_s + TAKES_S
        first = 1e-9 * float(self.samples["host_time_ns"][0]) + RAMPED_S
        return {"before": (first, begins), "during": (begins, ends), "after": (ends, math.inf)}

    def error(self, window: str) -> tuple[float, float]:
        """Relative rms error of the command while the blades close on material that they cut and
        the force is in; and the share of such samples in which it was out."""
        time = 1e-9 * self.samples["host_time_ns"].astype(np.float64)
        rate = np.gradient(self.samples["opening"], time)
        low, high = self.windows[window]
        chosen = np.isfinite(self.true) & (self.true > 0.01) & (rate < -0.05)
        chosen &= (time >= low) & (time < high)
        out = (self.samples["flags"] & int(SampleFlag.PLATE_OUT)) != 0
        share = float(np.mean(out[chosen])) if chosen.any() else math.nan
        felt = chosen & ~out
        if np.count_nonzero(felt) < 20:
            return math.nan, share
        off = self.samples["torque_command"][felt] - self.true[felt]
        return float(np.linalg.norm(off) / np.linalg.norm(self.true[felt])), share

    def pose_error(self, window: str) -> tuple[Array, Array]:
        """Rms error (6,) of the pose and its mean standard deviation."""
        low, high = self.windows[window]
        rows = [row for row in self.poses if low <= row[0] < high]
        errors = np.array([row[1] for row in rows])
        sds = np.sqrt(np.array([np.diag(row[2]) for row in rows]))
        return np.sqrt(np.mean(errors**2, axis=0)), sds.mean(axis=0)


def run(case: Case, seed: int, package: ModelPackage, folder: Path) -> Run:
    """Tap, carry, render and move; ``folder`` takes the recording."""
    recipe = case.recipe
    world = CarriedWorld(case, seed, package.tables.upper_face)
    eye = an_eye(recipe, seed)
    session = _session(case, recipe, world)
    pictures = (
        _located(world, eye) if case.rendered else StatedPictures(world, eye, seed, case.noise)
    )
    source = Watched(TrackedPose(session, pictures, steady=case.steady), world)
    with idle_rig(RigSession(world.link, recipe)) as motion:
        world.begin(motion)
        motion.configure(ConfigKey.HAND_SPEED_rad_per_s, TAPS_RAD_PER_S)
        if not case.taps:
            motion.configure(ConfigKey.MATERIAL, 0.0)
        begun = motion.now_s
        world.plate.tapped_until_s = begun + TAPS_S
        while motion.now_s < begun + TAPS_S + CARRY_S + WAIT_S:
            source(motion.now_s, motion.step())
            if motion.now_s > world.plate.tapped_until_s:
                motion.configure(ConfigKey.MATERIAL, 0.0)
    session.follower.restart_rig()
    session.follower.touching = False  # nothing real is between the blades
    world.plate.moves_at_s = world.link.virtual_time + BEGINS_S
    path = folder / f"{seed}.mcap"
    with open_writer(
        RigSession(world.link, package.recipe, recipe_toml="# a recipe"), package, path
    ) as writer:
        result = render(
            RigSession(world.link, package.recipe),
            package,
            Rendering(SECONDS, strokes=STROKES),
            writer=writer,
            plate=source,
        )
    samples = read_recording(path).samples
    tables = rendered_tables(package.tables, result.admission)
    true = true_torque(tables, world.plate, samples, 8)  # type: ignore[arg-type]
    return Run(result, samples, true, world.plate.moves_at_s, source.rows, session)


def _session(case: Case, recipe: Recipe, world: CarriedWorld) -> TrackSession:
    rig = mechanics(world.specimen)
    axis = AxisLaw(
        rig.opening.inertia, rig.opening.friction, rig.opening.offset, REST_RATE_RAD_PER_S
    )
    delay = recipe.plate.tracking.camera_delay_ms
    about = TrackAbout("sim", "rig", "a" * 16, SIM_LENS.width, SIM_LENS.height, delay)
    contacts = TipContacts(rig.tip, axis)
    return TrackSession(recipe, TrackFacts(Plane(), about, RigDrive(0.06), contacts))


def _located(world: CarriedWorld, eye: PoseFinder) -> Due:
    def due(now_s: float) -> Iterator[TrackPicture]:
        return (eye.picture(located) for located in eye.locate(world.frames(now_s)))

    return due
