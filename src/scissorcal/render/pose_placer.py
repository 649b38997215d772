"""Follow a plate whose pose is estimated while a package renders: judge, place, record, report."""

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.motion import Samples
from scissorcal.errors import MissingError
from scissorcal.kernel import ModelTables, PlateConfig, Section
from scissorcal.package import ModelPackage
from scissorcal.package.manifest import PoseRecord
from scissorcal.recording import RecordingWriter
from scissorcal.render.pose_section import (
    ACROSS,
    NONE_YET,
    PoseSection,
    PoseTorque,
    TorqueSpread,
    beside_sentence,
    late_sentence,
    leapt_sentence,
    lost_sentence,
    pose_section,
    uncertain_sentence,
)
from scissorcal.tracking.plate_pose import PlatePose, PoseSource, fixed_pose

EVERY_S = 0.01
"""Between two looks at the source: its rate is about 100 Hz."""
MOVE_S = 0.015
"""One and a half intervals of estimates, so that one that comes half an interval late finds the
section still on its way (docs/decisions/141-an-estimated-plate-is-a-section.md)."""
STALE_S = 0.1
FALL_S = 0.1
"""As long as the servo takes at most to let go of the blades when a watch ends it."""
BACK_SHARE = 0.8
"""Of the tolerance, below which a force that fell for its uncertainty returns."""
MOST_SPEED_m_per_s = 1.0
"""No hand moves a plate faster between the blades: a pose that does has leapt."""
LEAP_SDS = 6.0
MOST_PITCH_RAD = math.radians(10.0)
MOST_HEIGHT_M = 0.01
"""Between two moving blades; docs/decisions/142-a-plate-between-two-blades.md."""
FACES = 9
FACE_REACH_M = 0.02
"""Heights about the model's at which it is checked that the release falls along the blade."""

ROW_NAMES = (
    "time_s",
    "edge_x_m",
    "edge_y_m",
    "pitch_rad",
    "stretch",
    "thickening",
    "height_m",
    "usable",
)
"""Columns of what is kept of each estimate; ``time_s`` is of the source's clock, ``pitch_rad`` and
``height_m`` are the plate's, also where they are not rendered."""
ROWS_A_TABLE = 6000
"""A minute at 100 Hz: a killed rendering loses no more, and memory does not grow."""


def pose_placer(
    package: ModelPackage,
    source: PoseSource | None,
    tables: ModelTables,
    torque_limit_Nm: float,
    writer: RecordingWriter | None = None,
) -> "PosePlacer | None":
    """What follows the plate of a package; None where its scene has a known pose.

    Without a ``source`` the pose is the one that was fitted to photographs, which the package
    carries, as long as the rendering lasts. ``writer`` gets what is placed. Raises MissingError
    where there is none in the rig's frame.
    """
    manifest = package.manifest
    if manifest.plate_pose == "known":
        return None
    if source is None:
        if manifest.plate is None or manifest.plate.frame != "rig":
            raise MissingError(
                f'The scene of {manifest.name} has plate_pose = "estimated", and its package has '
                "no pose of the plate in the rig's frame. Photograph the plate's target and the "
                "rig card ('scissorcal capture plate --image ... --positions ...'), run "
                "'scissorcal fit plate' and 'scissorcal package build', or give the "
                "pose of a tracker."
            )
        source = _fitted_pose(manifest.plate)
    scene = package.recipe.scene
    return PosePlacer(
        source,
        tables,
        tolerance=scene.tolerance_percent / 100.0,
        confidence=scene.confidence_percent / 100.0,
        torque_limit_Nm=torque_limit_Nm,
        record=PoseLog(writer) if writer else None,
    )


class Placing(Protocol):
    """What a plate is placed on: a Motion."""

    @property
    def now_s(self) -> float: ...

    def place(self, section: Section, usable: bool, age_s: float) -> None: ...


@dataclass(frozen=True)
class PoseReport:
    """How an estimated plate was rendered.

    ``estimates`` came, of which ``lost`` (the source had lost the plate), ``late``, ``uncertain``
    (too uncertain for the scene's tolerance), ``leapt`` and ``unreachable`` (stands where it cannot
    be rendered) were not used. ``falls`` counts how often the force fell, ``out_s`` is for how long
    of the ``seconds`` of rendering it was below its own for it. ``widest`` is the largest half
    width of the torque's interval by the pose among estimates that were used, as a share.
    ``sentences`` tell of each kind once.
    """

    estimates: int
    lost: int
    late: int
    uncertain: int
    leapt: int
    unreachable: int
    falls: int
    seconds: float
    out_s: float
    widest: float
    sentences: tuple[str, ...]

    @property
    def summary(self) -> str:
        """How the plate was followed, in a line."""
        refused = self.lost + self.late + self.uncertain + self.leapt + self.unreachable
        return (
            f"plate: {self.estimates} estimates of its pose, {refused} not used; it leaves the "
            f"torque uncertain by up to {self.widest:.1%}; without its force for {self.out_s:.1f} s"
        )


class _Judged(NamedTuple):
    """A section and, where it is not used, the kind of reason and a sentence."""

    placed: PoseSection | None
    kind: str = ""
    sentence: str = ""


class PosePlacer:
    """Asks a source for the plate's pose and places it; the servo moves it there.

    ``tolerance`` and ``confidence`` are the scene's, as shares: where half of the interval that the
    pose leaves to the torque is wider than the tolerance, the force falls until it is below 0.8 of
    it. The servo lets the force fall by itself where estimates stop coming. Leaving the context
    closes the ``record`` of what was placed.
    """

    def __init__(
        self,
        source: PoseSource,
        tables: ModelTables,
        *,
        tolerance: float,
        confidence: float,
        torque_limit_Nm: float,
        record: "PoseLog | None" = None,
    ) -> None:
        self._source = source
        self._record = record
        self._tables = tables
        self._tolerance = tolerance
        self._confidence = confidence
        self._torque = PoseTorque(tables, confidence, torque_limit_Nm)
        self._leaps = _Leaps()
        self._state = (0.5 * (tables.opening_min + tables.opening_max), 0.0)
        self._begun_s = math.nan
        self._time = -math.inf
        self._kind = "none yet"
        self._refused: Counter[str] = Counter()
        self._warnings: dict[str, str] = {}
        self._estimates = self._falls = 0
        self._widest = 0.0

    def follow(self, motion: Placing, samples: Samples) -> None:
        """Take the source's newest estimate, if there is one, and place the plate by it."""
        now = motion.now_s
        if math.isnan(self._begun_s):
            self._begun_s = now
        if len(samples):
            place = float(samples["opening"][-1]), float(samples["advance"][-1])
            self._state = place if np.all(np.isfinite(place)) else self._state
        estimate = self._source(now, samples)
        if estimate is None or not estimate.time > self._time:
            self._notice_silence(now)
            return
        self._time = estimate.time
        self._estimates += 1
        age = now - estimate.time
        judged = self._judge(estimate)
        if not judged.kind and age > STALE_S:
            judged = judged._replace(kind="late", sentence=late_sentence(age))
        section = judged.placed.section if judged.placed else Section(0.0, 0.0)
        motion.place(section, not judged.kind, age)
        if judged.placed and self._record:
            self._record.add(estimate.time, judged.placed, not judged.kind)
        self._refused[judged.kind] += 1
        self._become(judged.kind, judged.sentence, now)

    def report(self, seconds: float, out_s: float) -> PoseReport:
        """What came and what was done in a rendering; ``out_s`` of it were below the force."""
        return PoseReport(
            estimates=self._estimates,
            lost=self._refused["lost"],
            late=self._refused["late"],
            uncertain=self._refused["uncertain"],
            leapt=self._refused["leapt"],
            unreachable=self._refused["unreachable"],
            falls=self._falls,
            seconds=seconds,
            out_s=out_s,
            widest=self._widest,
            sentences=tuple(self._warnings.values()),
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._record:
            self._record.flush()

    def _judge(self, estimate: PlatePose) -> _Judged:
        if not estimate.tracked:
            return _Judged(None, "lost", lost_sentence(estimate.why))
        upper, blades = self._tables.upper_face, self._tables.moving_blades
        placed = pose_section(estimate.rotation, estimate.translation, upper, blades)
        if placed is None or not placed.section.is_sound(blades):
            return _Judged(None, "unreachable", ACROSS)
        height = self._height(placed)
        if abs(placed.pitch_rad) > self._most_pitch or abs(height) > MOST_HEIGHT_M:
            limits = (MOST_HEIGHT_M, MOST_PITCH_RAD)
            far = beside_sentence(height, placed.pitch_rad, *limits)
            return _Judged(placed, "unreachable", far)
        covariance = placed.slopes @ np.asarray(estimate.covariance) @ placed.slopes.T
        by_m = self._leaps.take(estimate.time, placed.section, covariance)
        if by_m is not None:
            return _Judged(placed, "leapt", leapt_sentence(by_m))
        spread = self._torque.spread(placed.section, covariance, *self._state)
        allowed = self._tolerance * (BACK_SHARE if self._kind == "uncertain" else 1.0)
        if not spread.half_width <= allowed:
            return _Judged(placed, "uncertain", self._uncertain(placed, covariance, spread))
        self._widest = max(self._widest, spread.half_width)
        return _Judged(placed)

    def _uncertain(self, placed: PoseSection, covariance: Array, spread: TorqueSpread) -> str:
        if "uncertain" in self._warnings:
            return self._warnings["uncertain"]
        worst = self._torque.largest_share(placed.section, covariance, *self._state)
        allowed = (self._confidence, self._tolerance)
        return uncertain_sentence(covariance, spread.half_width, worst, *allowed)

    @property
    def _most_pitch(self) -> float:
        return MOST_PITCH_RAD if self._tables.moving_blades == 2 else math.inf

    def _height(self, placed: PoseSection) -> float:
        """How far from their middle two moving blades would have to hold the plate, at most."""
        if self._tables.moving_blades == 1:
            return 0.0
        along = max(self._state[1] + self._tables.contact_max - placed.section.edge_x, 0.0)
        far = placed.height_m + math.tan(placed.pitch_rad) * along
        return max(placed.height_m, far, key=abs)

    def _notice_silence(self, now: float) -> None:
        if self._time == -math.inf:
            if now - self._begun_s > STALE_S:
                self._become("none yet", NONE_YET, now)
        elif now - self._time > STALE_S:
            self._become("late", late_sentence(now - self._time), now)

    def _become(self, kind: str, sentence: str, now: float) -> None:
        """Count a change of state; the sentence of each kind is kept once."""
        self._falls += bool(kind) and not self._kind
        self._kind = kind
        if kind and kind not in self._warnings:
            after = now - self._begun_s
            self._warnings[kind] = f"After {after:.1f} s there was no force. {sentence}"


class PoseLog:
    """Attaches estimates to a recording as ``plate-0001.csv`` and so on, a minute each.

    One row an estimate that had a place; ``usable`` is 0 where it was not used. Samples with the
    flag PLATE_OUT were rendered with less than their force.
    """

    def __init__(self, writer: RecordingWriter) -> None:
        self._writer = writer
        self._rows: list[str] = []
        self._tables = 0

    def add(self, time_s: float, placed: PoseSection, usable: bool) -> None:
        """Keep one estimate."""
        section = placed.section
        place = (time_s, section.edge_x, section.edge_y, placed.pitch_rad)
        shape = (section.stretch, section.thickening, placed.height_m, float(usable))
        self._rows.append(",".join(f"{value:.9g}" for value in (*place, *shape)))
        if len(self._rows) >= ROWS_A_TABLE:
            self.flush()

    def flush(self) -> None:
        """Attach what is not attached yet."""
        if self._rows:
            self._tables += 1
            text = "\n".join([",".join(ROW_NAMES), *self._rows]) + "\n"
            self._writer.attach(f"plate-{self._tables:04d}.csv", text.encode(), "text/csv")
        self._rows = []


class _Leaps:
    """Sees an edge that goes farther between two estimates than a plate moves.

    After a leap nothing is used until the force has fallen, so that it returns at the new place.
    """

    def __init__(self) -> None:
        self._last: tuple[float, float, float, float] | None = None  # time, x, y, sd
        self._at = -math.inf
        self._by_m = 0.0

    def take(self, time: float, section: Section, covariance: Array) -> float | None:
        """By how much it leapt, None where it did not."""
        sd = math.sqrt(max(float(covariance[0, 0] + covariance[1, 1]), 0.0))
        last, self._last = self._last, (time, section.edge_x, section.edge_y, sd)
        if last is not None:
            moved = math.hypot(section.edge_x - last[1], section.edge_y - last[2])
            if moved > MOST_SPEED_m_per_s * (time - last[0]) + LEAP_SDS * math.hypot(sd, last[3]):
                self._at, self._by_m = time, moved
        return self._by_m if time - self._at <= FALL_S else None


def plate_config(tables: ModelTables) -> PlateConfig:
    """How the servo follows an estimated plate, for the tables that it renders."""
    low, high = tables.upper_face - FACE_REACH_M, tables.upper_face + FACE_REACH_M
    if tables.moving_blades == 2:
        low, high = 0.9 * tables.upper_face, 1.5 * tables.upper_face
    faces = np.linspace(low, high, FACES)
    falls = all(replace(tables, upper_face=float(face)).release_falls for face in faces)
    return PlateConfig(
        is_estimated=True,
        stale_us=round(STALE_S * 1e6),
        move_s=MOVE_S,
        fall_s=FALL_S,
        face_low=low if falls else 0.0,
        face_high=high if falls else 0.0,
    )


def _fitted_pose(record: PoseRecord) -> PoseSource:
    """A source that always gives a fitted pose, which must be in the rig's frame."""
    from scipy.spatial.transform import Rotation

    w, x, y, z = record.quaternion
    rotation = np.asarray(Rotation.from_quat([x, y, z, w]).as_matrix(), dtype=np.float64)
    return fixed_pose(rotation, np.array(record.translation_m), np.array(record.covariance))
