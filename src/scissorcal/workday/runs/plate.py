"""A workspace's plate: photographs of its target and of the rig's card, and its pose."""

import csv
import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from scissorcal.errors import InputError, MissingError, VerdictError
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
    from scissorcal.vision.geometry.pose import Pose
    from scissorcal.vision.geometry.rig_frame import RigPose
    from scissorcal.vision.photo import Photo
    from scissorcal.vision.targets.detect import Detection

Stances = Mapping[str, tuple[float, float]]
"""Where the rig stood in each photograph, by its name: advance in mm, opening in deg."""

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
                stance = None if stances is None else _stance_of(path, stances)
                photo = read_photo(path, colour=False)
                refuse_known(photo, before, writer)
                detection = _found(photo, boards)
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


def read_stances(path: Path) -> Stances:
    """Read where the rig stood: a CSV file with columns file, advance_mm, opening_deg.

    Raises InputError naming the line that is wrong.
    """
    try:
        rows = list(csv.DictReader(path.read_text("utf-8-sig").splitlines()))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {error}.") from None
    wanted = {"file", "advance_mm", "opening_deg"}
    if not rows or not wanted <= set(rows[0]):
        raise InputError(
            f"{path} needs a first line 'file,advance_mm,opening_deg' and a line for each "
            "photograph below it."
        )
    found: dict[str, tuple[float, float]] = {}
    for number, row in enumerate(rows, start=2):
        try:
            stance = float(row["advance_mm"]), float(row["opening_deg"])
        except (TypeError, ValueError):
            stance = (float("nan"), float("nan"))
        if not (np.isfinite(stance[0]) and np.isfinite(stance[1])):
            raise InputError(
                f"{path}, line {number}: advance_mm and opening_deg must be numbers, such as "
                "'rig-01.jpg,30,25'."
            )
        found[Path(row["file"]).name] = stance
    return found


def fit_workspace_plate(workspace: Workspace, *, force: bool = False) -> PlateOutcome:
    """Fit the plate's pose to the newest photographs of it, where anything changed.

    The plate may have been moved between captures, so that only the newest counts. With photographs
    of the rig's card the pose is in the rig's frame too. Writes fits/plate.nc and an overlay of
    each photograph. Raises MissingError where there is no camera or no photograph yet.
    """
    from scissorcal.calibration import load, save
    from scissorcal.calibration.plate.fit import fit_plate
    from scissorcal.calibration.plate.result import PlateFit

    recipe = workspace.recipe()
    expected = plate_inputs_hash(workspace, recipe)
    path = plate_path(workspace)
    if path.is_file() and not force:
        stored = load(path, PlateFit)
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
    save(fit, path)
    return PlateOutcome(fit, path, _draw(newest, fit, camera, recipe, path), cached=False)


def plate_path(workspace: Workspace) -> Path:
    """The file of a workspace's plate."""
    return workspace.root / "fits" / "plate.nc"


def require_plate(workspace: Workspace) -> "PlateFit":
    """Load a workspace's plate. Raises MissingError where there is none yet."""
    from scissorcal.calibration import load
    from scissorcal.calibration.plate.result import PlateFit

    if not plate_path(workspace).is_file():
        raise MissingError(
            "There is no pose of the plate yet: run 'scissorcal capture plate --image plate-*.jpg' "
            "and 'scissorcal fit plate'."
        )
    return load(plate_path(workspace), PlateFit)


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


def plate_target(recipe: "Recipe") -> "Pose":
    """T_plate_target of the recipe: printed y runs down and z into the sheet, so it is turned."""
    from scissorcal.vision.geometry.pose import Pose

    x, y = (1e-3 * value for value in recipe.plate.place_mm)
    turned = Pose.from_rotation_vector([0.0, 0.0, np.radians(recipe.plate.turn_deg)], [x, y, 0.0])
    return turned.after(Pose.from_rotation_vector([np.pi, 0.0, 0.0], np.zeros(3)))


def workspace_rig(workspace: Workspace, camera: "Camera", recipe: "Recipe") -> "RigPose | None":
    """Locate the rig from the newest photographs of its card, None where there are none.

    Raises VerdictError where they do not tell where it stands.
    """
    from scissorcal.vision.geometry.board_pose import Corners
    from scissorcal.vision.geometry.rig_frame import CardView, locate_rig

    captures = photo_captures(workspace, "rig")[-1:]
    views = []
    for capture in captures:
        _refuse_other_camera(capture, camera)
        for photo in capture.index.photographs:
            found = detection_of(capture, photo)
            frame = np.zeros(len(found.ids), dtype=np.int64)
            corners = Corners(found.pixels, found.points, frame, found.ids)
            angle = np.radians(photo.opening_deg or 0.0) / recipe.rig.moving_blades
            views.append(CardView(corners, 1e-3 * (photo.advance_mm or 0.0), float(angle)))
    if not views:
        return None
    middle = np.array([0.5 * RIG_MARKERS.width_m, 0.5 * RIG_MARKERS.height_m, 0.0])
    try:
        return locate_rig(tuple(views), camera, middle)
    except ValueError as error:
        raise VerdictError(f"{captures[0].folder}: {error}.") from None


def _found(photo: "Photo", boards: Sequence[MarkedBoard]) -> "Detection":
    from scissorcal.vision.targets.detect import find_board

    for board in boards[:-1]:
        try:
            return find_board(photo, board)
        except InputError:
            continue
    return find_board(photo, boards[-1])


def _stance_of(path: Path, stances: Stances) -> tuple[float, float]:
    if path.name not in stances:
        raise InputError(
            f"{path.name} has no line among the stances: add 'file,advance_mm,opening_deg' for it."
        )
    return stances[path.name]


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
