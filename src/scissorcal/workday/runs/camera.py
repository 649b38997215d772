"""A workspace's camera: photographs of a board taken in, fitted, or brought in from a file."""

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.errors import InputError, MissingError
from scissorcal.vision.coverage import ViewCoverage, detection_words
from scissorcal.vision.overlay import detection_overlay, write_picture
from scissorcal.vision.photo import PictureShape, read_photo, same_shape
from scissorcal.vision.targets.boards import CharucoBoard, Chessboard
from scissorcal.vision.targets.detect import find_board
from scissorcal.workday.photographs import (
    PhotoCapture,
    PhotoWriter,
    detection_of,
    photo_captures,
    pictures_beside,
    refuse_known,
)
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.calibration.camera.fit import CameraPhoto
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.vision.camera_files import CameraFile

Progress = Callable[[float, str], None]
CameraBoard = CharucoBoard | Chessboard


@dataclass(frozen=True)
class TakenPhoto:
    """One photograph as it was taken in, in words."""

    name: str
    corners: int
    square_px: float
    words: str


@dataclass(frozen=True)
class CameraCapture:
    """A finished capture: ``refused`` are sentences on what was left out."""

    capture: PhotoCapture
    taken: tuple[TakenPhoto, ...]
    refused: tuple[str, ...]
    coverage: ViewCoverage


@dataclass(frozen=True)
class CameraOutcome:
    """A camera's fit, its file, its pictures, and whether it had to be done at all."""

    fit: "CameraFit"
    path: Path
    pictures: tuple[Path, ...]
    cached: bool


def capture_camera(
    workspace: Workspace, paths: Iterable[Path], board: CameraBoard, tell: Callable[[str], None]
) -> CameraCapture:
    """Take photographs of a board into captures/camera-<stamp>/, copied byte for byte.

    Beside each a picture shows what was detected in it. ``tell`` hears of each as it is added, and
    of what is still wanted. A photograph that shows no such board, was taken in before, or is of
    another size than those before it is left out with its reason. Raises InputError, and keeps
    nothing, where that leaves none.
    """
    before = photo_captures(workspace, "camera")
    _refuse_other_board(before, board)
    coverage = _coverage_of(before)
    taken: list[TakenPhoto] = []
    refused: list[str] = []
    with PhotoWriter(workspace, "camera") as writer:
        shape = _shape_of(before)
        for path in paths:
            try:
                photo = read_photo(path, colour=False)
                refuse_known(photo, before, writer)
                detection = find_board(photo, board)
                shape = same_shape(photo, shape)
            except InputError as error:
                refused.append(str(error))
                tell(f"left out: {error}")
                continue
            stored = writer.add(path, photo, detection)
            drawn = f"{Path(stored.file).stem}-detected.png"
            write_picture(detection_overlay(photo, detection), writer.part / drawn)
            coverage = coverage.with_view(detection, photo.width, photo.height)
            corners, words = len(detection.ids), detection_words(photo, detection)
            taken.append(TakenPhoto(photo.source, corners, detection.square_px, words))
            tell(f"{taken[-1].words}\n  {coverage.sentence()}")
        if not taken:
            raise InputError(
                " ".join(refused[:3]) + " Nothing was kept."
                if refused
                else f"No picture showed the {board.name} held still. Nothing was kept."
            )
        capture = writer.finish(board)
    return CameraCapture(capture, tuple(taken), tuple(refused), coverage)


def fit_workspace_camera(
    workspace: Workspace,
    *,
    seed: int = 0,
    force: bool = False,
    progress: Progress | None = None,
) -> CameraOutcome:
    """Fit the camera to all photographs of boards in a workspace, where they changed.

    Writes fits/camera.json and pictures below fits/camera/: residuals over the picture, what is
    uncertain, and the three worst photographs with their residuals. Raises MissingError where
    there are too few photographs, and what the fit itself raises; nothing is written then.
    """
    from scissorcal.calibration.camera.fit import fit_camera
    from scissorcal.calibration.camera.store import load_camera, save_camera

    captures = photo_captures(workspace, "camera")
    expected = camera_inputs_hash(captures)
    path = camera_path(workspace)
    if path.is_file() and not force:
        stored = load_camera(path)
        if stored.inputs_hash == expected:
            return CameraOutcome(stored, path, pictures_beside(path), cached=True)
        if stored.origin == "imported" and not captures:
            return CameraOutcome(stored, path, (), cached=True)
    photos = _photos(captures)
    rng = np.random.default_rng([seed, 2])
    fit = fit_camera(photos, rng=rng, inputs_hash=expected, progress=progress)
    save_camera(fit, path)
    return CameraOutcome(fit, path, _draw(fit, photos, captures, path), cached=False)


def import_camera(workspace: Workspace, file: Path) -> tuple["CameraFit", "CameraFile", Path]:
    """Bring a camera file of OpenCV, ROS or Kalibr in as fits/camera.json.

    Raises InputError where the file is none, or the workspace has photographs of a board: what is
    fitted from them says how sure it is, and a file does not.
    """
    from scissorcal.calibration.camera.imported import imported_camera
    from scissorcal.calibration.camera.store import save_camera
    from scissorcal.vision.camera_files import read_camera_file

    if photo_captures(workspace, "camera"):
        raise InputError(
            f"{workspace.captures_dir} has photographs for the camera, so {file} was left alone: "
            "run 'scissorcal fit camera', or remove them first."
        )
    read = read_camera_file(file)
    fit = imported_camera(read, file)
    save_camera(fit, camera_path(workspace))
    return fit, read, camera_path(workspace)


def camera_path(workspace: Workspace) -> Path:
    """The file of a workspace's camera."""
    return workspace.root / "fits" / "camera.json"


def require_camera(workspace: Workspace) -> "CameraFit":
    """Load a workspace's camera. Raises MissingError where there is none yet."""
    from scissorcal.calibration.camera.store import load_camera

    if not camera_path(workspace).is_file():
        raise MissingError(
            "There is no camera yet: run 'scissorcal capture camera --image board-*.jpg' and "
            "'scissorcal fit camera', or bring one in with 'scissorcal import camera.yaml'."
        )
    return load_camera(camera_path(workspace))


def camera_inputs_hash(captures: Sequence[PhotoCapture]) -> str:
    """SHA-256 over all that a fit of these photographs depends on."""
    from scissorcal.calibration.camera.fit import ALGORITHM

    facts = [
        {
            "board": capture.index.model_dump(mode="json")["board"],
            "photographs": sorted(
                (photo.sha256, photo.ids, photo.pixels) for photo in capture.index.photographs
            ),
        }
        for capture in captures
    ]
    text = json.dumps({"algorithm": ALGORITHM, "captures": facts}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _refuse_other_board(before: Sequence[PhotoCapture], board: CameraBoard) -> None:
    for capture in before:
        if capture.index.board != board:
            held = capture.index.board.name if capture.index.board else "no board"
            raise InputError(
                f"{capture.folder} holds photographs of the {held}, and a fit takes one board: "
                f"remove it to start anew with the {board.name}."
            )


def _shape_of(captures: Sequence[PhotoCapture]) -> PictureShape | None:
    for capture in captures:
        for photo in capture.index.photographs:
            return photo.width, photo.height, photo.orientation
    return None


def _coverage_of(captures: Sequence[PhotoCapture]) -> ViewCoverage:
    coverage = ViewCoverage()
    for photo in _photos(captures):
        coverage = coverage.with_view(photo.detection, photo.width, photo.height)
    return coverage


def _photos(captures: Sequence[PhotoCapture]) -> list["CameraPhoto"]:
    from scissorcal.calibration.camera.fit import CameraPhoto

    found = []
    for capture in captures:
        for photo in capture.index.photographs:
            detection = detection_of(capture, photo)
            found.append(CameraPhoto(photo.source, photo.width, photo.height, detection))
    return found


def _draw(
    fit: "CameraFit",
    photos: Sequence["CameraPhoto"],
    captures: Sequence[PhotoCapture],
    path: Path,
) -> tuple[Path, ...]:
    """Draw the fit's pictures beside its file; those of an earlier fit are removed."""
    from scissorcal.calibration.camera.fit import seen_board
    from scissorcal.calibration.camera.pictures import (
        left_over,
        residual_chart,
        uncertainty_chart,
    )
    from scissorcal.vision.overlay import residual_overlay

    folder = path.with_suffix("")
    for old in pictures_beside(path):
        old.unlink()
    boards = [seen_board(photo.name, photo.detection) for photo in photos]
    drawn = [
        residual_chart(fit, boards, folder / "residuals.png"),
        uncertainty_chart(fit, folder / "uncertainty.png"),
    ]
    files = [capture.path(photo) for capture in captures for photo in capture.index.photographs]
    order = sorted(range(len(files)), key=lambda index: -fit.views[index].rms_px)
    for place, index in enumerate(order[:3], start=1):
        photo = read_photo(files[index], colour=False)
        residuals = left_over(fit, fit.views[index], boards[index])
        picture = residual_overlay(photo, boards[index].pixels, residuals)
        drawn.append(write_picture(picture, folder / f"worst-{place}-{files[index].stem}.png"))
    return tuple(drawn)
