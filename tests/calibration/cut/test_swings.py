"""Blades that swing back between teeth by less than the encoder shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from scissorcal.calibration.cut.segments import COUNTS_A_TOOTH, swings_unseen

TOOTH_RAD = 1.2e-3
TICK_S = 1e-3


def motion(speed: float, swing: float, resolution: float) -> SimpleNamespace:
    """Blades whose rate oscillates once a tooth by ``swing`` times their mean speed."""
    time = np.arange(2000) * TICK_S
    rate = -speed * (1.0 + swing * np.sin(2 * np.pi * speed / TOOTH_RAD * time))
    return SimpleNamespace(rate=rate, resolution=resolution)


@pytest.mark.parametrize(
    ("swing", "counts", "expected"),
    [(1.2, 4.0, True), (1.2, 2.0 * COUNTS_A_TOOTH, False), (0.3, 4.0, False), (0.3, 25.0, False)],
)
def test_motion_within_a_tooth_is_unresolved_with_few_counts(swing, counts, expected):
    found = swings_unseen(
        motion(0.1, swing, TOOTH_RAD / counts), np.array([100, 900, 1900]), TOOTH_RAD
    )
    assert found is expected


def test_only_the_stretch_counts():
    blades = motion(0.1, 0.0, TOOTH_RAD / 4.0)
    blades.rate[:500] = 0.0
    assert swings_unseen(blades, np.array([0, 1900]), TOOTH_RAD)
    assert not swings_unseen(blades, np.array([600, 1900]), TOOTH_RAD)
