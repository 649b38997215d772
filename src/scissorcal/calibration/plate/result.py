"""What the fit of a plate's pose results in."""

from dataclasses import dataclass

from scissorcal.calibration.result import Result
from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.pose import Pose


@dataclass(frozen=True)
class PoseView:
    """One photograph: corners seen and used, rms errors in pixels under the common pose and under
    its own, side of a square or marker in pixels, distance, angle between line of sight and the
    plate's normal, ambiguity of that pose, and how far that lies from the common one."""

    name: str
    corners: int
    used: int
    rms_px: float
    rms_alone_px: float
    side_px: float
    distance_m: float
    tilt_deg: float
    ambiguity: float
    away_deg: float
    away_mm: float


@dataclass(frozen=True)
class PoseHalves:
    """Difference of the poses fitted to two halves of the corners. ``square`` is its squared
    Mahalanobis length by their covariances: chi-square with six degrees of freedom where these are
    right."""

    rotation_deg: float
    translation_mm: float
    square: float


@dataclass(frozen=True, repr=False)
class PlateFit(Result):
    """The plate's pose in the camera's and in the rig's frame, with covariance.

    ``other`` is the second pose that a plane allows, ``odds`` those of the first against it,
    ``ambiguity`` the ratio of their rms errors (infinite without a second pose). ``rig_plate`` is
    None where the rig's frame is not known, ``halves`` where too few corners were seen.
    """

    title = "plate fit"
    command = "scissorcal fit plate"
    what = "plate"

    target: str
    camera_plate: Pose
    other: Pose | None
    odds: float
    ambiguity: float
    rig_plate: Pose | None
    views: tuple[PoseView, ...]
    halves: PoseHalves | None
    rms_px: float
    noise_px: float
    verdicts: tuple[Verdict, ...]
    inputs_hash: str
    sources: tuple[str, ...]
