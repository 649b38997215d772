"""Cast shadows of objects that lie above a sheet, under a lamp of a certain size."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.sim.coverage import coverage
from scissorcal.vision.sim.lens import Lens, SimPose
from scissorcal.vision.sim.looks import Picture

_SAMPLES = 24
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_ROOM_PX = 3


@dataclass(frozen=True)
class Lamp:
    """A round lamp far above the sheet.

    ``lean`` (x, y) is how far a shadow falls aside per height of what casts it, ``size`` the half
    width of its penumbra per height. ``share`` is the part of the sheet's light that the lamp
    gives: what is left in full shadow comes from elsewhere.
    """

    lean: tuple[float, float]
    size: float
    share: float


@dataclass(frozen=True)
class CastShadow:
    """The shadow of outlines (n, 2) on the plane of ``pose``, each point at its height (n,)."""

    outlines_m: Sequence[Array]
    heights_m: Sequence[Array]
    pose: SimPose
    lamp: Lamp

    @classmethod
    def of(
        cls,
        outlines_m: Sequence[Array],
        height_m: Callable[[Array], Array],
        pose: SimPose,
        lamp: Lamp,
    ) -> "CastShadow":
        """The common shadow of outlines in one plane; ``height_m`` of points (n, 2)."""
        dense = [_dense(np.asarray(outline)) for outline in outlines_m]
        return cls(dense, [height_m(outline) for outline in dense], pose, lamp)


def cast(radiance: Picture, shadow: CastShadow, lens: Lens) -> None:
    """Darken a picture by a shadow.

    The lamp's disc is a set of points, each of which casts a sharp shadow, so that the penumbra
    widens with the height above the sheet as it does under a real lamp.
    """
    import cv2

    number = np.arange(_SAMPLES)
    disc = np.sqrt((number + 0.5) / _SAMPLES)[:, None] * np.column_stack(
        [np.cos(_GOLDEN * number), np.sin(_GOLDEN * number)]
    )
    seen = [
        [
            lens.sees(
                outline + height[:, None] * (shadow.lamp.lean + shadow.lamp.size * d), shadow.pose
            )
            for outline, height in zip(shadow.outlines_m, shadow.heights_m, strict=True)
        ]
        for d in disc
    ]
    every = np.concatenate([o for one in seen for o in one])
    every = every[np.isfinite(every).all(axis=1)]
    if not len(every):
        return
    low = np.maximum(np.floor(every.min(axis=0)).astype(int) - _ROOM_PX, 0)
    high = np.minimum(np.ceil(every.max(axis=0)).astype(int) + _ROOM_PX, [lens.width, lens.height])
    if np.any(high <= low):
        return
    columns, rows = (int(side) for side in high - low)
    dark = np.zeros((rows, columns), dtype=np.float32)
    for one in seen:
        # the shadows of two parts that overlap take the same light once
        dark += np.minimum(coverage([o - low for o in one], columns, rows), 1.0)
    # between the points of the lamp's disc light changes evenly
    spread = 1.0 / np.sqrt(_SAMPLES)
    dark = np.asarray(cv2.GaussianBlur(dark / _SAMPLES, (0, 0), 0.5 + spread), dtype=np.float32)
    radiance[low[1] : high[1], low[0] : high[0]] *= 1.0 - shadow.lamp.share * dark


def _dense(outline: Array, step_m: float = 5e-4) -> Array:
    """The outline with points so near one another that its shadow bends with their heights."""
    closed = np.vstack([outline, outline[:1]])
    length = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    count = np.maximum(np.ceil(length / step_m), 1.0).astype(np.int64)
    index = np.repeat(np.arange(len(count)), count)
    part = (np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)) / count[index]
    return np.asarray(closed[index] + part[:, None] * (closed[index + 1] - closed[index]))
