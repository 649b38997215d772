"""Fit a camera, a board's bend and its poses to seen corners at once, robustly.

The unknowns are what all views share - the camera's free parameters and how far the board bulges
along either side - and six numbers per view. So each step solves a small system for what is shared
and one of six for every view (Schur complement; Triggs et al. 2000, doi:10.1007/3-540-44480-7_21).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.geometry.camera import PARAMETERS

Array = NDArray[np.float64]

DEGREES_OF_FREEDOM = 5.0
"""Of the Student-t that corner errors are taken from: a bad corner pulls less the worse it is."""

SHARED = (*PARAMETERS, "bulge_x", "bulge_y")
"""What the views of a fit share: the camera's nine parameters, and the board's bulges in metres."""

BULGE_SD_M = 1e-3
"""Prior standard deviation of a bulge: a sheet glued to something stiff bends less than that."""

LEAST_SD_PX = 0.01
_STEPS = 100
_SETTLED = 1e-7


@dataclass(frozen=True)
class SeenBoard:
    """Corners of a board in one photograph: ``points`` (n, 3) in its frame, ``pixels`` (n, 2).

    ``size_m`` are the board's width and height.
    """

    name: str
    points: Array
    pixels: Array
    size_m: tuple[float, float]

    @property
    def bulges(self) -> Array:
        """How high (n, 2) a corner stands where the middle bulges by 1, along either side.

        A parabola that is 0 at the board's borders (as mrcal has it).
        """
        half = 0.5 * np.asarray(self.size_m)
        return np.asarray(1.0 - ((self.points[:, :2] - half) / half) ** 2)


@dataclass(frozen=True)
class Structure:
    """Which of the parameters `SHARED` are free, and how: parameters = base + spread @ free."""

    names: tuple[str, ...]
    spread: Array


@dataclass(frozen=True)
class Bundle:
    """A fitted camera with its views.

    ``shared`` (11,) are the parameters `SHARED`, ``poses`` (views, 6) rotation vector and
    translation of each board in the camera's frame, ``residuals`` and ``weights`` of each view (n,
    2) and (n,). ``sd_px`` is the scale of corner errors. ``information`` (views, p, p) is what each
    view says of the free parameters once its pose is taken out, ``scores`` (views, p) its pull at
    the optimum, ``noise`` (p, p) the sum of outer products of single corners' pulls; ``prior``
    (p, p) is what the prior adds to the information.
    """

    structure: Structure
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
    views: Sequence[SeenBoard], structure: Structure, shared: Array, poses: Array | None = None
) -> Bundle:
    """Maximise the Student-t likelihood of all corners over the camera and all poses.

    Starts at ``shared`` (11,), whose parameters that are not free are held, and at ``poses`` (found
    from the camera where None). Scale and weights follow by iterated reweighting, each step damped
    after Levenberg and Marquardt.
    """
    if poses is None:
        poses = np.array([first_pose(view, shared[: len(PARAMETERS)]) for view in views])
    state = _State(views, structure, shared.copy(), poses.copy())
    damping, converged = 1e-4, False
    for _ in range(_STEPS):
        step = state.step(damping)
        tried = state.moved(*step)
        if tried.cost <= state.cost:
            gain = state.cost - tried.cost
            state = tried.reweighted()
            damping = max(0.2 * damping, 1e-12)
            if gain <= _SETTLED * max(state.cost, 1e-12):
                converged = True
                break
        else:
            damping *= 10.0
            if damping > 1e12:
                converged = True
                break
    return state.finished(converged)


def fit_pose(view: SeenBoard, shared: Array, start: Array) -> Array:
    """Fit a board's pose, all else known, from ``start`` (6,); return its residuals (n, 2)."""
    nothing = Structure((), np.zeros((len(SHARED), 0)))
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


class _State:
    """Where a fit stands: parameters, residuals and slopes, weights and scale."""

    def __init__(
        self,
        views: Sequence[SeenBoard],
        structure: Structure,
        shared: Array,
        poses: Array,
        weighting: tuple[list[Array], float] | None = None,
    ) -> None:
        self.views, self.structure, self.shared, self.poses = views, structure, shared, poses
        self.residuals: list[Array] = []
        self.by_pose: list[Array] = []
        self.by_shared: list[Array] = []
        for view, pose in zip(views, poses, strict=True):
            pixels, by_pose, by_shared = seen(view, pose, shared)
            self.residuals.append(view.pixels - pixels)
            self.by_pose.append(by_pose)
            self.by_shared.append(by_shared @ structure.spread)
        if weighting is None:
            self.sd_px = self._scale(np.ones(sum(map(len, self.residuals))))
            self.weights = self._weights()
        else:
            self.weights, self.sd_px = weighting

    @property
    def cost(self) -> float:
        """Weighted sum of squared residuals and the prior's; infinite behind the camera."""
        total = self._prior_cost() + sum(
            float(np.sum(w[:, None] * r**2))
            for w, r in zip(self.weights, self.residuals, strict=True)
        )
        return total if np.isfinite(total) and np.all(self.poses[:, 5] > 0.0) else np.inf

    def reweighted(self) -> "_State":
        """Estimate scale and weights anew at the same place."""
        self.sd_px = self._scale(np.concatenate(self.weights))
        self.weights = self._weights()
        return self

    def moved(self, step: Array, pose_steps: Array) -> "_State":
        shared = self.shared + self.structure.spread @ step
        return _State(
            self.views, self.structure, shared, self.poses + pose_steps, (self.weights, self.sd_px)
        )

    def step(self, damping: float) -> tuple[Array, Array]:
        """Damped Gauss-Newton steps of the free shared parameters (p,) and all poses (views, 6)."""
        size = self.structure.spread.shape[1]
        normal = self._prior()
        pull = -self.structure.spread.T @ (self._precision() * self.shared)
        kept = []
        for A, B, C, a, b in self._blocks():
            C = C + damping * np.diag(np.diag(C))
            inverse = np.linalg.inv(C)
            normal += A + damping * np.diag(np.diag(A)) - B @ inverse @ B.T
            pull += a - B @ inverse @ b
            kept.append((inverse, B, b))
        step: Array = np.asarray(np.linalg.solve(normal, pull) if size else pull)
        poses = np.array([inverse @ (b - B.T @ step) for inverse, B, b in kept])
        return step, poses

    def finished(self, converged: bool) -> Bundle:
        size = self.structure.spread.shape[1]
        information, scores, noise = [], [], np.zeros((size, size))
        curvature = self._curvature()
        rows = zip(
            self._blocks(), self.by_shared, self.by_pose, self.residuals, self.weights, strict=True
        )
        for (A, B, C, a, b), by_shared, by_pose, residual, weight in rows:
            share = np.linalg.solve(C, B.T).T
            information.append(curvature * (A - share @ B.T))
            scores.append(a - share @ b)
            own = by_shared - by_pose @ share.T
            pulls = (own * (weight[:, None] * residual).reshape(-1, 1)).reshape(
                len(residual), 2, size
            )
            single = pulls.sum(axis=1)
            # The pose has taken up six of the residuals' degrees of freedom.
            noise += single.T @ single * residual.size / max(residual.size - 6, 1)
        return Bundle(
            self.structure,
            self.shared,
            self.poses,
            tuple(self.residuals),
            tuple(self.weights),
            self.sd_px,
            np.array(information),
            np.array(scores),
            noise,
            self._prior(),
            converged,
        )

    def _blocks(self) -> list[tuple[Array, Array, Array, Array, Array]]:
        blocks = []
        rows = zip(self.by_shared, self.by_pose, self.residuals, self.weights, strict=True)
        for by_shared, by_pose, residual, weight in rows:
            doubled = np.repeat(weight, 2)[:, None]
            flat = residual.ravel()
            weighted, weighted_pose = doubled * by_shared, doubled * by_pose
            blocks.append(
                (
                    by_shared.T @ weighted,
                    by_shared.T @ weighted_pose,
                    by_pose.T @ weighted_pose,
                    weighted.T @ flat,
                    weighted_pose.T @ flat,
                )
            )
        return blocks

    def _curvature(self) -> float:
        """How much less the likelihood bends at its top than the weights alone would have it.

        A weight w falls as its corner moves off, so the slope of the pull w r, over both ways, is
        w - w^2 r^2 / ((nu + 2) sd^2).
        """
        weight = np.concatenate(self.weights)
        squared = np.sum(np.concatenate(self.residuals) ** 2, axis=1)
        lost = weight**2 * squared / ((DEGREES_OF_FREEDOM + 2.0) * self.sd_px**2)
        return float(np.sum(weight - lost) / np.sum(weight))

    def _precision(self) -> Array:
        """The prior's weight (11,) on squares of the shared parameters, as a corner's has it."""
        weight = np.zeros(len(SHARED))
        weight[len(PARAMETERS) :] = (self.sd_px / BULGE_SD_M) ** 2
        return weight

    def _prior(self) -> Array:
        spread = self.structure.spread
        return np.asarray(spread.T @ (self._precision()[:, None] * spread))

    def _prior_cost(self) -> float:
        return float(np.sum(self._precision() * self.shared**2))

    def _scale(self, weight: Array) -> float:
        """Scale of the Student-t by its own fixed point, per coordinate."""
        squared = np.sum(np.concatenate(self.residuals) ** 2, axis=1)
        unknowns = 6 * len(self.views) + self.structure.spread.shape[1]
        spare = max(2.0 * len(squared) - unknowns, 2.0) / 2.0
        return max(float(np.sqrt(np.sum(weight * squared) / (2.0 * spare))), LEAST_SD_PX)

    def _weights(self) -> list[Array]:
        nu = DEGREES_OF_FREEDOM
        return [
            (nu + 2.0) / (nu + np.sum(residual**2, axis=1) / self.sd_px**2)
            for residual in self.residuals
        ]
