"""What C makes of a path of measured places, in one pass: presliding, and the servo's rates."""

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib


def presliding_path(opening: Array, length: float) -> Array:
    """How far dry friction has built up since the last reversal, between -1 and 1, shape (n,).

    The same as :func:`scissorcal.model.presliding_state` of ``opening`` (n,) in order of time and
    ``length`` in its unit, to rounding. ValueError where ``length`` is not positive.

    >>> presliding_path(np.array([0.0, 1.0, 0.9, 0.8, -1.0]), 0.1).round(3)
    array([ 1.   ,  1.   , -0.264, -0.729, -1.   ])
    """
    if not length > 0.0:
        raise ValueError(f"length must be positive, not {length}")
    path = np.ascontiguousarray(opening, dtype=np.float64)
    state = np.empty(len(path))
    lib.sc_presliding(
        ffi.cast("double *", ffi.from_buffer(path)),
        len(path),
        float(length),
        ffi.cast("double *", ffi.from_buffer(state)),
    )
    return state


def estimated_rates(opening: ArrayLike, tick_us: int, cutoff_Hz: float) -> Array:
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
