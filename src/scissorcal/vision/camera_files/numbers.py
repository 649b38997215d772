"""Numbers, vectors, matrices and picture sizes as camera files write them."""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.foreign.text_tree import TYPE_KEY
from scissorcal.vision.camera_files.keys import Entry, plain
from scissorcal.vision.camera_files.refusal import RefusedError, short, shown
from scissorcal.vision.opencv_storage import MOST_NUMBERS, matrix_of, number_of

_OF_A_MATRIX = {"rows", "cols", "columns", "data", "dt", plain(TYPE_KEY)}
_SIZE = re.compile(r"\s*[\[(]?\s*(\d{1,6})\s*[xX*,×]\s*(\d{1,6})\s*[\])]?\s*")


def number_at(entry: Entry) -> float:
    """A number; raises RefusedError where it is none."""
    value = number_of(entry.value)
    if value is None:
        raise RefusedError(f"{short(entry.value)!r} is no number.", entry.place)
    return value


def array_at(entry: Entry) -> NDArray[np.float64]:
    """Numbers as a vector or matrix.

    They are OpenCV's matrix, rows, cols and data of ROS, or lists in lists. Raises RefusedError
    where an entry is no number, or the rows differ in length.
    """
    value = entry.value
    try:
        found = matrix_of(value)
    except ValueError as error:
        raise RefusedError(f"it is {error}. Save the file again.", entry.place) from None
    if found is not None:
        return found
    if isinstance(value, dict):
        return _with_rows(Entry(entry.place, value))
    if not isinstance(value, list):
        raise RefusedError(f"{short(value)!r} is no list of numbers.", entry.place)
    numbers, shape = _flat(value, entry.place)
    return np.array(numbers, dtype=np.float64).reshape(shape)


def vector_at(entry: Entry) -> NDArray[np.float64]:
    """Numbers in one row or column; raises RefusedError where they have several of both."""
    found = array_at(entry)
    if sum(side > 1 for side in found.shape) > 1:
        shape = " x ".join(map(str, found.shape))
        raise RefusedError(f"it is {shape} numbers where one row is needed.", entry.place)
    return found.ravel()


def size_at(entry: Entry) -> tuple[float, float]:
    """Two numbers, also as "1280x720"; raises RefusedError where they are not two."""
    if isinstance(entry.value, str):
        stated = _SIZE.fullmatch(entry.value)
        if stated is None:
            raise RefusedError(f"{short(entry.value)!r} is no width and height.", entry.place)
        return float(stated[1]), float(stated[2])
    found = vector_at(entry)
    if len(found) not in (2, 3) or (len(found) == 3 and found[2] not in (1.0, 3.0)):
        raise RefusedError("it is not a width and a height.", entry.place)
    return float(found[0]), float(found[1])


def _with_rows(entry: Entry) -> NDArray[np.float64]:
    """The matrix of ROS: data, with rows and columns where it has them."""
    facts = {plain(key): value for key, value in entry.value.items()}
    unknown = [key for key in entry.value if plain(key) not in _OF_A_MATRIX]
    if unknown:
        raise RefusedError(f"its keys {shown(unknown)} are not known. Delete them.", entry.place)
    numbers = array_at(Entry(f"{entry.place}.data", facts.get("data", "")))
    rows, columns = number_of(facts.get("rows")), number_of(facts.get("cols", facts.get("columns")))
    if rows is None or columns is None or numbers.ndim > 1:
        return numbers
    whole = rows >= 0.0 and rows.is_integer() and columns.is_integer()
    if not whole or rows * columns != numbers.size:
        raise RefusedError(
            f"it is a matrix of {rows:g} x {columns:g} with {numbers.size} numbers. "
            "Save the file again.",
            entry.place,
        )
    return numbers.reshape(int(rows), int(columns))


def _flat(value: list[Any], place: str) -> tuple[list[float], tuple[int, ...]]:
    if any(isinstance(one, list) for one in value):
        parts = [_flat(one, place) if isinstance(one, list) else ([], (-1,)) for one in value]
        shapes = {shape for _, shape in parts}
        if len(shapes) > 1 or (-1,) in shapes:
            raise RefusedError("its rows differ in length.", place)
        return [number for part, _ in parts for number in part], (len(parts), *shapes.pop())
    if len(value) > MOST_NUMBERS:
        raise RefusedError(f"it has {len(value)} numbers.", place)
    return [number_at(Entry(place, one)) for one in value], (len(value),)
