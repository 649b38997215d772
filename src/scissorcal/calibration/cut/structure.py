"""The discrete choices and the geometry of a cut, and the model that they and parameters make."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.model import Cutting, Edge, EdgeDistribution, Response
from scissorcal.model.checks import LARGEST, SMALLEST
from scissorcal.model.transforms import IDENTITY
from scissorcal.recipe.edge import stated_curve
from scissorcal.recipe.schema import Recipe


def cutting_from(structure: Mapping[str, Any], values: Mapping[str, Array]) -> Cutting:
    """The model of a cut from a fit's structure and parameters by name.

    ``values`` may hold scalars or arrays that broadcast with what the model is evaluated on.
    Parameters that begin with ``edge_`` take the place of the structure's own of the edge.
    """
    return Cutting(
        edge=edge_from(structure, values),
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
    # a trial far out may overflow; its torque is then no number, and the trial is rejected
    force, exponent = (
        np.clip(values[name], SMALLEST, LARGEST) for name in ("response_force", "response_exponent")
    )
    if family != "spline":
        return Response(family, force, exponent, reference)
    knots = tuple(structure["response_knots_m"])
    steps = [values[f"response_shape_{index}"] for index in range(1, len(knots) - 1)]
    return Response(family, force, exponent, reference, np.stack(steps, axis=-1), knots)


def edge_from(structure: Mapping[str, Any], values: Mapping[str, Array]) -> Edge:
    """The edge of a fit's structure, with the parameters among ``values`` that describe it."""
    edge = Edge(**structure["edge"])
    named = {name.removeprefix("edge_"): v for name, v in values.items() if _of_edge(name)}
    if not named:
        return edge
    edge_prior = EdgeDistribution(edge, tuple(named), np.zeros((len(named), len(named))))
    return edge_prior.with_values(named)


def edge_layout(edge_prior: EdgeDistribution) -> Layout:
    """Parameters of an edge that was measured, with that estimate as their prior."""
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
                "the blade's edge, as photographs or the recipe tell it",
                measured_prior=True,
            )
            for name, mean, sd in zip(edge_prior.names, edge_prior.mean, sds, strict=True)
        )
    )


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
