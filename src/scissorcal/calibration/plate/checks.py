"""Verdicts on a plate's pose: one pose or two, a plate at rest, honest covariance, the rig."""

from collections.abc import Sequence

import numpy as np

from scissorcal.calibration.plate.result import Halves, PlateView
from scissorcal.verdicts import Status, Verdict
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
    if whole.odds >= ODDS:
        why = "One pose explains the photographs far better than the other that a plane allows."
        return Verdict(SCOPE, "ambiguity", "pass", min(whole.odds, 1e6), ODDS, why)
    why = (
        f"Two poses explain the photographs about alike (odds {whole.odds:.1f}): look at the plate "
        "less squarely, from nearer, or use the plate board, which is larger than a marker."
    )
    return Verdict(SCOPE, "ambiguity", "fail", whole.odds, ODDS, why)


def _at_rest(views: Sequence[PlateView]) -> Verdict:
    if len(views) < 2:
        why = "One photograph alone cannot show whether plate and camera stayed: take several."
        return Verdict(SCOPE, "at rest", "not_evaluated", None, MOVED, why)
    ratios = [view.rms_px / max(view.rms_alone_px, 1e-9) for view in views]
    worst = int(np.argmax(ratios))
    if ratios[worst] < MOVED:
        why = f"All {len(views)} photographs show the plate in one place."
        return Verdict(SCOPE, "at rest", "pass", ratios[worst], MOVED, why)
    why = (
        f"{views[worst].name} shows the plate {views[worst].away_mm:.2g} mm and "
        f"{views[worst].away_deg:.2g} deg away from the common pose: camera or plate moved between "
        "photographs; leave it out, or take all again without touching either."
    )
    return Verdict(SCOPE, "at rest", "fail", ratios[worst], MOVED, why)


def _residuals(whole: BoardPose) -> Verdict:
    why = f"Corners lie {whole.sd_px:.2g} px (sd) from where the pose has them."
    if whole.sd_px < LEFT_OVER_PX:
        return Verdict(SCOPE, "residuals", "pass", whole.sd_px, LEFT_OVER_PX, why)
    why += (
        " That is more than they are found to: the target may be bent, or the camera's fit may not "
        "hold here (another focus or zoom?)."
    )
    return Verdict(SCOPE, "residuals", "fail", whole.sd_px, LEFT_OVER_PX, why)


def _halves(halves: Halves | None) -> Verdict:
    from scipy.stats import chi2

    limit = float(chi2.isf(0.5 * FALSE_ALARM, 6))
    if halves is None:
        why = "Too few corners were seen to compare two halves of them: show more of the target."
        return Verdict(SCOPE, "halves", "not_evaluated", None, limit, why)
    why = (
        f"Poses from two halves of the corners differ by {halves.rotation_deg:.2g} deg and "
        f"{halves.translation_mm:.2g} mm, "
    )
    if halves.square < limit:
        return Verdict(SCOPE, "halves", "pass", halves.square, limit, why + "within their claims.")
    why += (
        "more than they claim: the target may be bent, printed out of scale, or the camera's "
        "fit may not hold here."
    )
    return Verdict(SCOPE, "halves", "fail", halves.square, limit, why)


def _size(views: Sequence[PlateView]) -> Verdict:
    least = min(view.side_px for view in views)
    enough: Status = "pass" if least >= SMALL_PX else "fail"
    why = f"Squares or markers are {least:.0f} pixels wide where they are smallest."
    if enough == "fail":
        why += " Corners are found worse and less often there: go nearer, or print larger."
    return Verdict(SCOPE, "size", enough, least, SMALL_PX, why)


def _camera(camera: Camera) -> Verdict:
    if camera.covariance is None:
        why = (
            "Nobody said how well the camera is known, so the pose counts it as exact: run "
            "'scissorcal fit camera' on photographs of the camera board."
        )
        return Verdict(SCOPE, "camera", "not_evaluated", None, None, why)
    why = "What is unknown of the camera is in the pose's covariance."
    return Verdict(SCOPE, "camera", "pass", None, None, why)


def _rig(rig: RigPose | None) -> Verdict:
    if rig is None:
        why = (
            "The rig's frame is not known to the camera, so the plate is known before the camera "
            "only: photograph the rig markers at several advances and openings."
        )
        return Verdict(SCOPE, "rig frame", "not_evaluated", None, None, why)
    if rig.untold:
        why = (
            f"The rig's motion left open: {', '.join(rig.untold)}. Photograph the rig markers at "
            "several advances and several openings."
        )
        return Verdict(SCOPE, "rig frame", "fail", float(len(rig.untold)), 0.0, why)
    off = rig.rms_px / np.sqrt(2.0)
    if not off < LEFT_OVER_PX:
        why = (
            f"The card's corners lie {off:.2g} px (sd) from where its stances have them: look at "
            "the advances (mm) and openings (deg) that were given, and whether the camera stayed "
            "and the card is fixed to the blade that moves."
        )
        return Verdict(SCOPE, "rig frame", "fail", float(off), LEFT_OVER_PX, why)
    why = f"The rig's frame is known from its markers (rms {rig.rms_px:.2f} px)."
    return Verdict(SCOPE, "rig frame", "pass", 0.0, 0.0, why)
