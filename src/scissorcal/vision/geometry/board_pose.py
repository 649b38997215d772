"""The pose of a flat target before a camera: both solutions of a plane, and their covariance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.recipe.priors import PlatePriors
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, left_jacobian
from scissorcal.vision.targets.detect import Detection
from scissorcal.vision.targets.sides import unbent_corners

LEAST_SD_PX = 0.02
"""Least standard deviation of a corner."""

FAR_OFF = 6.0
"""Residuals above this many robust standard deviations are outliers and left out."""

ODDS = 20.0
"""A pose must be this many times likelier than the second one that a plane allows."""

FEWEST = 4
ROUNDS = 100


class UndeterminedPoseError(VerdictError, ValueError):
    """The corners that were seen do not determine a pose (exit code 3)."""


@dataclass(frozen=True)
class Corners:
    """Corners of one flat target as seen by a camera at rest, in one frame or several.

    ``pixels`` (n, 2); ``points`` (n, 3) in the target's frame, z = 0, metres; ``frame`` and
    ``corner`` (n,) say in which picture, and which corner of the target it is: a corner's
    errors by print and light repeat from picture to picture. ``target`` and ``sources`` name the
    target and the pictures in messages; ``size_px`` is the pictures' width and height, None where
    it is unknown. ``by_sides`` says that corners 4 k to 4 k + 3 are those of a marker, where
    straight lines along its sides cross: a lens bends these, which `unbent` corrects.
    """

    pixels: Array
    points: Array
    frame: Integers
    corner: Integers
    target: str = "target"
    sources: tuple[str, ...] = ()
    size_px: tuple[int, int] | None = None
    by_sides: bool = False

    @classmethod
    def of(cls, *detections: Detection) -> "Corners":
        """The corners of one target, a frame for each of its detections.

        Raises MissingError without a detection, InputError where they are of different targets or
        of pictures of different sizes.
        """
        if not detections:
            raise MissingError(
                "No picture of a target was given, so there is no pose to find: give what "
                "find_board found in one."
            )
        check_detections(detections)
        first = detections[0]
        for detection in detections:
            if detection.board != first.board:
                raise InputError(
                    f"{detection.source} shows the {detection.board.name}, {first.source} the "
                    f"{first.board.name}: a pose is that of one target; leave one of them out."
                )
        return cls(
            np.concatenate([detection.pixels for detection in detections]),
            np.concatenate([detection.points for detection in detections]),
            np.repeat(np.arange(len(detections)), [len(detection.ids) for detection in detections]),
            np.concatenate([detection.ids for detection in detections]),
            first.board.name,
            tuple(detection.source for detection in detections),
            (first.width, first.height),
            first.board.kind == "markers",
        )

    def unbent(self, camera: Camera) -> "Corners":
        """The corners without what the camera's distortion bends of the sides of markers.

        Markers that are not seen whole keep their corners.
        """
        if not self.by_sides:
            return self
        order = np.lexsort((self.corner, self.frame))
        order = order[np.isfinite(self.pixels[order]).all(axis=1)]
        marker = np.stack([self.frame, self.corner // 4])[:, order]
        _, place, count = np.unique(marker, axis=1, return_inverse=True, return_counts=True)
        whole = order[count[place.ravel()] == 4]
        pixels = self.pixels.copy()
        quads = pixels[whole].reshape(-1, 4, 2)
        pixels[whole] = unbent_corners(quads, camera).reshape(-1, 2)
        return replace(self, pixels=pixels, by_sides=False)

    def where(self, keep: NDArray[np.bool_]) -> "Corners":
        """The corners that ``keep`` selects."""
        return replace(
            self,
            pixels=self.pixels[keep],
            points=self.points[keep],
            frame=self.frame[keep],
            corner=self.corner[keep],
        )

    def undetermined(self, why: str, remedy: str = "") -> UndeterminedPoseError:
        """The refusal of a pose, for a reason that is a clause."""
        remedy = remedy or f"Show the whole {self.target} in good light"
        names = ", ".join(self.sources[frame] for frame in np.unique(self.frame) if self.sources)
        return UndeterminedPoseError(
            f"{names + ': ' if names else ''}{why}, so the pose of the {self.target} is "
            f"undetermined. {remedy}, or leave the picture out."
        )

    def check_camera(self, camera: Camera) -> None:
        """InputError where the pictures have another size than the camera's."""
        if self.size_px is not None and not camera.takes(*self.size_px):
            raise other_size(self.sources[0], self.size_px, camera)


def check_detections(detections: Sequence[Detection]) -> None:
    """InputError where one is no detection, or their pictures have different sizes."""
    first = detections[0]
    for other in detections:
        if not isinstance(other, Detection):
            raise InputError(
                f"{type(other).__name__} is not what was found in a picture: give what "
                "scissorcal.vision.find_board returns for it."
            )
        if (other.width, other.height) != (first.width, first.height):
            raise InputError(
                f"{other.source} has {other.width} x {other.height} pixels, {first.source} "
                f"{first.width} x {first.height}: one fit takes pictures of one camera at one size "
                "and zoom; leave one of them out."
            )


def other_size(source: str, size_px: tuple[int, int], camera: Camera) -> InputError:
    """The refusal of a picture of another size than the camera was fitted at."""
    return InputError(
        f"{source} has {size_px[0]} x {size_px[1]} pixels, and the camera was fitted at "
        f"{camera.width} x {camera.height}: take pictures with the same camera, size, focus and "
        "zoom."
    )


@dataclass(frozen=True)
class BoardPose:
    """T_camera_target and its diagnostics.

    ``other`` is the second pose that a plane allows, None where there is none. ``odds`` are those
    of the first against it by their squared errors; ``ambiguity`` is the ratio of their rms errors,
    1 where both explain the picture equally well. ``rms_px`` and ``sd_px`` are the rms error and
    the standard deviation that corners were found to have; ``used`` (n,) marks the corners that
    count, ``residuals_px`` (n, 2) are measured minus predicted. ``by_camera`` (6, 9) and
    ``by_print`` (6, 2) say how the pose moves with the camera's parameters and the print's scales;
    ``noise`` (6, 6) is the part of the pose's covariance that comes from the corners alone.
    """

    pose: Pose
    other: Pose | None
    odds: float
    ambiguity: float
    rms_px: float
    sd_px: float
    used: NDArray[np.bool_]
    residuals_px: Array
    by_camera: Array
    by_print: Array
    noise: Array


def locate_board(
    seen: Detection | Sequence[Detection] | Corners,
    camera: Camera,
    priors: PlatePriors = PlatePriors(),
) -> BoardPose:
    """Find a flat target's pose, and the second one that may explain the picture as well.

    ``seen`` is what `scissorcal.vision.find_board` found: in one picture, or in several where
    camera and target are at rest. Both solutions of the plane's pose (Collins and Bartoli 2014,
    doi:10.1007/s11263-014-0725-5) are refined on all corners, those far off left out; the better
    one is the pose. Its covariance has three parts: corner errors that are independent between
    frames, corner errors that repeat in all frames (both estimated from the residuals), and the
    errors of camera and print.
    ``priors`` state what one frame leaves open of the first, and the printer's scale. A whole
    picture that was reduced goes with ``camera.scaled(width, height)``.

    Raises InputError where a picture has another size than the camera's or shows another target
    than the others, MissingError without a picture, UndeterminedPoseError (a VerdictError) with
    fewer than four corners, or corners along one line, or seen as one.

    A plate board 250 mm before the camera; its pose is within three of its standard deviations:

    >>> import numpy as np
    >>> from scissorcal.vision import (
    ...     PLATE_BOARD, Camera, Lens, Looks, Pose, SimPose, difference, find_board, render,
    ...     target_layers,
    ... )
    >>> camera = Camera(600.0, 600.0, 319.5, 239.5, (0.0,) * 5, 640, 480)
    >>> lens = Lens(600.0, (319.5, 239.5), 640, 480)
    >>> truth = SimPose.looking_at((0.07, 0.05), 0.25, tilt=0.4)
    >>> picture = render(target_layers(PLATE_BOARD, truth), lens, Looks(), np.random.default_rng(0))
    >>> board = locate_board(find_board(picture, "plate board"), camera)
    >>> off = difference(board.pose, Pose.from_matrix(truth.rotation, truth.shift_m))
    >>> bool((np.abs(off) < 3.0 * np.sqrt(np.diag(board.pose.covariance))).all())
    True
    """
    corners = seen if isinstance(seen, Corners) else _corners_of(seen)
    corners.check_camera(camera)
    corners = corners.unbent(camera)
    if len(np.unique(corners.corner)) < FEWEST:
        count = len(np.unique(corners.corner))
        raise corners.undetermined(f"only {count} corners were seen; 4 are needed")
    flat = corners.points[:, :2] - corners.points[:, :2].mean(axis=0)
    if np.linalg.svd(flat, compute_uv=False)[-1] < 1e-6 * np.linalg.norm(flat):
        raise corners.undetermined("the corners that were seen lie along one line")
    used = np.all(np.isfinite(camera.rays(corners.pixels)), axis=1)
    if len(np.unique(corners.corner[used])) < FEWEST:
        raise corners.undetermined(
            "the corners that were seen lie where the camera's fit does not hold",
            f"Show the {corners.target} nearer to the middle of the picture",
        )
    try:
        begun = _both(corners.where(used), camera)
        refined = [_refine(start, corners, camera, used) for start in begun]
        used = near(min(refined, key=_square).residuals, used)
        refined = sorted(
            (_refine(start.pose, corners, camera, used) for start in refined), key=_square
        )
        best = refined[0]
        noise, kept = _components(best.residuals, corners, used, priors)
        by_noise, by_camera, by_print = _covariance(best, corners, used, noise, kept)
    except np.linalg.LinAlgError:
        raise corners.undetermined("the corners that were seen fit no single pose") from None
    sd = float(np.sqrt(noise + kept))
    print_sd = 0.01 * priors.print_scale_sd_percent
    covariance = by_noise + print_sd**2 * by_print @ by_print.T
    if camera.covariance is not None:
        covariance = covariance + by_camera @ camera.covariance @ by_camera.T
    other = refined[1] if len(refined) > 1 and _apart(refined[0], refined[1]) else None
    frames = len(np.unique(corners.frame[used]))
    gap = (other.square - best.square) / (noise + kept * frames) if other else np.inf
    return BoardPose(
        pose=Pose.from_rotation_vector(best.pose[:3], best.pose[3:], covariance),
        other=Pose.from_rotation_vector(other.pose[:3], other.pose[3:]) if other else None,
        odds=float(np.exp(min(0.5 * gap, 700.0))),
        ambiguity=_ratio(other.square, best.square) if other else np.inf,
        rms_px=float(np.sqrt(np.mean(np.sum(best.residuals[used] ** 2, axis=1)))),
        sd_px=sd,
        used=used,
        residuals_px=best.residuals,
        by_camera=by_camera,
        by_print=by_print,
        noise=by_noise,
    )


def _corners_of(seen: Detection | Sequence[Detection]) -> Corners:
    return Corners.of(seen) if isinstance(seen, Detection) else Corners.of(*seen)


class _Refined(NamedTuple):
    """``pose`` (6,) as rotation vector and translation, ``slope`` (2 n, 15) of pixels by pose and
    camera, ``square`` the sum of squared residuals of the corners used."""

    pose: Array
    residuals: Array
    slope: Array
    square: float


def _both(corners: Corners, camera: Camera) -> list[Array]:
    middle = np.append(corners.points[:, :2].mean(axis=0), 0.0)
    rays = camera.rays(corners.pixels)
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        corners.points - middle, rays[:, None, :], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    poses = []
    for turn, shift in zip(turns, shifts, strict=True):
        matrix = cv2.Rodrigues(turn)[0]
        translation = shift.ravel() - matrix @ middle
        if np.all(np.isfinite(translation)):
            poses.append(np.concatenate([turn.ravel(), translation]))
    if not poses:
        raise corners.undetermined("no pose in front of the camera explains the corners")
    return poses


def project_pose(pose: Array, corners: Corners, camera: Camera) -> tuple[Array, Array]:
    """Measured minus predicted pixels (n, 2) at a pose (6,), and slopes (2 n, 15) of the latter.

    The slopes are by the pose, then by the camera's parameters.
    """
    pixels, slope = cv2.projectPoints(
        corners.points, pose[:3], pose[3:], camera.matrix, camera.coefficients
    )
    return np.asarray(corners.pixels - pixels.reshape(-1, 2)), np.asarray(slope[:, :15])


def print_slopes(pose: Array, slope: Array, corners: Corners) -> Array:
    """Slopes (2 n, 2) of pixels by the print's scale along x and y, from those of `project_pose`.

    A point moves in the picture as the target would with it when shifted along the same axis.
    """
    turned = Pose.from_rotation_vector(pose[:3], np.zeros(3)).matrix
    shifts = (slope[:, 3:6] @ turned[:, k] * np.repeat(corners.points[:, k], 2) for k in (0, 1))
    return np.stack(list(shifts), axis=1)


def _refine(start: Array, corners: Corners, camera: Camera, used: NDArray[np.bool_]) -> _Refined:
    """Minimise the reprojection error of the corners used (Levenberg-Marquardt)."""
    turn, shift = cv2.solvePnPRefineLM(
        corners.points[used],
        corners.pixels[used],
        camera.matrix,
        camera.coefficients,
        start[:3, None].copy(),
        start[3:, None].copy(),
        (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, ROUNDS, 1e-12),
    )
    pose = np.concatenate([turn.ravel(), shift.ravel()])
    residuals, slope = project_pose(pose, corners, camera)
    return _Refined(pose, residuals, slope, float(np.sum(residuals[used] ** 2)))


def _square(refined: _Refined) -> float:
    return refined.square


def near(residuals: Array, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those of the ``used`` corners (n,) that residuals (n, 2) do not show as outliers."""
    distance = np.sqrt(np.sum(residuals**2, axis=1))
    robust = float(np.median(distance[used])) / 1.1774
    return np.asarray(used & (distance < FAR_OFF * max(robust, LEAST_SD_PX) * np.sqrt(2.0)))


def _components(
    residuals: Array, corners: Corners, used: NDArray[np.bool_], priors: PlatePriors
) -> tuple[float, float]:
    """Variances of a coordinate: independent between frames, and constant for a corner."""
    frames = len(np.unique(corners.frame[used]))
    kept_residuals = residuals[used]
    labels, place = np.unique(corners.corner[used], return_inverse=True)
    count = np.bincount(place)
    spare = 2 * len(kept_residuals) - 6
    least = LEAST_SD_PX**2
    if frames == 1:
        usual = priors.corner_weight * priors.corner_sd_px**2
        variance = (usual + float(np.sum(kept_residuals**2))) / (priors.corner_weight + spare)
        return max(variance, least), 0.0
    mean = np.stack([np.bincount(place, kept_residuals[:, k]) / count for k in (0, 1)], axis=1)
    within = float(np.sum((kept_residuals - mean[place]) ** 2)) / max(
        2 * (len(kept_residuals) - len(labels)), 1
    )
    between = float(np.sum(count * np.sum(mean**2, axis=1))) / max(2 * len(labels) - 6, 1)
    kept = max((between - within) / float(count.mean()), 0.0)
    return max(within, least / 2), max(kept, least / 2)


def _covariance(
    best: _Refined, corners: Corners, used: NDArray[np.bool_], noise: float, kept: float
) -> tuple[Array, Array, Array]:
    """The corners' own covariance (6, 6), and the pose's slopes by camera and by print."""
    slope = best.slope[np.repeat(used, 2)]
    by_pose = slope[:, :6]
    inverse = np.linalg.inv(by_pose.T @ by_pose)
    spread = noise * by_pose.T @ by_pose
    _, place = np.unique(corners.corner[used], return_inverse=True)
    each = by_pose.reshape(-1, 2, 6)
    summed = np.zeros((place.max() + 1, 2, 6))
    np.add.at(summed, place, each)
    flat = summed.reshape(-1, 6)
    spread = spread + kept * flat.T @ flat
    turn = np.eye(6)
    turn[:3, :3] = left_jacobian(best.pose[:3])
    gain = turn @ inverse
    printed = print_slopes(best.pose, best.slope, corners)[np.repeat(used, 2)]
    by_noise = gain @ spread @ gain.T
    return np.asarray(by_noise), -gain @ by_pose.T @ slope[:, 6:15], -gain @ by_pose.T @ printed


def _ratio(worse: float, better: float) -> float:
    """Ratio of rms errors; infinite where the better pose leaves nothing."""
    return float(np.sqrt(worse / better)) if better > 1e-12 * worse else float(np.inf)


def _apart(a: _Refined, b: _Refined) -> bool:
    """Whether two refined poses are different ones and not one found twice."""
    turn = cv2.Rodrigues(cv2.Rodrigues(a.pose[:3])[0] @ cv2.Rodrigues(b.pose[:3])[0].T)[0]
    return float(np.linalg.norm(turn)) > 1e-3
