"""MATLAB files, version 5 (scipy) and 7.3 (which is HDF5): arrays and single numbers by name."""

import re
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.errors import InputError
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import MATLAB
from scissorcal.recording.table import Column, Table, Wanted


def read_mat(path: Path, wanted: Wanted) -> Table:
    """Read variables of a MATLAB file as columns.

    A column is named as the variable is; ``data.q`` is a field of a structure, ``X[2]`` the third
    column of a matrix. All numbers of size one are the table's ``scalars``. The parsers of both
    versions run in a child process.
    """
    data = read_foreign(path, MATLAB)
    variables = parse_isolated(f"{__name__}:load_variables", data, path, MATLAB)
    columns = {channel: _column(path, variables, name, channel) for channel, name in wanted.items()}
    scalars = {name: float(v.ravel()[0]) for name, v in variables.items() if v.size == 1}
    return Table(path, columns, scalars)


def _column(path: Path, variables: Mapping[str, Any], name: str | int, channel: str) -> Column:
    match = re.fullmatch(r"\s*([\w.]+)(?:\[(\d{1,9})\])?\s*", str(name))
    values = variables.get(match[1]) if match else None
    if match is None or values is None:
        listed = ", ".join(f"{key} {_size(value)}" for key, value in variables.items())
        raise InputError(
            f"{path} has no variable {name!r} for {channel}. Name one of these: {listed or 'none'}."
        )
    if match[2] is not None:
        if values.ndim != 2 or int(match[2]) >= values.shape[1]:
            raise InputError(
                f"{path}: {match[1]} {_size(values)} has no column {match[2]} (from 0) for "
                f"{channel}. Name one that it has."
            )
        values = values[:, int(match[2])]
    elif values.ndim == 2 and 1 not in values.shape:
        raise InputError(
            f"{path}: {match[1]} {_size(values)} is a matrix. Name the column for {channel} by "
            f"its number from 0, for example {match[1]}[0]."
        )
    return Column(str(name), values.astype(np.float64).ravel())


def _flat(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the real numeric arrays, those in structures under dotted names."""
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif not name.startswith("__"):
            array = np.asarray(value)
            if array.dtype.kind in "fiub" and array.size:
                yield prefix + name, array


def load_variables(data: bytes) -> dict[str, Any]:
    """The real numeric arrays of a MATLAB file by name; called in a child process."""
    load = _load_hdf5 if data.startswith(b"MATLAB 7.3") else _load_version_5
    return dict(_flat(load(data)))


def _load_version_5(data: bytes) -> Mapping[str, Any]:
    from scipy.io import loadmat

    stream: Any = BytesIO(data)
    variables: Mapping[str, Any] = loadmat(stream, simplify_cells=True)
    return variables


def _load_hdf5(data: bytes) -> Mapping[str, Any]:
    """Read version 7.3, which keeps arrays transposed in HDF5; cells and text are left out."""
    import h5py

    def read(group: Any) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, item in group.items():
            if name.startswith("#"):
                continue
            if isinstance(item, h5py.Group):
                found[name] = read(item)
            elif item.dtype.kind in "fiub" and item.attrs.get("MATLAB_class") != b"char":
                found[name] = np.asarray(item).T
        return found

    with h5py.File(h5py.h5f.open_file_image(data), "r") as file:
        return read(file)


def _size(value: Any) -> str:
    shape = value.shape or (1,)
    return f"({' x '.join(map(str, shape))})"
