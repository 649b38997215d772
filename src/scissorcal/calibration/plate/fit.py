"""The plate's pose from photographs of its target, before the camera and in the rig's frame."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.camera.result import PixelMap
from scissorcal.calibration.plate.checks import camera_verdict, plate_verdicts
from scissorcal.calibration.plate.result import PlateFit, PoseHalves, PoseView
from scissorcal.errors import MissingError
from scissorcal.recipe.priors import PlatePriors
from scissorcal.recipe.schema import Recipe
from scissorcal.vision.geometry.board_pose import BoardPose, Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import UNMOVED, Pose, difference
from scissorcal.vision.geometry.rig_frame import RigPose
from scissorcal.vision.targets.detect import Detection

_EXACT_PRINT = {"print_scale_sd_percent": 0.0}


def fit_plate(
    seen: Sequence[Detection],
    camera: Camera,
    *,
    priors: PlatePriors = PlatePriors(),
    plate_target: Pose = UNMOVED,
    rig: RigPose | None = None,
    places: PixelMap | None = None,
) -> PlateFit:
    """Fit one pose of the plate to all photographs of it, corners and photographs together.

    ``seen`` is what `scissorcal.vision.find_board` found in each. ``plate_target`` says how the
    target lies on the plate; the plate's frame has x along the cut from its near edge, z out of its
    upper face. Camera and plate are taken to be at rest; a photograph of another pose is detected
    by fitting it alone. Both poses that a plane allows are refined and kept. ``priors`` are the
    recipe's. ``rig`` takes the pose into the rig's frame. ``places`` is how well the camera is
    known over the picture, from its fit. ``inputs_hash`` of the result is empty: who reads the
    photographs puts it in.

    Raises MissingError without a photograph, InputError where photographs show different targets or
    are of another size than the camera's, VerdictError where the corners determine no pose.

    A plate board that lies on the plate with its upper left corner 40 mm behind the plate's near
    edge and 20 mm to its right (y points left):

    >>> import numpy as np
    >>> from scissorcal.vision import (
    ...     PLATE_BOARD, Camera, Lens, Looks, Pose, SimPose, find_board, render, target_layers,
    ... )
    >>> camera = Camera(600.0, 600.0, 319.5, 239.5, (0.0,) * 5, 640, 480)
    >>> lens = Lens(600.0, (319.5, 239.5), 640, 480)
    >>> layers = target_layers(PLATE_BOARD, SimPose.looking_at((0.07, 0.05), 0.25, tilt=0.4))
    >>> pictures = [render(layers, lens, Looks(), np.random.default_rng(n)) for n in range(2)]
    >>> target = Pose.from_rotation_vector([np.pi, 0.0, 0.0], [0.04, -0.02, 0.0])
    >>> seen = [find_board(picture, "plate board") for picture in pictures]
    >>> fit = fit_plate(seen, camera, plate_target=target)
    >>> fit.target, len(fit.views), [v.check for v in fit.verdicts if v.status == "fail"]
    ('plate board', 2, [])
    """
    if not seen:
        raise MissingError(
            "There is no photograph of the plate's target: print it ('scissorcal target'), stick "
            "it to the plate, and take some with 'scissorcal capture plate --image plate-*.jpg'."
        )
    corners = Corners.of(*seen).unbent(camera)
    alone = [locate_board(detection, camera, priors) for detection in seen]
    whole = locate_board(corners, camera, priors)
    halves = _halves(corners, camera, priors)
    back = plate_target.inverse()
    views = tuple(
        _view(detection, located, whole, corners.frame == i)
        for i, (detection, located) in enumerate(zip(seen, alone, strict=True))
    )
    pose = whole.pose.after(back)
    known = camera_verdict(camera, places, seen)
    in_rig = rig.holds(whole, camera).after(back) if rig else None
    return PlateFit(
        target=corners.target,
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
        sources=corners.sources,
    )


def plate_target(recipe: Recipe) -> Pose:
    """T_plate_target of the recipe: printed y runs down and z into the sheet, hence the half turn
    about x."""
    x, y = (1e-3 * value for value in recipe.plate.place_mm)
    turn = Pose.from_rotation_vector([0.0, 0.0, np.radians(recipe.plate.turn_deg)], [x, y, 0.0])
    return turn.after(Pose.from_rotation_vector([np.pi, 0.0, 0.0], np.zeros(3)))


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


def _view(seen: Detection, alone: BoardPose, whole: BoardPose, here: NDArray[np.bool_]) -> PoseView:
    normal = alone.pose.matrix[:, 2]
    to_target = alone.pose.apply([seen.points.mean(axis=0)])[0]
    away = difference(alone.pose, whole.pose)
    residuals_px = whole.residuals_px[here][alone.used]
    slant = abs(normal @ to_target) / np.linalg.norm(to_target)
    return PoseView(
        name=seen.source,
        corners=len(seen.ids),
        used=int(np.sum(whole.used[here])),
        rms_px=float(np.sqrt(np.mean(np.sum(residuals_px**2, axis=1)))),
        rms_alone_px=alone.rms_px,
        side_px=seen.square_px,
        distance_m=float(np.linalg.norm(to_target)),
        tilt_deg=float(np.degrees(np.arccos(np.clip(slant, 0.0, 1.0)))),
        ambiguity=alone.ambiguity,
        away_deg=float(np.degrees(np.linalg.norm(away[:3]))),
        away_mm=float(1e3 * np.linalg.norm(away[3:])),
    )
