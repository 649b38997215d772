"""Numbers, matrices and picture sizes of camera files, and whether a matrix is a camera's."""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.foreign.reading import TYPE_KEY
from scissorcal.vision.camera_files.keys import (
    MOST_NUMBERS,
    Entry,
    RefusedError,
    matrix_of,
    number_of,
    plain,
    short,
    shown,
)
from scissorcal.vision.photo import MOST_SIDE_PX

_OF_A_MATRIX = {"rows", "cols", "columns", "data", "dt", plain(TYPE_KEY)}
_SIZE = re.compile(r"\s*[\[(]?\s*(\d{1,6})\s*[xX*,×]\s*(\d{1,6})\s*[\])]?\s*")


FOCAL_WIDTHS = (0.2, 20.0)
"""Focal length in the picture's longer sides: views of 136 to 2.9 deg along that side. Wider
pictures are not of the pinhole model, and narrower ones are of telescopes."""

MOST_SKEW_PX = 0.02
"""What a skew may shift a pixel of the top edge; corners are found to 0.02 px at best."""

LARGEST_COEFFICIENT = 1e7
"""k3 goes with the sixth power of the view: 1e6 where that is 3 deg, and bent by 1 % there."""

_MOST_ROW = 1e-6
"""Of the last row: 1e-6 of a pixel's place is 0.01 px of the largest pictures."""

_MOST_STRETCH = 2.1
"""Width over height of a pixel: fields of interlaced video and binned rows have 2."""

_USUAL_STRETCH = 1.1
_USUAL_CENTRE = 0.1
"""Share of the picture by which a lens is off its middle; whole pictures stay well within."""


def check_size(width: float, height: float) -> None:
    """Raise RefusedError where no picture has this size."""
    if not all(1.0 <= side <= MOST_SIDE_PX and side == int(side) for side in (width, height)):
        raise RefusedError(f"has a picture size of {width:g} x {height:g}: correct it.")


def check_matrix(K: NDArray[np.float64], width: float, height: float, place: str) -> list[str]:
    """Notes on what is unusual; raises RefusedError where K is not the matrix of such a picture."""
    if not np.isfinite(K).all():
        row, column = np.argwhere(~np.isfinite(K))[0] + 1
        raise RefusedError(
            f"row {row}, column {column} of the matrix is not finite. Save the file again.", place
        )
    if not K.any():
        raise RefusedError(
            "the matrix is all zeros, so the camera was not calibrated. Calibrate it.", place
        )
    _check_form(K, width, height, place)
    _check_focal(K, width, height, place)
    return _check_centre(K, width, height, place)


def _check_form(K: NDArray[np.float64], width: float, height: float, place: str) -> None:
    unit = np.array([0.0, 0.0, 1.0])
    sides = np.array([width, height, 1.0])
    row, column = K[2], K[:, 2]
    if np.abs((row - unit) * sides).max() > _MOST_ROW:
        numbers = ", ".join(f"{value:g}" for value in row)
        if np.allclose(column, unit):
            raise RefusedError(
                f"the matrix is transposed: its last row is {numbers} where 0, 0, 1 is needed. "
                "Write its rows as columns (MATLAB and Open3D write the transpose).",
                place,
            )
        raise RefusedError(
            f"the last row of the matrix is {numbers} where 0, 0, 1 is needed. Correct it.", place
        )
    fx, fy = float(K[0, 0]), float(K[1, 1])
    if min(fx, fy) <= 0.0:
        raise RefusedError(
            f"the focal length is {min(fx, fy):g} px, which is not positive. Correct it.",
            place,
        )
    for value, name in ((float(K[0, 1]), "row 1, column 2"), (float(K[1, 0]), "row 2, column 1")):
        shift = abs(value) * 0.5 * max(width, height) / min(fx, fy)
        if shift > MOST_SKEW_PX:
            raise RefusedError(
                f"the matrix has a skew of {value:g} ({name}), which shifts pixels by {shift:.2g} "
                f"px at the edge; {MOST_SKEW_PX:g} px is the limit. Calibrate without skew.",
                place,
            )


def _check_focal(K: NDArray[np.float64], width: float, height: float, place: str) -> None:
    longer = max(width, height)
    low, high = FOCAL_WIDTHS
    for name, focal in (("fx", float(K[0, 0])), ("fy", float(K[1, 1]))):
        if not low <= focal / longer <= high:
            raise RefusedError(
                f"{name} is {focal:g} px, {focal / longer:.3g} picture widths; {low:g} to {high:g} "
                "are possible. Check its unit (pixels, not mm or shares of the picture) and the "
                "picture's size.",
                place,
            )
    stretch = float(K[0, 0] / K[1, 1])
    if not 1.0 / _MOST_STRETCH <= stretch <= _MOST_STRETCH:
        raise RefusedError(
            f"fx is {stretch:.3g} times fy; {1 / _MOST_STRETCH:.2g} to {_MOST_STRETCH:g} are "
            "possible. Correct the one that is wrong.",
            place,
        )


def _check_centre(K: NDArray[np.float64], width: float, height: float, place: str) -> list[str]:
    centre = K[:2, 2]
    off, swapped = (
        float(np.abs(centre / sides - 0.5).max()) for sides in ((width, height), (height, width))
    )
    where = f"the centre is at {centre[0]:g}, {centre[1]:g} px of {width:g} x {height:g}"
    if swapped < 0.5 * off and off > _USUAL_CENTRE and swapped < _USUAL_CENTRE:
        raise RefusedError(
            f"{where}, which is the middle of {height:g} x {width:g}: width and height are swapped."
            " Exchange them.",
            place,
        )
    if not all(0.0 < at < side for at, side in zip(centre, (width, height), strict=True)):
        raise RefusedError(
            f"{where}, outside the picture. Check that the size belongs to this matrix.", place
        )
    if all(at < _USUAL_CENTRE * side for at, side in zip(centre, (width, height), strict=True)):
        raise RefusedError(
            f"{where}, in its corner, as where it is counted from the picture's middle. Write it "
            "from the first pixel.",
            place,
        )
    notes = []
    if off > _USUAL_CENTRE:
        notes.append(
            f"The {where[4:]}, {off:.0%} of the picture off its middle: check that the picture "
            "was neither cropped nor resized after the calibration."
        )
    stretch = max(K[0, 0] / K[1, 1], K[1, 1] / K[0, 0])
    if stretch > _USUAL_STRETCH:
        notes.append(
            f"fx is {K[0, 0]:g} and fy {K[1, 1]:g} px, so pixels are not square: check that the "
            "order is fx, fy, cx, cy, and that the picture was not stretched."
        )
    return notes


def check_coefficients(values: NDArray[np.float64], place: str) -> None:
    """Raise RefusedError where a coefficient is not finite or larger than any lens has."""
    if not np.isfinite(values).all():
        raise RefusedError("a distortion coefficient is not finite. Save the file again.", place)
    if len(values) and np.abs(values).max() > LARGEST_COEFFICIENT:
        worst = float(values[np.abs(values).argmax()])
        raise RefusedError(
            f"a distortion coefficient is {worst:g}, which no camera has. Check their unit.", place
        )


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
        matrix = matrix_of(value)
    except ValueError as error:
        raise RefusedError(f"it is {error}. Save the file again.", entry.place) from None
    if matrix is not None:
        return matrix
    if isinstance(value, dict):
        return _with_rows(Entry(entry.place, value))
    if not isinstance(value, list):
        raise RefusedError(f"{short(value)!r} is no list of numbers.", entry.place)
    numbers, shape = _flat(value, entry.place)
    return np.array(numbers, dtype=np.float64).reshape(shape)


def vector_at(entry: Entry) -> NDArray[np.float64]:
    """Numbers in one row or column; raises RefusedError where they have several of both."""
    values = array_at(entry)
    if sum(side > 1 for side in values.shape) > 1:
        shape = " x ".join(map(str, values.shape))
        raise RefusedError(f"it is {shape} numbers where one row is needed.", entry.place)
    return values.ravel()


def size_at(entry: Entry) -> tuple[float, float]:
    """Two numbers, also as "1280x720"; raises RefusedError where they are not two."""
    if isinstance(entry.value, str):
        stated = _SIZE.fullmatch(entry.value)
        if stated is None:
            raise RefusedError(f"{short(entry.value)!r} is no width and height.", entry.place)
        return float(stated[1]), float(stated[2])
    sides = vector_at(entry)
    if len(sides) not in (2, 3) or (len(sides) == 3 and sides[2] not in (1.0, 3.0)):
        raise RefusedError("it is not a width and a height.", entry.place)
    return float(sides[0]), float(sides[1])


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
    if any(isinstance(item, list) for item in value):
        parts = [_flat(item, place) if isinstance(item, list) else ([], (-1,)) for item in value]
        shapes = {shape for _, shape in parts}
        if len(shapes) > 1 or (-1,) in shapes:
            raise RefusedError("its rows differ in length.", place)
        return [number for part, _ in parts for number in part], (len(parts), *shapes.pop())
    if len(value) > MOST_NUMBERS:
        raise RefusedError(f"it has {len(value)} numbers.", place)
    return [number_at(Entry(place, item)) for item in value], (len(value),)
