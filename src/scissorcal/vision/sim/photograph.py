"""Rendering of flat shapes in planes through a lens, with soft shadows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.sim.optics import Bytes, Lens, Looks, Picture, SimPose, coverage, develop

FINEST_PX = 1.5
"""Projected polygons are subdivided to sides this short, which distortion leaves straight."""

_CUT_ALL = 4000

Box = tuple[int, int, int, int]
"""Left, top, right and bottom border of a part of a picture, in pixels."""


class Laid(Protocol):
    """What changes the light of a picture: a layer, or what a benchmark adds."""

    def lay(self, radiance: Picture, lens: Lens, rng: np.random.Generator) -> None:
        """Change the light (h, w) in place."""


@dataclass(frozen=True)
class PaintLayer:
    """Flat shapes of one material in one plane.

    ``outlines_m`` are closed polygons (n, 2) in the plane of ``pose``, those that run the other
    way round being holes. ``reflectance`` 1 is perfect white. ``shading`` is the relative gain of
    light over 100 mm along x and y; ``brushed`` is how strongly it is streaked along
    ``grain`` (rad). ``shadow_m`` shifts a shadow of the shapes, soft over ``shadow_soft_m``, and
    takes ``shadow`` of the light.
    """

    outlines_m: Sequence[Array]
    pose: SimPose
    reflectance: float
    shading: tuple[float, float] = (0.0, 0.0)
    brushed: float = 0.0
    grain: float = 0.0
    shadow: float = 0.0
    shadow_m: tuple[float, float] = (0.0, 0.0)
    shadow_soft_m: float = 0.002

    def lay(self, radiance: Picture, lens: Lens, rng: np.random.Generator) -> None:
        """Draw the shapes over a picture, in place."""
        if self.shadow > 0.0:
            _cast_shadow(radiance, self, lens)
        outlines = _seen(self.outlines_m, self, lens)
        box = _box(outlines, lens, 1)
        if box is None:
            return
        left, top, right, bottom = box
        share = coverage([o - (left, top) for o in outlines], right - left, bottom - top)
        part = radiance[top:bottom, left:right]
        part += share * (self.shade(lens, box, rng) - part)

    def shade(self, lens: Lens, box: Box, rng: np.random.Generator) -> Picture | np.float32:
        """Reflectance over a box of pixels; metal's changes slowly: every fourth pixel will do."""
        if not (any(self.shading) or self.brushed):
            return np.float32(self.reflectance)
        left, top, right, bottom = box
        columns, rows = max((right - left) // 4, 2), max((bottom - top) // 4, 2)
        x, y = np.meshgrid(
            np.linspace(left, right - 1, columns), np.linspace(top, bottom - 1, rows)
        )
        place = _on_plane(np.column_stack([x.ravel(), y.ravel()]), lens, self.pose)
        light = self.light(place[:, 0].reshape(x.shape), place[:, 1].reshape(x.shape), rng)
        light = np.asarray(np.clip(light, 0.01, 1.5), dtype=np.float32)
        return np.asarray(cv2.resize(light, (right - left, bottom - top)), dtype=np.float32)

    def light(self, x: Array, y: Array, rng: np.random.Generator) -> Array:
        """Reflectance at places of the layer's plane, metres."""
        light = self.reflectance * (1.0 + 10.0 * (x * self.shading[0] + y * self.shading[1]))
        if self.brushed:
            streaks = rng.standard_normal(512)
            across = (y * np.cos(self.grain) - x * np.sin(self.grain)) / 2e-4
            light *= 1.0 + self.brushed * np.interp(across % 511.0, np.arange(512), streaks)
        return np.asarray(light)


def render(
    layers: Sequence[Laid],
    lens: Lens,
    looks: Looks,
    rng: np.random.Generator,
    *,
    background: float = 0.35,
) -> Bytes:
    """Photograph layers, later ones over earlier ones: bytes (height, width, 3), BGR.

    Every shape's outline is projected point by point and its exact share of each pixel taken, so
    that edges are accurate to far below a hundredth of a pixel.
    """
    radiance = np.full((lens.height, lens.width), background, dtype=np.float32)
    for layer in layers:
        layer.lay(radiance, lens, rng)
    return develop(radiance, looks, rng)


def _cast_shadow(radiance: Picture, layer: PaintLayer, lens: Lens) -> None:
    moved = [np.asarray(outline) + layer.shadow_m for outline in layer.outlines_m]
    outlines = _seen(moved, layer, lens)
    soft = layer.shadow_soft_m * lens.focal_px / float(layer.pose.shift_m[2])
    box = _box(outlines, lens, int(np.ceil(3.0 * soft)) + 1)
    if box is None:
        return
    left, top, right, bottom = box
    small = max(1.0, soft / 4.0)
    size = (
        max(int(np.ceil((right - left) / small)), 1),
        max(int(np.ceil((bottom - top) / small)), 1),
    )
    scale = np.array([size[0] / (right - left), size[1] / (bottom - top)])
    share = coverage([(o - (left, top) + 0.5) * scale - 0.5 for o in outlines], *size)
    if soft > 0.05:
        share = np.asarray(cv2.GaussianBlur(share, (0, 0), soft / small), dtype=np.float32)
    share = np.asarray(cv2.resize(share, (right - left, bottom - top)), dtype=np.float32)
    radiance[top:bottom, left:right] *= 1.0 - layer.shadow * share


def _on_plane(pixels: Array, lens: Lens, pose: SimPose) -> Array:
    """Place in the plane that pixels show; a few fixed-point steps, good enough for shading."""
    target = (pixels - lens.centre_px) / lens.focal_px
    direction = target.copy()
    for _ in range(8):
        bent = (lens.bend(direction) - lens.centre_px) / lens.focal_px
        direction = direction + np.clip(target - bent, -0.2, 0.2)
    rays = np.column_stack([direction, np.ones(len(direction))]) @ pose.rotation
    origin = -pose.shift_m @ pose.rotation
    reach = np.where(np.abs(rays[:, 2]) > 1e-9, rays[:, 2], np.nan)
    where = origin[:2] - rays[:, :2] * (origin[2] / reach)[:, None]
    return np.asarray(np.nan_to_num(where))


def _seen(outlines: Sequence[Array], layer: PaintLayer, lens: Lens) -> list[Array]:
    """Pixels of each outline, every side cut so short that its projection is straight.

    All outlines at once: a target has hundreds of short ones.
    """
    closed = [np.vstack([outline, outline[:1]]) for outline in outlines if len(outline)]
    if not closed:
        return []
    corners = np.concatenate(closed)
    length = np.linalg.norm(np.diff(lens.sees(corners, layer.pose), axis=0), axis=1)
    count = np.where(np.isfinite(length), np.ceil(length / (20.0 * FINEST_PX)), 1.0)
    count = np.clip(count, 1, _CUT_ALL).astype(np.int64)
    joints = np.cumsum([len(outline) for outline in closed])[:-1] - 1
    count[joints] = 0  # from one outline to the next there is no side
    ends = np.cumsum(count)
    index = np.repeat(np.arange(len(count)), count)
    step = (np.arange(len(index)) - np.repeat(ends - count, count)) / count[index]
    fine = corners[index] + step[:, None] * (corners[index + 1] - corners[index])
    return np.split(lens.sees(fine, layer.pose), ends[joints])


def _box(outlines: Sequence[Array], lens: Lens, room: int) -> Box | None:
    points = np.concatenate([o[np.isfinite(o).all(axis=1)] for o in outlines] or [np.empty((0, 2))])
    if not len(points):
        return None
    low, high = points.min(axis=0) - room, points.max(axis=0) + room + 1
    left, top = max(int(low[0]), 0), max(int(low[1]), 0)
    right, bottom = min(int(high[0]) + 1, lens.width), min(int(high[1]) + 1, lens.height)
    return (left, top, right, bottom) if right > left and bottom > top else None
