"""Cells of geometry and photographs: poses at half a turn, plates edge-on, cameras of few views.

Photographs are points through a pinhole that is written out here.
"""

from collections.abc import Callable

import numpy as np
from benchmarks.extremes.cells import Cell, Found, judged, worst_of

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.camera.fit import fit_camera
from scissorcal.calibration.plate.fit import fit_plate
from scissorcal.verdicts import failed
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, difference, left_jacobian
from scissorcal.vision.targets.boards import CAMERA_BOARD, PLATE_BOARD
from scissorcal.vision.targets.detect import Detection

Spoil = Callable[[Array], Array]

FOCAL, WIDTH, HEIGHT = 1200.0, 1280, 720
NOISE_PX = 0.1
AXIS = np.array([0.6, -0.64, 0.48])
"""A unit vector along no axis of a frame."""
SQUARE = 45.0
"""Stated chi-square of a pose, six degrees of freedom: one in 20 million is above it. The sd of
corners is estimated from 24 of them, which costs the rest of the margin."""
ROUNDED = 1e-14
"""Stated error of rotations, rad: rounding of a few products of numbers up to one."""


def cells() -> tuple[Cell, ...]:
    """The cells of geometry and of photographs."""
    near_pi = "rotation to 1e-14 rad"
    angles = (("half a turn", np.pi), ("half a turn less 1e-12", np.pi - 1e-12),
              ("half a turn and 1e-8", np.pi + 1e-8), ("a rotation of 1e-12 rad", 1e-12),
              ("a rotation of 1e-300 rad", 1e-300), ("1e6 turns", 2e6 * np.pi))  # fmt: skip
    poses = tuple(
        Cell(f"pose: {name}", "vision", f"rotation by {name}", near_pi,
             "Rodrigues' formula", lambda rng, a=angle: _turned(a))  # type: ignore[misc]
        for name, angle in angles
    )  # fmt: skip
    slopes = Cell(
        "slopes of a rotation", "vision", "rotations from 1e-9 rad to half a turn",
        "left Jacobian to 1e-9", "its series and its closed form", lambda rng: _slopes(),
    )  # fmt: skip
    no_pose = tuple(
        Cell(f"pose of {name}", "vision", extreme, "refused in a sentence", "there is no answer",
             lambda rng, m=make: _no_pose(m))  # type: ignore[misc]
        for name, extreme, make in (
            ("NaN", "a rotation vector of NaN",
             lambda: Pose.from_rotation_vector([np.nan, 0.0, 0.0], np.zeros(3))),
            ("an infinite place", "a translation of infinity",
             lambda: Pose.from_matrix(np.eye(3), [np.inf, 0.0, 0.0])),
            ("a mirror", "a matrix that mirrors",
             lambda: Pose.from_matrix(np.diag([1.0, 1.0, -1.0]), np.zeros(3))),
            ("a stretched matrix", "a matrix that doubles lengths",
             lambda: Pose.from_matrix(2.0 * np.eye(3), np.zeros(3))),
            ("a quaternion of zeros", "a quaternion of length 0",
             lambda: Pose((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
        )
    )  # fmt: skip
    here = np.array([0.0, 0.0, 0.4])
    plates = tuple(
        _plate(name, extreme, vector, place, spoil)
        for name, extreme, vector, place, spoil in (
            ("everyday plate", "nothing", [0.6, 0.0, 0.0], here, None),
            ("plate square-on", "seen square-on", [0.0, 0.0, 0.0], here, None),
            ("plate square-on, half a turn", "turned by half a turn", [0.0, 0.0, np.pi], here,
             None),
            *((f"plate {deg:g} deg from square-on", f"seen under {90 - deg:g} deg",
               [np.radians(deg), 0.0, 0.0], here, None) for deg in (80, 89, 89.9, 90)),
            ("plate 40 m away", "24 corners within a pixel or two", [0.6, 0.0, 0.0],
             here * 100.0, None),
            ("plate 10 cm away", "beyond the picture's borders", [0.3, 0.0, 0.0], here / 4.0, None),
            ("plate with a corner of NaN", "a corner is NaN", [0.6, 0.0, 0.0], here,
             lambda uv: _spoilt(uv, 1, np.nan)),
            ("plate with a corner 1e6 px off", "outlier of 1e7 sd", [0.6, 0.0, 0.0], here,
             lambda uv: _spoilt(uv, 1, 1e6)),
            ("plate with five corners 300 px off", "a fifth of the corners are wrong",
             [0.6, 0.0, 0.0], here, lambda uv: _spoilt(uv, 5, 300.0)),
            ("plate whose corners coincide", "all corners at one pixel", [0.6, 0.0, 0.0], here,
             lambda uv: np.repeat(uv[:1], len(uv), axis=0)),
            ("plate without noise", "corners exact", [0.6, 0.0, 0.0], here, np.asarray),
            ("plate with noise of 1,000 px", "noise as wide as the picture", [0.6, 0.0, 0.0], here,
             lambda uv: uv + 1e3 * np.random.default_rng(1).standard_normal(uv.shape)),
        )
    )  # fmt: skip
    few = tuple(
        Cell(f"plate by {name}", "vision", name, "refused in a sentence, or flagged",
             "there is no answer", lambda rng, k=keep: _few(k, rng))  # type: ignore[misc]
        for name, keep in (("3 corners", [0, 5, 18]), ("corners on a line", [0, 1, 2, 3, 4, 5]))
    )  # fmt: skip
    stated = "focal length within 5 of its sds, or flagged, or refused in a sentence"
    views = tuple(
        Cell(name, "vision", extreme, stated, "by construction", run, slow="edge-on" in name)
        for name, extreme, run in (
            ("camera by no photograph", "0 photographs", lambda rng: _camera(rng, 0, 0.5)),
            ("camera by 2 photographs", "2 photographs", lambda rng: _camera(rng, 2, 0.5)),
            ("camera by 3 photographs", "3 photographs", lambda rng: _camera(rng, 3, 0.5)),
            ("camera by square-on photographs", "8 boards square-on",
             lambda rng: _camera(rng, 8, 0.0)),
            ("camera by one photograph 8 times", "8 equal photographs",
             lambda rng: _camera(rng, 8, 0.5, alike=True)),
            ("camera by edge-on photographs", "8 boards 89 deg from square-on",
             lambda rng: _camera(rng, 8, np.radians(89.0))),
            ("camera by a NaN", "a corner is NaN", lambda rng: _camera(rng, 8, 0.5, bad=np.nan)),
            ("camera by a corner 1e6 px off", "outlier of 1e7 sd",
             lambda rng: _camera(rng, 8, 0.5, bad=1e6)),
        )
    )  # fmt: skip
    return (*poses, slopes, *no_pose, *plates, *few, *views)


def rotation(vector: Array) -> Array:
    """Matrix (3, 3) of a rotation vector, by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle) * cross + 2.0 * np.sin(0.5 * angle) ** 2 * cross @ cross
    )


def _turned(angle: float) -> Found:
    """To a rotation vector, to a quaternion, and back; and the inverse."""
    within = float(np.remainder(angle, 2.0 * np.pi)) if angle > 7.0 else angle
    pose = Pose.from_rotation_vector(angle * AXIS, [0.1, -0.2, 0.3])
    true = rotation(within * AXIS)
    allowed = ROUNDED + np.spacing(angle)
    back = rotation(pose.rotation_vector)
    unit = pose.inverse().after(pose)
    errors = (
        np.abs(pose.matrix - true).max(),
        np.abs(back - true).max(),
        np.abs(unit.matrix - np.eye(3)).max(),
        np.abs(unit.translation_m).max(),
        np.abs(difference(pose, pose)).max(),
    )
    return worst_of([judged(float(error), allowed, "rotation, rad") for error in errors])


def _slopes() -> Found:
    found = []
    for angle in (1e-9, 1e-7, 9e-7, 2e-6, 1e-4, 1e-2, 1.0, 3.0, np.pi):
        x, y, z = AXIS
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        first = 2.0 * np.sin(0.5 * angle) ** 2 / angle
        second = angle**2 / 6.0 - angle**4 / 120.0 if angle < 0.02 else 1 - np.sin(angle) / angle
        true = np.eye(3) + first * cross + second * cross @ cross
        error = float(np.abs(left_jacobian(angle * AXIS) - true).max())
        found.append(judged(error, 1e-9, "left Jacobian"))
    return worst_of(found)


def _no_pose(make: Callable[[], Pose]) -> Found:
    return Found("wrong", f"a pose: {make()}")


def _seen(points: Array, turn: Array, place: Array) -> Array:
    """Pixels (n, 2) of points before the pinhole."""
    moved = points @ turn.T + place
    return FOCAL * moved[:, :2] / moved[:, 2:] + [0.5 * WIDTH, 0.5 * HEIGHT]


def _plate(name: str, extreme: str, vector: list[float], place: Array, spoil: Spoil | None) -> Cell:
    def run(rng: np.random.Generator) -> Found:
        points = PLATE_BOARD.points
        turn = rotation(np.array(vector))
        middle = place - turn @ points.mean(axis=0)
        photos = []
        for index in range(2):
            pixels = _seen(points, turn, middle)
            pixels = (
                pixels + NOISE_PX * rng.standard_normal(pixels.shape)
                if spoil is None
                else spoil(pixels)
            )
            photos.append(_detection(pixels, np.arange(len(points)), f"plate-{index}"))
        fit = fit_plate(photos, _pinhole())
        bad = failed(fit.verdicts)
        away = difference(fit.camera_plate, Pose.from_matrix(turn, middle))
        assert fit.camera_plate.covariance is not None
        square = float(away @ np.linalg.solve(fit.camera_plate.covariance, away))
        if bad and not square <= SQUARE:
            return Found("flagged", "; ".join(verdict.why for verdict in bad), square, SQUARE)
        return judged(square, SQUARE, "chi-square of the pose")

    stated = "chi-square of the pose up to 45, or flagged, or refused in a sentence"
    return Cell(name, "vision", extreme, stated, "by construction", run)


def _few(keep: list[int], rng: np.random.Generator) -> Found:
    points = PLATE_BOARD.points[keep]
    turn = rotation(np.array([0.6, 0.0, 0.0]))
    pixels = _seen(points, turn, np.array([0.0, 0.0, 0.4]))
    pixels = pixels + NOISE_PX * rng.standard_normal(pixels.shape)
    fit = fit_plate([_detection(pixels, np.array(keep), "plate")], _pinhole())
    bad = failed(fit.verdicts)
    return Found("flagged" if bad else "wrong", "; ".join(verdict.why for verdict in bad))


def _camera(
    rng: np.random.Generator,
    count: int,
    tilt: float,
    *,
    alike: bool = False,
    bad: float | None = None,
) -> Found:
    """Photographs of the camera board under one tilt, in directions that go round."""
    points = CAMERA_BOARD.points
    photos = []
    for index in range(count):
        way = 2.0 * np.pi * (0 if alike else index) / max(count, 1)
        turn = rotation(tilt * np.array([np.cos(way), np.sin(way), 0.0]))
        place = np.array([0.0, 0.0, 0.5]) - turn @ points.mean(axis=0)
        if not alike:
            place = place + np.array([0.04 * np.cos(3 * way), 0.03 * np.sin(way), 0.0])
        pixels = _seen(points, turn, place)
        pixels = pixels + NOISE_PX * rng.standard_normal(pixels.shape)
        if bad is not None and index == 0:
            pixels = _spoilt(pixels, 1, bad)
        ids, name = np.arange(len(points)), f"board-{index}"
        photos.append(Detection(CAMERA_BOARD, ids, pixels, 60.0, name, WIDTH, HEIGHT))
    fit = fit_camera(photos, rng=rng)
    assert fit.camera.covariance is not None
    away = abs(fit.camera.fx - FOCAL) / float(np.sqrt(fit.camera.covariance[0, 0]))
    wrong = failed(fit.verdicts)
    if wrong:
        return Found("flagged", "; ".join(verdict.why for verdict in wrong), away, 5.0)
    return judged(away, 5.0, "focal length, in its sds")


def _spoilt(pixels: Array, count: int, value: float) -> Array:
    """The first corners moved by ``value`` px, NaN included."""
    spoilt = pixels.copy()
    spoilt[:count] += value
    return spoilt


def _detection(pixels: Array, ids: Integers, source: str) -> Detection:
    return Detection(PLATE_BOARD, ids, pixels, 60.0, source, WIDTH, HEIGHT)


def _pinhole() -> Camera:
    return Camera(FOCAL, FOCAL, 0.5 * WIDTH, 0.5 * HEIGHT, (0.0,) * 5, WIDTH, HEIGHT)
