"""Pictures of a blade's fit: the fitted edge, its residuals and nicks over a photograph."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.edge.result import BladeFit
from scissorcal.vision.blade.photo import BladePhoto, NickMark, blade_picture


def edge_picture(photo: BladePhoto, fits: Mapping[str, BladeFit]) -> NDArray[np.uint8]:
    """Draw fitted edges over a photograph; ``fits`` by blade's name, as `BladePhoto.names`."""
    edges, marks = [], []
    for name, measured in zip(photo.names, photo.measured, strict=True):
        fit = fits[name]
        unit = measured.length / fit.belief.edge.length_m if not measured.metric else 1.0
        edges.append(_scaled_edge(fit, unit))
        marks.append(
            [
                NickMark(nick.station_m * unit, _nick_words(nick.depth_m, fit.metric))
                for nick in fit.nicks
            ]
        )
    return blade_picture(photo, edges, marks)


def _scaled_edge(fit: BladeFit, unit: float) -> Callable[[Array], Array]:
    edge = fit.belief.edge
    return lambda station: edge.offset_at(station / unit) * unit


def _nick_words(depth: float, metric: bool) -> str:
    return f"nick {1e3 * depth:.2f} mm" if metric else f"nick {100 * depth:.1f} %"
