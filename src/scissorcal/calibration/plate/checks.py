"""Verdicts on a plate's pose: ambiguity, motion, residuals, halves, size, camera, rig."""

from collections.abc import Sequence

import numpy as np

from scissorcal.calibration.camera.checks import MOST_SD_PX, verdict_there
from scissorcal.calibration.camera.result import PixelMap
from scissorcal.calibration.plate.result import PoseHalves, PoseView
from scissorcal.verdicts import STATED, Check, Verdict
from scissorcal.vision.geometry.board_pose import ODDS, BoardPose
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.rig_frame import RigPose
from scissorcal.vision.targets.detect import SMALL_PX, Detection

FALSE_ALARM = 0.001
"""False-alarm rate of the two splits into halves together."""
LEFT_OVER_PX = 0.3
"""Limit of the residuals' standard deviation; corners are found to 0.02 to 0.2 px."""
POSE = "where the plate is drawn; no torque depends on it"
AMBIGUITY = Check("fit.plate ambiguity", f"{POSE}: odds of the better of two poses", at_least=ODDS)
AT_REST = Check(
    "fit.plate at rest", f"{POSE}: error in the common pose over the photograph's own", at_most=3.0
)
"""Limit of a photograph's rms residual under the common pose over that under its own pose."""
RESIDUALS = Check("fit.plate residuals", f"{POSE}: sd of corners, px", at_most=LEFT_OVER_PX)
HALVES = Check(
    "fit.plate halves", f"{POSE}: squared difference of two halves, in covariances", at_most=STATED
)
SIZE = Check(
    "fit.plate size", f"{POSE}: width of the smallest square or marker, px", at_least=SMALL_PX
)
CAMERA = Check(
    "fit.plate camera", f"{POSE}: camera's standard error at the target, px", at_most=MOST_SD_PX
)
RIG_FRAME = Check(
    "fit.plate rig frame", f"{POSE}: open directions, or sd of corners, px", at_most=LEFT_OVER_PX
)


def plate_verdicts(
    whole: BoardPose,
    views: Sequence[PoseView],
    halves: PoseHalves | None,
    camera: Verdict,
    rig: RigPose | None,
) -> tuple[Verdict, ...]:
    """Judge a plate's pose; ``camera`` is the verdict on the camera (:func:`camera_verdict`)."""
    return (
        _one_pose(whole),
        _at_rest(views),
        _residuals(whole),
        _halves(halves),
        _size(views),
        camera,
        _rig(rig),
    )


def _one_pose(whole: BoardPose) -> Verdict:
    odds = min(whole.odds, 1e6)
    good = (
        f"The pose is {odds:.3g} times as likely as the mirrored one that a plane allows (limit "
        f"{ODDS:g})."
    )
    bad = (
        f"The pose is only {whole.odds:.1f} times as likely as the mirrored one that a plane "
        f"allows (limit {ODDS:g}). Photograph the plate at a larger tilt or from closer, or use "
        "the plate board, which is larger than a marker."
    )
    return AMBIGUITY.judge(odds, good, bad)


def _at_rest(views: Sequence[PoseView]) -> Verdict:
    if len(views) < 2:
        why = "One photograph cannot show whether plate and camera were at rest: take several."
        return AT_REST.not_evaluated(why)
    ratios = [view.rms_px / max(view.rms_alone_px, 1e-9) for view in views]
    worst = int(np.argmax(ratios))
    good = f"All {len(views)} photographs show the plate at one pose."
    bad = (
        f"{views[worst].name} shows the plate {views[worst].away_mm:.2g} mm and "
        f"{views[worst].away_deg:.2g} deg from the common pose: camera or plate moved between "
        "photographs. Leave it out, or repeat all without touching either."
    )
    return AT_REST.judge(ratios[worst], good, bad)


def _residuals(whole: BoardPose) -> Verdict:
    why = (
        f"The corner residuals' standard deviation is {whole.sd_px:.2g} px (limit "
        f"{LEFT_OVER_PX:g})."
    )
    remedy = " The target may be bent, or the camera's fit may not apply (another focus or zoom?)."
    return RESIDUALS.judge(whole.sd_px, why, why + remedy)


def _halves(halves: PoseHalves | None) -> Verdict:
    from scipy.stats import chi2

    limit = float(chi2.isf(0.5 * FALSE_ALARM, 6))
    if halves is None:
        why = "Too few corners to compare two halves of them: show more of the target."
        return HALVES.not_evaluated(why, threshold=limit)
    why = (
        f"Poses from two halves of the corners differ by {halves.rotation_deg:.2g} deg and "
        f"{halves.translation_mm:.2g} mm (chi-square {halves.square:.3g}, limit {limit:.3g})"
    )
    remedy = ": the target may be bent or printed out of scale, or the camera's fit may not apply."
    return HALVES.judge(halves.square, why + ".", why + remedy, threshold=limit)


def _size(views: Sequence[PoseView]) -> Verdict:
    least = min(view.side_px for view in views)
    why = f"The smallest squares or markers are {least:.0f} px wide (limit {SMALL_PX:g})."
    remedy = " Corners are found less accurately and less often: move closer, or print larger."
    return SIZE.judge(least, why, why + remedy)


def camera_verdict(camera: Camera, places: PixelMap | None, seen: Sequence[Detection]) -> Verdict:
    """Judge what the camera's fit knows of where the target was seen, by ``places`` of it."""
    if camera.covariance is None:
        why = (
            "The camera has no covariance, so the pose treats it as exact. Run 'scissorcal fit "
            "camera' on photographs of the camera board."
        )
        return CAMERA.not_evaluated(why)
    why = "The pose's covariance includes the camera's."
    if places is None:
        return CAMERA.verdict("pass", None, why)
    pixels = np.concatenate([detection.pixels for detection in seen])
    scale = min(detection.px_per_m for detection in seen)
    return verdict_there(CAMERA, places, pixels, scale, why)


def _rig(rig: RigPose | None) -> Verdict:
    if rig is None:
        why = (
            "The rig's frame is unknown, so the pose is in the camera's frame. Photograph the rig "
            "markers at several advances and openings."
        )
        return RIG_FRAME.not_evaluated(why)
    if rig.undetermined:
        why = (
            f"The rig's motion does not determine: {', '.join(rig.undetermined)}. Photograph the "
            "rig markers at several advances and several openings."
        )
        return RIG_FRAME.judge(len(rig.undetermined), why, threshold=0.0)
    off = rig.rms_px / np.sqrt(2.0)
    bad = (
        f"The card's corner residuals have a standard deviation of {off:.2g} px (limit "
        f"{LEFT_OVER_PX:g}). Check the stated advances (mm) and openings (deg), that the "
        "camera did not move, and that the card is fixed to the moving blade."
    )
    good = f"The rig's markers determine its frame (residuals {rig.rms_px:.2f} px rms)."
    return RIG_FRAME.judge(float(off), good, bad)
