"""The simpler law that a candidate names, near the fitted one: where a projection starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model import Response, edge_height, mean_share
from scissorcal.model.friction_terms import PARAMETERS, side_of, terms_of
from scissorcal.model.terms import Role
from scissorcal.package.exact import FitDraws
from scissorcal.package.simplest.difference import Scene
from scissorcal.package.simplest.law import (
    NONE,
    Candidate,
    Law,
    column,
    structured,
    with_columns,
    without,
)

EDGE_FIELDS = ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2")
EDGE_TERMS = {"line": 2, "arc": 3, "cubic": 4}
STATIONS = 61
MIDDLE_SLOPE = 0.3
"""tan(psi) at which the mean share of a ripple is taken to begin with."""
LEAST_EXPONENT, MOST_EXPONENT = 0.2, 8.0


@dataclass(frozen=True)
class Free:
    """Parameters of one fit ("cut" or "friction") that a projection may change.

    With ``shared`` the MAP point's values are every draw's: what the fit did not draw stays a
    constant, and takes no room in a package.
    """

    what: str
    names: tuple[str, ...]
    shared: bool = False


def restructure(law: Law, candidate: Candidate, scene: Scene) -> tuple[Law, Free]:
    """The law with the candidate in the place of what it has, and what a projection may change."""
    return _WAYS[candidate.aspect](law, candidate.name, scene)


def settled(law: Law, candidate: Candidate, free: Free) -> Law:
    """The law as a package stores it, once its free parameters have their values.

    An edge stands in the structure with its values at the MAP point; where no draw of it differs,
    it stands nowhere else.
    """
    if candidate.aspect != "edge":
        return law
    fields = {name.removeprefix("edge_"): column(law.cut, name) for name in free.names}
    part = _with_edge(law.cut, candidate.name, fields)
    return law.with_part("cut", without(part, free.names) if free.shared else part)


def _friction(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    if name == NONE:
        return law.with_part("friction", None), Free("friction", ())
    part = law.part("friction")
    kept = {term.name for term in terms_of(name)}
    dropped = [one for one in part.names if _of_law(one) and _stem(one) not in kept]
    part = structured(without(part, dropped), law=name, adopt=())
    return law.with_part("friction", part), Free("friction", tuple(filter(_of_law, part.names)))


def _of_law(name: str) -> bool:
    """Whether a parameter is the friction law's, and not the drive's (inertia, offset)."""
    row = PARAMETERS.get(_stem(name))
    return row is None or row.role is not Role.DRIVE


def _stem(name: str) -> str:
    return side_of(name, PARAMETERS) or name


def _fracture(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    """A smooth cut whose crack always costs what the ripple costs on average."""
    cutting = law.model().cutting
    if cutting.fracture_energy is None:
        raise ValueError("nothing is cut, so there is no fracture to simplify")
    energy = np.asarray(cutting.fracture_energy)
    share = mean_share(cutting, energy / (cutting.moving_blades * MIDDLE_SLOPE))
    mean = np.broadcast_to((energy * share).ravel(), law.rows)
    part = without(with_columns(law.cut, {"fracture_energy": mean}), ["kappa"])
    return law.with_part("cut", structured(part, fracture=name)), Free("cut", ("fracture_energy",))


def _edge(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    """The simpler edge that is nearest by least squares along the stations of the scene."""
    model = law.at(0).model()
    place = model.settled(scene.points.opening, scene.points.contact)
    view = edge_height(model.cutting.edge, place, model.blade_angle(scene.points.opening))
    within = view.station[view.station < model.cutting.edge.length_m]
    station = np.linspace(float(within.min()), float(within.max()), STATIONS)
    basis = np.stack([station**0, station, station**2 / 2.0, station**3 / 6.0], axis=1)
    shapes = np.broadcast_to(law.model().cutting.edge.offset_at(station), (law.rows, STATIONS))
    solved = np.linalg.lstsq(basis[:, : EDGE_TERMS[name]], shapes.T, rcond=None)[0]
    fields = dict(zip(EDGE_FIELDS, solved, strict=False))
    fields["taper_rad"] = np.arctan(fields["taper_rad"])
    drawn = [one for one in law.cut.names if one.startswith("edge_")]
    columns = {f"edge_{field}": values for field, values in fields.items()}
    part = with_columns(without(law.cut, drawn), columns)
    free = Free("cut", tuple(columns), shared=not drawn)
    return law.with_part("cut", _with_edge(part, name, fields)), free


def _with_edge(part: FitDraws, family: str, fields: Mapping[str, Array]) -> FitDraws:
    plain = {field: float(values[0]) for field, values in fields.items()}
    kept = {"curvature_per_m": 0.0, "length_m": part.structure["edge"]["length_m"]}
    return structured(part, edge={**kept, **plain, "family": family})


def _damping(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    part = structured(without(law.cut, ["rate_damping"]), rate_damping=False)
    return law.with_part("cut", part), Free("cut", ("response_force", "response_exponent"))


def _response(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    """A power law or an exponential with the force and the grade of the law at two depths."""
    response = law.model().cutting.response
    shallow, deep = _depths(law.at(0), scene)
    force_low, force_high = (np.ravel(response.force_at(depth)) for depth in (shallow, deep))
    grade = np.log(force_high / force_low) / np.log(deep / shallow)
    reference = float(law.cut.structure["reference_indentation_m"])
    exponent = np.clip(grade, LEAST_EXPONENT, MOST_EXPONENT)
    if name == "exponential":
        exponent = np.clip(2.0 * (grade - 1.0) * reference / deep, LEAST_EXPONENT, MOST_EXPONENT)
    unit = Response(name, np.ones((law.rows, 1)), exponent[:, None], reference)  # type: ignore[arg-type]
    force = force_high / np.ravel(unit.force_at(deep))
    shape = [one for one in law.cut.names if one.startswith("response_shape_")]
    part = with_columns(law.cut, {"response_force": force, "response_exponent": exponent})
    part = structured(without(part, shape), response=name, response_knots_m=())
    return law.with_part("cut", part), Free("cut", ("response_force", "response_exponent"))


def _depths(law: Law, scene: Scene) -> tuple[float, float]:
    """A small and a large indentation of a scene, in metres."""
    model, points = law.model(), scene.points
    place = model.settled(points.opening, points.contact)
    view = edge_height(model.cutting.edge, place, model.blade_angle(points.opening))
    depth = model.cutting.upper_face_m - view.height
    pressed = depth[(depth > 0.0) & (view.station < model.cutting.edge.length_m)]
    if len(pressed) == 0:
        return 0.5 * model.cutting.response.reference_m, model.cutting.response.reference_m
    low, high = np.quantile(pressed, [0.3, 0.9])
    return float(low), max(float(high), 1.01 * float(low))


def _closure(law: Law, name: str, scene: Scene) -> tuple[Law, Free]:
    names = ["response_force", "response_exponent"]
    if law.cut.structure["fracture"] != NONE:
        names.append("fracture_energy")
    part = structured(law.cut, closure=name)
    return law.with_part("cut", part), Free("cut", tuple(names))


_WAYS: Mapping[str, Callable[[Law, str, Scene], tuple[Law, Any]]] = {
    "friction": _friction,
    "fracture": _fracture,
    "edge": _edge,
    "damping": _damping,
    "response": _response,
    "closure": _closure,
}
