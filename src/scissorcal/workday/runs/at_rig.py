"""A run at a rig of which a camera may follow the plate: opened, probed, recorded, done."""

from abc import ABC, abstractmethod
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from scissorcal.recipe.load import read_text
from scissorcal.verdicts import Verdict
from scissorcal.workday.options import RigOptions
from scissorcal.workday.rigs import open_session
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.session import Operator, RigSession
    from scissorcal.recording import Kind, RecordingWriter
    from scissorcal.tracking.plate_pose import PoseSource
    from scissorcal.workday.tracking.session import TrackedRun
    from scissorcal.workday.tracking.tracking_camera import TrackingCamera

Result = TypeVar("Result")


@dataclass(frozen=True)
class RigRun(Generic[Result]):
    """A finished run: its result, its recording (None if not wanted), and the rig.

    ``tracked`` is what became of a camera's pictures and of contacts, None without a camera.
    """

    result: Result
    recording: Path | None
    rig: str
    tracked: "TrackedRun | None" = None

    @property
    def facts(self) -> dict[str, Any]:
        """The run for an answer in JSON, without its verdicts."""
        result: Any = self.result
        facts = {name: value for name, value in asdict(result).items() if name != "verdicts"}
        return {**facts, "rig": self.rig, "tracked": self.tracked.facts if self.tracked else None}

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Those of the result and of the track."""
        result: Any = self.result
        return (*result.verdicts, *(self.tracked.verdicts if self.tracked else ()))

    @property
    def files(self) -> tuple[Path, ...]:
        """What was written."""
        return (self.recording,) if self.recording else ()


@dataclass(frozen=True, eq=False, kw_only=True)
class RigTask(ABC, Generic[Result]):
    """What is done in a run, and the plate's pose: by ``camera``, else by ``source`` if given.

    Before the task a person taps the plate for ``taps_s``; the rig holds ``held_N`` at the tip.
    """

    kind: ClassVar["Kind"]
    camera: "TrackingCamera | None" = None
    source: "PoseSource | None" = None
    taps_s: float = 0.0
    held_N: float = 0.0

    def check(self, session: "RigSession") -> None:
        """Refuse a rig before it is probed: none by default."""

    def prepare(self, session: "RigSession") -> None:
        """Have done, once the rig is probed, what a camera is to see: nothing by default."""

    @abstractmethod
    def open_writer(self, session: "RigSession", path: Path) -> "RecordingWriter":
        """Open the recording."""

    @abstractmethod
    def do(
        self,
        session: "RigSession",
        writer: "RecordingWriter | None",
        source: "PoseSource | None",
    ) -> Result:
        """Do it, the plate standing where ``source`` has it."""


def run_at_rig(
    workspace: Workspace,
    task: RigTask[Result],
    rig: RigOptions,
    operator: "Operator | None",
    *,
    record: bool,
) -> RigRun[Result]:
    """Open the rig (or the world that a simulated camera shows), probe it if due, do the task.

    The recording is captures/<kind>-<stamp>.mcap, with the rows of a track where a camera follows
    the plate.
    """
    camera, text = task.camera, read_text(workspace.recipe_path)
    world = camera.world_rig if camera else None
    with open_session(workspace.recipe(), rig, operator, recipe_toml=text, world=world) as session:
        task.check(session)
        session = ensure_probed(workspace, session)
        task.prepare(session)
        path = workspace.new_recording(task.kind) if record else None
        with task.open_writer(session, path) if path else nullcontext() as writer:
            following = (
                camera.follow(session, writer, taps_s=task.taps_s, held_N=task.held_N)
                if camera
                else nullcontext(task.source)
            )
            with following as source:
                result = task.do(session, writer, source)
    return RigRun(result, path, session.name, camera.tracked() if camera else None)
