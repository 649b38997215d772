"""Counts of the lag that a hand feels, as the servo keeps them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LagCounts:
    """Ticks of the device by their lag and by the mode in force then.

    ``counts[mode, i]`` ticks had a lag of i + 1 ticks, the last column also all longer ones;
    ``held[mode]`` ticks had no new command since the tick before; ``worst[mode]`` is the longest
    lag, 0 where there was none.
    """

    counts: NDArray[np.int64]
    held: NDArray[np.int64]
    worst: NDArray[np.int64]

    @classmethod
    def of(cls, lag: Any) -> "LagCounts":
        """Copy what a C struct ``sc_lag`` has now."""
        rows = ([list(row) for row in lag.count], list(lag.held), list(lag.worst))
        return cls(*(np.array(values, dtype=np.int64) for values in rows))
