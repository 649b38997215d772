"""Verdicts on a plate's pose: one pose or two, a plate at rest, honest covariance, the rig."""

from collections.abc import Sequence

import numpy as np

from scissorcal.calibration.plate.result import Halves, PlateView
from scissorcal.verdicts import Verdict, judge, not_evaluated
from scissorcal.vision.geometry.board_pose import BoardPose
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.rig_frame import RigPose
from scissorcal.vision.targets.detect import SMALL_PX

SCOPE = "fit.plate"
ODDS = 20.0
"""The pose must be this many times likelier than the second one that a plane allows."""
FALSE_ALARM = 0.001
"""How often two ways of halving honest corners, together, differ by more than is allowed."""
LEFT_OVER_PX = 0.3
"""Corners are found to 0.02 to 0.2 px; where they lie farther off, something is not as assumed."""
MOVED = 3.0
"""A photograph whose rms under the common pose exceeds its own by this factor shows the plate
elsewhere."""


def plate_verdicts(
    whole: BoardPose,
    views: Sequence[PlateView],
    halves: Halves | None,
    camera: Camera,
    rig: RigPose | None,
) -> tuple[Verdict, ...]:
    """Judge a plate's pose."""
    return (
        _one_pose(whole),
        _at_rest(views),
        _residuals(whole),
        _halves(halves),
        _size(views),
        _camera(camera),
        _rig(rig),
    )


def _one_pose(whole: BoardPose) -> Verdict:
    good = "One pose explains the photographs far better than the other that a plane allows."
    bad = (
        f"Two poses explain the photographs about equally well (odds {whole.odds:.1f}): look at "
        "the plate less squarely, from nearer, or use the plate board, which is larger than a "
        "marker."
    )
    return judge(SCOPE, "ambiguity", min(whole.odds, 1e6), ODDS, good, bad)


def _at_rest(views: Sequence[PlateView]) -> Verdict:
    if len(views) < 2:
        why = "One photograph alone cannot show whether plate and camera stayed: take several."
        return not_evaluated(SCOPE, "at rest", why, MOVED)
    ratios = [view.rms_px / max(view.rms_alone_px, 1e-9) for view in views]
    worst = int(np.argmax(ratios))
    good = f"All {len(views)} photographs show the plate in one place."
    bad = (
        f"{views[worst].name} shows the plate {views[worst].away_mm:.2g} mm and "
        f"{views[worst].away_deg:.2g} deg away from the common pose: camera or plate moved between "
        "photographs; leave it out, or take all again without touching either."
    )
    return judge(SCOPE, "at rest", ratios[worst], MOVED, good, bad)


def _residuals(whole: BoardPose) -> Verdict:
    why = f"Corners lie {whole.sd_px:.2g} px (sd) from where the pose predicts them."
    remedy = (
        " That is more than their detection error: the target may be bent, or the camera's fit may "
        "not hold here (another focus or zoom?)."
    )
    return judge(SCOPE, "residuals", whole.sd_px, LEFT_OVER_PX, why, why + remedy)


def _halves(halves: Halves | None) -> Verdict:
    from scipy.stats import chi2

    limit = float(chi2.isf(0.5 * FALSE_ALARM, 6))
    if halves is None:
        why = "Too few corners were seen to compare two halves of them: show more of the target."
        return not_evaluated(SCOPE, "halves", why, limit)
    why = (
        f"Poses from two halves of the corners differ by {halves.rotation_deg:.2g} deg and "
        f"{halves.translation_mm:.2g} mm, "
    )
    bad = (
        "more than their covariances allow: the target may be bent, printed out of scale, or the "
        "camera's fit may not hold here."
    )
    good = "within their covariances."
    return judge(SCOPE, "halves", halves.square, limit, why + good, why + bad)


def _size(views: Sequence[PlateView]) -> Verdict:
    least = min(view.side_px for view in views)
    why = f"The smallest squares or markers are {least:.0f} pixels wide."
    remedy = " Corners are found worse and less often there: go nearer, or print larger."
    return judge(SCOPE, "size", least, SMALL_PX, why, why + remedy)


def _camera(camera: Camera) -> Verdict:
    if camera.covariance is None:
        why = (
            "The camera has no covariance, so the pose takes it as exact: run "
            "'scissorcal fit camera' on photographs of the camera board."
        )
        return not_evaluated(SCOPE, "camera", why)
    why = "What is unknown of the camera is in the pose's covariance."
    return Verdict(SCOPE, "camera", "pass", None, None, why)


def _rig(rig: RigPose | None) -> Verdict:
    if rig is None:
        why = (
            "The camera's place in the rig is not known, so the plate's pose is relative to the "
            "camera only: photograph the rig markers at several advances and openings."
        )
        return not_evaluated(SCOPE, "rig frame", why)
    if rig.untold:
        why = (
            f"The rig's motion left open: {', '.join(rig.untold)}. Photograph the rig markers at "
            "several advances and several openings."
        )
        return Verdict(SCOPE, "rig frame", "fail", float(len(rig.untold)), 0.0, why)
    off = rig.rms_px / np.sqrt(2.0)
    bad = (
        f"The card's corners lie {off:.2g} px (sd) from where its stances predict them: look at "
        "the advances (mm) and openings (deg) that were given, and whether the camera stayed and "
        "the card is fixed to the blade that moves."
    )
    good = f"The rig's frame is known from its markers (rms {rig.rms_px:.2f} px)."
    return judge(SCOPE, "rig frame", float(off), LEFT_OVER_PX, good, bad)
