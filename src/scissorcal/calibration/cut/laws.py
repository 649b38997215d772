"""The laws of a cut that are compared, and their parameters with priors."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]

KAPPA_LOGIT = (0.85, 1.0)
REST_PHASE = (0.65, 0.25)
"""Where in the cycle cracks come to rest, 0 just after a jump and 1 before the next: blades that
yield stall where the torque is highest."""
REST_SPREAD = (0.2, 1.0)
"""Spread of that in cycles, and the standard deviation of its logarithm: 0.29 is uniform,
and blades that stall leave less. Wide: a narrow one would tell kappa by the scatter of rests."""
VARIATION = (0.04, 0.7)
VARIATION_LENGTH_M = (1.5e-3, 0.5)
SHEET_VARIATION = (0.004, 1.0)
"""Sheets differ in their mean toughness: 90 % within 0.08 to 2 % before data."""
NOISE_SCALE_SD = 0.2
LOAD_SHARE_SD = 0.1
"""Share of the cut's torque by which friction of the pivot grows: up to 0.1 in jaw tools."""
DELAY_TICKS = (0.08, 0.06)
"""A motor whose lag is 0 to 2 ticks is late by 0 to 0.13 ticks; 0.08 for a lag of one tick."""
SHAPE_SD = 0.5

LOADED = "load-dependent friction"
"""What the name of a law says of a load share."""

NUISANCE = (
    "rest_phase",
    "rest_spread",
    "variation",
    "variation_length",
    "sheet_variation",
    "offset_closing",
    "offset_opening",
    "load_share",
    "noise_scale",
    "torque_delay",
)
"""Parameters that describe the day, not the material."""


@dataclass(frozen=True)
class CutLaw:
    """The discrete choices of a cut's law.

    ``response`` is the family of the force at the edge, ``damped`` says that it grows with the
    speed of sinking in, ``fracture`` is "none", "smooth" or "rippled", ``loaded`` says that
    friction grows with the cut's torque. ``knots_m`` are a spline's.
    """

    response: str
    fracture: str
    damped: bool = False
    loaded: bool = False
    knots_m: tuple[float, ...] = ()

    @classmethod
    def of(cls, structure: Mapping[str, Any]) -> "CutLaw":
        """The law of a fit's structure."""
        response = str(structure["response"])
        knots = structure.get("response_knots_m", ()) if response == "spline" else ()
        return cls(
            response,
            str(structure["fracture"]),
            bool(structure.get("rate_damping", False)),
            bool(structure.get("load_share", False)),
            tuple(knots),
        )

    @property
    def key(self) -> dict[str, Any]:
        """The choices as a fit's structure holds them."""
        return {
            "response": self.response,
            "rate_damping": self.damped,
            "fracture": self.fracture,
            "load_share": self.loaded,
            **({"response_knots_m": self.knots_m} if self.knots_m else {}),
        }

    @property
    def name(self) -> str:
        """The law in words."""
        fracture = "no fracture" if self.fracture == "none" else f"{self.fracture} fracture"
        damped = ", damped" if self.damped else ""
        loaded = f", {LOADED}" if self.loaded else ""
        return f"{self.response} response{damped}, {fracture}{loaded}"


def allowed_laws(recipe: Recipe) -> list[CutLaw]:
    """The laws that a recipe lets the ladder have, cheapest first."""
    settings = recipe.fit.cut
    families = {
        "auto": ("power", "exponential"),
        "auto+spline": ("power", "exponential", "spline"),
    }.get(settings.response, (settings.response,))
    fractures: tuple[str, ...] = ("smooth", "rippled")
    if not recipe.scene.cut:
        fractures = ("none",)
    elif settings.fracture != "auto":
        fractures = (settings.fracture,)
    choices = {"none": (False,), "fit": (True,), "auto": (False, True)}
    dampings, loads = choices[settings.rate_damping], choices[settings.load_share]
    laws = itertools.product(loads, fractures, dampings, families)
    return [CutLaw(family, fracture, damped, loaded) for loaded, fracture, damped, family in laws]


@dataclass(frozen=True)
class RippleLayout(Layout):
    """Parameters of a rippled cut, whose energy is sought as its mean over a cycle.

    The unconstrained coordinate of ``fracture_energy`` J is ln [J (1 + kappa) / 2]: that is what
    running cracks tell, and it is nearly independent of kappa. Its natural value is J.
    """

    def natural(self, u: Array) -> dict[str, Array]:
        """Values by name from unconstrained points of shape (..., p)."""
        values = super().natural(u)
        values["fracture_energy"] = values["fracture_energy"] * 2.0 / (1.0 + values["kappa"])
        return values

    def unconstrained(self, values: dict[str, float]) -> Array:
        """An unconstrained point (p,) from values by name."""
        mean = values["fracture_energy"] * (1.0 + values["kappa"]) / 2.0
        return super().unconstrained({**values, "fracture_energy": mean})


def cut_layout(recipe: Recipe, law: CutLaw, offset_sd: tuple[float, float]) -> Layout:
    """Parameters of a law, those of the material first.

    ``offset_sd`` (N m) is how well friction is known while closing and while opening.
    """
    settings = recipe.fit.cut
    force, exponent = settings.response_force_N, settings.response_exponent
    depth = f"force at {settings.reference_indentation_mm:g} mm of indentation"
    rows = [
        _log("response_force", "N", force.median, force.log_sd, depth),
        _log("response_exponent", "1", exponent.median, exponent.log_sd, "how force stiffens"),
    ]
    rows += [
        Parameter(
            f"response_shape_{index}",
            "1",
            "identity",
            0.0,
            SHAPE_SD,
            "logarithm by which the exponent changes from one interval of the spline to the next",
        )
        for index in range(1, len(law.knots_m) - 1)
    ]
    if law.damped:
        damping, meaning = settings.rate_damping_s_per_m, "share by which sinking in adds force"
        rows.append(_log("rate_damping", "s/m", damping.median, damping.log_sd, meaning))
    if law.fracture != "none":
        rows += _fracture(recipe, law)
    rows += [
        _plain("offset_closing", "N m", 0.0, offset_sd[0], "friction offset while closing"),
        _plain("offset_opening", "N m", 0.0, offset_sd[1], "friction offset while opening"),
        _log("noise_scale", "1", 1.0, NOISE_SCALE_SD, "noise of elastic segments over expected"),
        _plain("torque_delay", "1", *DELAY_TICKS, "ticks by which torque is measured late"),
    ]
    if law.loaded:
        meaning = "share of the cut's torque that friction adds"
        rows.append(_plain("load_share", "1", 0.0, LOAD_SHARE_SD, meaning))
    return (RippleLayout if law.fracture == "rippled" else Layout)(tuple(rows))


def _fracture(recipe: Recipe, law: CutLaw) -> list[Parameter]:
    """Toughness and unevenness; the energy's prior is that of its mean over a cycle."""
    toughness = recipe.fit.cut.toughness_J_per_m2
    assert toughness is not None
    energy = toughness.median * recipe.material.thickness_mm * 1e-3
    rows = [
        _log(
            "fracture_energy",
            "J/m",
            energy,
            toughness.log_sd,
            "toughness times thickness: energy per length of cut",
        )
    ]
    if law.fracture == "rippled":
        share = "share of the fracture energy at which a running crack stops"
        rows += [
            Parameter("kappa", "1", "logit", *KAPPA_LOGIT, share),
            _plain("rest_phase", "1", *REST_PHASE, "where in the cycle cracks come to rest"),
            _log("rest_spread", "1", *REST_SPREAD, "spread of that, in cycles"),
        ]
    return [
        *rows,
        _log("variation", "1", *VARIATION, "unevenness of the toughness within a sheet"),
        _log("variation_length", "m", *VARIATION_LENGTH_M, "length over which it is even"),
        _log("sheet_variation", "1", *SHEET_VARIATION, "unevenness between sheets"),
    ]


def _log(name: str, unit: str, median: float, sd: float, meaning: str) -> Parameter:
    return Parameter(name, unit, "log", float(np.log(median)), sd, meaning)


def _plain(name: str, unit: str, mean: float, sd: float, meaning: str) -> Parameter:
    return Parameter(name, unit, "identity", mean, sd, meaning)
