"""Parameters of a cut's laws with their priors, and where a search for them begins."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.ladder import Likelihood
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]

STARTS = 3
VISIBILITY_LOG_SD, PERIOD_LOG_SD = 0.3, 0.2
"""How well size and pace of a ripple as seen are known beforehand: a rig that yields to it shows
less of it, and more slowly, than blades that close steadily."""

REST_PHASE, REST_PHASE_SD = -0.25, 0.25
REST_SPREAD, REST_SPREAD_LOG_SD = 0.2, 0.6
"""Where cracks come to rest, in cycles from the mean place. Blades that stop at any instant leave
it uniform (0, with 0.29 about it); blades that yield stop where the force is highest, just before
the crack would run (-0.5). Priors of the place that rests have in common, and of the spread of each
about it."""

SHAPE_SD = 0.5
SHAPE_MEANING = (
    "logarithm by which the exponent changes from one interval of the spline to the next"
)
"""Its prior, weakly smooth: 90 % of neighbouring exponents within a factor of 2.3."""

NUISANCE = (
    "noise",
    "slow_noise",
    "variation",
    "ripple_visibility",
    "ripple_period",
    "rest_phase",
    "rest_spread",
)
"""Parameters that describe the noise of a cut, not the cut."""


@dataclass(frozen=True)
class CutLaw:
    """The discrete choices of a cut's law.

    ``response`` is the family of the force at the edge, ``damped`` says that it grows with the
    speed of sinking in, ``fracture`` is "none", "smooth" or "rippled". ``knots_m`` are a spline's.
    """

    response: str
    fracture: str
    damped: bool = False
    knots_m: tuple[float, ...] = ()

    @classmethod
    def of(cls, structure: Mapping[str, Any]) -> "CutLaw":
        """The law of a fit's structure."""
        damped = bool(structure.get("rate_damping", False))
        response = str(structure["response"])
        knots = structure.get("response_knots_m", ()) if response == "spline" else ()
        return cls(response, str(structure["fracture"]), damped, tuple(knots))

    @property
    def key(self) -> dict[str, Any]:
        """The choices as a fit's structure holds them."""
        return {
            "response": self.response,
            "rate_damping": self.damped,
            "fracture": self.fracture,
            **({"response_knots_m": self.knots_m} if self.knots_m else {}),
        }

    @property
    def name(self) -> str:
        """The law in words."""
        words = "no fracture" if self.fracture == "none" else f"{self.fracture} fracture"
        return f"{self.response} response{', damped' if self.damped else ''}, {words}"


def material_layout(recipe: Recipe, law: CutLaw, drive_sd: float) -> Layout:
    """Parameters of a law, and of the noise.

    ``drive_sd`` (N m) is the size of the measured effort, which the noise's priors are wide about.
    """
    settings = recipe.fit.cut
    force, exponent = settings.response_force_N, settings.response_exponent
    depth = f"force at {settings.reference_indentation_mm:g} mm of indentation"
    grows = "how the response stiffens"
    rows = [
        _log("response_force", "N", force.median, force.log_sd, depth),
        _log("response_exponent", "1", exponent.median, exponent.log_sd, grows),
    ]
    rows += [
        Parameter(f"response_shape_{index}", "1", "identity", 0.0, SHAPE_SD, SHAPE_MEANING)
        for index in range(1, len(law.knots_m) - 1)
    ]
    if law.damped:
        damping, per_speed = settings.rate_damping_s_per_m, "share by which sinking in adds force"
        rows.append(_log("rate_damping", "s/m", damping.median, damping.log_sd, per_speed))
    if law.fracture != "none":
        toughness = settings.toughness_J_per_m2
        assert toughness is not None
        energy = toughness.median * recipe.material.thickness_mm * 1e-3
        meaning = "toughness times thickness: energy per length of cut"
        rows.append(_log("fracture_energy", "J/m", energy, toughness.log_sd, meaning))
    if law.fracture == "rippled":
        share = "share of the fracture energy at which a running crack stops"
        rows.append(Parameter("kappa", "1", "logit", 0.85, 1.0, share))
        size, pace = "size of the ripple as seen", "periods of it in a bin as seen"
        rest = "where cracks rest, in cycles from the mean place"
        rows += [
            _log("ripple_visibility", "1", 1.0, VISIBILITY_LOG_SD, size),
            _log("ripple_period", "1", 1.0, PERIOD_LOG_SD, pace),
            Parameter("rest_phase", "1", "identity", REST_PHASE, REST_PHASE_SD, rest),
            _log("rest_spread", "1", REST_SPREAD, REST_SPREAD_LOG_SD, "spread of that, in cycles"),
        ]
    noise = 0.1 * drive_sd
    rows += [
        _log("noise", "N m", noise, 2.8, "noise of single bins"),
        _log("slow_noise", "N m", noise, 2.8, "noise of blocks"),
        _log("variation", "1", 0.03, 1.0, "unevenness of the material"),
    ]
    return Layout(tuple(rows))


def starts_over(
    material: Layout, base: Array, misfit: Callable[[Array], Array], likelihood: Likelihood
) -> Array:
    """The best three of a coarse grid over stiffness, its growth and fracture energy.

    ``base`` (p,) is where everything else starts; the noise at each place of the grid is what that
    place leaves.
    """
    grid = {"response_force": (-1.2, -0.8, -0.4, 0.0, 0.4, 0.8), "response_exponent": (-0.5, 0.5)}
    if "fracture_energy" in material.names:
        grid["fracture_energy"] = (-1.2, -0.8, -0.5, -0.25, 0.0, 0.25, 0.5, 0.8, 1.2)
    found = []
    for steps in itertools.product(*grid.values()):
        point = base.copy()
        for name, step in zip(grid, steps, strict=True):
            index = material.names.index(name)
            point[index] += step * material.sd[index]
        left = float(np.log(max(float(np.std(misfit(point))), 1e-9)))
        for name in ("noise", "slow_noise"):
            point[material.names.index(name)] = left
        found.append((float(likelihood.terms(point).sum()), point))
    best = sorted(found, key=lambda pair: -pair[0])
    return np.stack([point for _, point in best[:STARTS]])


def _log(name: str, unit: str, median: float, sd: float, meaning: str) -> Parameter:
    return Parameter(name, unit, "log", float(np.log(median)), sd, meaning)
