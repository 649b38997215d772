"""A workspace's plate: photographs of its target and of the rig's card, and its pose."""

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.vision.stances import Stances, stance_of
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP, RIG_MARKERS, MarkedBoard
from scissorcal.workday.photographs import (
    PhotoCapture,
    PhotoWriter,
    detection_of,
    photo_captures,
    pictures_beside,
    refuse_known,
)
from scissorcal.workday.runs.camera import camera_path, require_camera
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.calibration.plate.fit import PlatePhoto
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.geometry.camera import Camera
    from scissorcal.vision.geometry.rig_frame import RigPose

AXES_M = 0.03
"""How long the axes of the plate's frame are drawn."""

_KINDS: tuple[Literal["plate", "rig"], ...] = ("plate", "rig")


@dataclass(frozen=True)
class PlateCapture:
    """A finished capture: ``refused`` are sentences on what was left out."""

    capture: PhotoCapture
    target: str
    taken: tuple[str, ...]
    refused: tuple[str, ...]


@dataclass(frozen=True)
class PlateOutcome:
    """A plate's pose, its file, its pictures, and whether it had to be done at all."""

    fit: "PlateFit"
    path: Path
    pictures: tuple[Path, ...]
    cached: bool


def capture_plate(
    workspace: Workspace,
    paths: Iterable[Path],
    tell: Callable[[str], None],
    *,
    stances: Stances | None = None,
) -> PlateCapture:
    """Take photographs of the plate's target into captures/plate-<stamp>/, as they are.

    With ``stances`` they are of the card on the rig, and go to captures/rig-<stamp>/. The first
    photograph says which target it is; one that shows another, or none, is left out with its
    reason. Raises InputError, and keeps nothing, where that leaves none.
    """
    from scissorcal.vision.photo import read_photo
    from scissorcal.vision.targets.detect import find_any_board

    kind: Literal["plate", "rig"] = "plate" if stances is None else "rig"
    boards: tuple[MarkedBoard, ...] = (
        (PLATE_BOARD, PLATE_STRIP) if stances is None else (RIG_MARKERS,)
    )
    before = photo_captures(workspace, kind)
    taken: list[str] = []
    refused: list[str] = []
    with PhotoWriter(workspace, kind) as writer:
        for path in paths:
            try:
                stance = None if stances is None else stance_of(path, stances)
                photo = read_photo(path, colour=False)
                refuse_known(photo, before, writer)
                detection = find_any_board(photo, boards)
            except InputError as error:
                refused.append(str(error))
                tell(f"left out: {error}")
                continue
            boards = (detection.board,)  # type: ignore[assignment]
            writer.add(path, photo, detection, stance)
            taken.append(
                f"{photo.source}: {len(detection.ids)} of {len(detection.board.points)} corners of "
                f"the {detection.board.name}, {detection.square_px:.0f} px a side"
            )
            tell(taken[-1])
        if not taken:
            nothing = "No picture showed the plate's target held still."
            raise InputError(" ".join(refused[:3] or [nothing]) + " Nothing was kept.")
        capture = writer.finish(boards[0])
    return PlateCapture(capture, boards[0].name, tuple(taken), tuple(refused))


def fit_workspace_plate(workspace: Workspace, *, force: bool = False) -> PlateOutcome:
    """Fit the plate's pose to the newest photographs of it, where anything changed.

    The plate may have been moved between captures, so that only the newest counts. With photographs
    of the rig's card the pose is in the rig's frame too. Writes fits/plate.json and an overlay of
    each photograph. Raises MissingError where there is no camera or no photograph yet.
    """
    from scissorcal.calibration.plate.fit import fit_plate, plate_target
    from scissorcal.calibration.plate.store import load_plate, save_plate

    recipe = workspace.recipe()
    expected = plate_inputs_hash(workspace, recipe)
    path = plate_path(workspace)
    if path.is_file() and not force:
        stored = load_plate(path)
        if stored.inputs_hash == expected:
            return PlateOutcome(stored, path, pictures_beside(path), cached=True)
    camera = require_camera(workspace).camera
    newest = photo_captures(workspace, "plate")[-1:]
    photos = [photo for capture in newest for photo in _photos(capture)]
    for capture in newest:
        _refuse_other_camera(capture, camera)
    rig = workspace_rig(workspace, camera, recipe)
    fit = fit_plate(
        photos, camera, plate_target=plate_target(recipe), rig=rig, inputs_hash=expected
    )
    save_plate(fit, path)
    return PlateOutcome(fit, path, _draw(newest, fit, camera, recipe, path), cached=False)


def plate_path(workspace: Workspace) -> Path:
    """The file of a workspace's plate."""
    return workspace.root / "fits" / "plate.json"


def require_plate(workspace: Workspace) -> "PlateFit":
    """Load a workspace's plate. Raises MissingError where there is none yet."""
    from scissorcal.calibration.plate.store import load_plate

    if not plate_path(workspace).is_file():
        raise MissingError(
            "There is no pose of the plate yet: run 'scissorcal capture plate --image plate-*.jpg' "
            "and 'scissorcal fit plate'."
        )
    return load_plate(plate_path(workspace))


def plate_inputs_hash(workspace: Workspace, recipe: "Recipe") -> str:
    """SHA-256 over all that a fit of the plate's pose depends on."""
    from scissorcal.calibration.plate.fit import ALGORITHM

    camera = camera_path(workspace)
    facts = {
        "algorithm": ALGORITHM,
        "camera": hashlib.sha256(camera.read_bytes()).hexdigest() if camera.is_file() else "",
        "plate": recipe.plate.model_dump(mode="json"),
        "moving": recipe.rig.moving,
        "captures": [
            capture.index.model_dump(mode="json")
            for kind in _KINDS
            for capture in photo_captures(workspace, kind)[-1:]
        ],
    }
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def workspace_rig(workspace: Workspace, camera: "Camera", recipe: "Recipe") -> "RigPose | None":
    """Locate the rig from the newest photographs of its card, None where there are none.

    Raises VerdictError where they do not tell where it stands.
    """
    from scissorcal.vision.geometry.rig_frame import card_view, locate_rig

    captures = photo_captures(workspace, "rig")[-1:]
    views = []
    for capture in captures:
        _refuse_other_camera(capture, camera)
        for photo in capture.index.photographs:
            stance = photo.advance_mm or 0.0, photo.opening_deg or 0.0
            found = detection_of(capture, photo)
            views.append(card_view(found, stance, recipe.rig.moving_blades))
    if not views:
        return None
    middle = np.array([0.5 * RIG_MARKERS.width_m, 0.5 * RIG_MARKERS.height_m, 0.0])
    try:
        return locate_rig(tuple(views), camera, middle)
    except ValueError as error:
        raise VerdictError(f"{captures[0].folder}: {error}.") from None


def _photos(capture: PhotoCapture) -> list["PlatePhoto"]:
    from scissorcal.calibration.plate.fit import PlatePhoto

    return [
        PlatePhoto(photo.source, detection_of(capture, photo))
        for photo in capture.index.photographs
    ]


def _refuse_other_camera(capture: PhotoCapture, camera: "Camera") -> None:
    for photo in capture.index.photographs:
        if (photo.width, photo.height) != (camera.width, camera.height):
            raise InputError(
                f"{capture.folder.name}/{photo.file} has {photo.width} x {photo.height} pixels, "
                f"the camera was fitted at {camera.width} x {camera.height}: take photographs of "
                "the plate with the same camera, size, focus and zoom."
            )


def _draw(
    captures: Sequence[PhotoCapture],
    fit: "PlateFit",
    camera: "Camera",
    recipe: "Recipe",
    path: Path,
) -> tuple[Path, ...]:
    """Draw residuals over each photograph beside the fit's file; earlier ones are removed."""
    from scissorcal.calibration.plate.fit import plate_target
    from scissorcal.vision.overlay import residual_overlay, write_picture
    from scissorcal.vision.photo import read_photo

    for old in pictures_beside(path):
        old.unlink()
    pose = fit.camera_plate.after(plate_target(recipe))
    axes = camera.project(fit.camera_plate.apply(AXES_M * np.eye(4, 3, -1)))
    drawn = []
    for capture in captures:
        for photograph in capture.index.photographs:
            found = detection_of(capture, photograph)
            photo = read_photo(capture.path(photograph), colour=False)
            left = found.pixels - camera.project(pose.apply(found.points))
            picture = residual_overlay(photo, found.pixels, left, axes=axes)
            drawn.append(
                write_picture(picture, path.with_suffix("") / f"{Path(photograph.file).stem}.png")
            )
    return tuple(drawn)
