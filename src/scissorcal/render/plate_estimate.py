"""How an estimated plate was rendered, and the source of a fitted pose."""

from dataclasses import dataclass

import numpy as np

from scissorcal.package.manifest import PlateRecord
from scissorcal.tracking.plate_pose import PoseSource, fixed_pose


@dataclass(frozen=True)
class PlateReport:
    """How an estimated plate was rendered.

    ``estimates`` came, of which ``lost`` (the source had lost the plate), ``late``, ``uncertain``
    (too uncertain for the scene's tolerance), ``leapt`` and ``unreachable`` (stands where it cannot
    be rendered) were not used. ``falls`` counts how often the force fell, ``out_s`` is for how long
    of the ``seconds`` of rendering it was below its own for it. ``widest`` is the largest half
    width of the torque's interval by the pose among estimates that were used, as a share.
    ``sentences`` tell of each kind once.
    """

    estimates: int
    lost: int
    late: int
    uncertain: int
    leapt: int
    unreachable: int
    falls: int
    seconds: float
    out_s: float
    widest: float
    sentences: tuple[str, ...]

    @property
    def summary(self) -> str:
        """How the plate was followed, in a line."""
        refused = self.lost + self.late + self.uncertain + self.leapt + self.unreachable
        return (
            f"plate: {self.estimates} estimates of its pose, {refused} not used; it leaves the "
            f"torque uncertain by up to {self.widest:.1%}; without its force for {self.out_s:.1f} s"
        )


def fixed_plate(record: PlateRecord) -> PoseSource:
    """A source that always gives a fitted pose, which must be in the rig's frame."""
    from scipy.spatial.transform import Rotation

    w, x, y, z = record.quaternion
    rotation = np.asarray(Rotation.from_quat([x, y, z, w]).as_matrix(), dtype=np.float64)
    return fixed_pose(rotation, np.array(record.translation_m), np.array(record.covariance))
