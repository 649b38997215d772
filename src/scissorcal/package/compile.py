"""Compile the model to the arrays and scalars that a kernel evaluates."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.kernel import ModelTables, Table
from scissorcal.model import damped, edge_height, mean_share, settled_contact
from scissorcal.model.curvature import (
    cubic_curvature,
    edge_breaks,
    edge_curvature,
    response_breaks,
    response_curvature,
)
from scissorcal.package.exact import ExactModel
from scissorcal.package.friction_tables import friction_functions, friction_tables
from scissorcal.package.grid import NOTHING_TOUCHED, Points, spread_points
from scissorcal.package.layer_pieces import hardest_layer
from scissorcal.package.manifest import Fracture, Friction, Mechanics, Ranges
from scissorcal.package.tables import Fitted, Function, NumberFormat, Rows, TableLaw, fit_table
from scissorcal.recipe.schema import Recipe

TOLERANCE = 1e-4
"""Of each table, as a share of its value; bound.py measures the resulting error in torque."""

SCOUTS = 8_000
BEYOND_LIMIT = 1.25
MARGIN = 1.05

STRONGEST_N = 1e5
"""No response is tabulated beyond this force."""

LEAST_TORQUE_Nm = 1e-6
LEAST_SLOPE = 1e-6
STEP_rad = 1e-4

SLOWEST_EPS = 0.02
"""Below this rate (rad/s) friction is linear in it, even where the scene begins at rest: a measured
rate is never quite 0."""

Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class TableChoice:
    """How fine one table is: its tolerance, as a share of its value, and its number format."""

    tolerance: float = TOLERANCE
    number_format: NumberFormat = "float32"


@dataclass(frozen=True)
class Compiled:
    """Tables by file name, each (3, knots), and the scalars that go with them.

    The tables are float32 as a kernel evaluates them (float64 where that was asked for, for
    comparison alone). ``rows`` say of those stored in int16 how; ``choices``, by table, how fine
    each was asked for.
    """

    arrays: dict[str, NDArray[Any]]
    mechanics: Mechanics
    rows: dict[str, Rows] = field(default_factory=dict)
    choices: dict[str, TableChoice] = field(default_factory=dict)


def scene_ranges(recipe: Recipe) -> Ranges:
    """The ranges of a recipe's scene, in SI."""
    scene = recipe.scene
    return Ranges(
        opening_rad=scene.opening_rad,
        opening_rate_rad_per_s=scene.opening_rate_rad_per_s,
        contact_m=scene.contact_m,
    )


def compile_model(
    model: ExactModel,
    recipe: Recipe,
    *,
    tolerance: float = TOLERANCE,
    number_format: NumberFormat = "float32",
) -> Compiled:
    """Compile edge, response, ripple and friction to tables over what the scene can reach.

    ``tolerance`` is each table's, as a share of its value. Raises InputError where the scene
    never touches the material, where friction would drive the motion, or where a law cannot be
    held by a table.
    """
    laws = table_laws(model, recipe)
    choice = TableChoice(tolerance, number_format)
    return _compile_tables(laws, scene_mechanics(model, recipe), dict.fromkeys(laws, choice))


def _compile_tables(
    laws: Mapping[str, TableLaw], mechanics: Mechanics, choices: Mapping[str, TableChoice]
) -> Compiled:
    """Make a table of each law as chosen for it. Raises InputError as `compile_model` does."""
    arrays: dict[str, NDArray[Any]] = {}
    rows: dict[str, Rows] = {}
    for name, law in laws.items():
        fitted = table_of_law(name, law, choices[name])
        file = table_file(name)
        exact = choices[name].number_format == "float64"
        arrays[file] = fitted.array if exact else fitted.array.astype(np.float32)
        if fitted.rows:
            rows[file] = fitted.rows
    return Compiled(arrays, mechanics, rows, dict(choices))


def table_of_law(name: str, law: TableLaw, choice: TableChoice) -> Fitted:
    """One table; InputError where the law cannot be held by any."""
    try:
        return fit_table(law, tolerance=choice.tolerance, number_format=choice.number_format)
    except ValueError as error:
        raise InputError(
            f"The fitted {name.replace('_', ' ')} cannot be made into a table: {error}. "
            "Narrow the scene's ranges in the recipe to what was captured, or fit again."
        ) from error


def table_file(name: str) -> str:
    """The file of a table in a package."""
    return f"tables/{name}.npy"


def table_laws(model: ExactModel, recipe: Recipe) -> dict[str, TableLaw]:
    """The laws that become tables, by name, over what the scene can reach.

    Raises InputError where the scene never touches the material, or friction would drive it.
    """
    points = spread_points(scene_ranges(recipe), SCOUTS)
    reach = _reach(model, points, recipe.limits.torque_Nm)
    if recipe.plate.layers:
        hardest, limit = hardest_layer(model, recipe)
        deepest = _reach(hardest, points, limit).indentation
        reach = replace(reach, indentation=max(reach.indentation, deepest))
    cutting = model.cutting
    edge, response = cutting.edge, cutting.response
    functions = law_functions(model)
    laws = {
        "edge": TableLaw(
            *functions["edge"],
            reach.lowest_station,
            reach.highest_station,
            curvature=partial(edge_curvature, edge),
            breaks=edge_breaks(edge),
        ),
        "response": TableLaw(
            *functions["response"],
            0.0,
            reach.indentation,
            monotone=True,
            scale=reach.force_N,
            curvature=partial(response_curvature, response),
            breaks=response_breaks(response),
        ),
    }
    if model.friction is not None:
        laws |= {n: TableLaw(**a) for n, a in friction_tables(model.friction, recipe).items()}
    if cutting.fracture_energy is not None and float(cutting.kappa) < 1.0:
        laws["mean_energy"] = TableLaw(**_mean_energy_law(model, recipe))
    return laws


def law_functions(model: ExactModel) -> dict[str, tuple[Function, Function]]:
    """The laws of a model and their derivatives, by the table that holds each."""
    cutting = model.cutting
    functions: dict[str, tuple[Function, Function]] = {
        "edge": (cutting.edge.offset_at, cutting.edge.slope_at),
        "response": (cutting.response.force_at, cutting.response.stiffness_at),
    }
    return functions | (friction_functions(model.friction) if model.friction else {})


def scene_mechanics(model: ExactModel, recipe: Recipe) -> Mechanics:
    """The scalars that the kernel needs besides the tables."""
    cutting, scene = model.cutting, recipe.scene
    fracture = friction = None
    if cutting.fracture_energy is not None:
        fracture = Fracture(
            energy_J_per_m=float(cutting.fracture_energy), kappa=float(cutting.kappa)
        )
    if model.friction is not None:
        slowest = scene.opening_rate_rad_per_s[0]
        friction = Friction(rate_eps_rad_per_s=max(SLOWEST_EPS, slowest))
    return Mechanics(
        moving_blades=2 if cutting.moving_blades == 2 else 1,
        upper_face_m=cutting.upper_face_m,
        handle_radius_m=recipe.rig.handle_radius_mm * 1e-3,
        tip_station_m=cutting.edge.length_m,
        closure=cutting.closure,
        rate_damping_s_per_m=float(cutting.rate_damping),
        loop_rate_Hz=scene.loop_rate_Hz,
        render=scene.render,
        fracture=fracture,
        friction=friction,
    )


def kernel_tables(
    mechanics: Mechanics,
    ranges: Ranges,
    arrays: Arrays,
    *,
    mean_energy: float | None = None,
) -> ModelTables:
    """What the kernel evaluates, from a package's parts.

    As the loop renders it the crack runs from the energy that starts it to kappa times that. With
    ``mean_energy`` (J/m) it is smooth and costs that much, see average.py. Raises ValueError where
    the parts make no model.
    """
    fracture, friction = mechanics.fracture, mechanics.friction
    energy, kappa = 0.0, 1.0
    if mean_energy is not None:
        energy = mean_energy
    elif fracture is not None:
        energy, kappa = fracture.energy_J_per_m, fracture.kappa

    def table(name: str) -> Table:
        array = arrays.get(table_file(name))
        return _NOTHING if array is None else table_of(array)

    return ModelTables(
        edge=table("edge"),
        response=table("response"),
        friction_opening=table("friction_opening"),
        friction_closing=table("friction_closing"),
        friction_angle=table("friction_angle"),
        moving_blades=mechanics.moving_blades,
        upper_face=mechanics.upper_face_m,
        fracture_energy=energy,
        kappa=kappa,
        closure=mechanics.closure,
        rate_damping=mechanics.rate_damping_s_per_m,
        render_friction=friction is not None,
        friction_rate_eps=friction.rate_eps_rad_per_s if friction else SLOWEST_EPS,
        handle_radius=mechanics.handle_radius_m,
        tip_station=mechanics.tip_station_m,
        opening_min=ranges.opening_rad[0],
        opening_max=ranges.opening_rad[1],
        contact_min=ranges.contact_m[0],
        contact_max=ranges.contact_m[1],
    )


def table_of(array: NDArray[Any]) -> Table:
    """A kernel's table from a package's array; ValueError unless its rows are x, y and slope."""
    if len(array) != 3:
        raise ValueError(f"a table has three rows, x, y and slope, not {len(array)}")
    return Table(*array)


_NOTHING = Table(*np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], dtype=np.float32))
"""The friction table of a package without friction."""


@dataclass(frozen=True)
class _Reach:
    """How much of the edge and of the response a scene uses.

    Stations and indentation in metres; ``force_N`` makes the scene's largest torque at its longest
    lever, and so sets the scale of relevant forces.
    """

    lowest_station: float
    highest_station: float
    indentation: float
    force_N: float


def _reach(model: ExactModel, points: Points, limit: float) -> _Reach:
    """Stations and indentations between which the scene moves.

    Where the crack stands still and the torque exceeds its limit, the response need not be known,
    as the limit is what is rendered: the kernel goes on as a straight line from there. Where the
    crack has run, the response decides how far, and whether past the blade's tip: there it is
    needed whatever the torque.
    """
    peaks = ExactModel(replace(model.cutting, kappa=1.0), None)
    cutting = peaks.cutting
    edge = cutting.edge
    beta = peaks.blade_angle(points.opening)
    place = peaks.settled(points.opening, points.contact)
    view = edge_height(edge, place, beta)
    station = np.minimum(view.station, edge.length_m)
    height = station * np.sin(beta) + edge.offset_at(station) * np.cos(beta)
    ran = place > points.contact
    _refuse_leaning(points, view.height)
    indentation = np.where(ran | (view.station < edge.length_m), cutting.upper_face_m - height, 0.0)
    touching = indentation > 0
    if not np.any(touching):
        raise InputError(NOTHING_TOUCHED)
    lever = np.abs(view.lever)
    if cutting.closure == "eq4":
        lever = np.abs(place) / np.sqrt(1.0 + edge.slope_at(station) ** 2)
    felt = lever * damped(cutting, view, np.ones_like(lever), points.opening_rate)
    enough = BEYOND_LIMIT * limit / np.maximum(felt, BEYOND_LIMIT * limit / STRONGEST_N)
    enough = np.where(ran, STRONGEST_N, enough)
    needed = np.minimum(indentation, cutting.response.indentation_at(enough))
    torque = np.minimum(peaks.torque(points.opening, points.opening_rate, points.contact), limit)
    within = view.station < edge.length_m
    room = (MARGIN - 1.0) * edge.length_m
    return _Reach(
        lowest_station=min(0.0, float(np.min(view.station, where=within, initial=0.0)) - room),
        highest_station=edge.length_m + room,
        indentation=MARGIN * float(np.max(needed[touching])),
        force_N=max(float(np.max(torque)), LEAST_TORQUE_Nm) / float(np.max(lever[touching])),
    )


def _refuse_leaning(points: Points, height: Array) -> None:
    """Refuse a scene in which, somewhere, no edge stands over the contact."""
    wrong = np.flatnonzero(np.isnan(height))
    if len(wrong):
        first = wrong[int(np.argmin(points.opening[wrong]))]
        raise InputError(
            f"At an opening of {np.degrees(points.opening[first]):.0f} degrees no single point of "
            f"the edge stands over a contact of {points.contact[first] * 1e3:.1f} mm, because the "
            "edge is upright or leans back there: narrow scene.opening_deg in the recipe, or check "
            "rig.edge."
        )


def mean_energy(model: ExactModel, opening: Array) -> Array:
    """Mean energy of the crack over its ripple at openings (n,) in rad: J/m.

    Its share of the energy that starts the crack depends on the peak force there (not at all for
    a power law), and that on how the edge is inclined where the crack settles.
    """
    cutting = model.cutting
    energy = float(cutting.fracture_energy or 0.0)
    place = settled_contact(cutting, opening)
    cuts = np.isfinite(place)
    view = edge_height(cutting.edge, np.where(cuts, place, 0.0), opening / cutting.moving_blades)
    slope = np.where(cuts, np.maximum(view.slope, LEAST_SLOPE), LEAST_SLOPE)
    peak = energy / (cutting.moving_blades * slope)
    return np.broadcast_to(energy * mean_share(cutting, peak), peak.shape)


def _mean_energy_law(model: ExactModel, recipe: Recipe) -> dict[str, Any]:
    """What becomes the table of the mean energy."""
    law = partial(mean_energy, model)

    def derivative(opening: Array) -> Array:
        return (law(opening + STEP_rad) - law(opening - STEP_rad)) / (2.0 * STEP_rad)

    low, high = recipe.scene.opening_rad
    constant = model.cutting.response.family == "power"
    curvature = partial(cubic_curvature, np.zeros_like) if constant else None
    return {
        "law": law,
        "derivative": derivative,
        "low": low,
        "high": high,
        "curvature": curvature,
    }
