"""Photographs beyond those of the virtual camera: glare, texture, cast shadows, careless looks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.sim import BladeShape, Lens, Looks, PaintLayer, SimPose
from scissorcal.vision.sim.optics import Picture, coverage
from scissorcal.vision.sim.photograph import Box

_SAMPLES = 24
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
_ROOM_PX = 3


def random_looks(rng: np.random.Generator, px_per_mm: float, strength: float = 1.0) -> Looks:
    """Draw how a picture is taken, from careful (``strength`` 0) to careless (1 and above)."""
    blur = strength * min(px_per_mm / 12.0, 1.5)
    looks = Looks(
        exposure=float(rng.uniform(0.7, 0.95)),
        defocus_px=float(rng.uniform(0.0, 2.0) * blur),
        motion_px=float(rng.uniform(0.0, 2.5) * blur),
        motion_angle=float(rng.uniform(0.0, np.pi)),
        softness_px=float(rng.uniform(0.5, 0.8)),
        vignetting=float(rng.uniform(0.0, 0.4) * strength),
        light_slope=float(rng.uniform(-0.3, 0.3) * strength),
        noise=float(rng.uniform(0.003, 0.02) * max(strength, 0.1)),
        tone=float(rng.normal(0.0, 0.15) * strength),
    )
    warm = float(rng.uniform(-0.06, 0.06) * strength)
    return replace(looks, tint=(1.0 - warm, 1.0, 1.0 + warm))


def centreline_turn(shape: BladeShape) -> float:
    """How far a blade's frame must be turned for its x axis to halve it, in radians.

    Halving means: least squares through the pivot over 30 to 80 % of the blade's length.
    """
    turn = 0.0
    s = np.linspace(0.0, shape.length_m, 4001)
    for _ in range(6):
        c, n = np.cos(turn), np.sin(turn)
        along = np.linspace(0.3, 0.8, 501) * shape.length_m
        lower, upper = (
            np.interp(along, c * s + n * y, c * y - n * s)
            for y in (shape.edge_at(s), shape.back_at(s))
        )
        middle = 0.5 * (lower + upper)
        turn += float(np.arctan(np.sum(middle * along) / np.sum(along**2)))
    return turn


@dataclass(frozen=True)
class Glare:
    """A bright patch on metal: an ellipse in the layer's plane with soft borders, metres."""

    centre_m: tuple[float, float]
    along_m: float
    across_m: float
    angle: float = 0.0
    strength: float = 1.0


@dataclass(frozen=True)
class GlaringLayer(PaintLayer):
    """A layer of metal with bright patches."""

    glares: tuple[Glare, ...] = ()

    def light(self, x: Array, y: Array, rng: np.random.Generator) -> Array:
        """Reflectance at places of the layer's plane, metres."""
        light = super().light(x, y, rng)
        for glare in self.glares:
            dx, dy = x - glare.centre_m[0], y - glare.centre_m[1]
            c, s = np.cos(glare.angle), np.sin(glare.angle)
            along, across = (c * dx + s * dy) / glare.along_m, (c * dy - s * dx) / glare.across_m
            light += glare.strength / (1.0 + (along**2 + across**2) ** 3)
        return light


@dataclass(frozen=True)
class TexturedLayer(PaintLayer):
    """A layer of a rough material: ``texture`` is the relative sd of its light, alike over
    ``texture_m``."""

    texture: float = 0.0
    texture_m: float = 0.001

    def shade(self, lens: Lens, box: Box, rng: np.random.Generator) -> Picture | np.float32:
        """Reflectance over a box of pixels."""
        shade = super().shade(lens, box, rng)
        if self.texture <= 0.0:
            return shade
        left, top, right, bottom = box
        reach = max(self.texture_m * lens.focal_px / float(self.pose.shift_m[2]), 0.3)
        noise = rng.standard_normal((bottom - top, right - left), dtype=np.float32)
        rough = np.asarray(cv2.GaussianBlur(noise, (0, 0), reach), dtype=np.float32)
        grain = 1.0 + self.texture * rough / max(float(rough.std()), 1e-9)
        return np.asarray(shade * np.asarray(grain, np.float32))


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

    def lay(self, radiance: Picture, lens: Lens, _rng: np.random.Generator) -> None:
        """Darken a picture by the shadow.

        The lamp's disc is a set of points, each of which casts a sharp shadow, so that the penumbra
        widens with the height above the sheet as it does under a real lamp.
        """
        number = np.arange(_SAMPLES)
        disc = np.sqrt((number + 0.5) / _SAMPLES)[:, None] * np.column_stack(
            [np.cos(_GOLDEN * number), np.sin(_GOLDEN * number)]
        )
        outlines = [
            [
                lens.sees(
                    outline + height[:, None] * (self.lamp.lean + self.lamp.size * d), self.pose
                )
                for outline, height in zip(self.outlines_m, self.heights_m, strict=True)
            ]
            for d in disc
        ]
        points = np.concatenate([o for sharp in outlines for o in sharp])
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return
        low = np.maximum(np.floor(points.min(axis=0)).astype(int) - _ROOM_PX, 0)
        high = np.minimum(
            np.ceil(points.max(axis=0)).astype(int) + _ROOM_PX, [lens.width, lens.height]
        )
        if np.any(high <= low):
            return
        columns, rows = (int(side) for side in high - low)
        dark = np.zeros((rows, columns), dtype=np.float32)
        for sharp in outlines:
            # the shadows of two parts that overlap take the same light once
            dark += np.minimum(coverage([o - low for o in sharp], columns, rows), 1.0)
        # between the points of the lamp's disc light changes evenly
        spread = 1.0 / np.sqrt(_SAMPLES)
        dark = np.asarray(cv2.GaussianBlur(dark / _SAMPLES, (0, 0), 0.5 + spread), dtype=np.float32)
        radiance[low[1] : high[1], low[0] : high[0]] *= 1.0 - self.lamp.share * dark


def _dense(outline: Array, step_m: float = 5e-4) -> Array:
    """The outline with points so near one another that its shadow bends with their heights."""
    closed = np.vstack([outline, outline[:1]])
    length = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    count = np.maximum(np.ceil(length / step_m), 1.0).astype(np.int64)
    index = np.repeat(np.arange(len(count)), count)
    part = (np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)) / count[index]
    return np.asarray(closed[index] + part[:, None] * (closed[index + 1] - closed[index]))
