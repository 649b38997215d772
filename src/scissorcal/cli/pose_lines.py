"""What stands below the printed Euler angles of poses."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scissorcal.vision.geometry.pose import Pose


def pose_lines(poses: "Mapping[str, Pose]") -> list[str]:
    """Quaternions of poses by the names of their frames, notes on their angles, the convention."""
    from scissorcal.recipe.euler_angles import CONVENTION, quaternion_words

    lines = [f"quaternion, {name}: {quaternion_words(p.quaternion)}" for name, p in poses.items()]
    notes = {name: pose.euler_angles.note for name, pose in poses.items()}
    lines += [f"note, {name}: {note}" for name, note in notes.items() if note]
    return [*lines, f"yaw, pitch, roll: {CONVENTION}"]
