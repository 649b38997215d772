"""A blade in one photograph: its edge to a fraction of a pixel, and what makes it uncertain."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.vision.blade_parts import BACK_FIRST, BACK_LAST, FIRST, LAST, BladeParts
from scissorcal.vision.blade_view import View
from scissorcal.vision.profile import Crossings, Light, crossings, steepest

Array = NDArray[np.float64]

TONE_SHARE = 0.12
"""By how much of its blur a border may seem shifted, since a camera's curve is not quite sRGB's."""

GRAIN_SHARE = 0.5
"""Which part of a crossing's noise neighbours share: brushed metal's streaks run along the edge."""

_MOST_POINTS = 3000
_SHADOW_SEARCH = 0.05
_LEAST_GOOD = {"edge": 0.6, "back": 0.3}
_LEAST_IN_SHADOW = 0.4
_MOST_BLUR_PX, _MOST_BLUR_SHARE = 8.0, 0.15


@dataclass(frozen=True)
class BorderPoints:
    """Border points of one part in the picture: ``pixels`` (n, 2), unit ``normals`` (n, 2) outward.

    ``sd_px`` (n,) is how well each is known along its normal.
    """

    pixels: Array
    normals: Array
    sd_px: Array
    softness: Array
    blur_px: float
    good_share: float


@dataclass(frozen=True)
class BladeMeasurement:
    """One blade of one photograph.

    ``station``, ``offset`` and ``sd`` (n,) are points of the edge in the blade's frame (sheet
    units: metres, or pixels without a scale), each with the noise of its own; ``modes`` (n, k) are
    what moves them together, each column by one standard deviation: the mapping, the print's
    scale, the pivot, the centreline, the tone of blurred borders, the metal's grain; ``mode_names``
    say which. ``softness`` (n,) is the blur of each point against the usual one. ``pivot_px`` and
    ``axis_px`` are for pictures.
    """

    source: str
    station: Array
    offset: Array
    sd: Array
    softness: Array
    modes: Array
    mode_names: tuple[str, ...]
    length: float
    hole_radius: float
    parts: BladeParts
    edge: BorderPoints
    metric: bool
    uncertainty: str
    pivot_px: Array
    axis_px: Array


def measure_blade(
    light: Light, view: View, parts: BladeParts, source: str, *, search: float = 0.035
) -> BladeMeasurement:
    """Measure a blade whose parts are roughly known, in the photograph's own pixels.

    Nothing is resampled: borders are crossed in the picture and their places taken to the sheet.
    What each source of error does to the edge is found by moving that source and measuring again.
    ``search`` is how far from the rough outline a border may lie, in blade lengths.
    Raises InputError where the picture is too blurred or too much of the edge is hidden.
    """
    edge = _border(light, view, parts, parts.edge, FIRST, LAST, source, "edge", search)
    back = _border(light, view, parts, parts.back, BACK_FIRST, BACK_LAST, source, "back", search)
    hole = _hole(light, view, parts)
    scene = _Scene(view, parts, edge, back, hole)
    place = scene.place()
    columns, names = _modes(scene, place)
    slope = np.gradient(place.offset, place.station)
    length = float(place.length)
    keep = (place.station > 0.0) & np.isfinite(slope)
    centre = view.to_pixels((place.pivot)[None])[0]
    ahead = view.to_pixels((place.pivot + 0.5 * length * place.axis)[None])[0]
    return BladeMeasurement(
        source,
        place.station[keep],
        place.offset[keep],
        place.sd[keep],
        edge.softness[place.order][keep],
        columns[keep],
        names,
        length,
        place.radius,
        replace(parts, pivot=place.pivot, axis=place.axis, up=place.up, length=length),
        edge,
        view.metric,
        view.uncertainty,
        centre,
        ahead,
    )


@dataclass(frozen=True)
class _Scene:
    """All that was seen of a blade; `place` turns it into a blade frame and an edge in it."""

    view: View
    parts: BladeParts
    edge: BorderPoints
    back: BorderPoints
    hole: BorderPoints | None
    pivot_shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    grown_px: float = 0.0
    grain: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    values: Array | None = None

    def place(self) -> "_Place":
        along = np.linspace(-1.0, 1.0, len(self.edge.pixels))
        level, ramp, bow, behind = self.grain
        edge = self._on_sheet(self.edge, level + ramp * along + bow * (3.0 * along**2 - 1.0) / 2.0)
        back = self._on_sheet(self.back, behind)
        if self.hole is None:
            pivot, radius = self._moved_pivot(), 0.0
        else:
            pivot, radius = _circle(self._on_sheet(self.hole))
        pivot = pivot + np.asarray(self.pivot_shift)
        axis, up = self.parts.axis, self.parts.up
        for _ in range(3):
            axis, up = _halved(edge, back, pivot, axis, up, self.parts.length)
        axis, up = _turned(axis, up, self.turn)
        away = edge - pivot
        station, offset = away @ axis, away @ up
        order = np.argsort(station)
        sd = self._sd(edge, up)
        tip = float(self.parts.length + (self.parts.pivot - pivot) @ axis)
        return _Place(station[order], offset[order], sd[order], pivot, axis, up, radius, tip, order)

    def _on_sheet(self, border: BorderPoints, drift: Array | float = 0.0) -> Array:
        out = np.broadcast_to(self.grown_px + np.asarray(drift), len(border.pixels))
        return self.view.to_sheet(border.pixels + out[:, None] * border.normals, self.values)

    def _moved_pivot(self) -> Array:
        if self.values is None:
            return self.parts.pivot
        seen = self.view.to_pixels(self.parts.pivot[None])
        return np.asarray(self.view.to_sheet(seen, self.values)[0])

    def _sd(self, edge: Array, up: Array) -> Array:
        """Noise along ``up`` in sheet units, from that along the normals in pixels."""
        moved = self.view.to_sheet(self.edge.pixels + self.edge.normals, self.values)
        return np.asarray(np.abs((moved - edge) @ up) * self.edge.sd_px)


@dataclass(frozen=True)
class _Place:
    station: Array
    offset: Array
    sd: Array
    pivot: Array
    axis: Array
    up: Array
    radius: float
    length: float
    order: NDArray[np.int64]


def _modes(scene: _Scene, place: _Place) -> tuple[Array, tuple[str, ...]]:
    """What one standard deviation of each shared source of error does to the edge, (n, k)."""
    rows: list[Array] = []
    names: list[str] = []

    def add(name: str, changed: _Scene, factor: float = 1.0) -> None:
        there = changed.place()
        moved = np.interp(place.station, there.station, there.offset)
        rows.append((moved - place.offset) * factor)
        names.append(name)

    for name, values in _mapping_modes(scene.view):
        add(name, replace(scene, values=values))
    shared = TONE_SHARE * scene.edge.blur_px
    add("tone", replace(scene, grown_px=shared))
    rough = GRAIN_SHARE * float(np.median(scene.edge.sd_px))
    behind = GRAIN_SHARE * float(np.median(scene.back.sd_px))
    for index, size in enumerate((rough, rough, rough, behind)):
        drift = [0.0, 0.0, 0.0, 0.0]
        drift[index] = size
        add("grain", replace(scene, grain=(drift[0], drift[1], drift[2], drift[3])))
    for row in _pivot_modes(scene, place):
        add("pivot", replace(scene, pivot_shift=(float(row[0]), float(row[1]))))
    add("centreline", replace(scene, turn=_turn_sd(scene, place)))
    return np.stack(rows, axis=1), tuple(names)


def _mapping_modes(view: View) -> list[tuple[str, Array]]:
    """Values of the mapping moved by one standard deviation of each of its independent errors.

    Those shared by all photographs come first, and take with them what follows from them.
    """
    count = len(view.values)
    order = np.r_[count - view.shared : count, 0 : count - view.shared]
    covariance = view.covariance[np.ix_(order, order)]
    scale = np.sqrt(np.diag(covariance))
    used = np.flatnonzero(scale > 0.0)
    if not len(used):
        return []
    size = scale[used]
    correlation = covariance[np.ix_(used, used)] / np.outer(size, size)
    root = size[:, None] * np.linalg.cholesky(correlation + 1e-9 * np.eye(len(used)))
    moved = []
    for column, place in enumerate(used):
        values = view.values.copy()
        values[order[used]] += root[:, column]
        moved.append(("shared mapping" if place < view.shared else "mapping", values))
    return moved


def _pivot_modes(scene: _Scene, place: _Place) -> Array:
    """Two shifts of the pivot, one standard deviation each."""
    if scene.hole is None:
        return np.eye(2) * scene.parts.pivot_sd
    there = scene._on_sheet(scene.hole)
    away = there - place.pivot
    radial = away / np.linalg.norm(away, axis=1, keepdims=True)
    off = np.linalg.norm(away, axis=1) - place.radius
    # neighbours along a small circle share their pixels: about one in four says something new
    spread = float(np.sqrt(np.mean(off**2)))
    information = radial.T @ radial / 4.0
    moved = scene.view.to_sheet(scene.hole.pixels + scene.hole.normals, scene.values) - there
    pixel = float(np.median(np.linalg.norm(moved, axis=1)))
    grain = GRAIN_SHARE * float(np.median(scene.hole.sd_px)) * pixel
    covariance = np.linalg.inv(information) * spread**2 + grain**2 * np.eye(2)
    return np.asarray(np.linalg.cholesky(covariance)).T


def _turn_sd(scene: _Scene, place: _Place) -> float:
    """How well the middle between edge and back fixes the axis, in radians."""
    view = scene.view
    back = view.to_sheet(scene.back.pixels)
    s, e = (back - place.pivot) @ place.axis, (back - place.pivot) @ place.up
    design = np.stack([np.ones_like(s), s, s**2, s**3], axis=1)
    off = e - design @ np.linalg.lstsq(design, e, rcond=None)[0]
    spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    stretch = 20.0 * float(np.median(np.abs(np.diff(s))) + 1e-12)
    independent = max(float(np.ptp(s)) / max(stretch, 1e-12), 2.0)
    return float(0.5 * spread / np.sqrt(independent * np.mean(s**2)))


def _halved(
    edge: Array, back: Array, pivot: Array, axis: Array, up: Array, length: float
) -> tuple[Array, Array]:
    along = np.linspace(BACK_FIRST, BACK_LAST, 201) * length
    middle = np.zeros_like(along)
    for side in (edge, back):
        away = side - pivot
        middle += 0.5 * _smooth(away @ axis, away @ up, along)
    return _turned(axis, up, float(np.sum(middle * along) / np.sum(along**2)))


def _smooth(station: Array, offset: Array, along: Array) -> Array:
    """A side of the blade, by medians of stretches: neither nicks nor glare should turn it."""
    cells = np.linspace(along[0], along[-1], 31)
    index = np.digitize(station, cells) - 1
    middles, medians = [], []
    for cell in range(30):
        here = index == cell
        if here.sum() >= 2:
            middles.append(float(np.median(station[here])))
            medians.append(float(np.median(offset[here])))
    return np.asarray(np.interp(along, middles, medians))


def _turned(axis: Array, up: Array, angle: float) -> tuple[Array, Array]:
    c, s = np.cos(angle), np.sin(angle)
    return c * axis + s * up, c * up - s * axis


def _border(
    light: Light,
    view: View,
    parts: BladeParts,
    side: Array,
    first: float,
    last: float,
    source: str,
    what: str,
    search: float,
) -> BorderPoints:
    """Cross one side of a blade in the picture, about once every pixel."""
    frame = parts.frame(side)
    there = (frame[:, 0] > first * parts.length) & (frame[:, 0] < last * parts.length)
    if there.sum() < 20:
        raise InputError(f"{source}: too little of the blade's {what} can be seen.")
    s, e = _thinned(frame[there])
    rough = _in_pixels(view, parts, s, e)
    count = int(np.clip(np.sum(np.linalg.norm(np.diff(rough, axis=0), axis=1)), 60, _MOST_POINTS))
    stations = np.linspace(s[0], s[-1], count)
    per_unit = count / max(s[-1] - s[0], 1e-12)
    offsets = np.interp(stations, s, e)
    outward = np.sign(np.median(e))
    shadowed = what == "edge" and search > _SHADOW_SEARCH
    for soft, far in ((1.2 if shadowed else 2.0, search), (1.5, 0.012)):
        points, normals = _with_normals(view, parts, stations, offsets, outward)
        reach = float(np.clip(far * parts.length * per_unit, 6.0, 80.0))
        shift = steepest(light, points, normals, reach, soft, innermost=shadowed and far == search)
        offsets = offsets + outward * shift / per_unit
    points, normals = _with_normals(view, parts, stations, offsets, outward)
    found = crossings(light, points, normals, 6.0)
    blur = float(np.median(found.blur[found.good])) if found.good.any() else np.inf
    if blur > 1.6:
        found = crossings(light, points, normals, float(np.clip(4.0 * blur, 6.0, 30.0)))
        blur = float(np.median(found.blur[found.good])) if found.good.any() else np.inf
    good = found.good & _alike(found)
    share = float(good.mean())
    _refuse_blur(blur, per_unit, parts, source)
    if share < (_LEAST_IN_SHADOW if shadowed else _LEAST_GOOD[what]):
        raise InputError(
            f"{source}: only {100 * share:.0f} % of the blade's {what} shows a clear border: a "
            "mirror's glare, a shadow or dirt hides the rest. Turn the blade or the lamp so that "
            "the metal looks darker than the sheet."
        )
    seen = points + normals * found.place[:, None]
    return BorderPoints(
        seen[good], normals[good], found.sd[good], found.blur[good] / blur, blur, share
    )


def _refuse_blur(blur: float, per_unit: float, parts: BladeParts, source: str) -> None:
    width = float(np.median(np.abs(parts.frame(parts.edge)[:, 1]))) * per_unit
    if not blur < max(_MOST_BLUR_PX, _MOST_BLUR_SHARE * width):
        raise InputError(
            f"{source} is too blurred: borders are {blur:.1f} pixels soft. Hold the camera still, "
            "focus on the blade, and try again."
        )


def _alike(found: Crossings) -> NDArray[np.bool_]:
    """Crossings whose blur and contrast are like those of most."""
    contrast = found.outer - found.inner
    usual = np.median(contrast[found.good]) if found.good.any() else 0.0
    blur = np.median(found.blur[found.good]) if found.good.any() else 1.0
    return np.asarray(
        (contrast * np.sign(usual) > 0.25 * abs(usual))
        & (found.blur < 1.8 * blur + 0.2)
        & (found.blur > 0.4 * blur - 0.3)
    )


def _hole(light: Light, view: View, parts: BladeParts) -> BorderPoints | None:
    if not len(parts.hole):
        return None
    middle = parts.hole.mean(axis=0)
    radius = float(np.linalg.norm(parts.hole - middle, axis=1).mean())
    turn = np.linspace(0.0, 2.0 * np.pi, 181)[:-1]
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    for _ in range(2):
        points = view.to_pixels(middle + radius * ring)
        inward = view.to_pixels(middle + 0.98 * radius * ring) - points
        size = float(np.median(np.linalg.norm(points - points.mean(axis=0), axis=1)))
        normals = inward / np.linalg.norm(inward, axis=1, keepdims=True)
        found = crossings(light, points, normals, float(np.clip(0.6 * size, 3.0, 12.0)))
        if found.good.sum() < 60:
            return None
        seen = points + normals * found.place[:, None]
        middle, radius = _circle(view.to_sheet(seen[found.good]))
        off = np.abs(np.linalg.norm(view.to_sheet(seen) - middle, axis=1) - radius)
        sure = found.good & (off < 4.0 * 1.4826 * np.median(off[found.good]) + 1e-12)
        middle, radius = _circle(view.to_sheet(seen[sure]))
    return BorderPoints(
        seen[sure],
        normals[sure],
        found.sd[sure],
        np.ones(int(sure.sum())),
        float(np.median(found.blur[sure])),
        1.0,
    )


def _circle(points: Array) -> tuple[Array, float]:
    """Least-squares circle: algebraic start, then Gauss-Newton on the distances."""
    middle = points.mean(axis=0)
    away = points - middle
    design = np.column_stack([2.0 * away, np.ones(len(away))])
    a, b, c = np.linalg.lstsq(design, np.sum(away**2, axis=1), rcond=None)[0]
    centre, radius = np.array([a, b]), float(np.sqrt(max(c + a * a + b * b, 0.0)))
    for _ in range(10):
        out = away - centre
        distance = np.linalg.norm(out, axis=1)
        J = np.column_stack([-out / distance[:, None], -np.ones(len(out))])
        step = np.linalg.lstsq(J, -(distance - radius), rcond=None)[0]
        centre, radius = centre + step[:2], radius + float(step[2])
    return middle + centre, radius


def _thinned(frame: Array) -> tuple[Array, Array]:
    """One offset per station, smoothed over a few flat pixels."""
    order = np.argsort(frame[:, 0])
    s, e = frame[order, 0], frame[order, 1]
    cells = np.linspace(s[0], s[-1], max(len(s) // 4, 10))
    index = np.digitize(s, cells)
    kept = [(s[index == k].mean(), np.median(e[index == k])) for k in np.unique(index)]
    thin = np.array(kept)
    return thin[:, 0], _median_filtered(thin[:, 1], 5)


def _median_filtered(values: Array, width: int) -> Array:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=width, mode="nearest"))


def _in_pixels(view: View, parts: BladeParts, s: Array, e: Array) -> Array:
    return view.to_pixels(parts.pivot + s[:, None] * parts.axis + e[:, None] * parts.up)


def _with_normals(
    view: View, parts: BladeParts, s: Array, e: Array, outward: float
) -> tuple[Array, Array]:
    """Points in the picture and unit normals there that lead out of the blade."""
    from scipy.ndimage import gaussian_filter1d

    smooth = gaussian_filter1d(e, 8.0, mode="nearest")
    points = _in_pixels(view, parts, s, e)
    line = _in_pixels(view, parts, s, smooth)
    along = np.gradient(line, axis=0)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    step = outward * 0.01 * parts.length
    leads = _in_pixels(view, parts, s, smooth + step) - line
    return points, normals * np.sign(np.sum(leads * normals, axis=1))[:, None]
