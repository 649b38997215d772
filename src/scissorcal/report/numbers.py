"""Numbers and units as people read them; what is not finite is said to be not available."""

import math
from collections.abc import Iterable
from typing import Any

Number = float | None
"""A finite number, or None where there is none (null in JSON, words on the page)."""

Scalar = float | int | str | bool | None

NOT_AVAILABLE = "not available"
SMALLEST_PLAIN = 1e-4
LARGEST_PLAIN = 1e5
ROUNDING = 16.0 * 2.0**-52
"""Share of a number that a mean of equal doubles, summed in pairs, may be off by rounding."""

MOST_DECIMALS = 6
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def finite(value: Any) -> Number:
    """Return ``value`` as a float, or None where it is no finite number.

    >>> finite(float("nan")) is None, finite(2)
    (True, 2.0)
    """
    if value is None or isinstance(value, str):
        return None
    number = float(value)
    return number if math.isfinite(number) else None


def finite_each(values: Iterable[Any], digits: int = 6) -> tuple[Number, ...]:
    """Return each value rounded to ``digits`` significant digits, None where not finite."""
    import numpy as np

    given = np.array(values if isinstance(values, np.ndarray) else list(values), dtype=np.float64)
    known = np.isfinite(given) & (np.abs(given) > 1e-290)
    exponent = digits - 1 - np.floor(np.log10(np.abs(np.where(known, given, 1.0))))
    scale = 10.0 ** np.abs(np.clip(exponent, -300, 300))
    with np.errstate(over="ignore", invalid="ignore"):
        up, down = np.rint(given * scale) / scale, np.rint(given / scale) * scale
    rounded = np.where(known & np.isfinite(up), np.where(exponent >= 0, up, down), given)
    return tuple(v if math.isfinite(v) else None for v in rounded.tolist())


def scalar(value: Any) -> Scalar:
    """Return a value that JSON can hold: finite numbers, text, booleans, None; else its words."""
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        value = value.item()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, list | tuple):
        return ", ".join(display(scalar(entry)) for entry in value)
    return str(value)


def display(value: Scalar, digits: int = 4) -> str:
    """Write any scalar for people.

    >>> display(True), display(None), display(12)
    ('yes', 'not available', '12')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return grouped(str(value))
    return short(value, digits)


def significant(value: Number, digits: int = 3) -> str:
    """Write a number with so many significant digits, powers of ten where it is far from one.

    >>> significant(0.012345), significant(2.3456e-7), significant(None)
    ('0.0123', '2.35 × 10⁻⁷', 'not available')
    """
    number = finite(value)
    if number is None:
        return NOT_AVAILABLE
    if number == 0.0:
        return "0"
    number = _round(number, digits)
    decimals = digits - 1 - _exponent(number)
    return (
        _power_of_ten(number, decimals)
        if abs(number) < SMALLEST_PLAIN
        else with_decimals(number, decimals)
    )


def short(value: Number, digits: int = 3) -> str:
    """Write a number that someone chose, without zeros at its end.

    >>> short(0.05), short(2.0)
    ('0.05', '2')
    """
    written = significant(value, digits)
    mantissa, times, power = written.partition(" × ")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return mantissa + times + power


def with_decimals(value: Number, decimals: int) -> str:
    """Write a number to a place after the point, which may be negative.

    >>> with_decimals(0.012345, 4), with_decimals(2.3456e-7, 9)
    ('0.0123', '2.35 × 10⁻⁷')
    """
    number = finite(value)
    if number is None:
        return NOT_AVAILABLE
    if abs(decimals) < 300:
        number = round(number, decimals)
    if number == 0.0:
        return "0" if not 0 < decimals <= MOST_DECIMALS else f"{0.0:.{decimals}f}"
    if abs(number) < LARGEST_PLAIN and decimals <= MOST_DECIMALS:
        return _minus(grouped(f"{number:.{max(decimals, 0)}f}"))
    return _power_of_ten(number, decimals)


def decimals_for(sd: Number, value: Number) -> int:
    """Place after the point that two significant digits of ``sd`` reach.

    Without a usable ``sd`` it is the place of the fourth significant digit of ``value``; one that
    is but the rounding of sums of equal samples is not usable.

    >>> decimals_for(0.0123, 1.0), decimals_for(None, 1.0), decimals_for(1e-17, 1.0)
    (3, 3, 3)
    """
    spread, number = finite(sd), finite(value)
    if spread and spread > ROUNDING * abs(number or 0.0):
        return 1 - _exponent(_round(spread, 2))
    return 3 - _exponent(number) if number else 3


def percent(share: Number, digits: int = 2) -> str:
    """Write a share as percent.

    >>> percent(0.0312)
    '3.1 %'
    """
    number = finite(share)
    if number is None:
        return NOT_AVAILABLE
    return f"{significant(100.0 * number, digits)} %"


def unit_text(unit: str) -> str:
    """Write a unit with raised exponents.

    >>> unit_text("kg m^2")
    'kg m²'
    """
    written = []
    parts = ["" if unit == "1" else unit] if "^" not in unit else unit.split("^")
    written.append(parts[0])
    for part in parts[1:]:
        length = next((i for i, c in enumerate(part) if not (c.isdigit() or c == "-")), len(part))
        written.append(part[:length].translate(SUPERSCRIPTS) + part[length:])
    return "".join(written)


def with_unit(value: Number, unit: str, digits: int = 3) -> str:
    """Write a number with its unit; no unit where there is no number."""
    number = finite(value)
    if number is None:
        return NOT_AVAILABLE
    return f"{significant(number, digits)} {unit_text(unit)}".rstrip()


def grouped(text: str) -> str:
    """Part the thousands of a long whole number with narrow spaces; decimals stay as they are."""
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text)
    whole, point, rest = digits.partition(".")
    if len(whole) < 5:
        return text
    return f"{sign}{int(whole):,}".replace(",", "\u202f") + point + rest


def _power_of_ten(number: float, decimals: int) -> str:
    exponent = _exponent(number)
    mantissa = (
        number * 1e300 / 10.0 ** (exponent + 300) if exponent < -300 else number / 10.0**exponent
    )
    places = min(max(decimals + exponent, 0), 15)
    return _minus(f"{mantissa:.{places}f} × 10{str(exponent).translate(SUPERSCRIPTS)}")


def _minus(text: str) -> str:
    return "−" + text[1:] if text.startswith("-") else text


def _exponent(number: float) -> int:
    return int(f"{abs(number):e}".partition("e")[2])


def _round(number: float, digits: int) -> float:
    rounded = float(f"{number:.{digits - 1}e}")
    return rounded if math.isfinite(rounded) else number


def shown_unit(unit: str) -> tuple[float, str]:
    """Factor and unit in which a parameter is shown: angles in degrees."""
    return (math.degrees(1.0), "°") if unit == "rad" else (1.0, unit)


def shown_place(unit: str) -> tuple[float, str]:
    """Factor and unit in which places of a motion are shown that is stored in rad, or in m.

    >>> shown_place("m")
    (1000.0, 'mm')
    """
    return (math.degrees(1.0), "deg") if unit == "rad" else (1e3, "mm")
