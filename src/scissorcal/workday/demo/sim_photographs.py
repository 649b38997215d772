"""The virtual blade that ``--camera sim`` photographs: the shape of the recipe's specimen."""

import math
from typing import TYPE_CHECKING

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.sim import BladeShape


def specimen_blade(recipe: "Recipe") -> "BladeShape":
    """Shape of the specimen's blade. Raises InputError where the recipe names no specimen."""
    from scissorcal.device.sim.specimen import load_specimen
    from scissorcal.vision.sim import BladeShape

    if recipe.specimen is None:
        raise InputError(
            f'The recipe "{recipe.name}" names no specimen, so there is no virtual blade to '
            'photograph: add specimen = "...", or give photographs with --image.'
        )
    blade = load_specimen(recipe.specimen).blade
    if blade.wave_mm is not None:
        raise InputError(
            f'The blade of the specimen "{recipe.specimen}" has a wave (blade.wave_mm), and the '
            "virtual camera draws lines and arcs only: take it out, or give photographs with "
            "--image."
        )
    taper = math.radians(blade.taper_deg)
    return BladeShape(
        length_m=1e-3 * blade.length_mm,
        offset_m=1e-3 * blade.offset_mm,
        taper_rad=taper,
        curvature_per_m=blade.curvature_per_m,
        back_m=-1e-3 * blade.offset_mm,
        back_slope=-math.tan(taper),
    )
