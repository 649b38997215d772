"""What a camera fit results in: the camera with its covariance, views, checks, verdicts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.result import Result, Stored, by_name
from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.camera import PARAMETERS, Camera


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


_MAP = Stored(("y", "x"))


@dataclass(frozen=True)
class PixelMap:
    """Errors over a grid of places in the picture: ``x`` (columns,), ``y`` (rows,) in pixels.

    ``sd_px`` (rows, columns): standard deviation of a projected point, per coordinate, after the
    best rotation of the camera, since every use of a camera estimates its own pose.
    ``difference_px`` (rows, columns): difference between the cameras fitted to two independent
    halves of the photographs, after the best rotation; None with too few photographs. ``inside``
    marks places near which corners were seen. ``model_px`` (rows, columns): largest difference to
    a candidate model that predicts unseen photographs as well, after the best rotation; None where
    there is no such candidate. NaN is a place that a model does not project to.
    """

    x: Annotated[Array, Stored(("x",))]
    y: Annotated[Array, Stored(("y",))]
    sd_px: Annotated[Array, _MAP]
    inside: Annotated[NDArray[np.bool_], _MAP]
    difference_px: Annotated[Array | None, _MAP] = None
    model_px: Annotated[Array | None, _MAP] = None

    @property
    def error_px(self) -> Array:
        """Standard error of a projected point per coordinate, (rows, columns); inf if unknown.

        Its standard deviation and the difference of equally good models together: where no corner
        was seen, the former holds for the chosen model alone.
        """
        model = 0.0 if self.model_px is None else self.model_px
        return np.nan_to_num(np.sqrt(self.sd_px**2 + 0.5 * model**2), nan=np.inf)

    def worst_px(self, pixels: Array) -> float:
        """Largest ``error_px`` at pixels (n, 2): that of the worst corner of their grid cells."""
        worst = self.error_px
        for axis in (0, 1):
            low, high = np.delete(worst, -1, axis), np.delete(worst, 0, axis)
            worst = np.maximum(low, high)
        column = np.clip(np.searchsorted(self.x, pixels[:, 0]) - 1, 0, len(self.x) - 2)
        row = np.clip(np.searchsorted(self.y, pixels[:, 1]) - 1, 0, len(self.y) - 2)
        return float(worst[row, column].max())


@dataclass(frozen=True)
class CrossValidation:
    """Two halves of the photographs, fitted separately.

    ``rms_px`` is their difference over the valid region, ``claimed_px`` its expected value by their
    covariances (rms), ``p_value`` the share of cameras drawn from these that differ as much.
    """

    rms_px: float
    claimed_px: float
    p_value: float


@dataclass(frozen=True, repr=False)
class CameraFit(Result):
    """A camera and its uncertainty.

    ``origin`` is "fitted" or "imported". ``candidate`` names the chosen distortion model and
    ``candidates`` lists those compared, simplest first, each with ``name``, ``free``, ``unseen_px``
    (rms on photographs left out), ``score`` (log density of these), ``behind`` and ``behind_se``
    (how much lower than the best one's), ``equivalent`` and ``chosen``. ``draws`` (draws, 9) are of
    the posterior, columns as in `scissorcal.vision.geometry.camera.PARAMETERS`. ``bulge_mm`` is how
    far the board's middle stands out along its width and its height, ``noise_px`` the scale of
    corner errors, ``stretch`` the factor by which standard errors were widened because errors
    within a photograph are correlated. ``region`` (k, 2) outlines where corners were seen.
    """

    title = "camera fit"
    command = "scissorcal fit camera"
    what = "camera"
    names = PARAMETERS
    """Parameters of the camera, in the order of the columns of ``draws``."""

    camera: Camera
    origin: Literal["fitted", "imported"]
    board: str
    candidate: str
    candidates: tuple[Mapping[str, Any], ...]
    draws: Annotated[Array, by_name("/posterior", "names")]
    views: tuple[ViewError, ...]
    bulge_mm: tuple[float, float]
    noise_px: float
    stretch: float
    region: Annotated[Array, Stored(("corner", "axis"))]
    region_share: float
    pixel_map: PixelMap | None
    cross: CrossValidation | None
    verdicts: tuple[Verdict, ...]
    inputs_hash: str
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
