"""One photograph of a blade, from the file to its measured edge."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.blade import BladeMeasurement, measure_blade
from scissorcal.vision.blade_parts import EdgeSide, lone_blade
from scissorcal.vision.blade_view import View, see_mat
from scissorcal.vision.camera import Camera
from scissorcal.vision.marker_corners import linear_light
from scissorcal.vision.photo import Photo
from scissorcal.vision.silhouette import Silhouette, silhouette

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BladePhoto:
    """What one photograph shows: how the sheet is seen, the outline, and the blade's edge."""

    photo: Photo
    view: View
    outline: Silhouette
    measured: BladeMeasurement


def photograph_blade(
    photo: Photo,
    camera: Camera | None = None,
    *,
    edge_side: EdgeSide = "down",
    pivot_px: tuple[float, float] | None = None,
    pivot_sd_px: float = 1.0,
) -> BladePhoto:
    """Measure one blade on the mat.

    ``pivot_px`` is the pivot in the picture where no hole shows it, known to ``pivot_sd_px``.
    Raises InputError where the photograph cannot be used, saying what is wrong with it.
    """
    view = see_mat(photo, camera)
    light = linear_light(photo.grey)
    outline = silhouette(light, view, photo.source)
    pivot, sd = None, 0.0
    if pivot_px is not None:
        there = view.to_sheet(np.array([pivot_px, (pivot_px[0] + 1.0, pivot_px[1])]))
        pivot, sd = there[0], pivot_sd_px * float(np.hypot(*(there[1] - there[0])))
    parts = lone_blade(outline, photo.source, edge_side=edge_side, pivot=pivot, pivot_sd=sd)
    return BladePhoto(photo, view, outline, measure_blade(light, view, parts, photo.source))
