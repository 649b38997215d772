"""What a report is made from besides the fits: recordings, completeness, sheets of facts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.edge.result import BladeResult
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.recipe.requirements import GeometryKind
from scissorcal.recording.recording import Recording, Stroke
from scissorcal.report.numbers import Scalar, scalar
from scissorcal.verdicts import Verdict

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.package.simplest.choice import SceneChoice

GeometryFit = CameraFit | BladeResult | PlateFit

UNITS = {
    "s": "s",
    "ms": "ms",
    "us": "µs",
    "ns": "ns",
    "m": "m",
    "mm": "mm",
    "J": "J",
    "N": "N",
    "Nm": "N m",
    "Hz": "Hz",
    "rad": "rad",
    "deg": "°",
    "bytes": "bytes",
    "percent": "%",
}


@dataclass(frozen=True)
class RecordingSummary:
    """A recording without its samples: what the report says about where data come from.

    ``source`` is the file as the fit names it in ``FitResult.sources``; ``duration_s`` is on the
    device clock.
    """

    source: str
    content_hash: str
    kind: str
    joint: str
    samples: int
    duration_s: float
    strokes: tuple[Stroke, ...]
    device: Mapping[str, Any]
    recipe_toml: str
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        """The file's name without its folder."""
        return PurePath(self.source).name or "recording without a file"


def summarise_recording(recording: Recording) -> RecordingSummary:
    """Reduce a recording to what the report prints about it."""
    return RecordingSummary(
        source=recording.source,
        content_hash=recording.content_hash,
        kind=recording.kind,
        joint=recording.joint.kind,
        samples=len(recording.samples),
        duration_s=recording.duration_s,
        strokes=recording.strokes,
        device=recording.device,
        recipe_toml=recording.recipe_toml,
        notes=recording.notes,
    )


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
        every: dict[GeometryKind, GeometryFit | None] = {
            "camera": self.camera,
            "blade": self.blade,
            "plate": self.plate,
        }
        return {what: fit for what, fit in every.items() if fit is not None}


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

    ``recordings`` name strokes, ``raw`` has those whose samples are at hand, ``checks`` the trust
    checks by fit ("friction", "cut"), ``geometry`` what photographs gave, ``completeness`` what was
    planned, recorded and used of captures (one without it is counted from recordings and fits).
    ``choice`` says what of the fitted laws the scene needs, ``pieces`` are those of a drawn plate.
    """

    recordings: tuple[RecordingSummary, ...] = ()
    raw: tuple[Recording, ...] = ()
    checks: Mapping[str, VerifyResult] = field(default_factory=dict)
    geometry: Geometry = field(default_factory=Geometry)
    completeness: tuple[Cell, ...] = ()
    choice: "SceneChoice | None" = None
    pieces: "tuple[LayerPiece, ...]" = ()


@dataclass(frozen=True)
class Fact:
    """One line of a fact sheet; ``unit`` is empty where none applies."""

    label: str
    value: Scalar
    unit: str = ""


@dataclass(frozen=True)
class FactSheet:
    """A section made elsewhere: what a package promises, how a run of the loop went.

    ``anchor`` is the section's address on the page (letters, digits, hyphens).
    """

    title: str
    anchor: str
    facts: tuple[Fact, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    notes: tuple[str, ...] = ()


def sheet_from_mapping(
    title: str,
    anchor: str,
    facts: Mapping[str, Any],
    *,
    verdicts: Sequence[Verdict] = (),
    notes: Sequence[str] = (),
) -> FactSheet:
    """Make a sheet from nested names and values, such as a package's manifest.

    A unit at the end of a name becomes the unit of the line; nested names are joined.

    >>> sheet_from_mapping("Loop", "loop", {"latency": {"p99_us": 112.0}}).facts
    (Fact(label='latency p99', value=112.0, unit='µs'),)
    """
    return FactSheet(title, anchor, tuple(_facts(facts, ())), tuple(verdicts), tuple(notes))


def _facts(facts: Mapping[str, Any], above: tuple[str, ...]) -> list[Fact]:
    found: list[Fact] = []
    for name, value in facts.items():
        if isinstance(value, Mapping):
            found += _facts(value, (*above, str(name)))
            continue
        stem, unit = _unit_of(str(name))
        words = " ".join((*above, stem)).replace("_", " ")
        found.append(Fact(words, scalar(value), unit))
    return found


def _unit_of(name: str) -> tuple[str, str]:
    """Part a name from the unit at its end: rate_rad_per_s is a rate in rad/s."""
    words = name.split("_")
    if len(words) > 3 and words[-2] == "per" and words[-3] in UNITS and words[-1] in UNITS:
        return "_".join(words[:-3]), f"{UNITS[words[-3]]}/{UNITS[words[-1]]}"
    if len(words) > 1 and words[-1] in UNITS:
        return "_".join(words[:-1]), UNITS[words[-1]]
    return name, ""
