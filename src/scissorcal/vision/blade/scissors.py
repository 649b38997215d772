"""Handles, blades, pivot and opening angle in the outline of scissors, and their lamp's side."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.vision.blade.silhouette import BACK_LAST, BladeParts, Silhouette

_LEAST_DARK, _MOST_DARK = 0.04, 0.6
_REACH = 0.12
_LEAST_LEAN = 0.2
"""Mean direction of penumbra from the silhouette, from 0 (alike on all sides) to 1, that counts."""


OPEN_FIRST = 0.55
"""Where halving begins on open blades, in shares of the length: a range that is seen at most
openings, so that photographs at different openings have one centreline."""

LEAST_OPENING = 0.12
"""Below this opening (rad) the blades hide each other's edges."""

_APART_SHARE = 0.08
_RING_SHARE = 0.04
_NOTCH_SHARE = 0.08
_CLEAR_OF_CROTCH = 0.06
_TIP_SHARE = 0.03
_SCREW_SHARE = (0.014, 0.055)
_FAINT, _LEAST_CIRCLE = 2.0, 0.5
"""Steepness of light (levels of 170) that is just seen; least score of a circle, over that of a
whole one: a corner of metal or shadow follows half of a circle at most."""

_MOST_PLACES = 30_000
"""Places that one call of OpenCV's remap takes: less than 32768."""

_SCREW_NEAR = 0.10
_PLAIN = 0.8
"""Score of an even disc, such as a rivet, over that of a circle with a slot or a glint inside."""
_GUESS_SD_SHARE = 0.03


@dataclass(frozen=True)
class Scissors:
    """A pair of scissors in a photograph, in sheet units.

    ``blades`` are two where they are open, and none where they are closed, as then each hides the
    other's edge. ``opening`` (rad) is the angle between their centrelines, 0 where closed.
    ``pivot`` (2,) is known to ``pivot_sd``; ``screw`` says whether it is a screw's centre or
    the intersection of the centrelines. ``tips`` (k, 2) and ``rings`` were found too.
    """

    pivot: Array
    pivot_sd: float
    screw: bool
    blades: tuple[BladeParts, ...]
    opening: float
    tips: Array
    rings: tuple[Array, ...]
    length: float


def find_scissors(shape: Silhouette, source: str, *, whole: bool = False) -> Scissors:
    """Find the parts of an outline that should be a pair of scissors.

    Handles have rings, or extend beyond the mat's field, unless ``whole`` scissors must be seen;
    the tips are the ends away from them. Raises InputError where there are several objects, no
    handles (forks have none) or no blades.
    """
    outline = shape.outer
    rings = _rings(shape)
    _refuse_others(shape, source)
    if whole and len(shape.cut_off):
        raise InputError(f"{source}: the border cuts off the object: show whole scissors.")
    if not rings and not len(shape.cut_off):
        raise InputError(
            f"{source}: the object has no handle with a ring and so is not a pair of scissors"
            f"{_prongs(outline)}. Photograph whole scissors, or one blade on the mat."
        )
    handles = (
        np.mean([ring.mean(axis=0) for ring in rings], axis=0)
        if rings
        else shape.cut_off.mean(axis=0)
    )
    away = np.linalg.norm(outline - handles, axis=1)
    first = int(np.argmax(away))
    reach = float(away[first])
    if len(shape.cut_off) and rings:
        raise InputError(f"{source}: the border cuts off the scissors: show all of them.")
    crotch = _crotch(shape, first, rings, reach)
    if crotch is None:
        return _closed(shape, outline[first], handles, rings)
    second, notch = crotch
    return _open(shape, source, (first, second), notch, rings)


def _refuse_others(shape: Silhouette, source: str) -> None:
    """Refuse further objects; a handle that bright metal separates from the rest is near it."""
    size = float(np.ptp(shape.outer, axis=0).max())
    tree = cKDTree(shape.outer)
    away = [float(np.min(tree.query(other)[0])) for other in shape.others]
    if any(distance > _APART_SHARE * size for distance in away):
        raise InputError(
            f"{source}: several objects of like size are on the sheet; one pair of scissors is "
            "expected. Leave one pair."
        )


def _rings(shape: Silhouette) -> tuple[Array, ...]:
    size = float(np.ptp(shape.outer, axis=0).max())
    rings = []
    for hole in shape.holes:
        _, sides, _ = cv2.minAreaRect(hole.astype(np.float32))
        if min(sides) > _RING_SHARE * size:
            rings.append(hole)
    return tuple(rings)


def _prongs(outline: Array) -> str:
    """Count of the prongs between deep notches, as of a fork."""
    deep = [depth for _, _, _, depth in _notches(outline)]
    size = float(np.ptp(outline, axis=0).max())
    count = sum(depth > 0.04 * size for depth in deep)
    return f" ({count + 1} prongs, as of a fork)" if count >= 2 else ""


def _notches(outline: Array) -> list[tuple[int, int, int, float]]:
    """Start, end, deepest point (indices) and depth of an outline's convexity defects."""
    scale = 1e4 / float(np.ptp(outline, axis=0).max())
    whole = np.rint((outline - outline.min(axis=0)) * scale).astype(np.int32)[:, None, :]
    hull = np.sort(cv2.convexHull(whole, returnPoints=False).ravel())[::-1]
    # None where the outline is convex, which OpenCV's types do not say
    defects: Any = cv2.convexityDefects(whole, hull[:, None].astype(np.int32))
    if defects is None:
        return []
    return [
        (int(a), int(b), int(deep), float(depth) / 256.0 / scale)
        for a, b, deep, depth in np.asarray(defects).reshape(-1, 4)
    ]


def _crotch(
    shape: Silhouette, tip: int, rings: tuple[Array, ...], reach: float
) -> tuple[int, int] | None:
    """The other tip and the point between both blades; None where they are closed."""
    outline = shape.outer
    handle = np.concatenate(rings) if rings else np.concatenate([shape.cut_off, shape.cut_off])
    best: tuple[float, int, int] | None = None
    for start, end, deep, depth in _notches(outline):
        if depth < _NOTCH_SHARE * reach:
            continue
        for here, there in ((start, end), (end, start)):
            near = float(np.linalg.norm(outline[here] - outline[tip]))
            if near > 0.12 * reach:
                continue
            by_handle = float(np.linalg.norm(handle - outline[there], axis=1).min())
            away = float(np.linalg.norm(outline[there] - handle.mean(axis=0)))
            if (
                by_handle > 0.15 * reach
                and away > 0.55 * reach
                and (best is None or depth > best[0])
            ):
                best = depth, there, deep
    return None if best is None else (best[1], best[2])


def _open(
    shape: Silhouette,
    source: str,
    tips: tuple[int, int],
    notch: int,
    rings: tuple[Array, ...],
) -> Scissors:
    outline = shape.outer
    crotch = outline[notch]
    sides = [_sides_of(outline, tip, notch) for tip in tips]
    lines = []
    for (edge, back), tip in zip(sides, tips, strict=True):
        length = float(np.linalg.norm(outline[tip] - crotch))
        lines.append(_middle_line(edge, back, crotch, outline[tip], length))
    guess = _meeting(lines)
    length = float(np.mean([np.linalg.norm(outline[tip] - guess) for tip in tips]))
    pivot, sd, screw = _pivot(shape, guess, length)
    blades = []
    for (edge, back), tip, line in zip(sides, tips, lines, strict=True):
        axis = outline[tip] - pivot
        axis = line[1] * np.sign(line[1] @ axis)
        up = np.array([axis[1], -axis[0]])
        up = up * np.sign(np.median((back - pivot) @ up) - np.median((edge - pivot) @ up))
        rough = BladeParts(pivot, axis, up, edge, back, np.empty((0, 2)), 0.0, sd)
        stop = float(rough.frame(np.concatenate([edge, back]))[:, 0].max())
        clear = rough.frame(crotch[None])[0, 0] + _CLEAR_OF_CROTCH * stop
        last = stop * (1.0 - _TIP_SHARE)
        edge, back = (_between(rough, side, clear, last) for side in (rough.edge, rough.back))
        halved = (max(OPEN_FIRST, clear / stop), BACK_LAST)
        blades.append(replace(rough, edge=edge, back=back, length=stop, halved=halved))
    opening = opening_of(*blades)
    if min(len(b.edge) for b in blades) < 20 or opening < LEAST_OPENING:
        raise InputError(
            f"{source}: the blades are open by {np.degrees(opening):.0f} deg, and too little of "
            "their edges is visible: open them wider."
        )
    return Scissors(pivot, sd, screw, tuple(blades), opening, outline[list(tips)], rings, length)


def opening_of(first: BladeParts, second: BladeParts) -> float:
    """The angle (rad) between the centrelines of two blades."""
    return float(np.arccos(np.clip(first.axis @ second.axis, -1.0, 1.0)))


def _closed(shape: Silhouette, tip: Array, handles: Array, rings: tuple[Array, ...]) -> Scissors:
    """Closed scissors: the pivot is a screw between handles and tip, or is unknown."""
    outline = shape.outer
    axis = tip - handles
    reach = float(np.linalg.norm(axis))
    axis = axis / reach
    across = np.array([-axis[1], axis[0]])
    along = (outline - handles) @ axis
    behind = max(float(((ring - handles) @ axis).max()) for ring in rings) if rings else 0.0
    places = np.linspace(behind + 0.12 * (reach - behind), behind + 0.6 * (reach - behind), 60)
    middles = []
    for place in places:
        here = np.abs(along - place) < 0.02 * reach
        if not here.any():
            continue
        off = (outline[here] - handles) @ across
        middles.append(handles + place * axis + 0.5 * (off.min() + off.max()) * across)
    if not middles:
        middles = [0.5 * (tip + handles)]
    best = _best_screw(shape, np.array(middles), 0.5 * reach, 0.045)
    if best is None:
        pivot = np.array(middles)[len(middles) // 4]
        return Scissors(pivot, 0.1 * reach, False, (), 0.0, tip[None], rings, reach)
    pivot, radius = best
    length = float(np.linalg.norm(tip - pivot))
    return Scissors(pivot, 0.2 * radius, True, (), 0.0, tip[None], rings, length)


def _pivot(shape: Silhouette, guess: Array, length: float) -> tuple[Array, float, bool]:
    screw = _best_screw(shape, guess[None], length, _SCREW_NEAR)
    if screw is None:
        return guess, _GUESS_SD_SHARE * length, False
    return screw[0], 0.2 * screw[1], True


def _best_screw(
    shape: Silhouette, near: Array, length: float, within: float
) -> tuple[Array, float] | None:
    """The clearest circle near any of several places: its centre and radius.

    A circle is clear where the light changes across most of its length, in either sense. Larger
    circles score higher than a glint, and those with structure inside higher than even patches.
    """
    centre = shape.grid(near)
    size = length / shape.pixel
    light = np.clip(shape.relative * 170.0, 0, 255).astype(np.uint8)
    low, high = (max(share * size, 2.0) for share in _SCREW_SHARE)
    room = within * size + high + 3.0
    left, top = np.maximum(np.floor(centre.min(axis=0) - room).astype(int), 0)
    right, bottom = np.ceil(centre.max(axis=0) + room).astype(int)
    part = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.8), dtype=np.float32)
    part = part[top:bottom, left:right]
    if min(part.shape) < 8:
        return None
    gx, gy = (cv2.Sobel(part, cv2.CV_32F, i, j) / 8.0 for i, j in ((1, 0), (0, 1)))
    steep = np.hypot(gx, gy)
    weight = np.clip((steep - _FAINT) / _FAINT, 0.0, 1.0) / np.maximum(steep, 1e-6)
    gx, gy = gx * weight, gy * weight
    y, x = np.mgrid[0 : part.shape[0], 0 : part.shape[1]]
    place = np.stack([x.ravel() + left, y.ravel() + top], axis=1)
    gap = np.linalg.norm(place[:, None, :] - centre[None, :, :], axis=2).min(axis=1)
    tried = place[gap < within * size]
    if not len(tried):
        return None
    tried = tried[:: len(tried) // _MOST_PLACES + 1]
    turn = np.linspace(0.0, 2.0 * np.pi, 49)[:-1].astype(np.float32)
    best: tuple[float, Array, float] | None = None
    for radius in np.arange(low, high + 0.5, 0.5):
        px = (tried[:, :1] - left + radius * np.cos(turn)).astype(np.float32)
        py = (tried[:, 1:] - top + radius * np.sin(turn)).astype(np.float32)
        across = np.asarray(cv2.remap(gx, px, py, cv2.INTER_LINEAR)) * np.cos(turn)
        across += np.asarray(cv2.remap(gy, px, py, cv2.INTER_LINEAR)) * np.sin(turn)
        clear = np.maximum(np.abs(across) - 0.6, 0.0) / 0.4
        within_it = cv2.blur(steep, (2 * int(0.35 * radius) + 1,) * 2)
        inner = within_it[tried[:, 1] - top, tried[:, 0] - left]
        shaped = _PLAIN + (1.0 - _PLAIN) * np.minimum(inner / (2.0 * _FAINT), 1.0)
        score = clear.mean(axis=1) * shaped * np.sqrt(radius)
        index = int(np.argmax(score))
        if best is None or score[index] > best[0]:
            best = float(score[index]), tried[index], float(radius)
    if best is None or best[0] < _LEAST_CIRCLE * np.sqrt(best[2]):
        return None
    return best[1] * shape.pixel + np.asarray(shape.origin), best[2] * shape.pixel


def _sides_of(outline: Array, tip: int, notch: int) -> tuple[Array, Array]:
    """The edge, from the notch to the tip, and the back, from the tip as far again."""
    count = len(outline)
    ahead = (notch - tip) % count
    step = 1 if ahead < count - ahead else -1
    span = min(ahead, count - ahead)
    edge = outline[(tip + step * np.arange(span + 1)) % count][::-1]
    back = outline[(tip - step * np.arange(span + 1)) % count][::-1]
    return edge, back


def _middle_line(
    edge: Array, back: Array, crotch: Array, tip: Array, length: float
) -> tuple[Array, Array]:
    """Point and direction of the centreline of the part of a blade beyond the crotch."""
    axis = (tip - crotch) / length
    across = np.array([-axis[1], axis[0]])
    along = np.linspace(0.1, 0.75, 60) * length
    middles = np.zeros((60, 2))
    for side in (edge, back):
        s, e = (side - crotch) @ axis, (side - crotch) @ across
        order = np.argsort(s)
        off = np.interp(along, s[order], e[order])
        middles += 0.5 * (crotch + along[:, None] * axis + off[:, None] * across)
    centre = middles.mean(axis=0)
    direction = np.linalg.svd(middles - centre, full_matrices=False)[2][0]
    return centre, np.asarray(direction * np.sign(direction @ axis))


def _meeting(lines: list[tuple[Array, Array]]) -> Array:
    (a, u), (b, v) = lines
    solved = np.linalg.lstsq(np.column_stack([u, -v]), b - a, rcond=None)[0]
    return np.asarray(a + solved[0] * u)


def _between(parts: BladeParts, side: Array, first: float, last: float) -> Array:
    station = parts.frame(side)[:, 0]
    kept = side[(station > first) & (station < last)]
    return np.asarray(kept[np.argsort(parts.frame(kept)[:, 0])])


def lamp_direction(shape: Silhouette, scissors: Scissors) -> float | None:
    """The direction in which the shadow falls, in degrees from between the tips; None without one.

    Around the silhouette the sheet is darkened by the penumbra, on the side away from the lamp
    farther than on the other. Each darkened place counts with its darkness and its direction from
    the nearest place of the silhouette.
    """
    inside = (shape.mask > 0).astype(np.uint8)
    distance, nearest = cv2.distanceTransformWithLabels(
        1 - inside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    dark = 1.0 - cv2.GaussianBlur(shape.relative, (0, 0), 1.0)
    reach = _REACH * scissors.length / shape.pixel
    rows, columns = np.nonzero(
        (distance > 1.5) & (distance < reach) & (dark > _LEAST_DARK) & (dark < _MOST_DARK)
    )
    if len(rows) < 50 or not len(scissors.blades):
        return None
    places = np.zeros((int(nearest.max()) + 1, 2))
    inner = np.nonzero(inside)
    places[nearest[inner]] = np.column_stack([inner[1], inner[0]])
    away = np.column_stack([columns, rows]) - places[nearest[rows, columns]]
    weight = dark[rows, columns]
    total = float(np.sum(weight * np.linalg.norm(away, axis=1)))
    lean = np.sum(weight[:, None] * away, axis=0) / max(total, 1e-12)
    if float(np.linalg.norm(lean)) < _LEAST_LEAN:
        return None
    forward = np.sum([blade.axis for blade in scissors.blades], axis=0)
    turn = np.arctan2(lean[1], lean[0]) - np.arctan2(forward[1], forward[0])
    return float(np.degrees(turn) % 360.0)
