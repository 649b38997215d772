"""The plate's pose while rig and plate work: a filter over pictures and contacts.

Arrays in, arrays out: no files, no ports, no clocks. `PoseTracker` is the filter;
`PoseFollower` feeds it from a camera and a rig whose clocks it measures. 'scissorcal track' and
`scissorcal.workday.runs.track.track_plate` connect it to a workspace.
"""

from scissorcal.tracking.clocks import ClockFit, ClockWatch, fit_clock
from scissorcal.tracking.follow import FollowedRow, PoseFollower
from scissorcal.tracking.judge import (
    DelayFit,
    TrackFigures,
    measure_delay,
    track_figures,
    track_verdicts,
)
from scissorcal.tracking.plate_pose import pose_error
from scissorcal.tracking.rows import CameraPose, TipContact, TipContacts
from scissorcal.tracking.settings import (
    CameraErrors,
    ContactErrors,
    ForceErrors,
    PlateMotion,
    TrackingSettings,
    settings_of,
)
from scissorcal.tracking.tracker import Counts, Outcome, PoseEstimate, PoseTracker

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
