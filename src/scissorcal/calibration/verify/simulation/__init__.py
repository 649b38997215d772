"""Simulated raw recordings of known parameters, with the motion of existing recordings."""

from scissorcal.calibration.verify.simulation.crack import (
    Sheet,
    Unevenness,
    crack_law,
    material_torque,
)
from scissorcal.calibration.verify.simulation.drive import DriveTruth, drawn_noise, measured_drive
from scissorcal.calibration.verify.simulation.motion import Motion, SmoothPiece, motion_of
from scissorcal.calibration.verify.simulation.recordings import (
    CutTruth,
    cut_truth,
    friction_truth,
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
