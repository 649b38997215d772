from .clocks import ClockFit as ClockFit
from .clocks import ClockWatch as ClockWatch
from .clocks import fit_clock as fit_clock
from .follow import FollowedRow as FollowedRow
from .follow import PoseFollower as PoseFollower
from .judge import DelayFit as DelayFit
from .judge import TrackFigures as TrackFigures
from .judge import measure_delay as measure_delay
from .judge import track_figures as track_figures
from .judge import track_verdicts as track_verdicts
from .plate_pose import PlatePose as PlatePose
from .plate_pose import PoseSource as PoseSource
from .plate_pose import fixed_pose as fixed_pose
from .plate_pose import level_plate as level_plate
from .plate_pose import pose_error as pose_error
from .rows import CameraPose as CameraPose
from .rows import TipContact as TipContact
from .rows import TipContacts as TipContacts
from .settings import CameraErrors as CameraErrors
from .settings import ContactErrors as ContactErrors
from .settings import ForceErrors as ForceErrors
from .settings import PlateMotion as PlateMotion
from .settings import TrackingSettings as TrackingSettings
from .settings import settings_of as settings_of
from .tracker import Counts as Counts
from .tracker import Outcome as Outcome
from .tracker import PoseEstimate as PoseEstimate
from .tracker import PoseTracker as PoseTracker

__all__ = [
    "CameraErrors",
    "CameraPose",
    "ClockFit",
    "ClockWatch",
    "ContactErrors",
    "Counts",
    "DelayFit",
    "FollowedRow",
    "ForceErrors",
    "Outcome",
    "PlateMotion",
    "PoseEstimate",
    "PoseFollower",
    "PoseTracker",
    "TipContact",
    "TipContacts",
    "TrackFigures",
    "TrackingSettings",
    "fit_clock",
    "measure_delay",
    "pose_error",
    "settings_of",
    "track_figures",
    "track_verdicts",
]
