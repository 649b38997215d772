"""The true world of the benchmark: a plate, a tool on it, a camera, and what each sensor says.

Nothing here shares code with the filter or the model's surfaces: rotations are SciPy's, shapes are
their own closed forms, and there are effects that the filter lacks (a compliance that stiffens, a
tip that errs sideways as well, jittered times of exposure, quantised places).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation, RotationSpline

from scissorcal.aliases import Array

Shape = Callable[[Array, Array], tuple[Array, Array]]
"""Surface points and outward normals (n, 3) of two parameters (n,) in metres."""
Probe = Callable[[Array], tuple[float, Array]]
"""Signed distance to the surface, positive outside, and the normal (3,) there, of a point (3,)."""
Path = Callable[[Array, float, float], tuple[Array, Array]]
"""The parameters (n,) of a path at times (n,), with a phase (rad) and an angular rate (rad/s)."""
Motion = Callable[[Array], tuple[Array, Array]]
"""The plate's true rotation (n, 3, 3) and place (n, 3) at times (n,)."""

CONTACT_HZ = 100.0
CAMERA_HZ = 33.0
DELAY_S = (0.06, 0.10)
DROPPED = 0.05
NOISE_M = (0.5e-3, 0.5e-3, 1.5e-3)
NOISE_RAD = tuple(math.radians(deg) for deg in (0.4, 0.4, 0.1))
BIAS_M, BIAS_RAD = 0.3e-3, math.radians(0.1)
WHITE_M, SLOW_M, SLOW_S = 0.02e-3, 0.1e-3, 2.0
SIDEWAYS_M = 0.02e-3
COMPLIANCE, COMPLIANCE_SPREAD = 1e-4, 0.2
STIFFENING = 0.02
FORCE_N, FORCE_NOISE_N, FORCE_ZERO_N = 2.5, 0.05, 0.02
FRICTION = (0.1, 0.3)
STEP_M = 1e-6
EXPOSURE_JITTER_S = 1e-3
SPEED_M_PER_S, SPIN_RAD_PER_S, MOTION_S, SMOOTH_S = 0.02, math.radians(5.0), 0.5, 0.03
DOUBTED_FLIPS, DOUBTED = 0.9, 0.1
FINE_S, MARGIN_S, KNOTS = 2e-3, 0.1, 5
WAVE_HEIGHT_M, WAVE_M = 1.5e-3, 0.03


@dataclass(frozen=True)
class Scenario:
    """One row of the benchmark: how the plate moves, and what befalls the pictures.

    ``blackout_s`` is the time without pictures at the end, ``flips`` the share of pictures that a
    burst of mirrored poses takes.
    """

    name: str
    moving: bool = False
    blackout_s: float = 0.0
    flips: float = 0.0
    seconds: float = 8.0


@dataclass(frozen=True)
class Picture:
    """One picture: when it was exposed (as stamped), when it arrived, and the pose in it.

    ``certain`` is what the odds of both poses of a plane say: most mirrored pictures are known to
    be ambiguous, and some good ones are called so.
    """

    exposed_s: float
    arrives_s: float
    rotation: Array
    place_m: Array
    covariance: Array
    certain: bool


@dataclass(frozen=True)
class World:
    """What happened, and what sensors said of it; places and forces in the rig's frame.

    ``times_s`` (n,) are those of the contact rows; ``rotation`` (n, 3, 3) and ``place_m`` (n, 3)
    the plate's true pose then; ``touched_m`` (n, 3) the true surface point under the tip without
    load, ``normal`` (n, 3). ``point_m``, ``force_N``, ``force_vector_N`` and ``velocity_m_per_s``
    are measured.
    """

    times_s: Array
    rotation: Array
    place_m: Array
    touched_m: Array
    normal: Array
    point_m: Array
    force_N: Array
    force_vector_N: Array
    velocity_m_per_s: Array
    pictures: tuple[Picture, ...]


def plane(a: Array, b: Array) -> tuple[Array, Array]:
    """A plane: the plate's upper face."""
    zero = np.zeros_like(a)
    return np.stack([a, b, zero], axis=1), np.stack([zero, zero, zero + 1.0], axis=1)


def cylinder(radius_m: float) -> Shape:
    """A convex cylinder about an axis along x, its apex at the origin."""

    def shape(a: Array, b: Array) -> tuple[Array, Array]:
        angle = b / radius_m
        sine, cosine = np.sin(angle), np.cos(angle)
        points = np.stack([a, radius_m * sine, radius_m * (cosine - 1.0)], axis=1)
        return points, np.stack([np.zeros_like(a), sine, cosine], axis=1)

    return shape


def sphere(radius_m: float) -> Shape:
    """A ball, its apex at the origin; the parameters are arcs from there."""

    def shape(a: Array, b: Array) -> tuple[Array, Array]:
        arc = np.hypot(a, b)
        flat = np.sinc(arc / radius_m / np.pi) / radius_m
        normal = np.stack([a * flat, b * flat, np.cos(arc / radius_m)], axis=1)
        return radius_m * (normal - np.array([0.0, 0.0, 1.0])), normal

    return shape


def wavy(a: Array, b: Array) -> tuple[Array, Array]:
    """A smooth free-form face: three waves, with height and tilt 0 at the origin."""
    z, z_a, z_b = np.zeros_like(a), np.zeros_like(a), np.zeros_like(a)
    for i, j, phase in ((1.0, 0.3, 0.4), (-0.5, 1.1, 1.3), (0.7, -0.8, 2.2)):
        k, m = 2.0 * np.pi * i / WAVE_M / 2.0, 2.0 * np.pi * j / WAVE_M / 2.0
        turn = k * a + m * b + phase
        z += (np.sin(turn) - math.sin(phase) - (k * a + m * b) * math.cos(phase)) / 3.0
        z_a += k * (np.cos(turn) - math.cos(phase)) / 3.0
        z_b += m * (np.cos(turn) - math.cos(phase)) / 3.0
    normal = np.stack([-WAVE_HEIGHT_M * z_a, -WAVE_HEIGHT_M * z_b, np.ones_like(a)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([a, b, WAVE_HEIGHT_M * z], axis=1), normal


def probe_plane(point: Array) -> tuple[float, Array]:
    """Distance to the plane z = 0."""
    return float(point[2]), np.array([0.0, 0.0, 1.0])


def probe_cylinder(radius_m: float) -> Probe:
    """Distance to the cylinder about an axis along x, radius below the origin."""

    def probe(point: Array) -> tuple[float, Array]:
        across = np.array([0.0, float(point[1]), float(point[2]) + radius_m])
        away = math.hypot(across[1], across[2])
        return away - radius_m, across / away

    return probe


def circle(reach_m: float) -> Path:
    """A circle about the origin whose radius breathes between 0.4 and 1 of ``reach_m``."""

    def path(times: Array, phase: float, rate: float) -> tuple[Array, Array]:
        radius = reach_m * (0.7 + 0.3 * np.sin(0.37 * rate * times + phase))
        turn = rate * times + phase
        return radius * np.cos(turn), radius * np.sin(turn)

    return path


def rim(around_m: float) -> Path:
    """To and fro around a disc, nearly all of its rim, wandering along its axis."""

    def path(times: Array, phase: float, rate: float) -> tuple[Array, Array]:
        turn = 0.5 * rate * times + phase
        return 2e-3 * np.sin(1.7 * turn), 0.45 * around_m * np.sin(turn)

    return path


def make_world(scenario: Scenario, shape: Shape, path: Path, rng: np.random.Generator) -> World:
    """Draw a world: a pose, its motion, a path on the surface, and what sensors say."""
    count = round(scenario.seconds * CONTACT_HZ)
    times = np.arange(1, count + 1) / CONTACT_HZ
    motion = plate_motion(scenario, rng)
    rotation, place = motion(times)
    phase, rate = rng.uniform(0.0, 2.0 * np.pi), 2.0 * np.pi * rng.uniform(0.25, 0.4)
    compliance = COMPLIANCE * (1.0 + COMPLIANCE_SPREAD * rng.standard_normal())
    friction = rng.uniform(*FRICTION)

    def tip(at: Array) -> tuple[Array, Array, Array, Array]:
        surface, normal = shape(*path(at, phase, rate))
        force = FORCE_N + 0.3 * np.sin(2.0 * np.pi * 0.9 * at + phase)
        force = force + 0.1 * np.sin(2.0 * np.pi * 7.0 * at)
        sunk = compliance * force * (1.0 - STIFFENING * (force - FORCE_N) / FORCE_N)
        return surface, normal, force, surface - normal * sunk[:, None]

    surface, normal, force, tipped = tip(times)
    step = 0.5e-3
    apart = tip(times + step)[3] - tip(times - step)[3]
    sliding = apart - normal * np.sum(apart * normal, axis=1, keepdims=True)
    along = sliding / np.linalg.norm(sliding, axis=1, keepdims=True)

    def in_rig(at: Array) -> Array:
        turn, origin = motion(at)
        return np.asarray(origin + _rotated(turn, tip(at)[3]))

    outward = _rotated(rotation, normal)
    on_tool = outward * force[:, None] - _rotated(rotation, along) * (friction * force)[:, None]
    slow = slow_process(count, 1.0 / CONTACT_HZ, SLOW_S, rng) * SLOW_M
    aside = slow_process(3 * count, 1.0 / CONTACT_HZ, SLOW_S, rng).reshape(3, count).T * SIDEWAYS_M
    aside -= outward * np.sum(aside * outward, axis=1, keepdims=True)
    point = place + _rotated(rotation, tipped) + outward * slow[:, None] + aside
    point = point + WHITE_M * rng.standard_normal((count, 3))
    zero = FORCE_ZERO_N * rng.standard_normal(3)
    felt = on_tool + zero + FORCE_NOISE_N * rng.standard_normal((count, 3))
    return World(
        times_s=times,
        rotation=rotation,
        place_m=place,
        touched_m=place + _rotated(rotation, surface),
        normal=outward,
        point_m=STEP_M * np.round(point / STEP_M),
        force_N=np.sum(felt * outward, axis=1),
        force_vector_N=felt,
        velocity_m_per_s=(in_rig(times + step) - in_rig(times - step)) / (2.0 * step),
        pictures=tuple(pictures_of(scenario, motion, rng)),
    )


def plate_motion(scenario: Scenario, rng: np.random.Generator) -> Motion:
    """A plate at rest, or one whose six velocities are smoothed noise."""
    start = Rotation.random(random_state=rng)
    middle = np.array([0.1, 0.0, 0.0]) + 0.02 * rng.standard_normal(3)
    count = round((scenario.seconds + 2.0 * MARGIN_S) / FINE_S)
    noise = [slow_process(count, FINE_S, MOTION_S, rng) for _ in range(6)]
    if not scenario.moving:
        return lambda times: (
            np.tile(start.as_matrix(), (len(times), 1, 1)),
            np.tile(middle, (len(times), 1)),
        )
    fine = FINE_S * np.arange(count) - MARGIN_S
    sizes = np.repeat([SPIN_RAD_PER_S, SPEED_M_PER_S], 3)
    ways = np.cumsum(sizes * np.stack([_smoothed(part) for part in noise], axis=1), axis=0) * FINE_S
    attitudes = [start.as_matrix()]
    for turn in Rotation.from_rotvec(np.diff(ways[::KNOTS, :3], axis=0)).as_matrix():
        attitudes.append(turn @ attitudes[-1])
    turn_at = RotationSpline(fine[::KNOTS], Rotation.from_matrix(attitudes))
    place_at = CubicSpline(fine, ways[:, 3:] - ways[0, 3:])
    return lambda times: (turn_at(times).as_matrix(), middle + place_at(times))


def pictures_of(scenario: Scenario, motion: Motion, rng: np.random.Generator) -> list[Picture]:
    """Pictures in the order of their arrival: late, noisy, biased, dropped, mirrored in bursts."""
    count = int(scenario.seconds * CAMERA_HZ)
    exposed = np.sort(np.arange(count) / CAMERA_HZ + rng.uniform(-2e-3, 2e-3, count) + 2e-3)
    arrives = exposed + rng.uniform(*DELAY_S, count)
    kept = rng.random(count) >= DROPPED
    kept &= exposed < scenario.seconds - scenario.blackout_s
    flipped = _bursts(count, scenario.flips, rng)
    camera = Rotation.random(random_state=rng)
    axes = camera.as_matrix()
    rotation, place = motion(exposed)
    bias_turn, bias_place = BIAS_RAD * rng.standard_normal(3), BIAS_M * rng.standard_normal(3)
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = axes @ np.diag(np.square(NOISE_RAD)) @ axes.T
    covariance[3:, 3:] = axes @ np.diag(np.square(NOISE_M)) @ axes.T
    bias = Rotation.from_rotvec(bias_turn)
    pictures = []
    for index in np.flatnonzero(kept):
        turn = Rotation.from_rotvec(axes @ (np.array(NOISE_RAD) * rng.standard_normal(3)))
        measured = (turn * bias * Rotation.from_matrix(rotation[index])).as_matrix()
        if flipped[index]:
            measured = _mirrored(measured, axes[:, 2])
        where = place[index] + bias_place + axes @ (np.array(NOISE_M) * rng.standard_normal(3))
        stamp = float(exposed[index] + EXPOSURE_JITTER_S * rng.standard_normal())
        certain = bool(rng.random() >= (DOUBTED_FLIPS if flipped[index] else DOUBTED))
        pictures.append(Picture(stamp, float(arrives[index]), measured, where, covariance, certain))
    return sorted(pictures, key=lambda picture: picture.arrives_s)


def _mirrored(rotation: Array, sight: Array) -> Array:
    """The second pose of a plane: its normal mirrored at the line of sight."""
    normal = rotation[:, 2]
    across = np.cross(normal, sight)
    tilt = math.atan2(float(np.linalg.norm(across)), float(normal @ sight))
    if tilt > 0.5 * math.pi:
        tilt -= math.pi
    turn = Rotation.from_rotvec(2.0 * tilt * across / max(float(np.linalg.norm(across)), 1e-9))
    return np.asarray(turn.as_matrix() @ rotation)


def _bursts(count: int, share: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Pictures in bursts of 3 to 8, which take ``share`` of all; never the first ten."""
    hit = np.zeros(count, dtype=bool)
    while hit.sum() < share * count:
        at = int(rng.integers(10, count))
        hit[at : at + int(rng.integers(3, 9))] = True
    return hit


def slow_process(count: int, step_s: float, time_s: float, rng: np.random.Generator) -> Array:
    """A first-order process of unit variance."""
    keep = math.exp(-step_s / time_s)
    drawn = rng.standard_normal(count) * math.sqrt(1.0 - keep * keep)
    drawn[0] /= math.sqrt(1.0 - keep * keep)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn))


def _smoothed(velocity: Array) -> Array:
    """Velocities behind a low-pass of SMOOTH_S, so that a plate has no jerks."""
    keep = math.exp(-FINE_S / SMOOTH_S)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], velocity))


def _rotated(rotation: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", rotation, vectors))
