"""The rate that the servo estimates from a stream of measured places."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib


def estimated_rates(opening: ArrayLike, tick_us: int, cutoff_Hz: float) -> NDArray[np.float64]:
    """Rates (n,) that the servo has at each of the openings (n,), one in each tick.

    By the servo's own C: backward differences behind a first-order low-pass at ``cutoff_Hz``
    (0: none), 0 at the first place. Raises ValueError unless a tick takes at least 1 us.

    >>> estimated_rates([0.0, 0.001, 0.002], tick_us=1000, cutoff_Hz=0.0).round(3)
    array([0., 1., 1.])
    """
    if tick_us < 1:
        raise ValueError(f"a tick takes at least 1 us, not {tick_us}")
    places = np.asarray(opening, dtype=np.float32)
    rates = np.empty(places.size)
    motion = ffi.new("sc_motion *")
    for index, place in enumerate(places.tolist()):
        passed_us = tick_us if index else 0
        lib.sc_motion_update(motion, cutoff_Hz, passed_us, place, 0.0)
        rates[index] = motion.opening_rate
    return rates
