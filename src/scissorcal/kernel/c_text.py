"""A model as C text: tables and numbers as constants, bit for bit what a kernel steps with."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from scissorcal.kernel._kernel import ffi
from scissorcal.kernel.tables import ModelTables, model_struct

_NUMBERS_A_LINE = 6
_POINTER32_BYTES = 4


def c_float(value: float) -> str:
    """A number as C's hexadecimal float, which is exact; ValueError where it is not finite.

    >>> c_float(3.0), c_float(0.1)
    ('0x1.8p+1f', '0x1.99999ap-4f')
    """
    rounded = float(np.float32(value))
    if not np.isfinite(rounded):
        raise ValueError(f"{value} is no finite number of 32 bits")
    return re.sub(r"\.?0*p", "p", rounded.hex()) + "f"


def c_array(name: str, values: Iterable[float]) -> list[str]:
    """Lines of an array of constants, numbers exact."""
    numbers = [c_float(value) for value in values]
    rows = [
        ", ".join(numbers[start : start + _NUMBERS_A_LINE])
        for start in range(0, len(numbers), _NUMBERS_A_LINE)
    ]
    head = f"static const float {name}[{len(numbers)}] = {{"
    return [head, *(f"    {row}," for row in rows), "};"]


def model_lines(tables: ModelTables, name: str) -> list[str]:
    """Lines of C that define ``static const sc_model <name>`` and its arrays.

    What a kernel computes once (areas, slopes of the edge, whether the release falls) stands there
    as numbers, so that a program keeps all of it in flash and prepares nothing.
    """
    model, _keep = model_struct(tables)
    arrays: list[str] = []
    parts: list[str] = []
    for field, kind in ffi.typeof("sc_model").fields:
        value = getattr(model, field)
        if kind.type.cname == "sc_table":
            lines, text = _table(f"{name}_{field}", value)
            arrays += lines
        else:
            text = c_float(value) if kind.type.cname == "float" else str(int(value))
        parts.append(f"    .{field} = {text},")
    return [*arrays, f"static const sc_model {name} = {{", *parts, "};"]


def model_bytes(tables: ModelTables) -> tuple[int, int]:
    """Bytes of the arrays of :func:`model_lines`, and of its ``sc_model`` on a 32-bit processor."""
    model, _keep = model_struct(tables)
    arrays = struct = 0
    for field, kind in ffi.typeof("sc_model").fields:
        value = getattr(model, field)
        if kind.type.cname == "sc_table":
            rows = 3 if value.area == ffi.NULL else 4
            arrays += ffi.sizeof("float") * rows * int(value.size)
            struct += 4 * _POINTER32_BYTES + ffi.sizeof("int32_t")
        else:
            struct += ffi.sizeof(kind.type)
    return arrays, struct


def _table(name: str, table: Any) -> tuple[list[str], str]:
    """Lines of a table's arrays, and the initializer of its struct."""
    rows: Sequence[str] = ("x", "y", "slope", "area")
    held = [row for row in rows if getattr(table, row) != ffi.NULL]
    lines: list[str] = []
    for row in held:
        values = ffi.unpack(getattr(table, row), table.size)
        lines += c_array(f"{name}_{row}", values)
    inner = ", ".join(f".{row} = {f'{name}_{row}' if row in held else '0'}" for row in rows)
    return lines, f"{{{inner}, .size = {table.size}}}"
