"""What a report is made from besides the fits: recordings, photographs, completeness."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.edge.result import BladeResult
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.recipe.requirements import GeometryKind
from scissorcal.recording.recording import Recording
from scissorcal.report.panel import Panel

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.package.simplest.choice import SceneChoice

GeometryFit = CameraFit | BladeResult | PlateFit


@dataclass(frozen=True)
class Geometry:
    """What photographs gave: fits of the camera, the blade and the plate, as far as there are any.

    By fit: ``pictures`` are the files that it drew, ``sha256`` is of its file, and ``missing``
    says in a sentence why one that the scene requires is not there, and what to run.
    """

    camera: CameraFit | None = None
    blade: BladeResult | None = None
    plate: PlateFit | None = None
    pictures: Mapping[GeometryKind, tuple[Path, ...]] = field(default_factory=dict)
    sha256: Mapping[GeometryKind, str] = field(default_factory=dict)
    missing: Mapping[GeometryKind, str] = field(default_factory=dict)

    @property
    def fits(self) -> dict[GeometryKind, GeometryFit]:
        """The fits that are there, in the order in which they build on one another."""
        kinds: dict[GeometryKind, GeometryFit | None] = {
            "camera": self.camera,
            "blade": self.blade,
            "plate": self.plate,
        }
        return {kind: fit for kind, fit in kinds.items() if fit is not None}


@dataclass(frozen=True)
class Cell:
    """One planned cell of a capture, such as all closing strokes at one speed.

    ``planned``, ``recorded`` and ``used`` (by the fit) count ``unit``; None where that is not
    known. ``remark`` adds to that, such as the seconds of motion that were recorded and used.
    """

    capture: str
    name: str
    planned: int | None
    recorded: int | None
    used: int | None
    unit: str = "strokes"
    remark: str = ""

    @property
    def incomplete(self) -> bool:
        """Whether less was recorded than planned."""
        if self.planned is None or self.recorded is None:
            return False
        return self.recorded < self.planned

    @property
    def unused(self) -> bool:
        """Whether less is used than was recorded (than planned, where that is not known)."""
        there = self.planned if self.recorded is None else self.recorded
        return there is not None and self.used is not None and self.used < there


@dataclass(frozen=True)
class Evidence:
    """What fits are reported from besides themselves, all of it optional.

    ``recordings`` name strokes and their speeds, and are matched to ``FitResult.sources`` by path,
    file name or hash; only those with samples give the work of each stroke. ``checks`` are
    verifications by fit ("friction", "cut"), ``geometry`` is what photographs gave,
    ``completeness`` what was planned, recorded and used of captures (one without it is counted from
    recordings and fits).
    ``choice`` says what of the fitted laws the scene needs, ``pieces`` are those of a drawn plate
    (`recipe.plate_layers.plate_pieces`). ``panels`` are further ones, such as what a package
    states. ``recipe_text`` is the recipe as it was written; without it the values are printed as
    read. ``inputs_hash`` is the workspace's identity of all inputs, ``next_command`` what comes
    next in it once the report is written; without it the fits alone say.
    """

    recordings: tuple[Recording, ...] = ()
    checks: Mapping[str, VerifyResult] = field(default_factory=dict)
    geometry: Geometry = field(default_factory=Geometry)
    completeness: tuple[Cell, ...] = ()
    choice: "SceneChoice | None" = None
    pieces: "tuple[LayerPiece, ...]" = ()
    panels: tuple[Panel, ...] = ()
    recipe_text: str = ""
    inputs_hash: str = ""
    next_command: str = ""
