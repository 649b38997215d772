"""What a camera's fit ends in: the camera and its covariance, its views, checks and verdicts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.camera import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ViewError:
    """One photograph in the fit.

    ``tilt_deg`` is the angle between the board and the picture's plane, ``pose`` the rotation
    vector (rad) and translation (m) that take the board's frame into the camera's.
    """

    name: str
    corners: int
    rms_px: float
    worst_px: float
    square_px: float
    distance_m: float
    tilt_deg: float
    outlying: bool
    pose: tuple[float, ...]


@dataclass(frozen=True)
class PixelMap:
    """Pixels over a grid of places in the picture: ``x`` (columns,), ``y`` (rows,) in pixels.

    ``sd_px`` (rows, columns): how uncertain the fit says a projected point is, per coordinate, with
    the best rotation of the camera taken out, since every use of a camera finds its own pose.
    ``difference_px`` (rows, columns): how far the cameras of two independent halves of the
    photographs are apart, the same taken out; None where there were too few. ``inside`` marks
    places where corners were seen about.
    """

    x: Array
    y: Array
    sd_px: Array
    inside: NDArray[np.bool_]
    difference_px: Array | None = None


@dataclass(frozen=True)
class CrossValidation:
    """Two halves of the photographs fitted apart.

    ``rms_px`` is their difference over the valid region, ``claimed_px`` what their covariances let
    expect (rms), ``p_value`` the share of cameras drawn from these that differ as much.
    """

    rms_px: float
    claimed_px: float
    p_value: float


@dataclass(frozen=True)
class CameraFit:
    """A camera with all that is known of how well it is known.

    ``origin`` is "fitted" or "imported". ``rung`` names the distortion model that was chosen and
    ``rungs`` lists those compared, cheapest first, each with ``name``, ``free``, ``unseen_px`` (rms
    on photographs left out), ``behind`` and ``behind_se`` (how much worse than the best, in
    log-likelihood per photograph), ``equivalent`` and ``chosen``. ``draws`` (draws, 9) are of the
    posterior, columns as in `scissorcal.vision.geometry.camera.PARAMETERS`. ``bulge_mm`` is how far
    the board's middle stands out along its width and its height, ``noise_px`` the scale of corner
    errors, ``stretch`` the factor by which standard errors were widened because errors within a
    photograph go together. ``region`` (k, 2) outlines where corners were seen.
    """

    camera: Camera
    origin: Literal["fitted", "imported"]
    board: str
    rung: str
    rungs: tuple[Mapping[str, Any], ...]
    draws: Array
    views: tuple[ViewError, ...]
    bulge_mm: tuple[float, float]
    noise_px: float
    stretch: float
    region: Array
    region_share: float
    pixel_map: PixelMap | None
    cross: CrossValidation | None
    verdicts: tuple[Verdict, ...]
    inputs_hash: str
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
