"""The smooth motion that is simulated does not depend on single lost samples."""

from dataclasses import replace

import numpy as np

from scissorcal.calibration.verify.simulated_motion import motion_of
from tests.calibration.cut.path.made import INERTIA, record, swing

STEP_rad = 3.14e-4


def test_lost_samples_leave_no_encoder_steps_in_the_simulated_path():
    """Interpolated positions lie between steps: taken for readings, the encoder seemed finer."""
    way = swing(4.0)
    whole = record(way, lambda opening: 0.0 * opening, step_rad=STEP_rad).recording
    lost = np.random.default_rng(0).choice(np.arange(10, len(way) - 10), 40, replace=False)
    parts = replace(whole, samples=np.delete(whole.samples, lost))
    errors = []
    for recording in (whole, parts):
        (motion,) = motion_of((recording,), INERTIA, 1e-3)
        (piece,) = motion.pieces
        inside = slice(50, -50)
        errors.append(float(np.sqrt(np.mean((piece.opening - way)[inside] ** 2))))
    assert errors[1] < 1.5 * errors[0]
