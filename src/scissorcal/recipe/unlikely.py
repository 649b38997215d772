"""Numbers of a recipe that are not of its unit: millimetres in metres, degrees in radians.

A number is refused where it lies within a factor of 1.5 of an everyday value that is written in
another unit, or farther out: then a wrong unit explains it better than an uncommon rig. Of the
other units only those count whose everyday values lie outside the everyday range (where that holds
0, clear of it by 1.5 on both sides), and no number within a factor of 1.5 of the everyday range is
ever refused.

The everyday range of each quantity stands here alone: what rigs, materials and hands of this kind
usually have, in SI units and radians; a share is a number between 0 and 1.
``benchmarks/extremes`` calls a state everyday by them.
"""

import difflib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scissorcal.recipe.units import Unit, converted, parse_unit, split_unit


@dataclass(frozen=True)
class Everyday:
    """One range, from ``low`` to ``high``, and ``why``: what has such values.

    ``least`` is the smallest magnitude that is usual, where the range reaches or crosses 0.
    """

    low: float
    high: float
    why: str
    least: float = 0.0

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends, as they were stated."""
        return self.low, self.high

    @property
    def magnitudes(self) -> tuple[float, float]:
        """Smallest and largest usual magnitude; the first is 0 where none is stated.

        >>> EVERYDAY["edge_offset"].magnitudes
        (0.001, 0.01)
        """
        return self.least or max(self.low, 0.0), max(-self.low, self.high)


EVERYDAY: Mapping[str, Everyday] = {
    "opening": Everyday(0.2, 0.9, "scissors cut at 12 to 50 deg between the blades"),
    "opening_rate": Everyday(-2.0, 2.0, "a hand closes scissors in 0.5 to 2 s", 0.5),
    "contact": Everyday(0.2, 0.8, "shares of the blade's length"),
    "contact_place": Everyday(0.01, 0.096, "0.2 to 0.8 of blades of 50 to 120 mm"),
    "indentation": Everyday(1e-6, 5e-4, "an edge sinks in by less than the plate's thickness"),
    "reference_indentation": Everyday(
        5e-5, 1e-3, "within what an edge reaches before it cuts, or presses"
    ),
    "thickness": Everyday(5e-5, 2e-3, "paper, cloth, film, board, leather"),
    "force": Everyday(0.5, 20.0, "sheets at an indentation of 0.3 mm"),
    "exponent": Everyday(1.0, 2.5, "1 is a spring, 1.5 a round contact, 2 a wedge"),
    "toughness": Everyday(1e3, 2e4, "paper, cloth, plastic films"),
    "kappa": Everyday(0.5, 1.0, "1 is smooth, cracks that jump stop at half or more"),
    "edge_offset": Everyday(-0.01, 0.0, "edges lie beside the pivot by millimetres", 1e-3),
    "taper": Everyday(-0.05, 0.1, "blades taper by a few degrees"),
    "curvature": Everyday(-2.0, 2.0, "arcs of a radius of 0.5 m and more"),
    "nick": Everyday(0.0, 1e-5, "a worn edge"),
    "rate_damping": Everyday(0.0, 10.0, "stiffer by a tenth or two at 20 mm/s", 0.1),
    "blade_length": Everyday(0.05, 0.12, "office, household and cloth scissors"),
    "handle_radius": Everyday(0.03, 0.12, "from the pivot to the fingers"),
    "hand_damping": Everyday(1.0, 20.0, "an arm showed 6.5 N s/m, doi:10.1038/srep18004"),
    "sheet_length": Everyday(0.05, 1.0, "from a card to a roll's end"),
    "plate_place": Everyday(0.005, 0.15, "a pattern lies on its plate"),
    "touch_stiffness": Everyday(500.0, 5e4, "a soft plate to a blade's own bending"),
    "time_step": Everyday(2.5e-4, 2e-3, "loops of 500 to 4000 Hz"),
    "loop_rate": Everyday(500.0, 4000.0, "loops of haptic devices"),
    "tolerance": Everyday(0.02, 0.15, "people just notice about 7 % of a force"),
    "cutoff": Everyday(10.0, 500.0, "above a hand's motion, below the loop's rate"),
    "between_recordings": Everyday(0.005, 0.1, "two recordings of one rig differ by 2 %"),
    "torque_limit": Everyday(0.1, 5.0, "small motors"),
    "torque_slew": Everyday(10.0, 2000.0, "the limit of torque within 5 to 10 ms"),
    "force_limit": Everyday(3.0, 100.0, "what fingers hold"),
    "force_slew": Everyday(500.0, 5e4, "the limit of force within 5 to 10 ms"),
    "engagement_ramp": Everyday(0.05, 5.0, "a force that comes on as one expects it"),
    "held_at_limit": Everyday(0.2, 20.0, "longer than a stroke's peak"),
    "sliding_speed": Everyday(0.01, 0.3, "a carriage moves by its travel in a second or more"),
    "travel": Everyday(0.01, 0.3, "the stops of a carriage"),
    "probe_angle": Everyday(0.0175, 0.26, "1 to 15 deg, so that nothing is hit"),
    "toughness_length": Everyday(3e-4, 0.01, "fibres and threads"),
    "inertia": Everyday(1e-5, 1e-3, "blades and handles about the pivot"),
    "table_size": Everyday(33, 128, "knots"),
    "rotation": Everyday(0.0, 1.0, "a plate before a camera"),
    "tilt": Everyday(0.3, 1.0, "a plate seen from the side by 17 to 57 deg"),
    "samples": Everyday(1e3, 1e6, "seconds to minutes at 1 kHz"),
    "scale": Everyday(1e-3, 1e3, "units with the prefixes milli to kilo"),
    "outlier": Everyday(0.0, 5.0, "normal noise"),
}


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
    def full_sentence(self) -> str:
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
    unlikely = [Unlikely(("unusual",), _no_range(key)) for key in meant if key not in QUANTITY_OF]
    for key in QUANTITY_OF:
        if key not in meant:
            for path, value in _values(document, key.split("."), ()):
                unlikely += _judged(key, path, value)
    return unlikely


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
    return [
        other for other in map(parse_unit, names) if other is not None and other.name != unit.name
    ]


def _label(unit: Unit) -> str:
    return "%" if unit.name == "percent" else unit.label


def _short(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"


def _largest(value: Any) -> float | None:
    """Largest magnitude of a number, of a list's, or of a prior's median; None if not finite."""
    if isinstance(value, Mapping):
        value = value.get("median")
    if isinstance(value, list):
        sizes = [_largest(item) for item in value]
        return max((item for item in sizes if item is not None), default=None)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        return None
    return abs(float(value))
