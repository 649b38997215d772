"""Numbers and matrices of OpenCV's file storage (YAML, XML, JSON), read by Python alone.

``cv2.FileStorage`` 5.0 writes past its memory on a matrix with ``rows`` and without ``cols``.
"""

import base64
import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.foreign.text_tree import TYPE_KEY

MOST_NUMBERS = 100_000
"""Numbers of one matrix; a camera's have nine and fourteen."""

_LONGEST_NUMBER = 40
_DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,4})?")
_NOT_FINITE = {".nan": math.nan, ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf}
_TYPE = re.compile(r"(\d{0,2})([ucwsifdhbHIL])")
_BYTES = {"u": "<u1", "c": "<i1", "w": "<u2", "s": "<i2", "i": "<i4", "f": "<f4", "d": "<f8"}
_BINARY_HEAD = 24
"""Bytes of text before the numbers of a matrix in base64, which repeat its type."""


def number_of(value: Any) -> float | None:
    """A decimal number, ``.Inf`` or ``.Nan``; None for anything else.

    >>> number_of("640."), number_of("-.Inf"), number_of("camera"), number_of("9" * 6000)
    (640.0, -inf, None, None)
    """
    word = value.strip() if isinstance(value, str) else ""
    if len(word) <= _LONGEST_NUMBER and _DECIMAL.fullmatch(word):
        return float(word)
    return _NOT_FINITE.get(word.lower())


def matrix_of(value: Any) -> NDArray[np.float64] | None:
    """A matrix (rows, cols), or (rows, cols, channels); None for what is no matrix.

    Raises ValueError where rows, columns, type and data of a matrix do not belong together.
    """
    if not isinstance(value, dict) or value.get(TYPE_KEY) != "opencv-matrix":
        return None
    rows, columns = (_count(value.get(name), name) for name in ("rows", "cols"))
    stated = _TYPE.fullmatch(str(value.get("dt", "")).strip().strip('"'))
    if stated is None:
        raise ValueError(f"a matrix of the type {str(value.get('dt'))[:20]!r}")
    channels = int(stated[1] or 1)
    wanted = rows * columns * channels
    if not 0 <= wanted <= MOST_NUMBERS:
        raise ValueError(f"a matrix of {rows} x {columns}")
    numbers = _numbers(value.get("data", ""), stated[2])
    if len(numbers) != wanted:
        raise ValueError(f"a matrix of {rows} x {columns} with {len(numbers)} numbers")
    shape = (rows, columns) if channels == 1 else (rows, columns, channels)
    return numbers.reshape(shape)


def _count(word: Any, name: str) -> int:
    if not isinstance(word, str) or not re.fullmatch(r"\s*[0-9]{1,6}\s*", word):
        raise ValueError(f"a matrix without {name}")
    return int(word)


def _numbers(data: Any, kind: str) -> NDArray[np.float64]:
    """The numbers of a matrix: a list, words, or the bytes of base64."""
    if isinstance(data, str):
        words = data.split()
        if not words or number_of(words[0]) is not None:
            data = words
        else:
            return _from_base64("".join(words), kind)
    values = [number_of(word) for word in data] if isinstance(data, list) else [None]
    if None in values:
        raise ValueError("a matrix with an entry that is no number")
    return np.array(values, dtype=np.float64)


def _from_base64(word: str, kind: str) -> NDArray[np.float64]:
    try:
        content = base64.b64decode(word.removeprefix("$base64$"), validate=True)
        dtype = np.dtype(_BYTES[kind])
        return np.frombuffer(content[_BINARY_HEAD:], dtype).astype(np.float64)
    except (ValueError, KeyError):
        raise ValueError("a matrix with an entry that is no number") from None
