"""The camera: photographs of a board captured, fitted, or a camera file imported."""

from collections.abc import Callable, Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from scissorcal.calibration.camera.bundle import SeenBoard
from scissorcal.calibration.camera.fit import fit_camera, imported_camera, seen_board
from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.fit_pictures import left_over, residual_chart, uncertainty_chart
from scissorcal.errors import InputError
from scissorcal.vision.camera_files import CameraFile, read_camera_file
from scissorcal.vision.overlay import (
    ViewCoverage,
    detection_overlay,
    detection_words,
    residual_overlay,
    write_picture,
)
from scissorcal.vision.photo import Photo, PictureShape, read_photo, same_shape
from scissorcal.vision.targets.boards import CharucoBoard, Chessboard
from scissorcal.vision.targets.detect import Detection, find_board
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import save_version
from scissorcal.workday.photographs import (
    PhotoCapture,
    Seen,
    Taken,
    detection_of,
    photo_captures,
    take_photographs,
)
from scissorcal.workday.runs.fit import Made, Request
from scissorcal.workday.workspace import Workspace

CameraBoard = CharucoBoard | Chessboard

STREAM = 2
WORST = 3
"""Photographs whose residuals are drawn: those with the largest rms."""

NOT_DRAWN = (
    "residuals.png and uncertainty.png were not drawn, because matplotlib is not installed: pip "
    "install 'scissorcal[plots]', then 'scissorcal fit camera --force'."
)


def capture_camera(
    workspace: Workspace, paths: Iterable[Path], board: CameraBoard, tell: Callable[[str], None]
) -> tuple[Taken, ViewCoverage]:
    """Capture photographs of a board, and say which views are still wanted.

    Beside each photograph a picture shows the corners that were found in it. One that shows no such
    board, or has another size than those before it, is left out with its reason. Raises InputError,
    and keeps nothing, where none is left.
    """
    before = photo_captures(workspace, "camera")
    _refuse_other_board(before, board)
    coverage = _coverage_of(before)
    shape = _shape_of(before)

    def look(path: Path, photo: Photo) -> Seen:
        nonlocal coverage, shape
        detection = find_board(photo, board)
        shape = same_shape(photo, shape)
        coverage = coverage.with_view(detection, photo.width, photo.height)
        words = f"{detection_words(photo, detection)}\n  {coverage.sentence()}"
        return Seen(
            words,
            detection,
            drawn=lambda file: write_picture(detection_overlay(photo, detection), file),
        )

    taken = take_photographs(workspace, "camera", paths, look, tell)
    return taken, coverage


def fit(engine: Engine, request: Request) -> Made:
    """Fit the camera to all photographs of boards; draw residuals and uncertainty.

    Both are charts of matplotlib; a note replaces them where that is not installed.
    """
    captures = photo_captures(engine.workspace, "camera")
    seen = _detections(captures)
    rng = np.random.default_rng([request.seed, STREAM])
    priors = engine.recipe.fit.camera.priors
    result = fit_camera(
        seen,
        rng=rng,
        priors=priors,
        inputs_hash=request.inputs_hash,
        progress=request.run.tell,
    )
    boards = [seen_board(detection, priors) for detection in seen]
    charts = find_spec("matplotlib") is not None
    return Made(
        result,
        lambda folder: _draw(result, boards, captures, folder, charts=charts),
        () if charts else (NOT_DRAWN,),
    )


def import_camera(engine: Engine, file: Path) -> tuple[CameraFit, CameraFile, Path]:
    """Import a camera file of OpenCV, ROS or Kalibr as the workspace's camera.

    Raises InputError where the file is none, or the workspace has photographs of a board: a fit to
    them states its uncertainty, and a file does not.
    """
    if photo_captures(engine.workspace, "camera"):
        raise InputError(
            f"{engine.workspace.captures_dir} has photographs for the camera, so {file} was not "
            "imported: run 'scissorcal fit camera', or remove the photographs first."
        )
    read = read_camera_file(file)
    found = imported_camera(read, file)
    path = save_version(engine, "fit camera", found)
    return found, read, path


def _refuse_other_board(before: Sequence[PhotoCapture], board: CameraBoard) -> None:
    for capture in before:
        if capture.index.board != board:
            held = capture.index.board.name if capture.index.board else "no board"
            raise InputError(
                f"{capture.folder} holds photographs of the {held}, and one fit uses one board: "
                f"remove that folder to start again with the {board.name}."
            )


def _shape_of(captures: Sequence[PhotoCapture]) -> PictureShape | None:
    for capture in captures:
        for photo in capture.index.photographs:
            return photo.width, photo.height, photo.orientation
    return None


def _coverage_of(captures: Sequence[PhotoCapture]) -> ViewCoverage:
    coverage = ViewCoverage()
    for detection in _detections(captures):
        coverage = coverage.with_view(detection, detection.width, detection.height)
    return coverage


def _detections(captures: Sequence[PhotoCapture]) -> list[Detection]:
    return [
        detection_of(capture, photo) for capture in captures for photo in capture.index.photographs
    ]


def _draw(
    found: CameraFit,
    boards: Sequence[SeenBoard],
    captures: Sequence[PhotoCapture],
    folder: Path,
    *,
    charts: bool,
) -> None:
    """Draw the worst photographs, and charts of residuals and uncertainty where ``charts``."""
    if charts:
        residual_chart(found, boards, folder / "residuals.png")
        uncertainty_chart(found, folder / "uncertainty.png")
    files = [capture.path(photo) for capture in captures for photo in capture.index.photographs]
    order = sorted(range(len(files)), key=lambda index: -found.views[index].rms_px)
    for place, index in enumerate(order[:WORST], start=1):
        photo = read_photo(files[index], colour=False)
        residuals = left_over(found, found.views[index], boards[index])
        picture = residual_overlay(photo, boards[index].pixels, residuals)
        write_picture(picture, folder / f"worst-{place}-{files[index].stem}.png")
