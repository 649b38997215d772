"""A pin-hole camera: corners are projected row by row, blurred by noise, and a pose is solved."""

from dataclasses import dataclass
from math import radians

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array

from .motion import Motion

FOCAL_PX, CENTRE_PX, HEIGHT_PX, BEND = 900.0, (640.0, 360.0), 720, -0.1
FOCAL_OFF, CENTRE_OFF_PX, BEND_OFF = 4e-4, 0.25, 2e-3
"""Standard deviations of a calibration's errors: 0.2 mm of depth at 0.5 m."""
TURN_OFF_RAD, SHIFT_OFF_M = radians(0.1), 0.24e-3
"""Of the camera's place in the rig, each axis, at the plate; with the lens about 0.3 mm."""
CORNER_PX = 0.3
"""Rms of a corner's error, as it is stated; one corner in ten has 2.5 times the others'."""
OUTLYING, OUTLYING_TIMES = 0.1, 2.5
GRID, PITCH_M = (5, 4), 10e-3
READOUT_S, STAMP_STEP_S, STAMP_SD_S = 10e-3, 1e-3, 0.4e-3
"""A rolling shutter; stamps of its middle, in whole milliseconds."""
FRAMES_HZ, LATE_S, DROPPED = 30.0, (0.05, 0.11), 0.05
CERTAIN_ODDS = 100.0


@dataclass(frozen=True)
class Picture:
    """A solved pose with the covariance of its corners' stated noise; ``mirrored`` is the truth."""

    stamp_s: float
    arrives_s: float
    rotation: Array
    place_m: Array
    covariance: Array
    certain: bool
    mirrored: bool


@dataclass(frozen=True)
class _Lens:
    """Camera matrix, distortion, and the rig's frame as the camera has it."""

    matrix: Array
    bend: Array
    turn: Rotation
    shift_m: Array


def pictures(
    motion: Motion, seconds: float, blind_s: float, flat: bool, rng: np.random.Generator
) -> tuple[Picture, ...]:
    """Pictures in the order of their arrival, none in the last ``blind_s``.

    ``flat`` puts the camera farther and more above the plate, where both poses of its plane
    explain a picture about equally well.
    """
    true, told = _draw_lens(motion, flat, rng)
    a, b = (part.ravel() for part in np.meshgrid(*(np.arange(n) for n in GRID)))
    board = PITCH_M * np.stack([a - 2.0, b + 1.2, 0.0 * a], axis=1)
    begun = np.arange(0.0, seconds - READOUT_S - blind_s, 1.0 / FRAMES_HZ)
    begun = begun[rng.random(len(begun)) >= DROPPED]
    rotation, place = motion(begun + 0.5 * READOUT_S)
    found = []
    for at, axes, where in zip(begun.tolist(), rotation, place, strict=True):
        rough = _project(true, board @ axes.T + where)
        times = at + READOUT_S * np.clip(rough[:, 1] / HEIGHT_PX, 0.0, 1.0)
        turns, places = motion(times)
        pixels = _project(true, np.einsum("nij,nj->ni", turns, board) + places)
        pixels += _corner_noise(len(board), rng)
        stamp = at + 0.5 * READOUT_S + STAMP_SD_S * rng.standard_normal()
        stamp = STAMP_STEP_S * round(stamp / STAMP_STEP_S)
        seen = _solve(told, board, pixels)
        if seen is not None:
            mirrored = float(seen[0][:, 2] @ axes[:, 2]) < np.cos(radians(6.0))
            found.append(Picture(stamp, at + rng.uniform(*LATE_S), *seen, mirrored))
    return tuple(sorted(found, key=lambda one: one.arrives_s))


def _draw_lens(motion: Motion, flat: bool, rng: np.random.Generator) -> tuple[_Lens, _Lens]:
    """The true camera, and what its calibration says."""
    (axes,), (place,) = motion(np.zeros(1))
    lean = rng.uniform(*((0.2, 0.35) if flat else (0.45, 0.8)))
    away = rng.uniform(*((0.55, 0.65) if flat else (0.45, 0.55)))
    about = rng.uniform(0.0, 2.0 * np.pi)
    lean_axis = np.cos(about) * axes[:, 0] + np.sin(about) * axes[:, 1]
    sight = -Rotation.from_rotvec(lean * lean_axis).apply(axes[:, 2])
    side = np.cross(sight, lean_axis)
    basis = np.stack([np.cross(side, sight), side, sight])
    turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-0.3, 0.3)]) * Rotation.from_matrix(basis)
    aim = np.array([*rng.uniform(-5e-3, 5e-3, 2), away])
    bend = np.array([BEND, 0.0, 0.0, 0.0])
    true = _Lens(_matrix(FOCAL_PX, *CENTRE_PX), bend, turn, aim - turn.apply(place))
    off = rng.standard_normal(10)
    focal = FOCAL_PX * (1.0 + FOCAL_OFF * off[0])
    centre = np.array(CENTRE_PX) + CENTRE_OFF_PX * off[1:3]
    told_turn = Rotation.from_rotvec(TURN_OFF_RAD * off[3:6]) * turn
    told = _Lens(
        _matrix(focal, *centre),
        bend + np.array([BEND_OFF * off[9], 0.0, 0.0, 0.0]),
        told_turn,
        aim + SHIFT_OFF_M * off[6:9] - told_turn.apply(place),
    )
    return true, told


def _matrix(focal: float, across: float, down: float) -> Array:
    return np.array([[focal, 0.0, across], [0.0, focal, down], [0.0, 0.0, 1.0]])


def _project(lens: _Lens, points: Array) -> Array:
    vector = lens.turn.as_rotvec()
    return cv2.projectPoints(points, vector, lens.shift_m, lens.matrix, lens.bend)[0][:, 0]


def _corner_noise(count: int, rng: np.random.Generator) -> Array:
    size = CORNER_PX / np.sqrt(1.0 - OUTLYING + OUTLYING * OUTLYING_TIMES**2)
    times = np.where(rng.random((count, 1)) < OUTLYING, OUTLYING_TIMES, 1.0)
    return size * times * rng.standard_normal((count, 2))


def _solve(lens: _Lens, board: Array, pixels: Array) -> tuple[Array, Array, Array, bool] | None:
    """The likelier of a plane's two poses in the rig's frame, its covariance, and whether sure."""
    middle = board.mean(axis=0)
    solved = cv2.solvePnPGeneric(
        board - middle, pixels, lens.matrix, lens.bend, flags=cv2.SOLVEPNP_IPPE
    )
    poses = []
    for vector, shift in zip(solved[1], solved[2], strict=True):
        refined = cv2.solvePnPRefineLM(
            board - middle, pixels, lens.matrix, lens.bend, vector.copy(), shift.copy()
        )
        seen = cv2.projectPoints(board - middle, *refined, lens.matrix, lens.bend)[0][:, 0]
        poses.append((float(np.sum((seen - pixels) ** 2)), *refined))
    poses.sort(key=lambda one: one[0])
    if not poses:
        return None
    square, vector, shift = poses[0]
    turn = Rotation.from_rotvec(vector[:, 0])
    rays = turn.apply(board)
    place = shift[:, 0] - turn.apply(middle)
    slopes = _slopes(lens, rays, place)
    covariance = CORNER_PX**2 * np.linalg.inv(slopes.T @ slopes)
    sure = len(poses) < 2 or poses[1][0] - square > 2.0 * np.log(CERTAIN_ODDS) * CORNER_PX**2
    back = lens.turn.inv()
    both = np.kron(np.eye(2), back.as_matrix())
    rotation = (back * turn).as_matrix()
    return rotation, back.apply(place - lens.shift_m), both @ covariance @ both.T, bool(sure)


def _slopes(lens: _Lens, rays: Array, place: Array) -> Array:
    """How pixels (2 n) move with a turn about the plate's origin and a shift, in camera axes."""
    x, y, z = (rays + place).T
    focal, zero = lens.matrix[0, 0], np.zeros_like(x)
    by_point = focal * np.stack(
        [np.stack([1 / z, zero, -x / z**2], 1), np.stack([zero, 1 / z, -y / z**2], 1)], 1
    )
    arms = -np.cross(rays[:, None], np.eye(3)[None]).swapaxes(1, 2)
    by_turn = np.einsum("nij,njk->nik", by_point, arms)
    return np.concatenate([by_turn, by_point], axis=2).reshape(-1, 6)
