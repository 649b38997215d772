"""What the kernel evaluates: tables in float32, and the set of them that makes a model."""

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.kernel._kernel import ffi, lib

Float32 = NDArray[np.float32]

LARGEST_TABLE = int(lib.SC_TABLE_MAX)

TABLE_NAMES = ("edge", "response", "friction_opening", "friction_closing", "friction_angle")
"""The tables of a model, in the order of the core's own struct."""


@dataclass(frozen=True, eq=False)
class Table:
    """A piecewise cubic Hermite table: knots ``x``, values ``y``, derivatives ``slope``.

    All three have shape (n,), 2 <= n <= 256, and are kept as read-only float32; ``x`` ascends and
    need not be even. Raises ValueError for anything else.

    >>> Table([0.0, 1.0], [0.0, 1.0], [0.0, 2.0]).evaluate([0.5, 2.0])  # x^2, then straight on
    array([0.25, 3.  ], dtype=float32)
    """

    x: Float32
    y: Float32
    slope: Float32

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.array(getattr(self, field.name), dtype=np.float32)
            array.setflags(write=False)
            object.__setattr__(self, field.name, array)
        n = len(self.x) if self.x.ndim == 1 else 0
        if not 2 <= n <= LARGEST_TABLE:
            raise ValueError(f"A table needs 2 to {LARGEST_TABLE} knots in one row, not {n}.")
        if self.y.shape != (n,) or self.slope.shape != (n,):
            raise ValueError(f"A table of {n} knots needs as many values and slopes.")
        if not all(np.isfinite(a).all() for a in (self.x, self.y, self.slope)):
            raise ValueError("A table holds a number that is not finite in float32.")
        if not np.all(self.x[1:] > self.x[:-1]):
            raise ValueError("A table's knots must ascend, also once rounded to float32.")

    def evaluate(self, x: ArrayLike, *, held: bool = False) -> Float32:
        """Values at ``x``, same shape, computed in C in float32.

        Beyond the ends the table goes on straight with the end's slope, or, if ``held``, keeps
        the end's value.
        """
        places = np.asarray(x, dtype=np.float32, order="C")
        values = np.empty_like(places)
        table, _keep = _table_struct(self)
        lib.sc_table_many(
            ffi.addressof(table),
            held,
            ffi.from_buffer("float[]", places),
            ffi.from_buffer("float[]", values, require_writable=True),
            places.size,
        )
        return values


@dataclass(frozen=True, eq=False, kw_only=True)
class ModelTables:
    """A whole model as the kernel takes it. SI units and radians throughout.

    ``edge``: e(s) over station s. ``response``: g over indentation, from (0, 0) and never
    falling. ``friction_opening`` and ``friction_closing``: level >= 0 over |rate|;
    ``friction_angle``: factor over the opening. ``upper_face`` is y_top, ``fracture_energy`` is
    J_c h in newtons, 0 where nothing is cut. ``kappa`` in (0, 1]: share of J_c h at which a
    running crack stops. ``rate_damping`` (s/m) multiplies the response by 1 + c d(delta)/dt.
    Friction runs linearly through 0 within ``friction_rate_eps`` (rad/s). ``tip_station``: where
    the blade ends; infinite if the edge may be continued straight. The four ranges are those the
    tables were made for; outside, steps are flagged.

    Raises ValueError, with a sentence, for a value that the kernel would not take.
    """

    edge: Table
    response: Table
    friction_opening: Table
    friction_closing: Table
    friction_angle: Table
    moving_blades: int
    upper_face: float
    fracture_energy: float
    kappa: float
    closure: Literal["work", "eq4"]
    rate_damping: float
    render_friction: bool
    friction_rate_eps: float
    handle_radius: float
    opening_min: float
    opening_max: float
    contact_min: float
    contact_max: float
    tip_station: float = math.inf

    def __post_init__(self) -> None:
        _check_numbers(self)
        if self.response.x[0] != 0 or self.response.y[0] != 0:
            raise ValueError("The response table must start at indentation 0 with force 0.")
        if not _never_falls(self.response):
            raise ValueError(
                "The response table falls somewhere: its values and slopes must make a cubic "
                "that never falls (slopes between 0 and three times the chords do)."
            )
        for name in ("friction_opening", "friction_closing"):
            if np.any(getattr(self, name).y < 0):
                raise ValueError(f"{name} holds a negative level, which would drive the blades.")

    @property
    def release_falls(self) -> bool:
        """Whether the energy that a crack releases falls outwards along the blade.

        Once past its largest value, and at every opening of the range, as far as it decides where
        a crack stops. Then the kernel finds that place in a few look-ups; else it looks at the
        edge's knots one by one, because the first such place is where the crack stops.
        """
        model, _keep = model_struct(self)
        return bool(model.release_falls)


def _check_numbers(tables: ModelTables) -> None:
    if tables.moving_blades not in (1, 2):
        raise ValueError(f"moving_blades is 1 or 2, not {tables.moving_blades}.")
    if tables.closure not in ("work", "eq4"):
        raise ValueError(f'closure is "work" or "eq4", not {tables.closure!r}.')
    finite = ("upper_face", "fracture_energy", "rate_damping", "friction_rate_eps")
    ranges = ("opening_min", "opening_max", "contact_min", "contact_max")
    for name in (*finite, *ranges, "handle_radius", "kappa"):
        if not math.isfinite(np.float32(getattr(tables, name))):
            raise ValueError(f"{name} is not finite in float32: {getattr(tables, name)}.")
    if not 0 < tables.kappa <= 1:
        raise ValueError(f"kappa is {tables.kappa}; it must be above 0 and at most 1.")
    if tables.fracture_energy < 0 or tables.rate_damping < 0:
        raise ValueError("fracture_energy and rate_damping must not be negative.")
    if not np.float32(tables.friction_rate_eps) > 0:
        raise ValueError("friction_rate_eps must be positive, for example 0.01 rad/s.")
    if not tables.tip_station > 0:
        raise ValueError("tip_station must be positive (infinite where the edge is continued).")
    if not tables.opening_min <= tables.opening_max or not tables.contact_min <= tables.contact_max:
        raise ValueError("Each range needs its lower end first.")


def _never_falls(table: Table) -> bool:
    """Whether the cubic's derivative stays >= 0 in every interval, to float32's rounding."""
    x, y, slope = (a.astype(np.float64) for a in (table.x, table.y, table.slope))
    width = np.diff(x)
    rise = np.diff(y)
    first, last = slope[:-1] * width, slope[1:] * width
    third = 3.0 * (first + last - 2.0 * rise)
    second = 3.0 * rise - 2.0 * first - last
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.clip(np.nan_to_num(-second / third), 0.0, 1.0)
    least = np.minimum.reduce([first, last, first + turn * (2.0 * second + turn * third)])
    # a value's rounding enters the derivative in units of the value, not of the small rise
    slack = 1e-6 * (np.abs(first) + np.abs(last)) + 4e-7 * np.abs(y[1:])
    return bool(np.all(least >= -slack))


def _table_struct(table: Table, area: Float32 | None = None) -> tuple[Any, tuple[Any, ...]]:
    """Give the C struct that points at a table's arrays, and what must be kept alive with it.

    With ``area`` (shape (n,), written here) the table can be integrated.
    """
    struct = ffi.new("sc_table *")
    keep = tuple(ffi.from_buffer("float[]", a) for a in (table.x, table.y, table.slope))
    struct.x, struct.y, struct.slope = keep
    struct.size = len(table.x)
    if area is not None:
        place = ffi.from_buffer("float[]", area, require_writable=True)
        lib.sc_table_accumulate(struct, place)
        struct.area = place
        keep = (*keep, place)
    return struct[0], (struct, *keep)


def model_struct(tables: ModelTables) -> tuple[Any, tuple[Any, ...]]:
    """Give the C model of a set of tables, and what must be kept alive with it."""
    model = ffi.new("sc_model *")
    keep: list[Any] = [model]
    for name in TABLE_NAMES:
        table = getattr(tables, name)
        area = np.zeros(len(table.x), dtype=np.float32) if name == "response" else None
        struct, kept = _table_struct(table, area)
        setattr(model, name, struct)
        keep.append(kept)
    fill_numbers(model, tables)
    if not lib.sc_model_is_sound(model):
        raise ValueError("The kernel refuses these tables: their numbers do not fit float32.")
    lib.sc_model_edge_slopes(model)
    model.release_falls = lib.sc_model_release_falls(model)
    return model, tuple(keep)


def fill_numbers(model: Any, tables: ModelTables) -> None:
    """Copy everything but the tables into a C struct whose fields have the same names."""
    for field in fields(tables):
        value = getattr(tables, field.name)
        if field.name == "closure":
            model.closure = lib.SC_CLOSURE_WORK if value == "work" else lib.SC_CLOSURE_EQ4
        elif not isinstance(value, Table):
            setattr(model, field.name, value)


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

    def numbers(self, values: ArrayLike, down: bool = False) -> NDArray[np.int16]:
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
        return self.values(self.numbers(values, down)).astype(np.float64)


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
