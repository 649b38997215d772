"""NumPy's view of the C core's structs, read off the compiled declarations."""

from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scissorcal.kernel._kernel import ffi

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_NUMBERS = {
    "float": "<f4",
    "double": "<f8",
    "uint8_t": "u1",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
}


def dtype_of(struct: str) -> np.dtype[Any]:
    """Give the dtype of a C struct of numbers and arrays of them, with the compiler's offsets."""
    kind = ffi.typeof(struct)
    fields = [(name, _format_of(field.type), field.offset) for name, field in kind.fields]
    return np.dtype(
        {
            "names": [name for name, _, _ in fields],
            "formats": [number for _, number, _ in fields],
            "offsets": [offset for _, _, offset in fields],
            "itemsize": ffi.sizeof(kind),
        }
    )


def _format_of(kind: Any) -> Any:
    """NumPy's format of a C number, or of an array of numbers of any depth."""
    shape: tuple[int, ...] = ()
    while kind.kind == "array":
        shape, kind = (*shape, kind.length), kind.item
    number = _NUMBERS[kind.cname]
    return (number, shape) if shape else number


def fill_struct(struct: Any, values: "DataclassInstance") -> None:
    """Copy a dataclass into the C struct of the same field names, structs within it as well."""
    for field in fields(values):
        value = getattr(values, field.name)
        if is_dataclass(value) and not isinstance(value, type):
            fill_struct(getattr(struct, field.name), value)
        else:
            setattr(struct, field.name, value)
