"""Simulated raw recordings of known parameters, with the motion of existing recordings."""

from scissorcal.calibration.verify.simulation.motion import (
    DriveTruth,
    Motion,
    SmoothPiece,
    drawn_noise,
    measured_drive,
    motion_of,
)
from scissorcal.calibration.verify.simulation.recordings import (
    CutTruth,
    Sheet,
    Unevenness,
    crack_law,
    cut_truth,
    friction_truth,
    material_torque,
    simulate_cut,
    simulate_friction,
)

__all__ = [
    "CutTruth",
    "DriveTruth",
    "Motion",
    "Sheet",
    "SmoothPiece",
    "Unevenness",
    "crack_law",
    "cut_truth",
    "drawn_noise",
    "friction_truth",
    "material_torque",
    "measured_drive",
    "motion_of",
    "simulate_cut",
    "simulate_friction",
]
