"""Photographs for ``--camera sim``: rendered blades and targets, a plate and a rig's card."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.recipe.library import specimen_path
from scissorcal.recipe.schema import Recipe
from scissorcal.vision.sim.optics import Lens, Looks, SimPose, about, as_jpeg
from scissorcal.vision.sim.photograph import PaintLayer, render
from scissorcal.vision.sim.scenes import (
    LEVEL,
    BladeShape,
    PlateScene,
    blade_layer,
    plate_scene,
    scissors_layers,
    target_layers,
)
from scissorcal.vision.targets.boards import (
    BLADE_MAT,
    MAT_PIVOT_M,
    PLATE_BOARD,
    Board,
)

SIM_LENS = Lens(1900.0, (1003.2, 744.9), 2000, 1500, (-0.08, 0.03, 4e-4, -3e-4, 0.0))
"""The lens of every rendered photograph."""

ADVANCES_MM = (0.0, 15.0, 30.0)
OPENINGS_DEG = (8.0, 22.0, 36.0)

_JPEG_QUALITY = 92
_SHADOW_M = np.array([-0.0006, 0.0009, 0.0])
_CORNERS = ((0.4, 0.35), (-0.4, 0.35), (0.4, -0.35), (-0.4, -0.35))
_LOOKS = Looks(exposure=0.85, defocus_px=0.7, softness_px=0.6, vignetting=0.2, noise=0.008)


def render_blade_photographs(
    shape: BladeShape, folder: Path, seed: int, *, count: int = 3, both: bool = False
) -> tuple[Path, ...]:
    """Render photographs of a blade on the mat, or with ``both`` of open scissors.

    The lamp of open scissors stands elsewhere in each. Returns the files, in ``folder``.
    """
    look: dict[str, Any] = {"shadow": 0.25, "shading": (0.15, 0.2)}
    paths = []
    for number in range(count):
        aside = about(2, 2.0 * math.pi * number / 3.0 if both else 0.0) @ _SHADOW_M
        look["shadow_m"] = (float(aside[0]), float(aside[1]))
        rng = np.random.default_rng([seed, 7, number])
        pose = _view_of(BLADE_MAT, rng)
        turn = float(rng.normal(0.0, 0.05))
        if both:
            opening = float(rng.uniform(0.5, 0.9))
            middle = (0.1, 0.09)
            things = scissors_layers(shape, shape, opening, pose, middle, turn, **look)
        else:
            things = [blade_layer(shape, pose, MAT_PIVOT_M, turn, **look)]
        layers = [*target_layers(BLADE_MAT, pose), *things]
        paths.append(_write(layers, rng, folder / f"blade-{number + 1:02d}.jpg"))
    return tuple(paths)


def render_board_photographs(
    board: Board, folder: Path, seed: int, name: str, *, count: int = 15
) -> tuple[Path, ...]:
    """Render photographs of one target from many directions into a folder; returns the files.

    Every other one has the target in a corner of the picture, where lens distortion is largest.
    """
    paths = []
    for number in range(count):
        rng = np.random.default_rng([seed, 8, number])
        tilt = 0.6 if number else 0.05
        near = float(rng.uniform(0.55, 1.0))
        aside = _CORNERS[number // 2 % 4] if number % 2 else (0.0, 0.0)
        pose = _view_of(board, rng, tilt=tilt, nearness=near, aside=aside)
        path = folder / f"{name}-{number + 1:02d}.jpg"
        paths.append(_write(target_layers(board, pose), rng, path))
    return tuple(paths)


def sim_plate_scene(recipe: "Recipe", seed: int, rig_plate: SimPose | None = None) -> PlateScene:
    """The scene that all rendered photographs of one seed show: the true poses.

    The plate stands at ``rig_plate``, such as `touched_plate`; without it, it is drawn.
    """
    x, y = (1e-3 * value for value in recipe.plate.place_mm)
    turn = float(np.radians(recipe.plate.turn_deg))
    scene = plate_scene(np.random.default_rng([seed, 9]), (x, y), turn)
    return scene if rig_plate is None else replace(scene, rig_plate=rig_plate)


def render_plate_photographs(
    recipe: "Recipe",
    folder: Path,
    seed: int,
    *,
    count: int = 5,
    rig_plate: SimPose | None = None,
) -> tuple[Path, ...]:
    """Render photographs of the plate at rest into a folder; returns the files.

    It stands as `sim_plate_scene` has it.
    """
    scene = sim_plate_scene(recipe, seed, rig_plate)
    paths = [folder / f"plate-{n:02d}.jpg" for n in range(1, count + 1)]
    for path in paths:
        path.write_bytes(_plate_jpeg(scene, (0.0, OPENINGS_DEG[0]), recipe, path, seed))
    return tuple(paths)


def render_card_photographs(
    recipe: "Recipe", folder: Path, seed: int, rig_plate: SimPose | None = None
) -> dict[Path, tuple[float, float]]:
    """Render photographs of the rig's card.

    Returns the files with the rig's position in each: advance (mm) and opening (deg).
    """
    scene = sim_plate_scene(recipe, seed, rig_plate)
    positions = [(advance, opening) for advance in ADVANCES_MM for opening in OPENINGS_DEG]
    position_of = {
        folder / f"rig-{n:02d}.jpg": position for n, position in enumerate(positions, start=1)
    }
    for path, position in position_of.items():
        path.write_bytes(_plate_jpeg(scene, position, recipe, path, seed))
    return position_of


def render_frame(
    scene: PlateScene, recipe: "Recipe", position: tuple[float, float], seed: int, number: int
) -> NDArray[np.uint8]:
    """Render one picture of a running camera, (height, width, 3).

    ``position`` is the rig's advance (mm) and opening (deg); ``number`` gives each picture of a
    seed another noise.
    """
    return _plate_picture(scene, position, recipe, np.random.default_rng([seed, 11, number]))


def standing_plate(recipe: "Recipe") -> SimPose | None:
    """Where the plate of a recipe's simulated day stands; None where it is drawn.

    A plate whose pose the scene estimates is cut, and is drawn between the blades; one that is not
    cut by its pose is there to be touched, where the specimen has it.
    """
    if recipe.specimen is None or recipe.scene.plate_pose == "estimated":
        return None
    return touched_plate(recipe.specimen)


def touched_plate(name: str) -> SimPose | None:
    """Where a specimen's file has the plate that the blade's tip touches; None without one.

    By code that the virtual rig does not share.
    """
    with specimen_path(name).open("rb") as file:
        plate = tomllib.load(file).get("plate")
    if plate is None:
        return None
    lean = [np.radians(plate.get(f"{angle}_deg", 0.0)) for angle in ("pitch", "yaw", "roll")]
    turned = about(2, lean[0]) @ about(1, lean[1]) @ about(0, lean[2])
    return SimPose(turned @ LEVEL, 1e-3 * np.array(plate["place_mm"]))


def _view_of(
    board: Board,
    rng: np.random.Generator,
    *,
    tilt: float = 0.15,
    nearness: float = 0.85,
    aside: tuple[float, float] = (0.0, 0.0),
) -> SimPose:
    """SimPose of a target before the camera; at ``nearness`` 1 it fills the picture.

    ``aside`` shifts the aim from the target's centre, in its widths and heights.
    """
    lens = SIM_LENS
    fills = max(board.width_m / lens.width, board.height_m / lens.height) * lens.focal_px
    return SimPose.looking_at(
        ((0.5 + aside[0]) * board.width_m, (0.5 + aside[1]) * board.height_m),
        1.12 * fills / nearness,
        tilt=float(rng.uniform(0.3, 1.0) * tilt),
        azimuth=float(rng.uniform(0.0, 2.0 * math.pi)),
        turn=float(rng.normal(0.0, 0.05)),
    )


def _write(layers: Sequence[PaintLayer], rng: np.random.Generator, path: Path) -> Path:
    looks = replace(_LOOKS, light_slope=0.1)
    path.write_bytes(as_jpeg(render(layers, SIM_LENS, looks, rng), _JPEG_QUALITY))
    return path


def _plate_jpeg(
    scene: PlateScene,
    position: tuple[float, float],
    recipe: "Recipe",
    path: Path,
    seed: int,
) -> bytes:
    rng = np.random.default_rng([seed, 10, *path.name.encode()])
    return as_jpeg(_plate_picture(scene, position, recipe, rng), _JPEG_QUALITY)


def _plate_picture(
    scene: PlateScene,
    position: tuple[float, float],
    recipe: "Recipe",
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    advance_mm, opening_deg = position
    angle = float(np.radians(opening_deg)) / recipe.rig.moving_blades
    return render(scene.layers(PLATE_BOARD, 1e-3 * advance_mm, angle), SIM_LENS, _LOOKS, rng)
