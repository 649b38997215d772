"""Motion over the path: position smoothed as its encoder needs, work, and the noise of both."""

from scissorcal.calibration.cut.path.motion import PathMotion, path_motion, turning_points
from scissorcal.calibration.cut.path.work import (
    FrictionDraws,
    Material,
    advance_line,
    built_friction,
    built_up,
    kinetic_variance,
    material_of,
    mean_advance,
    mean_torque,
    sums_between,
    torque_covariance,
    torque_noise_of,
    without_tremor,
)

__all__ = [
    "FrictionDraws",
    "Material",
    "PathMotion",
    "advance_line",
    "built_friction",
    "built_up",
    "kinetic_variance",
    "material_of",
    "mean_advance",
    "mean_torque",
    "path_motion",
    "sums_between",
    "torque_covariance",
    "torque_noise_of",
    "turning_points",
    "without_tremor",
]
