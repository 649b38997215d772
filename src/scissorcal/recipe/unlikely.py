"""Numbers of a recipe that are not of its unit: millimetres in metres, degrees in radians.

A number is refused where it lies within a factor of 1.5 of an everyday value that is written in
another unit, or farther out: then a wrong unit explains it better than an uncommon rig. Of the
other units only those count whose everyday values lie outside the everyday range (where that holds
0, clear of it by 1.5 on both sides), and no number within a factor of 1.5 of the everyday range is
ever refused.
"""

import difflib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scissorcal.recipe.everyday import EVERYDAY, Everyday
from scissorcal.recipe.units import Unit, converted, parse_unit, split_unit

Path = tuple[str | int, ...]

MARGIN = 1.5
"""An everyday range is known to about half of its ends."""

QUANTITY_OF: Mapping[str, str] = {
    "rig.handle_radius_mm": "handle_radius",
    "rig.hand_damping_N_s_per_m": "hand_damping",
    "rig.edge.offset_mm": "edge_offset",
    "rig.edge.length_mm": "blade_length",
    "rig.edge.points_mm": "blade_length",
    "rig.probe.largest_angle_deg": "probe_angle",
    "material.thickness_mm": "thickness",
    "material.sheet_length_mm": "sheet_length",
    "scene.opening_deg": "opening",
    "scene.opening_rate_rad_per_s": "opening_rate",
    "scene.contact_mm": "contact_place",
    "scene.loop_rate_Hz": "loop_rate",
    "scene.tolerance_percent": "tolerance",
    "plate.place_mm": "plate_place",
    "plate.touch.stiffness_N_per_mm": "touch_stiffness",
    "plate.layers.thickness_mm": "thickness",
    "plate.layers.outline_mm": "sheet_length",
    "limits.torque_Nm": "torque_limit",
    "limits.torque_slew_Nm_per_s": "torque_slew",
    "limits.force_N": "force_limit",
    "limits.force_slew_N_per_s": "force_slew",
    "limits.engagement_ramp_s": "engagement_ramp",
    "limits.held_at_limit_s": "held_at_limit",
    "capture.friction.speeds_rad_per_s": "opening_rate",
    "capture.friction_advance.speeds_mm_per_s": "sliding_speed",
    "capture.friction_advance.travel_mm": "travel",
    "capture.cut.speeds_rad_per_s": "opening_rate",
    "fit.friction.cutoff_Hz": "cutoff",
    "fit.friction.between_recordings_percent": "between_recordings",
    "fit.friction.priors.rotary.inertia_kg_m2": "inertia",
    "fit.friction_advance.cutoff_Hz": "cutoff",
    "fit.friction_advance.between_recordings_percent": "between_recordings",
    "fit.cut.reference_indentation_mm": "reference_indentation",
    "fit.cut.response_force_N": "force",
    "fit.cut.rate_damping_s_per_m": "rate_damping",
    "fit.cut.toughness_J_per_m2": "toughness",
    "fit.cut.between_recordings_percent": "between_recordings",
    "fit.cut.priors.toughness_variation_length_mm": "toughness_length",
}
"""Keys by their quantity. Of a list the largest magnitude counts, of a prior the median.

Other keys have no range in which a slip can be told from a choice: angles of any size, standard
deviations, sizes of errors, gains, and what is bounded by the schema more closely than by a slip.
"""

_SLIPS = (
    ("um", "mm", "cm", "m"),
    ("deg", "rad"),
    ("rad_per_s", "deg_per_s"),
    ("um_per_s", "mm_per_s", "cm_per_s", "m_per_s"),
    ("Hz", "kHz"),
    ("ms", "s"),
    ("mN", "N"),
    ("mNm", "Nm"),
    ("mN_per_s", "N_per_s", "N_per_ms"),
    ("mNm_per_s", "Nm_per_s", "Nm_per_ms"),
    ("N_per_m", "N_per_mm"),
    ("N_s_per_m", "N_s_per_mm"),
    ("s_per_m", "s_per_mm"),
    ("J_per_m2", "kJ_per_m2"),
    ("kg_m2", "kg_cm2", "g_cm2"),
)
"""Units that people write for one another."""

_SHARE = Unit("share", 1.0, (("percent", 1),))


@dataclass(frozen=True)
class Unlikely:
    """A value at ``path``: what is unlikely, the likely slip, and how it is kept if it is meant."""

    path: Path
    sentence: str
    slip: str = ""
    kept_by: str = ""

    @property
    def told(self) -> str:
        """All of it."""
        return " ".join(part for part in (self.sentence, self.slip, self.kept_by) if part)


def unlikely_numbers(document: Mapping[str, Any]) -> list[Unlikely]:
    """Numbers of a recipe that are not of their unit.

    Keys that the document lists under ``unusual`` are meant as they stand; a name there that has
    no range is a mistake, too. Anything that is no number is left to the schema.

    >>> for one in unlikely_numbers({"limits": {"torque_Nm": 1000}}):
    ...     print(one.slip)
    Was it in mN m? 1000 mN m = 1 N m, so write torque_Nm = 1.
    """
    meant = document.get("unusual", ())
    meant = [key for key in meant if isinstance(key, str)] if isinstance(meant, list) else []
    found = [Unlikely(("unusual",), _no_range(key)) for key in meant if key not in QUANTITY_OF]
    for key in QUANTITY_OF:
        if key not in meant:
            for path, value in _values(document, key.split("."), ()):
                found += _judged(key, path, value)
    return found


def bounds(key: str) -> tuple[float, float]:
    """Smallest and largest magnitude other than 0 that ``key`` takes, in its own unit.

    0 and infinity where no slip is told on that side.

    >>> low, high = bounds("material.thickness_mm")
    >>> round(low, 6), round(high, 3)
    (0.003, 33.333)
    """
    unit = _unit(key)
    low, high = _everyday(key, unit)
    apart = MARGIN**2 if EVERYDAY[QUANTITY_OF[key]].least else 1.0  # a range with 0 has no low end
    least, most = 0.0, math.inf
    for other in _others(unit):
        slip = other.factor / unit.factor
        if low <= 0.0 or max(slip, 1.0 / slip) < apart * high / low:
            continue
        if slip > 1.0:
            least = max(least, min(MARGIN * high / slip, low / MARGIN))
        else:
            most = min(most, max(low / slip / MARGIN, MARGIN * high))
    return least, most


def _values(value: Any, keys: Sequence[str], path: Path) -> Iterator[tuple[Path, Any]]:
    """Values that stand under ``keys``, with their paths: one for each table of a list."""
    if not keys:
        yield path, value
    elif isinstance(value, Mapping):
        if keys[0] in value:
            yield from _values(value[keys[0]], keys[1:], (*path, keys[0]))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            if isinstance(inner, Mapping):
                yield from _values(inner, keys, (*path, index))


def _judged(key: str, path: Path, value: Any) -> list[Unlikely]:
    """What is unlikely about the value of a key; empty where nothing is."""
    size = _largest(value)
    least, most = bounds(key)
    if size is None or size == 0.0 or least <= size <= most:
        return []
    unit = _unit(key)
    low, high = _everyday(key, unit)
    sentence = (
        f"{key}: {size:g} {_label(unit)} is far from the everyday {_short(low)} to {_short(high)} "
        f"{_label(unit)} ({EVERYDAY[QUANTITY_OF[key]].why})."
    )
    slip = ""
    other = _likely(size, unit, low, high)
    if other is not None:
        factor = float(f"{other.factor / unit.factor:.15g}")
        given = "" if other is _SHARE else f" {_label(other)}"
        asked = "a share of 1" if other is _SHARE else f"in{given}"
        number = converted(value, factor)
        written = f"{path[-1]} = {number}"
        so = f", so write {written}" if number and len(written) <= 100 else ""
        slip = f"Was it {asked}? {size:g}{given} = {size * factor:.4g} {_label(unit)}{so}."
    kept_by = f'If it is meant, add unusual = ["{key}"] above the first [table].'
    return [Unlikely(path, sentence, slip, kept_by)]


def _likely(size: float, unit: Unit, low: float, high: float) -> Unit | None:
    """The unit in which a magnitude would be everyday, or within the margin of that."""

    def away(other: Unit) -> float:
        value = size * other.factor / unit.factor
        return max(low / value, value / high, 1.0)

    nearest = min(_others(unit), key=away, default=None)
    return nearest if nearest is not None and away(nearest) <= MARGIN * (1 + 1e-9) else None


def _no_range(key: str) -> str:
    close = difflib.get_close_matches(key[:100], QUANTITY_OF, 1, 0.5)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    return f'unusual: "{key[:100]}" is no key that has an everyday range.{hint} Else remove it.'


def _everyday(key: str, unit: Unit) -> tuple[float, float]:
    row: Everyday = EVERYDAY[QUANTITY_OF[key]]
    low, high = row.magnitudes
    return low / unit.factor, high / unit.factor


def _unit(key: str) -> Unit:
    unit = split_unit(key.rpartition(".")[2])[1]
    assert unit is not None, f"{key} names no unit"
    return unit


def _others(unit: Unit) -> list[Unit]:
    """Units that may have been meant in the place of one."""
    if unit.name == "percent":
        return [_SHARE]
    names = next((names for names in _SLIPS if unit.name in names), ())
    return [one for one in map(parse_unit, names) if one is not None and one.name != unit.name]


def _label(unit: Unit) -> str:
    return "%" if unit.name == "percent" else unit.label


def _short(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"


def _largest(value: Any) -> float | None:
    """Largest magnitude of a number, of a list's, or of a prior's median; None if not finite."""
    if isinstance(value, Mapping):
        value = value.get("median")
    if isinstance(value, list):
        sizes = [_largest(one) for one in value]
        return max((one for one in sizes if one is not None), default=None)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return abs(float(value))
