"""Fit a camera, a board's bend and its poses to seen corners at once, robustly.

The unknowns are what all views share - the camera's free parameters and how far the board bulges
along either side - and six numbers per view (Triggs et al. 2000, doi:10.1007/3-540-44480-7_21).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.ascent import least_squares
from scissorcal.vision.geometry.camera import PARAMETERS

DEGREES_OF_FREEDOM = 5.0
"""Of the Student-t that corner errors are taken from: a bad corner pulls less the worse it is."""

SHARED = (*PARAMETERS, "bulge_x", "bulge_y")
"""What the views of a fit share: the camera's nine parameters, and the board's bulges in metres."""

LEAST_SD_PX = 0.01
_ROUNDS = 20
_SETTLED = 1e-3
"""Relative change of the scale from which on it stays; the camera then moves by far less."""

_PRECISION = 1e-8


@dataclass(frozen=True)
class SeenBoard:
    """Corners of a board in one photograph: ``points`` (n, 3) in its frame, ``pixels`` (n, 2).

    ``size_m`` are the board's width and height, ``bulge_sd_m`` is the prior standard deviation of
    either bulge.
    """

    name: str
    points: Array
    pixels: Array
    size_m: tuple[float, float]
    bulge_sd_m: float

    @property
    def bulges(self) -> Array:
        """How high (n, 2) a corner stands where the middle bulges by 1, along either side.

        A parabola that is 0 at the board's borders (as mrcal has it).
        """
        half = 0.5 * np.asarray(self.size_m)
        return np.asarray(1.0 - ((self.points[:, :2] - half) / half) ** 2)


@dataclass(frozen=True)
class Bundle:
    """A fitted camera with its views.

    ``shared`` (11,) are the parameters `SHARED`, moved by ``spread`` (11, p) times the p free ones;
    ``poses`` (views, 6) rotation vector and
    translation of each board in the camera's frame, ``residuals`` and ``weights`` of each view (n,
    2) and (n,). ``sd_px`` is the scale of corner errors. ``information`` (views, p, p) is what each
    view says of the free parameters once its pose is taken out, ``scores`` (views, p) its pull at
    the optimum, ``noise`` (p, p) the sum of outer products of single corners' pulls; ``prior``
    (p, p) is what the prior adds to the information.
    """

    spread: Array
    shared: Array
    poses: Array
    residuals: tuple[Array, ...]
    weights: tuple[Array, ...]
    sd_px: float
    information: Array
    scores: Array
    noise: Array
    prior: Array
    converged: bool

    @property
    def camera(self) -> Array:
        """The camera's nine parameters."""
        return self.shared[: len(PARAMETERS)]

    @property
    def rms_px(self) -> Array:
        """Root of the mean squared distance (views,) between seen and predicted corners."""
        return np.array([np.sqrt(np.mean(np.sum(r**2, axis=1))) for r in self.residuals])


def fit_bundle(
    views: Sequence[SeenBoard], spread: Array, shared: Array, poses: Array | None = None
) -> Bundle:
    """Maximise the Student-t likelihood of all corners over the camera and all poses.

    Starts at ``shared`` (11,), which moves by ``spread`` (11, p) times the p free parameters, and
    at ``poses`` (found from the camera where None). Least squares on robust residuals with the
    scale held, and the scale that the residuals show, follow each other until the scale stays.
    """
    if poses is None:
        poses = np.array([first_pose(view, shared[: len(PARAMETERS)]) for view in views])
    size = spread.shape[1]

    def place(point: Array) -> _Place:
        moved = shared + spread @ point[:size]
        return _Place(views, spread, moved, point[size:].reshape(-1, 6))

    def fitted(start: Array, sd_px: float) -> tuple[Array, bool]:
        return least_squares(lambda x: place(x).rows(sd_px), start, precision=_PRECISION)

    point = np.concatenate([np.zeros(size), poses.ravel()])
    sd_px, converged = place(point).scale(), False
    for _ in range(_ROUNDS):
        held = sd_px
        point, converged = fitted(point, held)
        sd_px = place(point).scale(held)
        if abs(np.log(sd_px / held)) < _SETTLED:
            break
    return place(point).bundle(sd_px, converged)


def fit_pose(view: SeenBoard, shared: Array, start: Array) -> Array:
    """Fit a board's pose, all else known, from ``start`` (6,); return its residuals (n, 2)."""
    nothing = np.zeros((len(SHARED), 0))
    return fit_bundle([view], nothing, shared, start[None]).residuals[0]


def first_pose(view: SeenBoard, camera: Array) -> Array:
    """Pose (6,) of a flat board by its homography and some steps of refinement."""
    import cv2

    matrix, bend = _matrix(camera), camera[4:]
    found, turn, shift = cv2.solvePnP(
        view.points, view.pixels, matrix, bend, flags=cv2.SOLVEPNP_ITERATIVE
    )
    if not found or shift[2, 0] <= 0.0:
        _, turns, shifts, _ = cv2.solvePnPGeneric(
            view.points, view.pixels, matrix, bend, flags=cv2.SOLVEPNP_IPPE
        )
        turn, shift = turns[0], shifts[0]
    return np.concatenate([turn.ravel(), shift.ravel()]).astype(np.float64)


def projected(points: Array, pose: Array, camera: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2), and their slopes (2 n, 6) by the pose and (2 n, 9) by the camera."""
    import cv2

    pixels, slope = cv2.projectPoints(points, pose[:3], pose[3:], _matrix(camera), camera[4:])
    flat = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
    return flat, np.asarray(slope[:, :6]), np.asarray(slope[:, 6:15])


def seen(view: SeenBoard, pose: Array, shared: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2) of a bent board, and their slopes (2 n, 6) by pose, (2 n, 11) by `SHARED`."""
    import cv2

    bulges = view.bulges
    bent = view.points + np.outer(bulges @ shared[-2:], [0.0, 0.0, 1.0])
    pixels, by_pose, by_camera = projected(bent, pose, shared[: len(PARAMETERS)])
    outward = by_pose[:, 3:] @ cv2.Rodrigues(pose[:3])[0][:, 2]
    by_bulge = outward[:, None] * np.repeat(bulges, 2, axis=0)
    return pixels, by_pose, np.hstack([by_camera, by_bulge])


def _matrix(camera: Array) -> Array:
    return np.array([[camera[0], 0.0, camera[2]], [0.0, camera[1], camera[3]], [0.0, 0.0, 1.0]])


class _Place:
    """Residuals (n, 2) and slopes of every view at one camera (``shared``) and ``poses``."""

    def __init__(
        self, views: Sequence[SeenBoard], spread: Array, shared: Array, poses: Array
    ) -> None:
        self.spread, self.shared, self.poses = spread, shared, poses
        self.bulge_sd_m = views[0].bulge_sd_m
        self.residuals: list[Array] = []
        self.by_pose: list[Array] = []
        self.by_shared: list[Array] = []
        for view, pose in zip(views, poses, strict=True):
            pixels, by_pose, by_shared = seen(view, pose, shared)
            self.residuals.append(view.pixels - pixels)
            self.by_pose.append(by_pose)
            self.by_shared.append(by_shared @ spread)

    def rows(self, sd_px: float) -> tuple[Array, Array]:
        """Rows whose squares are the likelihood's and the prior's, and their slopes.

        Infinite behind the camera. A corner's residual r counts as (rho / |r|^2)^(1/2) r, whose
        square is rho = (nu + 2) sd^2 log(1 + |r|^2 / (nu sd^2)). Each view is rotated so that six
        rows hold its pose and the others the shared parameters alone; those are rotated together
        again, which leaves 6 views + p + 1 rows.
        """
        size, views = self.spread.shape[1], len(self.poses)
        of_poses = np.zeros((6 * views, size + 6 * views + 1))
        common = []
        for index in range(views):
            turned = np.asarray(np.linalg.qr(self._robust(index, sd_px), mode="r"))
            six = slice(6 * index, 6 * index + 6)
            of_poses[six, :size], of_poses[six, -1] = turned[:6, 6:-1], turned[:6, -1]
            of_poses[six, size + 6 * index : size + 6 * index + 6] = turned[:6, :6]
            common.append(turned[6:, 6:])
        prior = np.sqrt(self._precision(sd_px))[:, None]
        common.append(prior * np.column_stack([self.spread, self.shared]))
        rest = np.asarray(np.linalg.qr(np.concatenate(common), mode="r"))
        whole = np.zeros((len(of_poses) + len(rest), of_poses.shape[1]))
        whole[: len(of_poses)] = of_poses
        whole[len(of_poses) :, :size], whole[len(of_poses) :, -1] = rest[:, :-1], rest[:, -1]
        if np.any(self.poses[:, 5] <= 0.0):
            whole[:, -1] = np.inf
        return whole[:, -1], whole[:, :-1]

    def _robust(self, index: int, sd_px: float) -> Array:
        """Slopes by pose, by free parameters, and the robust residuals (2 n, 6 + p + 1)."""
        residual = self.residuals[index]
        squared = np.maximum(np.sum(residual**2, axis=1), 1e-20)
        nu, variance = DEGREES_OF_FREEDOM, sd_px**2
        rho = (nu + 2.0) * variance * np.log1p(squared / (nu * variance))
        factor = np.sqrt(rho / squared)
        bent = (_weights(residual, sd_px) - rho / squared) / (factor * squared)
        slopes = np.hstack([self.by_pose[index], self.by_shared[index]])
        by_corner = slopes.reshape(len(residual), 2, -1)
        along = np.einsum("nk,nkp->np", residual, by_corner)
        turned = factor[:, None, None] * by_corner
        turned += (bent[:, None] * residual)[:, :, None] * along[:, None, :]
        return np.column_stack(
            [-turned.reshape(slopes.shape), (factor[:, None] * residual).ravel()]
        )

    def scale(self, start_px: float | None = None) -> float:
        """Scale of the Student-t, per coordinate, by its fixed point."""
        residual = np.concatenate(self.residuals)
        squared = np.sum(residual**2, axis=1)
        unknowns = self.poses.size + self.spread.shape[1]
        spare = max(2.0 * len(squared) - unknowns, 2.0)
        sd_px = start_px or float(np.sqrt(np.sum(squared) / spare))
        for _ in range(_ROUNDS):
            summed = float(np.sum(_weights(residual, sd_px) * squared))
            sd_px = max(float(np.sqrt(summed / spare)), LEAST_SD_PX)
        return sd_px

    def bundle(self, sd_px: float, converged: bool) -> Bundle:
        """What the fit knows here: information by view, pulls of views and of single corners."""
        size = self.spread.shape[1]
        weights = [_weights(residual, sd_px) for residual in self.residuals]
        curvature = _curvature(np.concatenate(self.residuals), np.concatenate(weights), sd_px)
        information, scores, noise = [], [], np.zeros((size, size))
        rows = zip(self.by_shared, self.by_pose, self.residuals, weights, strict=True)
        for by_shared, by_pose, residual, weight in rows:
            doubled = np.repeat(weight, 2)[:, None]
            inner = by_pose.T @ (doubled * by_pose)
            share = np.linalg.solve(inner, by_pose.T @ (doubled * by_shared)).T
            less_pose = by_shared - by_pose @ share.T
            pulls = less_pose * (doubled * residual.reshape(-1, 1))
            information.append(curvature * less_pose.T @ (doubled * by_shared))
            scores.append(pulls.sum(axis=0))
            single = pulls.reshape(len(residual), 2, size).sum(axis=1)
            # The pose has taken up six of the residuals' degrees of freedom.
            noise += single.T @ single * residual.size / max(residual.size - 6, 1)
        return Bundle(
            self.spread,
            self.shared,
            self.poses,
            tuple(self.residuals),
            tuple(weights),
            sd_px,
            np.array(information),
            np.array(scores),
            noise,
            self.spread.T @ (self._precision(sd_px)[:, None] * self.spread),
            converged,
        )

    def _precision(self, sd_px: float) -> Array:
        """The prior's weight (11,) on squares of the shared parameters, as a corner's has it."""
        weight = np.zeros(len(SHARED))
        weight[len(PARAMETERS) :] = (sd_px / self.bulge_sd_m) ** 2
        return weight


def _weights(residual: Array, sd_px: float) -> Array:
    """Weights (n,) of corners under the Student-t."""
    nu = DEGREES_OF_FREEDOM
    return np.asarray((nu + 2.0) / (nu + np.sum(residual**2, axis=1) / sd_px**2))


def _curvature(residual: Array, weight: Array, sd_px: float) -> float:
    """How much less the likelihood bends at its top than the weights alone would have it.

    A weight w falls as its corner moves off, so the slope of the pull w r, over both ways, is
    w - w^2 r^2 / ((nu + 2) sd^2).
    """
    squared = np.sum(residual**2, axis=1)
    lost = weight**2 * squared / ((DEGREES_OF_FREEDOM + 2.0) * sd_px**2)
    return float(np.sum(weight - lost) / np.sum(weight))
