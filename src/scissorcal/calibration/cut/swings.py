"""Whether an encoder shows how the blades move from tooth to tooth."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut.path import PathMotion

Integers = NDArray[np.int64]

COUNTS_A_TOOTH = 10.0
"""A tooth of more encoder steps shows how the blades move within it: with 25 the work is right."""
SWINGING = 0.5
"""Standard deviation of the rate over its mean from which blades may turn back: 0.8 to 1 where they
did, 0.2 at most where they did not."""


def swings_unseen(motion: PathMotion, ends: Integers, period: float) -> bool:
    """Whether blades may swing back between teeth by less than the encoder shows.

    Slow blades stop or turn at each tooth. Friction then acts over a longer path than the net one:
    with 4 counts a tooth (``period``, rad) it was 0.7 to 1.0 mN m, or 4 %, more than smoothed
    positions say.
    """
    if period > COUNTS_A_TOOTH * motion.resolution:
        return False
    rate = motion.rate[ends[0] : ends[-1] + 1]
    return bool(np.std(rate) > SWINGING * abs(float(np.mean(rate))))
