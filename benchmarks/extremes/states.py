"""States of all laws: values for every quantity of the physics, and the tables that they make."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from benchmarks.extremes.quantities import QUANTITIES
from numpy.typing import NDArray

from scissorcal.bench.extremes.states import State
from scissorcal.kernel import ModelTables, Table
from scissorcal.model import Cutting, Edge, Response
from scissorcal.package.tables import TableLaw, fit_table

REFERENCE_m = 3e-4
"""Indentation at which the quantity ``force`` holds: that of the recipes for paper."""

SWEPT = (
    "opening", "opening_rate", "contact", "indentation", "thickness", "force", "exponent",
    "toughness", "kappa", "edge_offset", "taper", "curvature", "nick", "rate_damping",
    "blade_length", "table_size",
)  # fmt: skip
"""Quantities of the physics, each of which is swept."""

NICK_PIECES = 60
"""Intervals of the spline whose one weight is a nick: a nick is 4 of them wide."""

TABLE_TOLERANCE = 1e-4
STRONGEST_N = 1e5
"""As in `package.compile`: no response is tabulated beyond."""

Band = Literal["everyday", "extreme"]


def made_state(
    values: Mapping[str, float],
    *,
    band: Band = "everyday",
    swept: tuple[str, ...] = (),
    moving: int = 2,
    closure: Literal["work", "eq4"] = "work",
    family: Literal["power", "exponential"] = "power",
    cut: bool = True,
    by_depth: bool = False,
) -> State:
    """A state of a value for each quantity of :data:`SWEPT`, and the discrete choices.

    All numbers that a kernel holds are float32 numbers. ``by_depth``: the contact is where the
    indentation has its value, else it is ``contact``.
    """
    opening = float(min(np.float32(values["opening"]), np.float32(3.1415925)))
    energy = float(np.float32(values["toughness"] * values["thickness"]))
    cutting = Cutting(
        _edge(values),
        Response(family, values["force"], values["exponent"], REFERENCE_m),
        moving,
        float(np.float32(values["thickness"] / moving)),
        energy if cut else None,
        float(np.float32(values["kappa"])),
        closure,
        float(np.float32(values["rate_damping"])),
    )
    contact = values["contact"] * values["blade_length"]
    if by_depth:
        contact = _contact_at_depth(values, cutting, opening)
    rate = float(np.float32(values["opening_rate"]))
    return State(band, swept, values, opening, rate, float(np.float32(contact)), cutting)


def fitted_tables(state: State, deepest: float) -> tuple[ModelTables, bool]:
    """The kernel's tables for indentations up to ``deepest`` (m), and whether they are close.

    Close: every table kept its tolerance with the knots that it may have. ValueError, with a
    sentence, where a law cannot be a table.
    """
    size, cutting = int(state.values["table_size"]), state.cutting
    length, response = state.values["blade_length"], cutting.response
    strongest = float(response.indentation_at(STRONGEST_N))
    edge = fit_table(
        TableLaw(cutting.edge.offset_at, cutting.edge.slope_at, 0.0, 1.05 * length),
        tolerance=TABLE_TOLERANCE, largest=size,
    )  # fmt: skip
    force = fit_table(
        TableLaw(
            response.force_at, response.stiffness_at, 0.0, min(1.05 * deepest, strongest),
            monotone=True,
        ),
        tolerance=TABLE_TOLERANCE, largest=size,
    )  # fmt: skip
    nothing = Table(*np.array([[0, 1], [0, 0], [0, 0]], dtype=np.float32))
    tables = ModelTables(
        edge=edge.table,
        response=force.table,
        friction_opening=nothing,
        friction_closing=nothing,
        friction_angle=nothing,
        moving_blades=cutting.moving_blades,
        upper_face=cutting.upper_face_m,
        fracture_energy=float(cutting.fracture_energy or 0.0),
        kappa=float(cutting.kappa),
        closure=cutting.closure,
        rate_damping=float(cutting.rate_damping),
        render_friction=False,
        friction_rate_eps=0.01,
        handle_radius=0.06,
        opening_min=0.0,
        opening_max=np.pi,
        contact_min=-1e3,
        contact_max=1e3,
        tip_station=length,
    )
    return tables, edge.met and force.met


def everyday_state(rng: np.random.Generator) -> State:
    """A state whose quantities all lie in their everyday ranges."""
    return _state("everyday", (), {}, rng)


def one_at_a_time(name: str, count: int, repeats: int, rng: np.random.Generator) -> list[State]:
    """``count`` values of one quantity over its extreme range, ``repeats`` everyday states each."""
    return [
        _state("extreme", (name,), {name: float(value)}, rng)
        for value in QUANTITIES[name].values(count)
        for _ in range(repeats)
    ]


def in_pair(first: str, second: str, count: int, rng: np.random.Generator) -> list[State]:
    """A grid of ``count`` by ``count`` values of two quantities over their extreme ranges."""
    return [
        _state("extreme", (first, second), {first: float(a), second: float(b)}, rng)
        for a in QUANTITIES[first].values(count)
        for b in QUANTITIES[second].values(count)
    ]


def random_state(rng: np.random.Generator) -> State:
    """A state whose quantities are all drawn from their extreme ranges."""
    drawn = {name: QUANTITIES[name].draw(rng, extreme=True) for name in SWEPT}
    return _state("extreme", (), drawn, rng)


def _edge(values: Mapping[str, float]) -> Edge:
    """The edge as the model takes it; a nick makes it a spline of one weight."""
    fields: dict[str, Any] = {
        "offset_m": values["edge_offset"],
        "taper_rad": values["taper"],
        "length_m": values["blade_length"],
        "curvature_per_m": values["curvature"],
    }
    if not values["nick"]:
        return Edge("arc" if values["curvature"] else "line", **fields)
    weights = [0.0] * (NICK_PIECES + 3)
    weights[NICK_PIECES // 2] = 1.5 * values["nick"]
    return Edge("spline", **fields, spline_m=tuple(weights))


def _contact_at_depth(values: Mapping[str, float], cutting: Cutting, opening: float) -> float:
    beta, edge, length = opening / cutting.moving_blades, cutting.edge, values["blade_length"]
    s = 0.5 * length
    for _ in range(60):
        rise = np.sin(beta) + float(edge.slope_at(s)) * np.cos(beta)
        height = s * np.sin(beta) + float(edge.offset_at(s)) * np.cos(beta)
        step = (cutting.upper_face_m - values["indentation"] - height) / rise if rise else 0.0
        s = float(np.clip(s + step, -10 * length, 10 * length))
    return float(s * np.cos(beta) - float(edge.offset_at(s)) * np.sin(beta))


def _state(
    band: Band, swept: tuple[str, ...], given: Mapping[str, float], rng: np.random.Generator
) -> State:
    values = {name: QUANTITIES[name].draw(rng, extreme=False) for name in SWEPT} | dict(given)
    choices: NDArray[np.int64] = rng.integers(0, 4, 5)
    return made_state(
        values,
        band=band,
        swept=swept,
        moving=1 if choices[0] < 2 else 2,
        closure="work" if choices[1] < 3 else "eq4",
        family="power" if choices[2] < 2 else "exponential",
        cut=bool(choices[3] < 3),
        by_depth="contact" not in swept and bool("indentation" in swept or choices[4] >= 2),
    )
