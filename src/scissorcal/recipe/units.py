"""Units as they stand in names: ``thickness_mm``, ``torque_Nm``, ``toughness_J_per_m2``.

Used by error messages (which key was meant, and what the number becomes) and by conversions of
columns to SI.
"""

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

_BASE: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0),
    "in": ("m", 0.0254),
    "g": ("kg", 1e-3),
    "s": ("s", 1.0),
    "min": ("s", 60.0),
    "Hz": ("/s", 1.0),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "rev": ("rad", 2.0 * math.pi),
    "N": ("N", 1.0),
    "Nm": ("N m", 1.0),
    "J": ("N m", 1.0),
    "percent": ("1", 0.01),
    "V": ("V", 1.0),
    "A": ("A", 1.0),
}
_PREFIX = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3}
_PREFIXED = {"m", "g", "s", "Hz", "rad", "N", "Nm", "J", "V", "A"}
_SPECIAL: dict[str, tuple[str, float]] = {"Ncm": ("N m", 1e-2), "Nmm": ("N m", 1e-3)}
_MOST_FACTORS = 12
"""Words at a name's end in which its unit is looked for; "Nm_s_per_rad" has four."""
_DIMENSION = {
    "m": {"m": 1},
    "kg": {"kg": 1},
    "s": {"s": 1},
    "/s": {"s": -1},
    "rad": {"rad": 1},
    "N": {"N": 1},
    "N m": {"N": 1, "m": 1},
    "1": {"percent": 1},
    "V": {"V": 1},
    "A": {"A": 1},
}


class Unit(NamedTuple):
    """A unit read from a name: factor to SI, and dimension as sorted (base, power) pairs."""

    name: str
    factor: float
    dimension: tuple[tuple[str, int], ...]

    @property
    def label(self) -> str:
        """The unit as people write it: ``N m s/rad`` for ``Nm_s_per_rad``."""
        name = f"1_{self.name}" if self.name.startswith("per_") else self.name
        return name.replace("_per_", "/").replace("_", " ").replace("Nm", "N m")


def parse_unit(text: str) -> Unit | None:
    """Read a unit as it stands in a name; None if ``text`` is not one.

    Factors stand side by side, joined by ``_``; everything after ``_per_`` divides; a digit at the
    end of a factor is its power.

    >>> parse_unit("kJ_per_m2").factor
    1000.0
    >>> parse_unit("cloth") is None
    True
    """
    above, *below = text.split("_per_")
    if above.startswith("per_"):
        above, below = "", [above.removeprefix("per_"), *below]
    factor = 1.0
    powers: Counter[str] = Counter()
    for sign, part in ((1, above), *((-1, piece) for piece in below)):
        if not part and not (below and sign == 1):
            return None
        for token in part.split("_") if part else ():
            symbol = token.rstrip("0123456789")
            digits = token[len(symbol) :] or "1"
            known = _symbol(symbol)
            if known is None or len(digits) > 1:
                return None
            power = sign * int(digits)
            base, scale = known
            factor *= scale**power
            for name, exponent in _DIMENSION[base].items():
                powers[name] += power * exponent
    dimension = tuple(sorted((name, power) for name, power in powers.items() if power))
    return Unit(text, factor, dimension)


def split_unit(key: str) -> tuple[str, Unit | None]:
    """Split a name into what it measures and its unit, taking the longest unit that fits.

    >>> stem, unit = split_unit("opening_kd_Nm_s_per_rad")
    >>> stem, unit.name
    ('opening_kd', 'Nm_s_per_rad')
    >>> split_unit("family")
    ('family', None)
    """
    words = key.rsplit("_", _MOST_FACTORS)
    for start in range(1, len(words)):
        unit = parse_unit("_".join(words[start:]))
        if unit is not None:
            return "_".join(words[:start]), unit
    return key, None


def conversion(source: Unit, target: Unit) -> float | None:
    """Return what multiplies a number in ``source`` to give ``target``; None if kinds differ.

    >>> conversion(parse_unit("cm"), parse_unit("mm"))
    10.0
    """
    if source.dimension != target.dimension:
        return None
    return float(f"{source.factor / target.factor:.15g}")


def converted(value: Any, factor: float) -> str | None:
    """A value of TOML with its numbers times ``factor``; of a prior the median alone.

    None where a part is no finite number.

    >>> converted([1.5, 6.0], 10.0), converted({"median": 5.0, "factor_90": 10.0}, 1e3)
    ('[15, 60]', '{ median = 5000, factor_90 = 10 }')
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        return f"{value * factor:.6g}"
    if isinstance(value, list) and value:
        parts = [converted(item, factor) for item in value]
        return None if None in parts else f"[{', '.join(str(part) for part in parts)}]"
    if isinstance(value, Mapping) and "median" in value:
        parts = [converted(item, factor if key == "median" else 1.0) for key, item in value.items()]
        pairs = ", ".join(f"{key} = {part}" for key, part in zip(value, parts, strict=True))
        return None if None in parts else f"{{ {pairs} }}"
    return None


def _symbol(symbol: str) -> tuple[str, float] | None:
    if symbol in _SPECIAL:
        return _SPECIAL[symbol]
    if symbol in _BASE:
        return _BASE[symbol]
    prefix, rest = symbol[:1], symbol[1:]
    if prefix in _PREFIX and rest in _PREFIXED:
        base, scale = _BASE[rest]
        return base, scale * _PREFIX[prefix]
    return None
