"""Pictures of a plate as a track takes them: located, with their times, of any origin."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from scissorcal.recipe.priors import PlatePriors
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.geometry.rig_frame import PicturePose, RigPose, picture_pose
from scissorcal.vision.live import Frame, LocatedFrame, State, located_frames
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP

TARGETS = ("", PLATE_BOARD.name, PLATE_STRIP.name)
"""Names of targets, in the order of their numbers in a recording."""


@dataclass(frozen=True, eq=False)
class TrackPicture:
    """One picture: its number, times and state, and the plate's pose in it, if there is one.

    ``stamp_s`` is by the camera's clock, NaN where it states none; ``arrived_s`` by the host's;
    ``done`` is the share of all pictures that are passed, NaN where it is unknown.
    """

    number: int
    stamp_s: float
    arrived_s: float
    state: State
    corners: int
    target: str = ""
    odds: float = math.nan
    rms_px: float = math.nan
    seen: PicturePose | None = None
    done: float = math.nan


@dataclass(frozen=True, eq=False)
class PoseFinder:
    """What turns a camera's pictures into poses of the plate.

    ``back`` is T_target_plate; ``rig`` takes poses into the rig's frame, None where that is not
    known.
    """

    camera: Camera
    back: Pose
    rig: RigPose | None
    priors: PlatePriors

    def locate(self, frames: Iterable[Frame]) -> Iterator[LocatedFrame]:
        """Find the plate's target in every picture."""
        return located_frames(frames, (PLATE_BOARD, PLATE_STRIP), self.camera, self.priors)

    def picture(self, located: LocatedFrame) -> TrackPicture:
        """The picture as a track takes it; a video's arrives when it is stamped."""
        frame, pose = located.frame, located.pose
        live = not math.isnan(frame.arrived_s)
        return TrackPicture(
            number=frame.number,
            stamp_s=frame.stamp_s if live else frame.time_s,
            arrived_s=frame.arrived_s if live else frame.time_s,
            state=located.state,
            corners=located.corners,
            target=located.board.name if located.board else "",
            odds=min(pose.odds, 1e12) if pose and pose.other else math.nan,
            rms_px=pose.rms_px if pose else math.nan,
            seen=picture_pose(pose, self.camera, self.back, self.rig) if pose else None,
            done=frame.number / frame.count if frame.count else math.nan,
        )
