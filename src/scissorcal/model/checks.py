"""What every law and shape of the model refuses: unknown names and impossible numbers."""

import sys
from collections.abc import Iterable
from typing import Any

import numpy as np

from scissorcal.errors import ModelError, unknown_name

LARGEST = sys.float_info.max
SMALLEST = 5e-324
"""The smallest positive number of 64 bits, as the lower end of a range that leaves 0 out."""


def check_name(what: str, given: object, names: Iterable[str]) -> None:
    """ModelError, naming the nearest, unless ``given`` is one of ``names``; ``what`` has them.

    >>> check_name("family of a response", "powr", ("power", "exponential"))
    Traceback (most recent call last):
    scissorcal.errors.ModelError: "powr" is no family of a response. Did you mean "power"? \
There are: power, exponential.
    """
    known = tuple(names)
    if isinstance(given, str) and given in known:
        return
    raise ModelError(unknown_name(what, given, known))


def check_numbers(what: str, value: Any, low: float = -LARGEST, high: float = LARGEST) -> None:
    """ModelError unless ``value``, a number or an array of any shape, is within [low, high].

    NaN and infinity never are. An array is looked at once, by its smallest and largest; an empty
    one passes.

    >>> check_numbers("the force of a response", [2.0, -1.0], SMALLEST)
    Traceback (most recent call last):
    scissorcal.errors.ModelError: The force of a response must be finite and above 0; it has -1.
    """
    if isinstance(value, float):
        if low <= value <= high:
            return
    else:
        array = np.asarray(value)
        if array.dtype.kind == "c":  # for derivatives by a complex step
            array = array.real
        if array.dtype.kind in "fiu" and (
            not array.size or (low <= array.min() and array.max() <= high)
        ):
            return
    said = f"{what} must be {_range(low, high)}; it has {_first_wrong(value, low, high)}"
    raise ModelError(said[0].upper() + said[1:])


def check_moving_blades(count: Any) -> None:
    """ModelError unless one blade moves, or both."""
    if np.ndim(count) or count not in (1, 2):
        raise ModelError(f"1 or 2 blades move, not {str(count)[:60]}.")


def _range(low: float, high: float) -> str:
    least = {-LARGEST: "", SMALLEST: " and above 0"}.get(low, f", {low:g} or more")
    return f"finite{least}" + (f" and at most {high:g}" if high < LARGEST else "")


def _first_wrong(value: Any, low: float, high: float) -> str:
    array = np.atleast_1d(value)
    if array.dtype.kind not in "fiuc":
        return f'"{str(value)[:60]}", which is no number.'
    wrong = array[~((array.real >= low) & (array.real <= high))]
    return f"{wrong[0]:g}."
