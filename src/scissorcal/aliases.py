"""Names for types that many rooms share."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Progress(Protocol):
    """What follows long work: any function that takes these two arguments.

    ``done`` is the share that is done (0 to 1), ``sentence`` says what is being done. It is called
    from the thread that works, often; an error that it raises ends the work.
    """

    def __call__(self, done: float, sentence: str, /) -> None: ...


Say = Callable[[str], None]
"""Told a sentence for people."""
