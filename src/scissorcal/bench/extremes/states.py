"""States that are tried of a package: places from its scene to the absurd, and its law there."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.bench.extremes.exact_blade import Blade
from scissorcal.bench.extremes.exact_laws import (
    Exponential,
    FormulaEdge,
    NotComparedError,
    Power,
    TableCurve,
    TableForce,
    mp,
)
from scissorcal.kernel import ModelTables
from scissorcal.model import Cutting
from scissorcal.package.manifest import Ranges
from scissorcal.package.model_package import ModelPackage

QUANTITIES = ("opening", "opening_rate", "contact", "indentation")
"""Quantities of a place (rad, rad/s, m, m); an indentation says where the contact is."""
PAIRS = (("opening", "contact"), ("opening", "indentation"), ("opening_rate", "indentation"))
"""Pairs of quantities, each drawn as a map of errors."""
BEYOND_TIP = 1.5
"""Blade lengths up to which contacts are tried."""
KERNEL_CAP_N = 1e6
"""The kernel's cap on the response."""
LARGEST_OPENING_rad = 3.1415925
"""The largest float32 number below pi."""


@dataclass(frozen=True)
class State:
    """One place of the blades, all three float32 numbers, and the law of the cut there.

    ``band`` says whether the state is an ordinary one or an extreme one, ``swept`` which quantities
    were moved on purpose, ``values`` those of all that are named.
    """

    band: str
    swept: tuple[str, ...]
    values: Mapping[str, float]
    opening: float
    rate: float
    contact: float
    cutting: Cutting = field(repr=False)


def package_states(package: ModelPackage, size: float, seed: int) -> list[State]:
    """States of a package: in its scene, one quantity at a time, in pairs, and at random in all.

    ``size`` multiplies their number. The same package, size and seed give the same states.
    """
    rng = np.random.default_rng([seed, 0])
    ranges, cutting = package.manifest.ranges, package.exact.cutting
    side = math.sqrt(size)
    many, repeats = max(3, round(17 * side)), max(1, round(3 * side))
    grid, random = max(3, round(13 * side)), max(1, round(200 * size))
    moved: list[dict[str, float]] = [{}] * random
    for name in QUANTITIES:
        moved += [{name: value} for value in extreme(name, cutting, many).tolist()] * repeats
    for pair in PAIRS:
        axes = [extreme(name, cutting, grid).tolist() for name in pair]
        moved += [dict(zip(pair, place, strict=True)) for place in itertools.product(*axes)]
    states = [
        _state(
            "beyond" if values else "scene",
            tuple(values),
            _drawn(ranges, cutting, rng) | values,
            cutting,
        )
        for values in moved
    ]
    for number in range(random):
        names = ("opening", "opening_rate", ("contact", "indentation")[number % 2])
        absurd = {name: float(rng.choice(extreme(name, cutting, 10_001))) for name in names}
        states.append(_state("beyond", (), absurd, cutting))
    return [state for state in states if math.isfinite(state.contact)]


def extreme(name: str, cutting: Cutting, count: int) -> Array:
    """``count`` values of a quantity from one end of its extreme range to the other."""
    if name == "opening":
        return np.linspace(0.0, np.pi, count)
    if name == "contact":
        return np.linspace(0.0, BEYOND_TIP * cutting.edge.length_m, count)
    if name == "indentation":
        return np.geomspace(1e-12, 0.1, count)
    half = np.geomspace(1e-6, 1e3, max((count - 1) // 2, 2))
    return np.concatenate([-half[::-1], [0.0], half])


def blade_of_law(cutting: Cutting, parallel: float) -> Blade:
    """A law in 50 digits. NotComparedError where its response has no written formula."""
    edge, response = cutting.edge, cutting.response
    kinds: dict[str, Any] = {"power": Power, "exponential": Exponential}
    if response.family not in kinds:
        raise NotComparedError(f"a response that is a {response.family} has no second writing")
    offset, taper, *bends = _exact(
        edge.offset_m, edge.taper_rad, edge.curvature_per_m, edge.bend_per_m2
    )
    weights = _exact(*np.asarray(edge.spline_m))
    start, length = _exact(edge.spline_start_m, edge.length_m)
    step = (length - start) / (len(weights) - 3) if weights else length
    force = _exact(response.force, response.exponent, response.reference_m)
    upper, energy, kappa, damping = _exact(
        cutting.upper_face_m, cutting.fracture_energy or 0.0, cutting.kappa, cutting.rate_damping
    )
    shape = FormulaEdge((offset, mp.tan(taper), *bends), weights, start, step)
    return Blade(
        shape, kinds[response.family](*force), cutting.moving_blades, upper, energy, kappa,
        cutting.closure, damping, length, mp.mpf(parallel),
    )  # fmt: skip


def blade_of_tables(tables: ModelTables, parallel: float) -> Blade:
    """A kernel's own tables and float32 numbers in 50 digits."""
    numbers = (tables.upper_face, tables.fracture_energy, tables.kappa, tables.rate_damping)
    upper, energy, kappa, damping, tip = _exact(*map(np.float32, (*numbers, tables.tip_station)))
    response = TableForce(TableCurve.of(tables.response), mp.mpf(KERNEL_CAP_N))
    return Blade(
        TableCurve.of(tables.edge), response, tables.moving_blades, upper, energy, kappa,
        tables.closure, damping, tip, mp.mpf(parallel),
    )  # fmt: skip


def _exact(*numbers: Any) -> tuple[Any, ...]:
    return tuple(mp.mpf(float(number)) for number in numbers)


def _drawn(ranges: Ranges, cutting: Cutting, rng: np.random.Generator) -> dict[str, float]:
    """A place of the scene at which the edge touches, where it does; both directions alike."""
    opening = rng.uniform(*ranges.opening_rad)
    low, high = ranges.contact_m
    touched = _contact(cutting, opening, 0.0)
    return {
        "opening": opening,
        "opening_rate": rng.choice([-1.0, 1.0]) * rng.uniform(*ranges.opening_rate_rad_per_s),
        "contact": rng.uniform(low, min(high, touched) if touched > low else high),
    }


def _contact(cutting: Cutting, opening: float, indentation: float) -> float:
    """Where the edge is so deep in the material; NaN where it is nowhere."""
    edge, beta = cutting.edge, opening / cutting.moving_blades
    station = edge.station_at_height(cutting.upper_face_m - indentation, beta)
    return float(station * np.cos(beta) - edge.offset_at(station) * np.sin(beta))


def _state(
    band: str, swept: tuple[str, ...], values: Mapping[str, float], cutting: Cutting
) -> State:
    """A state at these values; its contact is NaN where the edge reaches no such indentation."""
    opening = min(float(np.float32(values["opening"])), LARGEST_OPENING_rad)
    contact = values.get("contact", math.nan)
    if "indentation" in values:
        contact = _contact(cutting, opening, values["indentation"])
    rate = float(np.float32(values["opening_rate"]))
    return State(band, swept, values, opening, rate, float(np.float32(contact)), cutting)
