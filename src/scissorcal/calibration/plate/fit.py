"""The plate's pose from photographs of its target, before the camera and in the rig's frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.camera.result import PixelMap
from scissorcal.calibration.plate.checks import camera_verdict, plate_verdicts
from scissorcal.calibration.plate.result import PlateFit, PoseHalves, PoseView
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.recipe.priors import PlatePriors
from scissorcal.recipe.schema import Recipe
from scissorcal.vision.geometry.board_pose import BoardPose, Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, difference
from scissorcal.vision.geometry.rig_frame import RigPose
from scissorcal.vision.targets.detect import Detection

UNMOVED = Pose((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
_EXACT_PRINT = {"print_scale_sd_percent": 0.0}


@dataclass(frozen=True)
class PosePhoto:
    """The plate's target as one photograph shows it."""

    name: str
    detection: Detection


def fit_plate(
    photos: Sequence[PosePhoto],
    camera: Camera,
    *,
    priors: PlatePriors = PlatePriors(),
    plate_target: Pose = UNMOVED,
    rig: RigPose | None = None,
    places: PixelMap | None = None,
) -> PlateFit:
    """Fit one pose of the plate to all photographs of it, corners and photographs together.

    ``plate_target`` says how the target lies on the plate; the plate's frame has x along the cut
    from its near edge, z out of its upper face. Camera and plate are taken to be at rest; a
    photograph of another pose is detected by fitting it alone. Both poses that a plane allows
    are refined and kept. ``priors`` are the recipe's. ``rig`` takes the pose into the rig's frame.
    ``places`` is how well the camera is known over the picture, from its fit.
    ``inputs_hash`` of the result is empty: who reads the photographs puts it in.

    Raises MissingError without a photograph, InputError where photographs show different targets,
    VerdictError where the corners determine no pose.
    """
    if not photos:
        raise MissingError(
            "There is no photograph of the plate's target: print it ('scissorcal target'), stick "
            "it to the plate, and take some with 'scissorcal capture plate --image plate-*.jpg'."
        )
    target = photos[0].detection.board.name
    for photo in photos:
        if photo.detection.board != photos[0].detection.board:
            raise InputError(
                f"{photo.name} shows the {photo.detection.board.name}, {photos[0].name} the "
                f"{target}: a plate has one target; leave one of them out."
            )
    corners = Corners.of(*(photo.detection for photo in photos))
    alone = [
        _located(corners.where(corners.frame == i), camera, priors, photo)
        for i, photo in enumerate(photos)
    ]
    whole = _located(corners, camera, priors, *photos)
    halves = _halves(corners, camera, priors)
    back = plate_target.inverse()
    views = tuple(
        _view(photo, located, whole, corners.frame == i)
        for i, (photo, located) in enumerate(zip(photos, alone, strict=True))
    )
    pose = whole.pose.after(back)
    known = camera_verdict(camera, places, [photo.detection for photo in photos])
    in_rig = rig.holds(whole, camera).after(back) if rig else None
    return PlateFit(
        target=target,
        camera_plate=pose,
        other=whole.other.after(back) if whole.other else None,
        odds=whole.odds,
        ambiguity=whole.ambiguity,
        rig_plate=in_rig,
        views=views,
        halves=halves,
        rms_px=whole.rms_px,
        noise_px=whole.sd_px,
        verdicts=plate_verdicts(whole, views, halves, known, rig),
        inputs_hash="",
        sources=tuple(photo.name for photo in photos),
    )


def plate_target(recipe: Recipe) -> Pose:
    """T_plate_target of the recipe: printed y runs down and z into the sheet, hence the half turn
    about x."""
    x, y = (1e-3 * value for value in recipe.plate.place_mm)
    turn = Pose.from_rotation_vector([0.0, 0.0, np.radians(recipe.plate.turn_deg)], [x, y, 0.0])
    return turn.after(Pose.from_rotation_vector([np.pi, 0.0, 0.0], np.zeros(3)))


def _located(
    corners: Corners, camera: Camera, priors: PlatePriors, *photos: PosePhoto
) -> BoardPose:
    try:
        return locate_board(corners, camera, priors)
    except ValueError as error:
        names = ", ".join(photo.name for photo in photos)
        raise VerdictError(
            f"{names}: {error}, so the plate's pose is undetermined. Show the whole "
            f"{photos[0].detection.board.name} in good light, or leave the photograph out."
        ) from None


def _halves(corners: Corners, camera: Camera, priors: PlatePriors) -> PoseHalves | None:
    """Compare poses of two halves of the corners, of the same camera: the worse of two ways.

    Every other group of four corners (a marker's, or neighbours on a chessboard, which err
    together) shows errors of single corners; the left and the right half show a bent target and
    a poor fit of the lens. The covariances of camera and print count as far as they move the two
    halves differently.
    """
    across = corners.points[:, 0]
    ways = ((corners.corner // 4) % 2 == 1, across < np.median(across))
    splits = [halves for way in ways if (halves := _half_and_half(corners, camera, priors, way))]
    return max(splits, key=lambda halves: halves.square, default=None)


def _half_and_half(
    corners: Corners, camera: Camera, priors: PlatePriors, way: NDArray[np.bool_]
) -> PoseHalves | None:
    alone = replace(camera, covariance=None), priors.model_copy(update=_EXACT_PRINT)
    try:
        first, second = (locate_board(corners.where(half), *alone) for half in (way, ~way))
    except ValueError:
        return None
    assert first.pose.covariance is not None
    assert second.pose.covariance is not None
    away = difference(first.pose, second.pose)
    printed = first.by_print - second.by_print
    claimed = first.pose.covariance + second.pose.covariance
    claimed = claimed + (0.01 * priors.print_scale_sd_percent) ** 2 * printed @ printed.T
    if camera.covariance is not None:
        bent = first.by_camera - second.by_camera
        claimed = claimed + bent @ camera.covariance @ bent.T
    return PoseHalves(
        rotation_deg=float(np.degrees(np.linalg.norm(away[:3]))),
        translation_mm=float(1e3 * np.linalg.norm(away[3:])),
        square=float(away @ np.linalg.solve(claimed, away)),
    )


def _view(
    photo: PosePhoto, alone: BoardPose, whole: BoardPose, here: NDArray[np.bool_]
) -> PoseView:
    normal = alone.pose.matrix[:, 2]
    to_target = alone.pose.apply([photo.detection.points.mean(axis=0)])[0]
    away = difference(alone.pose, whole.pose)
    residuals_px = whole.residuals_px[here][alone.used]
    slant = abs(normal @ to_target) / np.linalg.norm(to_target)
    return PoseView(
        name=photo.name,
        corners=len(photo.detection.ids),
        used=int(np.sum(whole.used[here])),
        rms_px=float(np.sqrt(np.mean(np.sum(residuals_px**2, axis=1)))),
        rms_alone_px=alone.rms_px,
        side_px=photo.detection.square_px,
        distance_m=float(np.linalg.norm(to_target)),
        tilt_deg=float(np.degrees(np.arccos(np.clip(slant, 0.0, 1.0)))),
        ambiguity=alone.ambiguity,
        away_deg=float(np.degrees(np.linalg.norm(away[:3]))),
        away_mm=float(1e3 * np.linalg.norm(away[3:])),
    )
