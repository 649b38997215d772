"""Dahl's presliding along a path, in C, in one pass."""

import numpy as np

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
