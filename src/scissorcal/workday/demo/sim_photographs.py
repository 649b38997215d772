"""Photographs for ``--camera sim``: the recipe's virtual blade and targets, rendered."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.sim import BladeShape, Layer, Lens, Pose
    from scissorcal.vision.targets.boards import Board

QUALITY = 92
PHOTOGRAPHS = 3
_CORNERS = ((0.4, 0.35), (-0.4, 0.35), (0.4, -0.35), (-0.4, -0.35))


def sim_lens() -> "Lens":
    """The one lens of every rendered photograph."""
    from scissorcal.vision.sim import Lens

    return Lens(1900.0, (1003.2, 744.9), 2000, 1500, (-0.08, 0.03, 4e-4, -3e-4, 0.0))


def render_blade_photographs(
    recipe: "Recipe", folder: Path, seed: int, *, count: int = PHOTOGRAPHS, both: bool = False
) -> tuple[Path, ...]:
    """Render photographs of the specimen's blade on the mat into a folder; their files.

    With ``both`` they show open scissors. Raises InputError where the recipe names no specimen.
    """
    from scissorcal.vision.sim import blade_layer, scissors_layers, target_layers
    from scissorcal.vision.targets.boards import BLADE_MAT, MAT_PIVOT_M

    shape = _shape(recipe)
    paths = []
    for number in range(count):
        rng = np.random.default_rng([seed, 7, number])
        pose = _before(BLADE_MAT, rng)
        turn = float(rng.normal(0.0, 0.05))
        look: dict[str, Any] = {
            "shadow": 0.25,
            "shadow_m": (-0.0006, 0.0009),
            "shading": (0.15, 0.2),
        }
        if both:
            opening = float(rng.uniform(0.5, 0.9))
            middle = (0.1, 0.09)
            things = scissors_layers(shape, shape, opening, pose, middle, turn, **look)
        else:
            things = [blade_layer(shape, pose, MAT_PIVOT_M, turn, **look)]
        paths.append(
            _taken(
                [*target_layers(BLADE_MAT, pose), *things], rng, folder, f"blade-{number + 1:02d}"
            )
        )
    return tuple(paths)


def render_board_photographs(
    board: "Board", folder: Path, seed: int, name: str, *, count: int = 15
) -> tuple[Path, ...]:
    """Render photographs of one target from many sides into a folder; their files.

    Every other one has the target in a corner of the picture, where lenses bend most.
    """
    from scissorcal.vision.sim import target_layers

    paths = []
    for number in range(count):
        rng = np.random.default_rng([seed, 8, number])
        tilted = 0.6 if number else 0.05
        near = float(rng.uniform(0.55, 1.0))
        aside = _CORNERS[number // 2 % 4] if number % 2 else (0.0, 0.0)
        pose = _before(board, rng, tilt=tilted, nearness=near, aside=aside)
        paths.append(_taken(target_layers(board, pose), rng, folder, f"{name}-{number + 1:02d}"))
    return tuple(paths)


def _before(
    board: "Board",
    rng: np.random.Generator,
    *,
    tilt: float = 0.15,
    nearness: float = 0.85,
    aside: tuple[float, float] = (0.0, 0.0),
) -> "Pose":
    """A place of the camera before a target: ``nearness`` 1 fills the picture with it.

    ``aside`` says where the camera aims instead of at its middle, in widths and heights of it.
    """
    from scissorcal.vision.sim import Pose

    lens = sim_lens()
    fills = max(board.width_m / lens.width, board.height_m / lens.height) * lens.focal_px
    return Pose.looking_at(
        ((0.5 + aside[0]) * board.width_m, (0.5 + aside[1]) * board.height_m),
        1.12 * fills / nearness,
        tilt=float(rng.uniform(0.3, 1.0) * tilt),
        azimuth=float(rng.uniform(0.0, 2.0 * math.pi)),
        turn=float(rng.normal(0.0, 0.05)),
    )


def _taken(layers: "Sequence[Layer]", rng: np.random.Generator, folder: Path, name: str) -> Path:
    from scissorcal.vision.sim import Looks, as_jpeg, render

    looks = Looks(
        exposure=0.85, defocus_px=0.7, softness_px=0.6, vignetting=0.2, light_slope=0.1, noise=0.008
    )
    path = folder / f"{name}.jpg"
    path.write_bytes(as_jpeg(render(layers, sim_lens(), looks, rng), QUALITY))
    return path


def _shape(recipe: "Recipe") -> "BladeShape":
    from scissorcal.device.sim.specimen import load_specimen
    from scissorcal.vision.sim import BladeShape

    if recipe.specimen is None:
        raise InputError(
            f'The recipe "{recipe.name}" names no specimen, so there is no virtual blade to '
            'photograph: add specimen = "...", or give photographs with --image.'
        )
    blade = load_specimen(recipe.specimen).blade
    taper = math.radians(blade.taper_deg)
    return BladeShape(
        length_m=1e-3 * blade.length_mm,
        offset_m=1e-3 * blade.offset_mm,
        taper_rad=taper,
        curvature_per_m=blade.curvature_per_m,
        back_m=-1e-3 * blade.offset_mm,
        back_slope=-math.tan(taper),
    )
