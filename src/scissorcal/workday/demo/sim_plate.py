"""Photographs for ``--camera sim``: a plate with its target, and the card on a moving rig."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.vision.targets.boards import PLATE_BOARD, MarkedBoard
from scissorcal.workday.demo.sim_photographs import QUALITY, sim_lens

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.live import Frame
    from scissorcal.vision.sim import PlateScene

PHOTOGRAPHS = 5
ADVANCES_MM = (0.0, 15.0, 30.0)
OPENINGS_DEG = (8.0, 22.0, 36.0)
FRAMES_PER_S = 10.0


def sim_plate_scene(recipe: "Recipe", seed: int) -> "PlateScene":
    """Give the scene that all rendered photographs of one seed show: what is true of it."""
    from scissorcal.vision.sim import plate_scene

    x, y = (1e-3 * value for value in recipe.plate.place_mm)
    turn = float(np.radians(recipe.plate.turn_deg))
    return plate_scene(np.random.default_rng([seed, 9]), (x, y), turn)


def render_plate_photographs(
    recipe: "Recipe",
    folder: Path,
    seed: int,
    *,
    target: MarkedBoard = PLATE_BOARD,
    count: int = PHOTOGRAPHS,
) -> tuple[Path, ...]:
    """Render photographs of the plate at rest into a folder; their files."""
    scene = sim_plate_scene(recipe, seed)
    return tuple(
        _written(scene, target, (0.0, OPENINGS_DEG[0]), recipe, folder / f"plate-{n:02d}.jpg", seed)
        for n in range(1, count + 1)
    )


def render_card_photographs(
    recipe: "Recipe", folder: Path, seed: int
) -> dict[Path, tuple[float, float]]:
    """Render photographs of the rig's card: files, and where the rig stood (mm, deg) in each."""
    scene = sim_plate_scene(recipe, seed)
    stances = [(advance, opening) for advance in ADVANCES_MM for opening in OPENINGS_DEG]
    return {
        _written(scene, PLATE_BOARD, stance, recipe, folder / f"rig-{n:02d}.jpg", seed): stance
        for n, stance in enumerate(stances, start=1)
    }


def render_frames(recipe: "Recipe", seed: int, count: int) -> Iterator["Frame"]:
    """Render what a camera sees while the plate slides by 0.3 mm a picture along its cut.

    Every eighth picture is black.
    """
    from dataclasses import replace

    from scissorcal.vision.live import Frame
    from scissorcal.vision.sim import Pose

    scene = sim_plate_scene(recipe, seed)
    lies = scene.rig_plate
    for number in range(count):
        slid = lies.shift_m + 3e-4 * number * lies.rotation[:, 0]
        moved = replace(scene, rig_plate=Pose(lies.rotation, slid))
        rng = np.random.default_rng([seed, 11, number])
        image = _photograph(moved, PLATE_BOARD, (0.0, OPENINGS_DEG[0]), recipe, rng)
        if number % 8 == 7:
            image = np.zeros_like(image)
        yield Frame(number, number / FRAMES_PER_S, image, count)


def _written(
    scene: "PlateScene",
    target: MarkedBoard,
    stance: tuple[float, float],
    recipe: "Recipe",
    path: Path,
    seed: int,
) -> Path:
    from scissorcal.vision.sim import as_jpeg

    rng = np.random.default_rng([seed, 10, *path.name.encode()])
    path.write_bytes(as_jpeg(_photograph(scene, target, stance, recipe, rng), QUALITY))
    return path


def _photograph(
    scene: "PlateScene",
    target: MarkedBoard,
    stance: tuple[float, float],
    recipe: "Recipe",
    rng: np.random.Generator,
) -> "NDArray[np.uint8]":
    from scissorcal.vision.sim import Looks, render

    advance_mm, opening_deg = stance
    angle = float(np.radians(opening_deg)) / recipe.rig.moving_blades
    looks = Looks(exposure=0.85, defocus_px=0.7, softness_px=0.6, vignetting=0.2, noise=0.008)
    return render(scene.layers(target, 1e-3 * advance_mm, angle), sim_lens(), looks, rng)
