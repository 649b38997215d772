"""Tables stored in 16-bit numbers: how rows of floats are rounded to them, and read again."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.tables import LARGEST_TABLE, Table

LOWEST, STEPS = -(2**15), 2**16 - 1
SCALE_BITS = 8
"""Significant bits of a scale: times a number of 16 bits they fit into float32, so that a value is
rounded once and equal on every processor."""

NEAR_ZERO = 0.5
"""A row that begins above 0, but below this share of its end, is stored from 0 on."""


@dataclass(frozen=True)
class Row16:
    """How a row is stored: ``offset`` + ``scale`` q for the whole numbers q of 16 bits.

    >>> row = Row16.spanning(0.0, 2.0)
    >>> row.rounded([0.0, 1.0]).round(6).tolist()
    [0.0, 1.0]
    """

    offset: float
    scale: float

    @classmethod
    def spanning(cls, low: float, high: float) -> "Row16":
        """The finest row that reaches from ``low`` to ``high``.

        It begins at exactly 0 where ``low`` is 0, or above 0 and below ``NEAR_ZERO`` of ``high``.
        Where ``low`` is below 0, a value of 0 is rounded as any other.
        """
        low = 0.0 if 0.0 <= low < NEAR_ZERO * high else low
        if not high > low:
            return cls(float(np.float32(low)), 0.0)
        fraction, exponent = math.frexp((high - low) / STEPS)
        fraction = math.ceil(fraction * 2**SCALE_BITS) / 2**SCALE_BITS
        scale = float(np.float32(math.ldexp(fraction, exponent)))
        return cls(float(np.float32(low - LOWEST * scale)), scale)

    def numbers(self, values: ArrayLike, *, down: bool = False) -> NDArray[np.int16]:
        """The whole numbers nearest to ``values``, or, with ``down``, not above them."""
        wanted = np.asarray(values, dtype=np.float64)
        if self.scale == 0.0:
            return np.zeros(wanted.shape, dtype=np.int16)
        steps = (wanted - self.offset) / self.scale
        # a value that was rounded to float32 belongs to the number that it was decoded from
        spare = 2.0**-22 * max(abs(self.offset / self.scale), 1.0)
        whole = np.floor(steps + min(spare, 0.5)) if down else np.rint(steps)
        return np.clip(whole, LOWEST, LOWEST + STEPS).astype(np.int16)

    def values(self, numbers: NDArray[np.int16]) -> NDArray[np.float32]:
        """The values that a kernel decodes."""
        scale, offset = np.float32(self.scale), np.float32(self.offset)
        return np.asarray(offset + scale * numbers.astype(np.float32), dtype=np.float32)

    def rounded(self, values: ArrayLike, *, down: bool = False) -> Array:
        """The stored values nearest to ``values``, or, with ``down``, not above them."""
        return self.values(self.numbers(values, down=down)).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Table16:
    """A table in 16-bit numbers: ``numbers`` (3, n) of knots, values and slopes, and three rows.

    Raises ValueError where the decoded table is not sound: see :class:`Table`.
    """

    numbers: NDArray[np.int16]
    rows: tuple[Row16, Row16, Row16]

    def __post_init__(self) -> None:
        shape = self.numbers.shape
        if len(shape) != 2 or shape[0] != 3 or not 2 <= shape[1] <= LARGEST_TABLE:
            raise ValueError(f"A table has three rows of 2 to {LARGEST_TABLE} knots, not {shape}.")
        for row in self.rows:
            if not (math.isfinite(np.float32(row.offset)) and 0 <= row.scale < math.inf):
                raise ValueError("A row's offset must be finite, and its scale not negative.")
            if (math.frexp(row.scale)[0] * 2**SCALE_BITS) % 1.0:
                raise ValueError(f"A row's scale has at most {SCALE_BITS} significant bits.")

    @classmethod
    def of(cls, table: Table, rows: tuple[Row16, Row16, Row16]) -> "Table16":
        """Store a table that was decoded from such rows. ValueError where it was not."""
        parts = (table.x, table.y, table.slope)
        numbers = np.stack([row.numbers(part) for row, part in zip(rows, parts, strict=True)])
        stored = cls(numbers, rows)
        again = stored.decoded()
        if not all(
            np.array_equal(getattr(again, name), part)
            for name, part in zip(("x", "y", "slope"), parts, strict=True)
        ):
            raise ValueError("The table holds numbers that its 16-bit rows cannot.")
        return stored

    def decoded(self) -> Table:
        """The table of floats, decoded in C as a program that holds the numbers in flash does."""
        size = self.numbers.shape[1]
        stored, table = ffi.new("sc_table16 *"), ffi.new("sc_table *")
        stored.size = size
        keep: list[Any] = []
        for name, numbers, row in zip(("x", "y", "slope"), self.numbers, self.rows, strict=True):
            whole = np.ascontiguousarray(numbers, dtype=np.int16)
            keep.append(ffi.from_buffer("int16_t[]", whole))
            part = getattr(stored, name)
            part.numbers, part.offset, part.scale = keep[-1], row.offset, row.scale
        floats = np.empty((3, size), dtype=np.float32)
        places = [ffi.from_buffer("float[]", part, require_writable=True) for part in floats]
        if not lib.sc_table16_decode(stored, *places, table):
            raise ValueError("A table's 16-bit knots must ascend, and all of it be finite.")
        return Table(*floats)
