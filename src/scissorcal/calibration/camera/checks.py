"""Checks of a camera's fit, and how well the camera is known at some places of a picture."""

from collections.abc import Sequence

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.camera.bundle import Bundle, SeenBoard, first_pose
from scissorcal.calibration.camera.result import CrossValidation, PixelMap, ViewError
from scissorcal.errors import InputError, VerdictError
from scissorcal.verdicts import Check, Verdict
from scissorcal.vision.geometry.camera import Camera

FEWEST_VIEWS = 3
MOST_SD_PX = 0.5

OUTLYING = 2.5
"""A photograph whose rms is so many times the middle one's is named."""

_BORDER = 0.01
"""Share of the picture by which a refined corner may lie beyond its border."""
_PARALLEL_DEG = 6.0
_UNDETERMINED = 0.05
CAMERA = "lengths measured in photographs"
FOCAL_LENGTH = Check(
    "fit.camera focal length", f"{CAMERA}: sd of the focal length, share of it", at_most=0.005
)
VIEWS = Check(
    "fit.camera views", f"{CAMERA}: error of the worst photograph over the median", at_most=OUTLYING
)
CORNERS = Check("fit.camera corners", f"{CAMERA}: corners seen", at_least=200)
PROJECTION = Check(
    "fit.camera projection", f"{CAMERA}: sd of a projected point, px", at_most=MOST_SD_PX
)
TWO_HALVES = Check(
    "fit.camera two halves", f"{CAMERA}: p-value of two halves' difference", at_least=0.01
)


def refuse_outside(views: Sequence[SeenBoard], width: int, height: int) -> None:
    """Raise InputError where a corner lies outside of its photograph, or is no number."""
    for view in views:
        with np.errstate(invalid="ignore"):
            inside = np.abs(view.pixels / [width, height] - 0.5) <= 0.5 + _BORDER
        if not np.all(inside):
            x, y = view.pixels[np.argmin(np.all(inside, axis=1))]
            raise InputError(
                f"{view.name}: a corner is at ({x:.6g}, {y:.6g}) px, outside of the photograph of "
                f"{width} by {height}: detect its corners again, or leave it out."
            )


def refuse_parallel(views: Sequence[SeenBoard], start: Array) -> None:
    """Raise VerdictError where all boards stand at one slant: that leaves the focal length open.

    A plane fixes the focal length by how its parallel lines meet, and all parallel planes meet in
    the same places (Zhang 2000, doi:10.1109/34.888718). The slants are found under a guessed
    camera, which is good enough to recognise parallel ones.
    """
    normals = _normals(np.array([first_pose(view, start) for view in views]))
    widest = _widest_deg(normals)
    if widest < _PARALLEL_DEG:
        raise VerdictError(_parallel(widest))


def refuse_undetermined(bundle: Bundle, width: int, height: int) -> None:
    """Raise VerdictError where a fit came out with a focal length that it does not know."""
    fx, fy, cx, cy = bundle.camera[:4]
    widest = _widest_deg(_normals(bundle.poses))
    inverse = np.linalg.pinv(bundle.information.sum(axis=0) + bundle.prior, hermitian=True)
    sd = float(np.sqrt(max(inverse[0, 0], 0.0))) * bundle.sd_px
    aside = max(abs(cx / width - 0.5), abs(cy / height - 0.5))
    if widest < _PARALLEL_DEG or not sd < _UNDETERMINED * fx or aside > 1.0 or min(fx, fy) <= 0.0:
        raise VerdictError(_parallel(widest))


def camera_verdicts(
    camera: Camera,
    views: Sequence[ViewError],
    places: PixelMap,
    cross: CrossValidation | None,
) -> tuple[Verdict, ...]:
    """Judge a fitted camera: focal length, views, corners, projection, two halves."""
    return (
        _focal(camera),
        _outlying(views),
        _corners(views),
        _projection(places),
        _halves(cross),
    )


def uncovered_notes(places: PixelMap, share: float) -> tuple[str, ...]:
    """What the part of the picture without corners means for what is measured there; may be empty.

    It is no verdict on the camera: the fits of blade and plate judge where these lie.
    """
    error = places.error_px
    known = error <= MOST_SD_PX
    if known.all():
        return ()
    worst = float(error.max())
    most = (
        f"{worst:.2g} px at worst"
        if np.isfinite(worst)
        else "a place may not be in the picture at all"
    )
    return (
        f"Corners were seen in {100 * share:.0f} % of the picture. A projected point is known to "
        f"{MOST_SD_PX:g} px in {100 * known.mean():.0f} % of it; elsewhere the camera is "
        f"extrapolated ({most}). Keep blade and plate out of that part, or add photographs with "
        "the board there.",
    )


def _focal(camera: Camera) -> Verdict:
    assert camera.covariance is not None
    sd = float(np.sqrt(camera.covariance[0, 0])) / camera.fx
    why = f"The focal length, {camera.fx:.1f} px, is known to {100 * sd:.2f} %."
    remedy = " Add photographs with the board tilted by 20 to 45 deg, every way."
    return FOCAL_LENGTH.judge(sd, why, why + remedy)


def _outlying(views: Sequence[ViewError]) -> Verdict:
    worst = max(views, key=lambda view: view.rms_px)
    middle = float(np.median([view.rms_px for view in views]))
    ratio = worst.rms_px / middle
    named = [view.name for view in views if view.outlying]
    why = (
        f"The worst photograph, {worst.name}, fits to {worst.rms_px:.2f} px, the middle one to "
        f"{middle:.2f} px."
    )
    remedy = (
        f" Look at the overlay of {', '.join(named)}: retake it, or remove it from its capture's "
        "folder."
    )
    return VIEWS.judge(ratio, why, why + remedy)


def _corners(views: Sequence[ViewError]) -> Verdict:
    count = sum(view.corners for view in views)
    why = f"{count} corners were seen in {len(views)} photographs"
    remedy = f"{why}; {CORNERS.threshold} are wanted: add photographs."
    return CORNERS.judge(count, f"{why}.", remedy)


def _projection(places: PixelMap) -> Verdict:
    inside = places.sd_px[places.inside]
    worst = float(np.nanmax(inside)) if inside.size else float("nan")
    outside = float(np.nanmax(places.sd_px))
    why = (
        f"A projected point is known to {worst:.2f} px (sd) at worst where corners were seen, to "
        f"{outside:.2f} px at worst in the whole picture."
    )
    return PROJECTION.judge(worst, why)


def _halves(cross: CrossValidation | None) -> Verdict:
    if cross is None:
        why = "Six photographs at least are needed to fit two halves apart."
        return TWO_HALVES.not_evaluated(why)
    why = (
        f"Two halves of the photographs differ by {cross.rms_px:.2f} px (rms) where corners were "
        f"seen; {cross.claimed_px:.2f} px is expected from their covariances "
        f"(p = {cross.p_value:.3f})."
    )
    remedy = " The board may be bent, or the lens moved (focus, zoom) between photographs."
    return TWO_HALVES.judge(cross.p_value, why, why + remedy)


def _normals(poses: Array) -> Array:
    import cv2

    return np.array([cv2.Rodrigues(pose[:3])[0][:, 2] for pose in poses])


def _widest_deg(normals: Array) -> float:
    cosines = np.clip(np.abs(normals @ normals.T), 0.0, 1.0)
    return float(np.degrees(np.arccos(cosines.min())))


def _parallel(widest_deg: float) -> str:
    return (
        f"The focal length is not determined: in all photographs the board stands at one slant "
        f"(within {widest_deg:.0f} deg). Nothing was saved. Add photographs with the board tilted "
        "by 20 to 45 deg to the left, to the right, up and down."
    )


def verdict_there(
    check: Check, places: PixelMap, pixels: Array, px_per_m: float, why: str = ""
) -> Verdict:
    """Judge the camera's standard error at the pixels (n, 2) of a thing, by the thing's ``check``.

    A part of the picture where no corner of the camera's board was seen is extrapolated. That does
    harm to what stands there, and to nothing else: so the share of the picture that is covered is
    no verdict on a camera, and this is one on each thing that is measured with it. ``px_per_m`` are
    the pixels to a metre of the thing; the limit is the one that a camera's fit has where corners
    were seen.
    """
    worst_px = places.worst_px(pixels)
    known = np.isfinite(worst_px)
    place = (
        f"The camera is known there to {worst_px:.2g} px at worst, "
        f"{1e3 * (worst_px / px_per_m):.2g} mm (limit {check.threshold:g} px)."
        if known
        else "The camera is not known at all where a part of it lies in the picture."
    )
    good = f"{why} {place}".lstrip()
    bad = (
        f"{place} It was fitted without a corner in that part of the picture: put this nearer "
        "to the middle, or add photographs of the camera board there and run 'scissorcal fit "
        "camera'."
    )
    return check.judge(worst_px if known else 1e6, good, bad)
