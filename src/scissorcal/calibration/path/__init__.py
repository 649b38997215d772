"""Motion over the path: position smoothed as its encoder needs, work, and the noise of both."""

from scissorcal.calibration.path.motion import PathMotion, path_motion, turning_points
from scissorcal.calibration.path.work import (
    Material,
    material_of,
    mean_torque,
    torque_covariance,
    torque_noise_of,
)

__all__ = [
    "Material",
    "PathMotion",
    "material_of",
    "mean_torque",
    "path_motion",
    "torque_covariance",
    "torque_noise_of",
    "turning_points",
]
