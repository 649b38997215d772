"""The plate: photographs of its target and of the rig's card captured, and its pose fitted."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from scissorcal.calibration.camera.result import CameraFit
from scissorcal.calibration.plate.fit import fit_plate, plate_target
from scissorcal.calibration.plate.result import PlateFit
from scissorcal.errors import VerdictError
from scissorcal.vision.geometry.board_pose import Corners, UndeterminedPoseError
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.rig_frame import RigPose, card_view, locate_rig
from scissorcal.vision.overlay import residual_overlay, write_picture
from scissorcal.vision.photo import Photo, read_photo
from scissorcal.vision.rig_positions import RigPositions, position_of
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP, RIG_MARKERS, MarkedBoard
from scissorcal.vision.targets.detect import find_any_board
from scissorcal.workday.engine import Engine
from scissorcal.workday.photographs import (
    PhotoCapture,
    Seen,
    Taken,
    detection_of,
    photo_captures,
    take_photographs,
)
from scissorcal.workday.runs.fit import Made, Request, load_result
from scissorcal.workday.workspace import Workspace

AXES_M = 0.03
"""Length at which the axes of the plate's frame are drawn."""


def capture_plate(
    workspace: Workspace,
    paths: Iterable[Path],
    tell: Callable[[str], None],
    *,
    positions: RigPositions | None = None,
) -> Taken:
    """Capture photographs of the plate's target, or with ``positions`` of the card on the rig.

    The first photograph says which target it is; one that shows another, or none, is left out with
    its reason. Raises InputError, and keeps nothing, where none is left.
    """
    kind: Literal["plate", "rig"] = "plate" if positions is None else "rig"
    boards: tuple[MarkedBoard, ...] = (
        (PLATE_BOARD, PLATE_STRIP) if positions is None else (RIG_MARKERS,)
    )

    def look(path: Path, photo: Photo) -> Seen:
        nonlocal boards
        position = None if positions is None else position_of(path, positions)
        detection = find_any_board(photo, boards)
        boards = (detection.board,)  # type: ignore[assignment]
        words = (
            f"{photo.source}: {len(detection.ids)} of {len(detection.board.points)} corners of "
            f"the {detection.board.name}, {detection.square_px:.0f} px a side"
        )
        return Seen(words, detection, position)

    return take_photographs(workspace, kind, paths, look, tell)


def fit(engine: Engine, request: Request) -> Made:
    """Fit the plate's pose to the newest photographs of it; draw residuals over each.

    The plate may have been moved between captures, so that only the newest counts. With photographs
    of the rig's card the pose is in the rig's frame too.
    """
    fitted: CameraFit = load_result(engine, "camera")
    camera = fitted.camera
    newest = photo_captures(engine.workspace, "plate")[-1:]
    photos = []
    for capture in newest:
        photos += [detection_of(capture, photo) for photo in capture.index.photographs]
    result = fit_plate(
        photos,
        camera,
        priors=engine.recipe.fit.plate.priors,
        plate_target=plate_target(engine.recipe),
        rig=locate_workspace_rig(engine, camera),
        places=fitted.pixel_map,
    )
    result = replace(result, inputs_hash=request.inputs_hash)
    return Made(result, lambda folder: _draw(newest, result, camera, engine, folder))


def locate_workspace_rig(engine: Engine, camera: Camera) -> RigPose | None:
    """Locate the rig from the newest photographs of its card, None where there are none.

    Raises VerdictError where they do not determine where it stands.
    """
    captures = photo_captures(engine.workspace, "rig")[-1:]
    views = []
    for capture in captures:
        for photo in capture.index.photographs:
            advance_m = 1e-3 * (photo.advance_mm or 0.0)
            opening_rad = float(np.radians(photo.opening_deg or 0.0))
            card = detection_of(capture, photo)
            views.append(card_view(card, advance_m, opening_rad, engine.recipe.rig.moving_blades))
    if not views:
        return None
    try:
        return locate_rig(views, camera, priors=engine.recipe.fit.plate.priors)
    except UndeterminedPoseError as error:
        raise VerdictError(f"{captures[0].folder}: {error}") from None


def _draw(
    captures: Sequence[PhotoCapture],
    found: PlateFit,
    camera: Camera,
    engine: Engine,
    folder: Path,
) -> None:
    pose = found.camera_plate.after(plate_target(engine.recipe))
    axes = camera.project(found.camera_plate.apply(AXES_M * np.eye(4, 3, -1)))
    for capture in captures:
        for photograph in capture.index.photographs:
            seen = detection_of(capture, photograph)
            photo = read_photo(capture.path(photograph), colour=False)
            pixels = Corners.of(seen).unbent(camera).pixels
            left = pixels - camera.project(pose.apply(seen.points))
            picture = residual_overlay(photo, pixels, left, axes=axes)
            write_picture(picture, folder / f"{Path(photograph.file).stem}.png")
