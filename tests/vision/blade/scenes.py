"""Rendered photographs of blades for the tests of this room and those behind it."""

from dataclasses import replace

import numpy as np
from benchmarks.photographs import Glare, GlaringLayer, centreline_turn
from numpy.typing import NDArray

from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import (
    BladeShape,
    Lens,
    Looks,
    SimPose,
    blade_layer,
    render,
    scissors_layers,
    target_layers,
)
from scissorcal.vision.targets.boards import BLADE_MAT, MAT_PIVOT_M

LENS = Lens(1250.0, (702.1, 521.4), 1400, 1050, (-0.06, 0.02, 3e-4, -2e-4, 0.0))
CAMERA = Camera(1250.0, 1250.0, 702.1, 521.4, LENS.distortion, 1400, 1050)
POSE = SimPose.looking_at((0.126, 0.09), 0.275, tilt=0.12, azimuth=0.8, turn=0.04)
LOOKS = Looks(exposure=0.85, softness_px=0.7, noise=0.008, vignetting=0.2)
SHAPE = BladeShape(back_slope=-float(np.tan(0.035)))


def photo_of(picture: NDArray[np.uint8], name: str = "blade.jpg") -> Photo:
    return Photo.from_array(picture, name)


def blade_photo(
    shape: BladeShape = SHAPE,
    *,
    pose: SimPose = POSE,
    looks: Looks = LOOKS,
    turn: float = 0.05,
    where: tuple[float, float] = MAT_PIVOT_M,
    mat: bool = True,
    seed: int = 0,
    glares: tuple[Glare, ...] = (),
    **look: object,
) -> Photo:
    """One blade on the mat (or on its bare sheet)."""
    sheet = target_layers(BLADE_MAT, pose)
    layers = sheet if mat else sheet[:1]
    metal = blade_layer(shape, pose, where, turn, **look)
    layers = [*layers, GlaringLayer(**vars(metal), glares=glares)]
    return photo_of(render(layers, LENS, looks, np.random.default_rng(seed)))


def scissors_photo(opening: float, *, seed: int = 0, mat: bool = True) -> Photo:
    """Open scissors on the mat (or on a sheet that fills the picture)."""
    shape = replace(SHAPE, length_m=0.08)
    sheet = target_layers(BLADE_MAT, POSE)
    things = scissors_layers(shape, shape, opening, POSE, (0.125, 0.09), 0.03)
    layers = [*(sheet if mat else sheet[:1]), *things]
    background = 0.35 if mat else 0.85
    rng = np.random.default_rng(seed)
    return photo_of(render(layers, LENS, LOOKS, rng, background=background), "open.jpg")


def true_edge(shape: BladeShape, station: NDArray[np.float64]) -> NDArray[np.float64]:
    """The edge in the frame whose x axis halves the blade."""
    turn = centreline_turn(shape)
    s = np.linspace(0.0, shape.length_m, 20_001)
    e = shape.edge_at(s)
    c, n = np.cos(turn), np.sin(turn)
    return np.interp(station, c * s + n * e, c * e - n * s)
