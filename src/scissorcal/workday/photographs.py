"""Photographs in a workspace: a folder per capture, with what was found in each."""

import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, ConfigDict, Field

from scissorcal.errors import InputError
from scissorcal.files import left_over, part_of, rename_folder
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import PHOTO_INDEX
from scissorcal.vision.targets.boards import CharucoBoard, Chessboard, MarkerBoard
from scissorcal.workday.workspace import PHOTOGRAPH_INDEX, Workspace

if TYPE_CHECKING:
    from scissorcal.vision.photo import Photo
    from scissorcal.vision.targets.detect import Detection

PhotoKind = Literal["camera", "blade", "plate", "rig"]
DRAWN_SUFFIX = "-detected.png"
"""How the name of a picture ends that shows what was found in the photograph beside it."""
KEPT_SUFFIX = ".interrupted"
NOTHING = "No photograph was given, or no picture showed the target held still."


class Photograph(BaseModel):
    """One stored photograph; ``pixels`` are where ``points[ids]`` of the capture's board stand."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    file: str = Field(description="name in the capture's folder")
    source: str = Field(description="the name it was given by")
    sha256: str
    width: int = Field(description="pixels, turned upright")
    height: int
    orientation: int = Field(default=1, description="EXIF orientation that was applied")
    square_px: float | None = None
    advance_mm: float | None = Field(default=None, description="where the rig stood; rig only")
    opening_deg: float | None = Field(default=None, description="how far it was open; rig only")
    ids: tuple[int, ...] = ()
    pixels: tuple[tuple[float, float], ...] = ()


class BladeSetup(BaseModel):
    """How a blade was laid down for its photographs.

    ``both``: open scissors in place of one blade. ``mat``: on the printed blade mat; without it,
    ``scale_mm_per_px`` or ``length_mm`` gives the size. ``edge_side``: the mat's rim that the edge
    faces. ``pivot_px``: the pivot in the picture, where no hole shows it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    both: bool = False
    mat: bool = True
    edge_side: Literal["down", "up"] = "down"
    scale_mm_per_px: float | None = None
    length_mm: float | None = None
    pivot_px: tuple[float, float] | None = None


class PhotoIndex(BaseModel):
    """What a folder of photographs says about itself."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["scissorcal-photographs/1"] = "scissorcal-photographs/1"
    kind: PhotoKind
    board: CharucoBoard | MarkerBoard | Chessboard | None = Field(
        default=None, discriminator="kind"
    )
    blade: BladeSetup | None = None
    photographs: tuple[Photograph, ...]


@dataclass(frozen=True)
class PhotoCapture:
    """A folder of photographs and its index."""

    folder: Path
    index: PhotoIndex

    def path(self, photograph: Photograph) -> Path:
        return self.folder / photograph.file


def photo_captures(workspace: Workspace, kind: PhotoKind) -> tuple[PhotoCapture, ...]:
    """Read the captures of one kind, oldest first. Raises InputError where one is damaged."""
    return tuple(
        PhotoCapture(path.parent, _index(path)) for path in workspace.photograph_indexes(kind)
    )


@dataclass(frozen=True)
class Seen:
    """What was found in one photograph, and the sentence that reports it.

    ``board`` is the target that it shows where there is no detection.
    """

    words: str
    detection: "Detection | None" = None
    position: tuple[float, float] | None = None
    drawn: Callable[[Path], object] | None = None
    board: CharucoBoard | MarkerBoard | Chessboard | None = None


@dataclass(frozen=True)
class Taken:
    """A finished capture of photographs: a sentence on each that was kept, and on each refused."""

    capture: PhotoCapture
    seen: tuple[Seen, ...]
    refused: tuple[str, ...]

    @property
    def taken(self) -> tuple[str, ...]:
        return tuple(one.words for one in self.seen)


def take_photographs(
    workspace: Workspace,
    kind: PhotoKind,
    paths: Iterable[Path],
    look: "Callable[[Path, Photo], Seen]",
    tell: Callable[[str], None],
    *,
    blade: BladeSetup | None = None,
) -> Taken:
    """Copy photographs byte for byte into captures/<kind>-<stamp>/, each looked at at once.

    ``look`` finds what the photograph must show and raises InputError where it does not; such a
    photograph, and one that was taken before, is left out with its reason. ``tell`` hears of each.
    ``blade`` is how a blade was laid down.
    Raises InputError, and keeps nothing, where none is left.
    """
    from scissorcal.vision.photo import read_photo

    before = photo_captures(workspace, kind)
    sightings: list[Seen] = []
    refused: list[str] = []
    with PhotoWriter(workspace, kind) as writer:
        for path in paths:
            try:
                photo = read_photo(path, colour=False)
                _refuse_known(photo, before, writer)
                sighting = look(path, photo)
            except InputError as error:
                refused.append(str(error))
                tell(f"left out: {error}")
                continue
            stored = writer.add(path, photo, sighting.detection, sighting.position)
            if sighting.drawn is not None:
                sighting.drawn(writer.part / f"{Path(stored.file).stem}{DRAWN_SUFFIX}")
            sightings.append(sighting)
            tell(sighting.words)
        if not sightings:
            raise InputError(" ".join(refused[:3] or [NOTHING]) + " Nothing was kept.")
        last = sightings[-1]
        capture = writer.finish(last.detection.board if last.detection else last.board, blade)
    return Taken(capture, tuple(sightings), tuple(refused))


class PhotoWriter:
    """A capture that is being taken: nothing of it is to be seen until `finish`.

    Leaving without it removes what was copied. After a kill `recover_photographs` finds it.
    """

    def __init__(self, workspace: Workspace, kind: PhotoKind) -> None:
        self.kind = kind
        self.folder = _new_folder(workspace, kind)
        self.part = part_of(self.folder)
        self.photographs: list[Photograph] = []

    def __enter__(self) -> "PhotoWriter":
        self.part.mkdir(parents=True)
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self.part, ignore_errors=True)

    def add(
        self,
        path: Path,
        photo: "Photo",
        detection: "Detection | None" = None,
        position: tuple[float, float] | None = None,
    ) -> Photograph:
        """Copy a photograph byte for byte and note what was found in it.

        ``position`` is where the rig stood: advance in mm, opening in deg.
        """
        name = f"{len(self.photographs) + 1:03d}-{path.name}"
        shutil.copyfile(path, self.part / name)
        found = {}
        if detection is not None:
            found = {
                "square_px": detection.square_px,
                "ids": tuple(detection.ids.tolist()),
                "pixels": tuple((float(u), float(v)) for u, v in detection.pixels),
            }
        photograph = Photograph.model_validate(
            {
                "file": name,
                "source": str(path.name),
                "sha256": photo.sha256,
                "width": photo.width,
                "height": photo.height,
                "orientation": photo.orientation,
                "advance_mm": position[0] if position else None,
                "opening_deg": position[1] if position else None,
                **found,
            }
        )
        self.photographs.append(photograph)
        return photograph

    def finish(
        self,
        board: CharucoBoard | MarkerBoard | Chessboard | None,
        blade: BladeSetup | None = None,
    ) -> PhotoCapture:
        """Write the index and let the capture be seen, all at once."""
        index = PhotoIndex(
            kind=self.kind, board=board, blade=blade, photographs=tuple(self.photographs)
        )
        (self.part / PHOTOGRAPH_INDEX).write_text(index.model_dump_json(indent=1) + "\n", "utf-8")
        rename_folder(self.part, self.folder)
        return PhotoCapture(self.folder, index)


def recover_photographs(folder: Path) -> tuple[str, ...]:
    """Keep the photographs of killed captures in ``folder``; return a sentence for each.

    They are not a capture: what was found in them is not known.
    """
    said = []
    for part in left_over(folder):
        number, kept = 1, folder / f"{part.name.split('.')[0]}{KEPT_SUFFIX}"
        while kept.exists():
            number += 1
            kept = kept.with_suffix(f"{KEPT_SUFFIX}-{number}")
        pictures = [file for file in part.iterdir() if not file.name.endswith(DRAWN_SUFFIX)]
        if not pictures:
            shutil.rmtree(part)
            continue
        part.rename(kept)
        kind = kept.name.split("-")[0]
        words = "plate --positions FILE" if kind == "rig" else kind
        said.append(
            f"A capture of photographs was interrupted; those taken ({len(pictures)}) are kept in "
            f"{kept}. Give the photographs to 'scissorcal capture {words}' again."
        )
    return tuple(said)


def detection_of(capture: PhotoCapture, photograph: Photograph) -> "Detection":
    """What was found in a stored photograph. Raises InputError where its capture has no board."""
    import numpy as np

    from scissorcal.vision.targets.detect import Detection

    board = capture.index.board
    if board is None:
        raise InputError(f"{capture.folder} holds no photographs of a board: remove it.")
    return Detection(
        board,
        np.array(photograph.ids, dtype=np.int64),
        np.array(photograph.pixels, dtype=np.float64).reshape(-1, 2),
        photograph.square_px or float("nan"),
        photograph.source,
        photograph.width,
        photograph.height,
    )


def _refuse_known(photo: "Photo", before: Sequence[PhotoCapture], writer: PhotoWriter) -> None:
    """Raise InputError where a photograph was taken in before, or is given twice."""
    known = _already_there(before, photo.sha256)
    if known is not None:
        raise InputError(
            f"{photo.source} was taken in before, as {known.parent.name}/{known.name}."
        )
    if any(photo.sha256 == other.sha256 for other in writer.photographs):
        raise InputError(f"{photo.source} is given twice.")


def _already_there(captures: Sequence[PhotoCapture], sha256: str) -> Path | None:
    """Find a photograph of these bytes among captures."""
    for capture in captures:
        for photograph in capture.index.photographs:
            if photograph.sha256 == sha256:
                return capture.path(photograph)
    return None


def _new_folder(workspace: Workspace, kind: PhotoKind) -> Path:
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    workspace.captures_dir.mkdir(parents=True, exist_ok=True)
    folder = workspace.captures_dir / f"{kind}-{stamp}"
    number = 1
    while any(workspace.captures_dir.glob(f"{folder.name}*")):
        number += 1
        folder = workspace.captures_dir / f"{kind}-{stamp}-{number}"
    return folder


def _index(path: Path) -> PhotoIndex:
    remedy = f"Remove {path.parent.name} and capture its photographs again."
    kind = replace(PHOTO_INDEX, remedy=remedy)
    with reading(path, kind):
        return PhotoIndex.model_validate_json(read_foreign(path, kind))
