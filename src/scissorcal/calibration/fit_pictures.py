"""Pictures that are drawn for the fits of photographs."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.camera.bundle import SeenBoard, seen
from scissorcal.calibration.camera.result import CameraFit, PixelMap, ViewError
from scissorcal.calibration.edge.result import BladeFit
from scissorcal.files import replacing
from scissorcal.vision.blade.photo import BladePhoto, NickMark, blade_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_ARROW_SHARE = 0.02


def left_over(fit: CameraFit, view: ViewError, board: SeenBoard) -> Array:
    """Seen minus predicted pixels (n, 2) of one photograph."""
    shared = np.append(fit.camera.parameters, 1e-3 * np.asarray(fit.bulge_mm))
    predicted, _, _ = seen(board, np.asarray(view.pose), shared)
    return np.asarray(board.pixels - predicted)


def residual_chart(fit: CameraFit, boards: Sequence[SeenBoard], path: Path) -> Path:
    """Draw all corners' residuals where they stand in the picture, with a scale."""
    pixels = np.concatenate([board.pixels for board in boards])
    residuals = np.concatenate(
        [left_over(fit, view, board) for view, board in zip(fit.views, boards, strict=True)]
    )
    figure, axes = _frame(fit, 1)
    middle = float(np.median(np.linalg.norm(residuals, axis=1)))
    magnified = _ARROW_SHARE * fit.camera.width / max(middle, 1e-3)
    arrows = axes[0].quiver(
        *pixels.T,
        *residuals.T,
        angles="xy",
        scale_units="xy",
        scale=1.0 / magnified,
        width=0.0012,
        color="tab:blue",
    )
    axes[0].quiverkey(arrows, 0.88, 1.03, middle, f"{middle:.2f} px", labelpos="E")
    closed = np.vstack([fit.region, fit.region[:1]])
    axes[0].plot(*closed.T, color="tab:gray", linewidth=0.8, linestyle="--")
    axes[0].set_title(
        f"seen minus predicted, {len(pixels)} corners in {len(boards)} photographs", loc="left"
    )
    return _saved(figure, path)


def uncertainty_chart(fit: CameraFit, path: Path) -> Path:
    """Draw maps of the projection's standard deviation and of two halves' difference."""
    places = fit.pixel_map
    assert places is not None
    maps = [("standard deviation of a projected point", places.sd_px)]
    if places.difference_px is not None:
        maps.append(("difference of two halves", places.difference_px))
    figure, axes = _frame(fit, len(maps))
    highest = max(float(np.nanmax(values)) for _, values in maps)
    closed = np.vstack([fit.region, fit.region[:1]])
    for axis, (title, values) in zip(axes, maps, strict=True):
        _draw_map(figure, axis, places, values, highest)
        axis.plot(*closed.T, color="black", linewidth=1.0, linestyle="--")
        axis.set_title(f"{title} [px]", loc="left")
    return _saved(figure, path)


def _draw_map(
    figure: "Figure", axis: "Axes", places: PixelMap, values: Array, highest: float
) -> None:
    from matplotlib.colors import LogNorm

    low = 0.01
    norm = LogNorm(low, max(highest, 2.0 * low))
    drawn = axis.pcolormesh(
        places.x, places.y, np.clip(values, low, None), norm=norm, cmap="viridis", shading="nearest"
    )
    bar = figure.colorbar(drawn, ax=axis, shrink=0.8)
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    bar.ax.yaxis.set_minor_formatter(lambda _value, _: "")


def _frame(fit: CameraFit, count: int) -> tuple["Figure", Any]:
    from matplotlib.figure import Figure

    camera = fit.camera
    wide = 8.0 if count == 1 else 6.0
    figure = Figure(
        figsize=(wide * count, wide * camera.height / camera.width + 0.8), layout="constrained"
    )
    axes = figure.subplots(1, count, squeeze=False)[0]
    for axis in axes:
        axis.set_xlim(0, camera.width)
        axis.set_ylim(camera.height, 0)
        axis.set_aspect("equal")
        axis.set_xlabel("pixels")
    return figure, axes


def _saved(figure: "Figure", path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        figure.savefig(part, format="png", dpi=110)
    return path


def edge_picture(photo: BladePhoto, fits: Mapping[str, BladeFit]) -> NDArray[np.uint8]:
    """Draw fitted edges over a photograph; ``fits`` by blade's name, as `BladePhoto.names`."""
    edges, marks = [], []
    for name, measured in zip(photo.names, photo.measured, strict=True):
        fit = fits[name]
        unit = measured.length / fit.edge_posterior.edge.length_m if not measured.metric else 1.0
        edges.append(_scaled_edge(fit, unit))
        marks.append(
            [
                NickMark(nick.station_m * unit, _nick_words(nick.depth_m, fit.metric))
                for nick in fit.nicks
            ]
        )
    return blade_picture(photo, edges, marks)


def _scaled_edge(fit: BladeFit, unit: float) -> Callable[[Array], Array]:
    edge = fit.edge_posterior.edge
    return lambda station: edge.offset_at(station / unit) * unit


def _nick_words(depth: float, metric: bool) -> str:
    return f"nick {1e3 * depth:.2f} mm" if metric else f"nick {100 * depth:.1f} %"
