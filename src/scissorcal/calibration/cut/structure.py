"""The laws of a cut with their parameters and priors, its geometry, and the model they make."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.model import (
    Cutting,
    Edge,
    EdgeDistribution,
    Response,
    ResponseLaw,
    law_parameters,
    log_normal,
    response_of,
)
from scissorcal.model.checks import LARGEST, SMALLEST
from scissorcal.model.terms import IDENTITY, LOG
from scissorcal.recipe.edge import stated_curve
from scissorcal.recipe.priors import AnyPrior
from scissorcal.recipe.schema import Recipe


def cutting_from(structure: Mapping[str, Any], values: Mapping[str, Array]) -> Cutting:
    """The model of a cut from a fit's structure and parameters by name.

    ``values`` may hold scalars or arrays that broadcast with what the model is evaluated on.
    Parameters that begin with ``edge_`` take the place of the structure's own of the edge.
    """
    return Cutting(
        edge=_edge_from(structure, values),
        response=response_from(structure, values),
        moving_blades=structure["moving_blades"],
        upper_face_m=structure["upper_face_m"],
        fracture_energy=values.get("fracture_energy"),
        kappa=values.get("kappa", 1.0),
        closure=structure["closure"],
        rate_damping=values.get("rate_damping", 0.0),
    )


def response_from(structure: Mapping[str, Any], values: Mapping[str, Array]) -> Response:
    """The response of a fit's structure, with parameters by name."""
    family, reference = structure["response"], structure["reference_indentation_m"]
    if family == "own":
        law = structure["response_law"]
        stated = law_parameters(law)
        named = {name: values.get(name, np.asarray(value)) for name, (value, _) in stated.items()}
        return response_of(law, named, reference)
    # a trial far out may overflow; its torque is then no number, and the trial is rejected
    force, exponent = (
        np.clip(values[name], SMALLEST, LARGEST) for name in ("response_force", "response_exponent")
    )
    if family != "spline":
        return Response(family, force, exponent, reference)
    knots = tuple(structure["response_knots_m"])
    steps = [values[f"response_shape_{index}"] for index in range(1, len(knots) - 1)]
    return Response(family, force, exponent, reference, np.stack(steps, axis=-1), knots)


def _edge_from(structure: Mapping[str, Any], values: Mapping[str, Array]) -> Edge:
    """The edge of a fit's structure, with the parameters among ``values`` that describe it."""
    edge = Edge(**structure["edge"])
    named = {name.removeprefix("edge_"): v for name, v in values.items() if _of_edge(name)}
    if not named:
        return edge
    edge_prior = EdgeDistribution(edge, tuple(named), np.zeros((len(named), len(named))))
    return edge_prior.with_values(named)


_EDGE_TERMS = {
    "offset_m": "offset at the pivot",
    "taper_rad": "taper",
    "curvature_per_m": "curvature",
    "bend_per_m2": "change of the curvature",
}


def edge_layout(edge_prior: EdgeDistribution) -> Layout:
    """Parameters of an edge that was measured, with that estimate as their prior.

    >>> line = Edge("line", offset_m=-0.008, taper_rad=0.03, length_m=0.07)
    >>> named = EdgeDistribution(line, ("offset_m", "taper_rad"), np.diag([1e-10, 1e-8]))
    >>> [parameter.meaning for parameter in edge_layout(named).parameters]
    ["offset at the pivot of the blade's edge", "taper of the blade's edge"]
    """
    units = {"offset_m": "m", "taper_rad": "rad", "curvature_per_m": "1/m", "bend_per_m2": "1/m^2"}
    sds = np.sqrt(np.diag(edge_prior.covariance))
    return Layout(
        tuple(
            Parameter(
                f"edge_{name}",
                units.get(name, "m"),
                IDENTITY,
                float(mean),
                float(sd),
                f"{_edge_term(name)} of the blade's edge",
                measured_prior=True,
            )
            for name, mean, sd in zip(edge_prior.names, edge_prior.mean, sds, strict=True)
        )
    )


def _edge_term(name: str) -> str:
    return _EDGE_TERMS.get(name, name.replace("spline_m_", "spline weight "))


def geometry_of(recipe: Recipe, edge: Edge) -> dict[str, Any]:
    """A recipe's geometry, with the edge as it was measured, as the structure of a cut's fit."""
    return {
        "closure": recipe.scene.closure,
        "reference_indentation_m": recipe.fit.cut.reference_indentation_mm * 1e-3,
        "moving_blades": recipe.rig.moving_blades,
        "upper_face_m": recipe.upper_face_m,
        "edge": {
            "family": edge.family,
            "offset_m": float(edge.offset_m),
            "taper_rad": float(edge.taper_rad),
            "length_m": edge.length_m,
            "curvature_per_m": float(edge.curvature_per_m),
            **({"bend_per_m2": float(edge.bend_per_m2)} if np.any(edge.bend_per_m2) else {}),
            **(
                {
                    "spline_m": tuple(np.asarray(edge.spline_m).tolist()),
                    "spline_start_m": edge.spline_start_m,
                }
                if edge.family == "spline"
                else {}
            ),
        },
    }


def edge_of(recipe: Recipe) -> EdgeDistribution:
    """The edge that a recipe states, with what it says of its uncertainty."""
    edge = recipe.rig.edge
    sds = {
        "offset_m": edge.offset_sd_mm * 1e-3,
        "taper_rad": float(np.radians(edge.taper_sd_deg)),
    }
    open_ones = {name: sd for name, sd in sds.items() if sd > 0.0}
    return EdgeDistribution(
        stated_curve(edge).edge,
        tuple(open_ones),
        np.diag(np.square(list(open_ones.values()))).reshape(len(open_ones), len(open_ones)),
    )


def _of_edge(name: str) -> bool:
    return name.startswith("edge_")


def fitted_cutting(fit: FitResult, values: Array | None = None) -> Cutting | None:
    """The cut's model at its best point, or at parameters (..., p) in the fit's order.

    None where the fit is of friction, or holds no usable numbers.
    """
    if fit.what != "cut" or not has_numbers(fit, {"response", "edge"}):
        return None
    given = fit.map_point if values is None else values
    named = {p.name: np.asarray(given[..., i]) for i, p in enumerate(fit.parameters)}
    return cutting_from(dict(fit.structure), named)


def has_numbers(fit: FitResult, keys: set[str]) -> bool:
    """Whether a fit's structure has ``keys``, and its draws and best point are finite."""
    known = keys <= set(fit.structure) and len(fit.parameters) > 0 and len(fit.draws) > 1
    return known and bool(np.all(np.isfinite(fit.draws)) and np.all(np.isfinite(fit.map_point)))


def some_draws(fit: FitResult, most: int = 200) -> Array:
    """At most ``most`` posterior draws, evenly taken, shape (k, parameters)."""
    count = len(fit.draws)
    if count <= most:
        return fit.draws
    return fit.draws[np.linspace(0, count - 1, most).round().astype(np.int64)]


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
    friction grows with the cut's torque. ``knots_m`` are a spline's, ``own`` is a law of one's own,
    whose ``response`` is "own" until the fit is done
    (:func:`scissorcal.calibration.cut.own_law.as_spline_fit`).
    """

    response: str
    fracture: str
    damped: bool = False
    loaded: bool = False
    knots_m: tuple[float, ...] = ()
    own: ResponseLaw | None = None

    @classmethod
    def of(cls, structure: Mapping[str, Any]) -> "CutLaw":
        """The law of a fit's structure."""
        response = str(structure["response"])
        knots = structure.get("response_knots_m", ()) if response == "spline" else ()
        damped, loaded = (bool(structure.get(n, False)) for n in ("rate_damping", "load_share"))
        own = structure.get("response_law")
        return cls(response, str(structure["fracture"]), damped, loaded, tuple(knots), own)

    @property
    def key(self) -> dict[str, Any]:
        """The choices as a fit's structure holds them."""
        return {
            "response": self.response,
            "rate_damping": self.damped,
            "fracture": self.fracture,
            "load_share": self.loaded,
            **({"response_knots_m": self.knots_m} if self.knots_m else {}),
            **({"response_law": self.own} if self.own is not None else {}),
        }

    @property
    def name(self) -> str:
        """The law in words."""
        fracture = "no fracture" if self.fracture == "none" else f"{self.fracture} fracture"
        damped = ", damped" if self.damped else ""
        loaded = f", {LOADED}" if self.loaded else ""
        response = type(self.own).__name__ if self.own is not None else self.response
        return f"{response} response{damped}, {fracture}{loaded}"


def allowed_laws(recipe: Recipe) -> list[CutLaw]:
    """The candidate laws that a recipe allows, simplest first."""
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


def own_laws(recipe: Recipe, own: ResponseLaw) -> list[CutLaw]:
    """The laws that a recipe allows, with a response of one's own in the place of its families."""
    laws = [replace(law, response="own", own=own) for law in allowed_laws(recipe)]
    return list(dict.fromkeys(laws))


def usual_law(laws: Sequence[CutLaw]) -> CutLaw:
    """The law that cuts (or presses) usually support, of candidates: what draft effort fits.

    With the ripple of teeth; without damping and friction that depends on the load, which data are
    to be asked for (standard effort does). Sheets have a power law, as the built-in recipes state;
    soft things that are only pressed stiffen exponentially (Fung 1967,
    doi:10.1152/ajplegacy.1967.213.6.1532; taken on 3 of 3 days of the virtual rig).

    >>> from scissorcal.recipe.load import builtin_recipe
    >>> usual_law(allowed_laws(builtin_recipe("paper-80gsm"))).name
    'power response, rippled fracture'
    """

    def unlikely(law: CutLaw) -> tuple[bool, bool, bool, bool]:
        family = "exponential" if law.fracture == "none" else "power"
        smooth = law.fracture == "smooth"
        return (law.loaded, law.damped, law.response != family, smooth)

    return min(laws, key=unlikely)


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
    settings, priors = recipe.fit.cut, recipe.fit.cut.priors
    depth = f"force at {settings.reference_indentation_mm:g} mm of indentation"
    rows = [
        _stated("response_force", "N", settings.response_force_N, depth),
        _stated("response_exponent", "1", settings.response_exponent, "how force stiffens"),
    ]
    if law.own is not None:
        rows = _own_rows(law.own)
    steps = "logarithm by which the exponent changes from one interval of the spline to the next"
    rows += [
        _stated(f"response_shape_{index}", "1", priors.response_shape, steps)
        for index in range(1, len(law.knots_m) - 1)
    ]
    if law.damped:
        meaning = "share by which sinking in adds force"
        rows.append(_stated("rate_damping", "s/m", settings.rate_damping_s_per_m, meaning))
    if law.fracture != "none":
        rows += _fracture(recipe, law)
    words = "friction offset while"
    rows += [
        Parameter(f"offset_{way}", "N m", IDENTITY, 0.0, sd, f"{words} {way}")
        for way, sd in zip(("closing", "opening"), offset_sd, strict=True)
    ]
    late = "ticks by which torque is measured late"
    rows += [
        _stated("noise_scale", "1", priors.noise_scale, "noise of elastic segments over expected"),
        _stated("torque_delay", "1", priors.torque_delay_ticks, late),
    ]
    if law.loaded:
        meaning = "share of the cut's torque that friction adds"
        rows.append(_stated("load_share", "1", priors.load_share, meaning))
    return (RippleLayout if law.fracture == "rippled" else Layout)(tuple(rows))


def _own_rows(own: ResponseLaw) -> list[Parameter]:
    """What a law of one's own leaves open: its numbers with a standard deviation, as priors."""
    rows = []
    for name, (value, sd) in law_parameters(own).items():
        if sd > 0.0:
            unit = name.rpartition("_")[2] if "_" in name else "1"
            meaning = f"of {type(own).__name__}"
            rows.append(Parameter(name, unit, LOG, *log_normal(value, sd), meaning))
    return rows


def _fracture(recipe: Recipe, law: CutLaw) -> list[Parameter]:
    """Toughness and unevenness; the energy's prior is that of its mean over a cycle."""
    toughness, priors = recipe.fit.cut.toughness_J_per_m2, recipe.fit.cut.priors
    assert toughness is not None
    thickness = recipe.material.thickness_mm * 1e-3
    energy = "toughness times thickness: energy per length of cut"
    rows = [_stated("fracture_energy", "J/m", toughness, energy, thickness)]
    if law.fracture == "rippled":
        share = "share of the fracture energy at which a running crack stops"
        rows += [
            _stated("kappa", "1", priors.kappa, share),
            _stated("rest_phase", "1", priors.rest_phase, "where in the cycle cracks come to rest"),
            _stated("rest_spread", "1", priors.rest_spread, "spread of that, in cycles"),
        ]
    within = "unevenness of the toughness within a sheet"
    length = priors.toughness_variation_length_mm
    return [
        *rows,
        _stated("variation", "1", priors.toughness_variation, within),
        _stated("variation_length", "m", length, "length over which it is even", 1e-3),
        _stated("sheet_variation", "1", priors.sheet_variation, "unevenness between sheets"),
    ]


def _stated(name: str, unit: str, prior: AnyPrior, meaning: str, factor: float = 1.0) -> Parameter:
    """A parameter with a prior of the recipe, whose median is multiplied by ``factor``."""
    mean, sd = prior.normal()
    shift = float(np.log(factor)) if factor != 1.0 else 0.0
    return Parameter(name, unit, prior.transform, mean + shift, sd, meaning)
