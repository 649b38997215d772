"""A workspace's blade: photographs taken in, and its edge fitted."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.errors import InputError, MissingError
from scissorcal.vision.targets.boards import BLADE_MAT
from scissorcal.workday.photographs import (
    BladeSetup,
    PhotoCapture,
    PhotoWriter,
    photo_captures,
    refuse_known,
)
from scissorcal.workday.runs.camera import camera_path, require_camera
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.calibration.edge.result import BladeFit, BladeResult, SeenOpening
    from scissorcal.inference import Effort
    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.blade.photo import BladePhoto
    from scissorcal.vision.geometry.camera import Camera
    from scissorcal.vision.photo import Photo

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class BladeCapture:
    """A finished capture: ``taken`` and ``refused`` are sentences on each photograph."""

    capture: PhotoCapture
    taken: tuple[str, ...]
    refused: tuple[str, ...]


@dataclass(frozen=True)
class BladeOutcome:
    """A blade's fit, its file, its pictures, and whether it had to be done at all."""

    result: "BladeResult"
    path: Path
    pictures: tuple[Path, ...]
    cached: bool


def capture_blade(
    workspace: Workspace,
    paths: Sequence[Path],
    setup: BladeSetup,
    tell: Callable[[str], None],
) -> BladeCapture:
    """Take photographs of a blade into captures/blade-<stamp>/, copied byte for byte.

    Each is measured at once, so that one that cannot be used is left out with its reason while the
    blade still lies there. Raises InputError, and keeps nothing, where that leaves none.
    """
    from scissorcal.vision.photo import read_photo

    before = photo_captures(workspace, "blade")
    _refuse_other_setup(before, setup)
    taken: list[str] = []
    refused: list[str] = []
    with PhotoWriter(workspace, "blade") as writer:
        for path in paths:
            try:
                photo = read_photo(path, colour=False)
                refuse_known(photo, before, writer)
                seen = _measured(photo, _camera_for(workspace, photo, setup), setup)
            except InputError as error:
                refused.append(str(error))
                tell(f"left out: {error}")
                continue
            writer.add(path, photo)
            taken.append(seen.sentence())
            tell(taken[-1])
        if not taken:
            raise InputError(" ".join(refused[:3]) + " Nothing was kept.")
        capture = writer.finish(BLADE_MAT if setup.mat else None, setup)
    return BladeCapture(capture, tuple(taken), tuple(refused))


def fit_workspace_blade(
    workspace: Workspace,
    *,
    effort: "Effort | None" = None,
    seed: int = 0,
    force: bool = False,
    progress: Progress | None = None,
) -> BladeOutcome:
    """Fit the blade's edge to all its photographs, where they or the camera changed.

    Uses the workspace's camera where there is one. Writes fits/blade.json and an overlay of each
    photograph below fits/blade/. Raises MissingError where there is no photograph yet.
    """
    from scissorcal.calibration.edge.result import BladeResult
    from scissorcal.calibration.edge.store import load_blade, save_blade

    recipe = workspace.recipe()
    captures = photo_captures(workspace, "blade")
    if not captures:
        raise MissingError(
            "There is no photograph of the blade yet: run 'scissorcal capture blade --image "
            "blade-*.jpg' first."
        )
    chosen = effort or recipe.fit.effort
    expected = blade_inputs_hash(workspace, recipe, captures, chosen)
    path = blade_path(workspace)
    if path.is_file() and not force:
        stored = load_blade(path)
        if stored.inputs_hash == expected:
            return BladeOutcome(stored, path, _pictures_of(workspace, stored), cached=True)
    tell = progress or (lambda done, sentence: None)
    seen = _all_measured(workspace, captures, tell)
    openings = _openings(seen)
    fits = _fits(seen, captures, recipe, chosen, seed, tell)
    result = BladeResult(
        fits, openings, expected, tuple(one.photo.source for one in seen), pictures=()
    )
    pictures = _draw(workspace, seen, fits)
    names = tuple(workspace.relative(picture) for picture in pictures)
    save_blade(replace(result, pictures=names), path)
    return BladeOutcome(result, path, pictures, cached=False)


def blade_path(workspace: Workspace) -> Path:
    """The file of a workspace's blade."""
    return workspace.root / "fits" / "blade.json"


def blade_inputs_hash(
    workspace: Workspace, recipe: "Recipe", captures: Sequence[PhotoCapture], effort: str
) -> str:
    """SHA-256 over all that a fit of the blade depends on."""
    from scissorcal.calibration.edge.fit import ALGORITHM

    camera = camera_path(workspace)
    facts = {
        "algorithm": ALGORITHM,
        "camera": hashlib.sha256(camera.read_bytes()).hexdigest() if camera.is_file() else "",
        "captures": [capture.index.model_dump(mode="json") for capture in captures],
        "scene": [recipe.scene.opening_deg, recipe.scene.contact_mm, recipe.rig.moving],
        "effort": effort,
    }
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _measured(photo: "Photo", camera: "Camera | None", setup: BladeSetup) -> "BladePhoto":
    from scissorcal.vision.blade.photo import photograph_blade, photograph_scissors

    if setup.both:
        scale = setup.scale_mm_per_px * 1e-3 if setup.scale_mm_per_px else None
        return photograph_scissors(photo, camera, mat=setup.mat, scale=scale)
    return photograph_blade(photo, camera, edge_side=setup.edge_side, pivot_px=setup.pivot_px)


def _camera_for(workspace: Workspace, photo: "Photo", setup: BladeSetup) -> "Camera | None":
    """The workspace's camera, where it has one and it took this size of photograph."""
    if not setup.mat or not camera_path(workspace).is_file():
        return None
    camera = require_camera(workspace).camera
    same = (camera.width, camera.height) == (photo.width, photo.height)
    return camera if same else None


def _refuse_other_setup(before: Sequence[PhotoCapture], setup: BladeSetup) -> None:
    for capture in before:
        held = capture.index.blade
        if held is not None and held.both != setup.both:
            what = "open scissors" if held.both else "one blade"
            raise InputError(
                f"{capture.folder} holds photographs of {what}, and one fit takes one kind: remove "
                "it to start anew."
            )


def _all_measured(
    workspace: Workspace, captures: Sequence[PhotoCapture], tell: Progress
) -> tuple["BladePhoto", ...]:
    from scissorcal.vision.photo import read_photo

    seen: list[BladePhoto] = []
    count = sum(len(capture.index.photographs) for capture in captures)
    for capture in captures:
        setup = capture.index.blade or BladeSetup()
        for photograph in capture.index.photographs:
            tell(0.6 * len(seen) / count, f"measuring {photograph.source}")
            photo = replace(read_photo(capture.path(photograph)), source=photograph.source)
            seen.append(_measured(photo, _camera_for(workspace, photo, setup), setup))
    return tuple(seen)


def _openings(seen: Sequence["BladePhoto"]) -> tuple["SeenOpening", ...]:
    from scissorcal.calibration.edge.result import SeenOpening

    return tuple(
        SeenOpening(one.photo.source, one.scissors.opening)
        for one in seen
        if one.scissors is not None
    )


def _fits(
    seen: Sequence["BladePhoto"],
    captures: Sequence[PhotoCapture],
    recipe: "Recipe",
    effort: "Effort",
    seed: int,
    tell: Progress,
) -> tuple["BladeFit", ...]:
    from scissorcal.calibration.edge.fit import fit_blade
    from scissorcal.vision.blade.photo import by_blade

    lengths = [c.index.blade.length_mm for c in captures if c.index.blade]
    known = next((1e-3 * length for length in lengths if length), None)
    sides = by_blade(seen)
    if not sides:
        raise InputError(
            "The scissors are closed in every photograph, and each blade hides the other's edge: "
            "photograph them open."
        )
    fits = []
    for index, (name, measured) in enumerate(sides.items()):
        rng = np.random.default_rng([seed, 3, index])

        def told(done: float, sentence: str, index: int = index, name: str = name) -> None:
            tell(0.6 + 0.4 * (index + done) / len(sides), f"{name}: {sentence}")

        fits.append(
            fit_blade(
                measured, recipe, effort=effort, rng=rng, name=name, length_m=known, progress=told
            )
        )
    return tuple(fits)


def _draw(
    workspace: Workspace, seen: Sequence["BladePhoto"], fits: Sequence["BladeFit"]
) -> tuple[Path, ...]:
    from scissorcal.calibration.edge.pictures import edge_picture
    from scissorcal.vision.overlay import write_picture

    folder = blade_path(workspace).with_suffix("")
    for old in folder.glob("*.png"):
        old.unlink()
    by_name = {fit.name: fit for fit in fits}
    paths = []
    for number, one in enumerate(seen, start=1):
        path = folder / f"{number:03d}-{Path(one.photo.source).stem}.png"
        paths.append(write_picture(edge_picture(one, by_name), path))
    return tuple(paths)


def _pictures_of(workspace: Workspace, result: "BladeResult") -> tuple[Path, ...]:
    return tuple(workspace.root / name for name in result.pictures)
