"""Every quantity with its everyday and its extreme range.

Everyday ranges are those of :mod:`scissorcal.recipe.unlikely`, extreme ones stand here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.unlikely import EVERYDAY

Spacing = Literal["linear", "log", "sign-log", "whole"]

ZERO_SHARE = 0.1
"""Share of draws that are 0 where a range begins or changes its sign there."""


@dataclass(frozen=True)
class Quantity:
    """One quantity: its unit, its everyday range, its extreme range, and how values are spaced.

    ``spacing``: ``linear``; ``log``, where a lower end of 0 is one value more; ``sign-log``, both
    signs and 0, log-spaced from ``least`` on; ``whole`` numbers, log-spaced. ``parts`` are those of
    the program that have it. ``least`` is the smallest magnitude other than 0 that is tried.
    """

    name: str
    unit: str
    everyday: tuple[float, float]
    extreme: tuple[float, float]
    spacing: Spacing
    parts: tuple[str, ...]
    what: str
    least: float = 0.0

    def values(self, count: int) -> Array:
        """``count`` values from one end of the extreme range to the other, both ends included.

        >>> QUANTITIES["kappa"].values(4).tolist()
        [0.001, 0.01, 0.1, 1.0]
        """
        low, high = self.extreme
        if self.spacing == "linear":
            return np.linspace(low, high, count)
        if self.spacing == "sign-log":
            half = np.geomspace(self.least, high, max((count - 1) // 2, 1))
            return np.concatenate([-half[::-1], [0.0], half])
        if low > 0.0:
            values = np.geomspace(low, high, count)
            values[[0, -1]] = low, high
        else:
            values = np.concatenate([[0.0], np.geomspace(self.least, high, count - 1)])
        return np.unique(np.round(values)) if self.spacing == "whole" else values

    def draw(self, rng: np.random.Generator, *, extreme: bool) -> float:
        """One value at random from the everyday or the extreme range, spaced as the quantity is."""
        low, high = self.extreme if extreme else self.everyday
        if self.spacing == "linear":
            return float(rng.uniform(low, high))
        if self.spacing != "sign-log":
            low = low or (0.0 if rng.random() < ZERO_SHARE else self.least)
            value = 0.0 if low == 0.0 else float(np.exp(rng.uniform(np.log(low), np.log(high))))
            return float(round(value)) if self.spacing == "whole" else value
        largest = max(-low, high)
        size = float(np.exp(rng.uniform(np.log(self.least), np.log(largest))))
        value = -size if rng.random() < -low / (high - low) else size
        return 0.0 if rng.random() < ZERO_SHARE else min(max(value, low), high)


def _quantity(name: str, unit: str, *others: Any) -> Quantity:
    return Quantity(name, unit, EVERYDAY[name].ends, *others)


_PHYSICS = ("model", "kernel")
_ROWS = (
    _quantity("opening", "rad", (0.0, float(np.pi)), "linear", _PHYSICS,
              "angle between the blades"),
    _quantity("opening_rate", "rad/s", (-1e3, 1e3), "sign-log", _PHYSICS,
              "rate of the opening; negative closes", 1e-6),
    _quantity("contact", "blade lengths", (0.0, 1.5), "linear", _PHYSICS,
              "place of the crack tip, from the pivot to beyond the tip"),
    _quantity("indentation", "m", (1e-12, 1e-1), "log", _PHYSICS,
              "depth of the edge in the material, where it is given in place of the contact"),
    _quantity("thickness", "m", (1e-6, 1e-1), "log", _PHYSICS,
              "thickness of the plate"),
    _quantity("force", "N", (1e-6, 1e6), "log", _PHYSICS,
              "response at the reference indentation of 0.3 mm"),
    _quantity("exponent", "1", (0.5, 8.0), "log", _PHYSICS,
              "exponent of the response"),
    _quantity("toughness", "J/m^2", (1.0, 1e5), "log", _PHYSICS,
              "energy per area of cut"),
    _quantity("kappa", "1", (1e-3, 1.0), "log", _PHYSICS,
              "share of the fracture energy at which a running crack stops"),
    _quantity("edge_offset", "m", (-0.1, 0.1), "sign-log", _PHYSICS,
              "offset of the edge from the blade's centreline at the pivot", 1e-6),
    _quantity("taper", "rad", (-1.5, 1.5), "linear", _PHYSICS,
              "angle of the edge against the centreline; parallel and re-entrant edges included"),
    _quantity("curvature", "1/m", (-1e3, 1e3), "sign-log", _PHYSICS,
              "bend of the edge", 1e-3),
    _quantity("nick", "m", (0.0, 1e-2), "log", _PHYSICS,
              "depth of a nick of 5 mm width in the edge", 1e-7),
    _quantity("rate_damping", "s/m", (0.0, 1e12), "log", _PHYSICS,
              "growth of the force with the speed of indentation", 1e-3),
    _quantity("blade_length", "m", (1e-3, 10.0), "log", _PHYSICS,
              "length of the blade"),
    _quantity("time_step", "s", (1e-5, 1.0), "log", ("kernel", "signals"),
              "time between two samples; with gaps, duplicates and backward jumps", 1e-5),
    _quantity("inertia", "kg m^2", (1e-6, 1e2), "log", ("kernel", "signals"),
              "inertia of the blades about the pivot"),
    _quantity("table_size", "knots", (2, 256), "whole", ("kernel",),
              "knots of a table"),
    _quantity("rotation", "rad", (0.0, float(np.pi)), "linear", ("vision",),
              "angle of a pose; quaternions near half a turn"),
    _quantity("tilt", "rad", (0.0, float(np.pi / 2)), "linear", ("vision",),
              "angle between a plate's normal and the view: 0 is square-on, pi/2 edge-on"),
    _quantity("samples", "1", (1, 1e7), "whole", ("inference", "signals"),
              "samples of a recording"),
    _quantity("scale", "1", (1e-12, 1e12), "log", ("inference",),
              "scale of a parameter or of data"),
    _quantity("outlier", "sd", (0.0, 1e6), "log", ("inference", "signals"),
              "distance of an outlier from the rest", 1.0),
)  # fmt: skip

QUANTITIES: Mapping[str, Quantity] = {row.name: row for row in _ROWS}


def is_everyday(values: Mapping[str, float]) -> bool:
    """Whether every named value lies in its everyday range.

    >>> is_everyday({"kappa": 0.7, "exponent": 8.0})
    False
    """
    return all(
        QUANTITIES[name].everyday[0] <= value <= QUANTITIES[name].everyday[1]
        for name, value in values.items()
    )
