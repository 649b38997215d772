"""Simultaneous bands of coverage: their false alarms, and what they catch."""

import numpy as np
import pytest

from scissorcal.calibration.verify.coverage import judge_coverage


def counts(rng: np.random.Generator, fits: int, width: float = 1.0) -> dict[str, dict[float, int]]:
    """Four parameters with normal errors, claimed ``width`` times as wide as they are."""
    errors = np.abs(rng.standard_normal((4, fits)))
    half = {0.5: 0.6745 * width, 0.9: 1.6449 * width}
    return {
        f"p{index}": {level: int(np.sum(row < z)) for level, z in half.items()}
        for index, row in enumerate(errors)
    }


def test_right_intervals_leave_the_bands_as_rarely_as_stated() -> None:
    """2,000 studies at 5 %: the share of alarms is below 5 % but for 4.1 sd (0.02)."""
    rng = np.random.default_rng(0)
    alarms = [
        not all(row.inside for row in judge_coverage(counts(rng, 300), 300)) for _ in range(2000)
    ]
    assert 0.005 < np.mean(alarms) < 0.07


def test_intervals_a_quarter_too_narrow_are_caught() -> None:
    found = judge_coverage(counts(np.random.default_rng(1), 300, width=0.75), 300)
    assert not all(row.inside for row in found)


def test_counts_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="number of fits, which is 10"):
        judge_coverage({"force": {0.5: 11}}, 10)
