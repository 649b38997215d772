"""One photograph of a blade on the mat, or of open scissors: measured, and then drawn over."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError, check_known
from scissorcal.recipe.priors import BladePriors
from scissorcal.vision.blade.borders import PicturedBlade
from scissorcal.vision.blade.measure import BladeMeasurement, measure_blade
from scissorcal.vision.blade.pair import PairLengths, measure_pair
from scissorcal.vision.blade.scissors import Scissors, find_scissors, lamp_direction, opening_of
from scissorcal.vision.blade.silhouette import LONGEST, EdgeSide, Silhouette, lone_blade, silhouette
from scissorcal.vision.blade.view import PlainView, View, see_mat
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.overlay import Canvas
from scissorcal.vision.photo import Photo, Picture, as_photo
from scissorcal.vision.targets.sides import linear_light

LARGEST = 1600
"""Pixels along the longer side of a picture."""

OUTLINE, END, EDGE, ARROW, NICK, PIVOT, AXIS = (
    (60, 140, 255),
    (255, 120, 200),
    (80, 220, 60),
    (220, 60, 220),
    (40, 40, 240),
    (240, 200, 0),
    (230, 230, 60),
)

_MARGIN = 0.12
_MOST_ARROWS = 120
_ARROW_PX = 30.0


class NickMark(NamedTuple):
    """A nick to be shown: where along the edge, and what to write beside it."""

    station: float
    text: str


@dataclass(frozen=True)
class BladePhoto:
    """The result of one photograph: the mapping to the sheet, the outline, the blades' edges.

    ``scissors`` is None where a blade lies alone. ``measured`` has one row for a blade alone, two
    for open scissors (the one whose tip is farther from the handles first), none for closed ones.
    ``lengths`` are those of a pair against each other, ``lamp_deg`` where its shadow falls.
    """

    photo: Photo
    view: View
    outline: Silhouette
    measured: tuple[BladeMeasurement, ...]
    scissors: Scissors | None = None
    lengths: PairLengths | None = None
    lamp_deg: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the measured blades: "blade" alone, else "left" and "right".

        Left and right are as seen from the handles, the same in every photograph as long as the
        scissors are not turned over.
        """
        if len(self.measured) != 2:
            return ("blade",) * len(self.measured)
        first, second = (measured.parts.axis for measured in self.measured)
        # y runs down on the sheet, so that a positive turn is clockwise: to the right
        turn = float(first[0] * second[1] - first[1] * second[0])
        return ("left", "right") if turn > 0 else ("right", "left")

    def sentence(self) -> str:
        """What was measured, in one line."""
        name = self.photo.source
        if self.scissors is not None and not self.measured:
            return f"{name}: closed scissors; their edges hide each other"
        parts = []
        for measurement in self.measured:
            length = (
                f"{1e3 * measurement.length:.2f} mm"
                if measurement.metric
                else f"{measurement.length:.0f} px"
            )
            blur = measurement.edge.blur_px
            parts.append(
                f"{length} long, {len(measurement.station)} points, borders {blur:.1f} px soft"
            )
        text = f"{name}: " + "; ".join(parts)
        if self.scissors is not None:
            text += f"; open by {np.degrees(self.scissors.opening):.1f} deg"
        if self.lamp_deg is not None:
            text += f"; shadow towards {self.lamp_deg:.0f} deg from between the tips"
        return text


def by_blade(photos: Sequence[BladePhoto]) -> dict[str, list[BladeMeasurement]]:
    """Measurements of all photographs by blade's name, in alphabetical order."""
    measurements: dict[str, list[BladeMeasurement]] = {}
    for photo in photos:
        for name, measured in zip(photo.names, photo.measured, strict=True):
            measurements.setdefault(name, []).append(measured)
    return dict(sorted(measurements.items()))


@dataclass(frozen=True)
class BladeLayout:
    """How blades were laid down for a photograph.

    ``both``: open scissors in place of one blade. ``mat``: on the printed blade mat; without it,
    ``m_per_px`` (metres to a pixel of the whole photograph) gives the size. ``edge_side``: the
    mat's rim that the edge faces, "down" or "up". ``pivot_px``: the pivot in the picture (column,
    row), where no hole shows it.
    """

    both: bool = False
    mat: bool = True
    edge_side: EdgeSide = "down"
    m_per_px: float | None = None
    pivot_px: tuple[float, float] | None = None


def measure_edge(
    picture: Photo | Picture,
    camera: Camera | None = None,
    layout: BladeLayout = BladeLayout(),
    priors: BladePriors = BladePriors(),
) -> BladePhoto:
    """Measure the edge of a blade, or of both blades of open scissors, in one photograph.

    ``picture`` is a photograph that was read, or an array of eight bits, grey (rows, columns) or
    blue-green-red (rows, columns, 3). ``measured`` of the result has a `BladeMeasurement` for each
    blade, none for closed scissors; `scissorcal.calibration.fit_blade` fits those of several
    photographs together. Pixels become metres by the printed mat: by its pose before ``camera``,
    without one by a homography, which is less certain. Without the mat no camera is used.

    Raises UnknownNameError where the layout's side is none, InputError where the layout is at odds
    with itself, the array is no picture, the camera was fitted at another size, or the photograph
    cannot be used: no mat, no blade or several, blur, glare.

    A rendered blade whose centreline is its x axis; nearly all of its edge is within two standard
    deviations:

    >>> import numpy as np
    >>> from scissorcal.vision import (
    ...     BLADE_MAT, BladeShape, Camera, Lens, Looks, SimPose, blade_layer, render, target_layers,
    ... )
    >>> camera = Camera(900.0, 900.0, 499.5, 374.5, (0.0,) * 5, 1000, 750)
    >>> lens = Lens(900.0, (499.5, 374.5), 1000, 750)
    >>> pose = SimPose.looking_at((0.126, 0.09), 0.275, tilt=0.1)
    >>> blade = BladeShape(length_m=0.075, taper_rad=0.035, back_slope=-np.tan(0.035))
    >>> layers = [*target_layers(BLADE_MAT, pose), blade_layer(blade, pose, (0.062, 0.0885))]
    >>> picture = render(layers, lens, Looks(), np.random.default_rng(0))
    >>> (edge,) = measure_edge(picture, camera).measured
    >>> off = edge.offset - blade.edge_at(edge.station)
    >>> bool(np.mean(np.abs(off) < 2.0 * edge.total_sd) > 0.9)
    True
    """
    _check_layout(layout)
    measure = photograph_scissors if layout.both else photograph_blade
    return measure(as_photo(picture), camera, layout, priors)


def _check_layout(layout: BladeLayout) -> None:
    """UnknownNameError or InputError where a layout is at odds with itself."""
    check_known("side of the mat", layout.edge_side, ("down", "up"))
    if not layout.mat and not layout.both:
        raise InputError(
            "A blade alone is measured on the mat: leave mat=False out, or state both=True where "
            "the photograph shows open scissors."
        )
    if layout.m_per_px is not None:
        if layout.mat:
            raise InputError("The mat gives the scale: leave m_per_px out, or state mat=False.")
        if not 0.0 < layout.m_per_px < 1.0:
            raise InputError(
                f"m_per_px = {layout.m_per_px:g} is no size of a pixel: state metres to a pixel, "
                "such as 1e-4."
            )
    if layout.pivot_px is not None and layout.both:
        raise InputError("Open scissors show their own pivot: leave pivot_px out.")


def photograph_blade(
    photo: Photo,
    camera: Camera | None = None,
    layout: BladeLayout = BladeLayout(),
    priors: BladePriors = BladePriors(),
) -> BladePhoto:
    """Measure one blade on the mat.

    The pivot is where ``layout`` has it, in the whole photograph's pixels, else in the blade's
    hole. Raises InputError where the photograph cannot be used, saying what is wrong with it.
    """
    view = see_mat(photo, camera, priors)
    light = linear_light(photo.grey)
    outline = silhouette(light, view, photo.source)
    pivot, sd = None, 0.0
    if layout.pivot_px is not None:
        beside = (layout.pivot_px[0] + 1.0, layout.pivot_px[1])
        there = view.to_sheet(photo.within([layout.pivot_px, beside]))
        pivot, sd = there[0], priors.pivot_sd_px * float(np.hypot(*(there[1] - there[0])))
    parts = lone_blade(outline, photo.source, layout.edge_side, pivot, sd)
    measured = measure_blade(PicturedBlade(light, view, parts, photo.source), priors)
    return BladePhoto(photo, view, outline, (measured,))


def photograph_scissors(
    photo: Photo,
    camera: Camera | None = None,
    layout: BladeLayout = BladeLayout(),
    priors: BladePriors = BladePriors(),
) -> BladePhoto:
    """Measure both blades of open scissors, on the mat or on any bright sheet.

    Without the mat shapes have no scale, unless ``layout`` states it. The camera should look
    straight down, since its tilt is not corrected. Raises InputError where the photograph shows no
    scissors, or cannot be used.
    """
    light = linear_light(photo.grey)
    if layout.mat:
        view: View = see_mat(photo, camera, priors)
        outline = silhouette(light, view, photo.source)
    else:
        height, width = photo.image.shape[:2]
        scale = layout.m_per_px * photo.reduction if layout.m_per_px else None
        view = PlainView.by_hand(width, height, priors, scale)
        outline = silhouette(light, view, photo.source, longest=min(max(width, height), LONGEST))
    scissors = find_scissors(outline, photo.source, whole=not layout.mat)
    if not scissors.blades:
        return BladePhoto(photo, view, outline, (), scissors)
    view, measured, lengths = measure_pair(light, view, scissors.blades, photo.source, priors)
    first, second = (measurement.parts for measurement in measured)
    scissors = replace(scissors, blades=(first, second), opening=opening_of(first, second))
    lamp = lamp_direction(outline, scissors)
    return BladePhoto(photo, view, outline, measured, scissors, lengths, lamp)


def blade_picture(
    photo: BladePhoto,
    edges: Sequence[Callable[[Array], Array]],
    nicks: Sequence[Sequence[NickMark]],
) -> Picture:
    """Draw a measurement over its photograph: bytes (rows, columns, 3), BGR.

    The segmented outline (orange), each blade's back and the end of its metal (violet), its points
    of the edge, the fitted edge (green) as ``edges`` gives e(s), the enlarged residuals as arrows,
    the nicks (red), the pivot and the centreline. Cropped to what matters and enlarged or reduced
    to `LARGEST` pixels.
    """
    borders = [
        photo.view.to_pixels(border) for border in (photo.outline.outer, *photo.outline.others)
    ]
    left, top, right, bottom = _frame(photo, borders)
    part = photo.photo.image[top:bottom, left:right]
    canvas = Canvas(part, min(LARGEST / max(part.shape[:2]), 4.0), (left, top))
    for border in borders:
        canvas.line(border, OUTLINE, closed=True)
    factor = 0.0
    for measured, edge, marks in zip(photo.measured, edges, nicks, strict=True):
        factor = max(factor, _blade(canvas, photo.view, measured, edge, marks))
    words = [photo.photo.source]
    if factor:
        words.append(f"residuals x {factor:.0f}")
    canvas.title("   ".join(words))
    return canvas.picture


def _blade(
    canvas: Canvas,
    view: View,
    blade: BladeMeasurement,
    edge: Callable[[Array], Array],
    marks: Sequence[NickMark],
) -> float:
    def on_picture(station: Array, offset: Array) -> Array:
        return view.to_pixels(blade.parts.points(station, offset))

    canvas.line(np.array([blade.pivot_px, blade.axis_px]), AXIS)
    if blade.parts.end is not None:
        canvas.line(view.to_pixels(blade.parts.end), END)
    back = blade.back.pixels[np.argsort(blade.parts.frame(view.to_sheet(blade.back.pixels))[:, 0])]
    canvas.line(back, END)
    canvas.cross(blade.pivot_px, PIVOT)
    points = on_picture(blade.station, blade.offset)
    station = np.linspace(blade.station[0], blade.station[-1], 400)
    canvas.line(on_picture(station, edge(station)), EDGE)
    factor = _arrows(canvas, points, on_picture(blade.station, edge(blade.station)))
    for mark in marks:
        here = float(np.interp(mark.station, blade.station, blade.offset))
        place = on_picture(np.array([mark.station]), np.array([here]))[0]
        canvas.ring(place, NICK, 14)
        canvas.words(mark.text, canvas.whole(place) + 18)
    return factor


def _arrows(canvas: Canvas, points: Array, fitted: Array) -> float:
    """Draw residuals from the fitted edge, enlarged; returns the factor."""
    off = points - fitted
    usual = float(np.quantile(np.linalg.norm(off, axis=1), 0.9)) * canvas.scale
    factor = float(np.clip(_ARROW_PX / max(usual, 1e-6), 1.0, 1000.0))
    factor = float(f"{factor:.1g}")
    step = max(len(points) // _MOST_ARROWS, 1)
    longest = 4.0 * _ARROW_PX / canvas.scale / factor
    for base, gap in zip(fitted[::step], off[::step], strict=True):
        size = float(np.linalg.norm(gap))
        shown = gap * min(1.0, longest / max(size, 1e-12)) * factor
        canvas.line(np.array([base, base + shown]), ARROW)
    return factor


def _frame(photo: BladePhoto, borders: Sequence[Array]) -> tuple[int, int, int, int]:
    height, width = photo.photo.image.shape[:2]
    points = [blade.edge.pixels for blade in photo.measured]
    points += [blade.pivot_px[None] for blade in photo.measured]
    corners = np.concatenate([*points, *borders])
    corners = corners[np.isfinite(corners).all(axis=1)]
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = _MARGIN * float((high - low).max())
    left, top = np.maximum(np.floor(low - room).astype(int), 0)
    right, bottom = np.minimum(np.ceil(high + room).astype(int), [width, height])
    return int(left), int(top), int(right), int(bottom)
