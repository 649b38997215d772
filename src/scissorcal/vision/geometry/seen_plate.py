"""The plate's pose in one picture: what is new in that picture, and what all pictures share."""

from dataclasses import dataclass, replace

from scissorcal.aliases import Array
from scissorcal.vision.geometry.board_pose import BoardPose
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.geometry.rig_frame import RigPose


@dataclass(frozen=True, eq=False)
class SeenPlate:
    """T_rig_plate, or T_camera_plate where the rig's frame is not known.

    The covariance of ``pose`` is the whole one. It is the sum of ``noise`` (6, 6), from the errors
    of corners, which are new in each picture, and ``shared`` (6, 6), from the errors of camera,
    print and rig card, which are the same in all of them. ``other`` is the second pose that a plane
    allows.
    """

    pose: Pose
    other: Pose | None
    noise: Array
    shared: Array


def seen_plate(found: BoardPose, camera: Camera, back: Pose, rig: RigPose | None) -> SeenPlate:
    """The plate of a target that was found; ``back`` is T_target_plate.

    ``rig`` takes it into the rig's frame, with the errors of the camera that both share. A filter
    over many pictures takes ``noise`` for each and ``shared`` once, as its bias: counted in each
    picture, the shared errors would seem to average out.
    """
    pose = (rig.holds(found, camera) if rig else found.pose).after(back)
    exact = replace(rig.camera_rig, covariance=None).inverse() if rig else None

    def placed(seen: Pose) -> Pose:
        return (exact.after(seen) if exact else seen).after(back)

    alone = placed(replace(found.pose, covariance=found.noise))
    assert pose.covariance is not None
    assert alone.covariance is not None
    shared = pose.covariance - alone.covariance
    return SeenPlate(
        pose=pose,
        other=placed(found.other) if found.other else None,
        noise=alone.covariance,
        shared=0.5 * (shared + shared.T),
    )
