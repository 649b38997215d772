"""Names for types that many rooms share."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

Progress = Callable[[float, str], None]
"""Told the share done (0 to 1) and a sentence on what is being done."""

Say = Callable[[str], None]
"""Told a sentence for people."""
