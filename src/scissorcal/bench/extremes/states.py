"""States that are tried: values for every quantity of the physics, and the laws they make."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.bench.extremes import exact_laws as exact
from scissorcal.bench.extremes.exact_blade import Blade
from scissorcal.bench.extremes.exact_laws import mp
from scissorcal.bench.extremes.quantities import QUANTITIES
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

Plan = Literal["one", "pair", "random", "everyday"]


@dataclass(frozen=True)
class State:
    """One state: a value for each quantity of :data:`SWEPT`, and the discrete choices.

    ``plan`` says how it was chosen and ``swept`` which quantities were moved on purpose. Where
    ``by_depth`` is true the contact is where the indentation has its value, else it is ``contact``.
    """

    plan: Plan
    swept: tuple[str, ...]
    values: Mapping[str, float]
    moving: int
    closure: Literal["work", "eq4"]
    family: Literal["power", "exponential"]
    cut: bool
    by_depth: bool

    @property
    def contact_m(self) -> float:
        """Place of the crack tip from the pivot, a float32 number."""
        v = self.values
        if not self.by_depth:
            return float(np.float32(v["contact"] * v["blade_length"]))
        beta = self.opening / self.moving
        edge = self.edge
        s = 0.5 * v["blade_length"]
        for _ in range(60):
            rise = np.sin(beta) + float(edge.slope_at(s)) * np.cos(beta)
            height = s * np.sin(beta) + float(edge.offset_at(s)) * np.cos(beta)
            step = (self.upper_face_m - v["indentation"] - height) / rise if rise else 0.0
            s = float(np.clip(s + step, -10 * v["blade_length"], 10 * v["blade_length"]))
        return float(np.float32(s * np.cos(beta) - float(edge.offset_at(s)) * np.sin(beta)))

    @property
    def opening(self) -> float:
        """Opening (rad), a float32 number not above pi."""
        return float(min(np.float32(self.values["opening"]), np.float32(3.1415925)))

    @property
    def rate(self) -> float:
        """Opening rate (rad/s), a float32 number."""
        return float(np.float32(self.values["opening_rate"]))

    @property
    def upper_face_m(self) -> float:
        """y_top, a float32 number: h for one moving blade, h / 2 for two."""
        return float(np.float32(self.values["thickness"] / self.moving))

    @property
    def fracture_energy(self) -> float:
        """J_c h, a float32 number; 0 where nothing is cut."""
        if not self.cut:
            return 0.0
        return float(np.float32(self.values["toughness"] * self.values["thickness"]))

    @property
    def kappa(self) -> float:
        """Share of the fracture energy at which a crack stops, a float32 number."""
        return float(np.float32(self.values["kappa"]))

    @property
    def damping(self) -> float:
        """Rate damping (s/m), a float32 number."""
        return float(np.float32(self.values["rate_damping"]))

    @property
    def edge(self) -> Edge:
        """The edge as the model takes it; a nick makes it a spline of one weight."""
        v = self.values
        fields: dict[str, Any] = {
            "offset_m": v["edge_offset"],
            "taper_rad": v["taper"],
            "length_m": v["blade_length"],
            "curvature_per_m": v["curvature"],
        }
        if not v["nick"]:
            return Edge("arc" if v["curvature"] else "line", **fields)
        weights = [0.0] * (NICK_PIECES + 3)
        weights[NICK_PIECES // 2] = 1.5 * v["nick"]
        return Edge("spline", **fields, spline_m=tuple(weights))

    @property
    def cutting(self) -> Cutting:
        """The law as the float64 model takes it."""
        return Cutting(
            self.edge,
            Response(self.family, self.values["force"], self.values["exponent"], REFERENCE_m),
            self.moving,
            self.upper_face_m,
            self.fracture_energy if self.cut else None,
            self.kappa,
            self.closure,
            self.damping,
        )

    def exact_law(self, parallel: float) -> Blade:
        """The law in 50 digits."""
        v = {name: mp.mpf(value) for name, value in self.values.items()}
        bow = exact.Bow(v["edge_offset"], mp.tan(v["taper"]), v["curvature"])
        edge: exact.Curve = bow
        if v["nick"]:
            width = v["blade_length"] / NICK_PIECES
            first = width * (NICK_PIECES // 2 - 3)
            edge = exact.Nicked(bow, mp.mpf(1.5 * self.values["nick"]), first, width)
        kind = exact.Power if self.family == "power" else exact.Exponential
        response = kind(v["force"], v["exponent"], mp.mpf(REFERENCE_m))
        return self._blade(edge, response, parallel, v["blade_length"])

    def exact_tables(self, tables: ModelTables, cap: float, parallel: float) -> Blade:
        """The kernel's own tables in 50 digits."""
        edge = exact.TableCurve.of(tables.edge)
        response = exact.TableForce.of(tables.response, cap)
        tip = mp.mpf(float(np.float32(tables.tip_station)))
        return self._blade(edge, response, parallel, tip)

    def _blade(self, edge: exact.Curve, response: exact.Force, parallel: float, tip: Any) -> Blade:
        return Blade(
            edge,
            response,
            self.moving,
            mp.mpf(self.upper_face_m),
            mp.mpf(self.fracture_energy),
            mp.mpf(self.kappa),
            self.closure,
            mp.mpf(self.damping),
            tip,
            mp.mpf(parallel),
        )

    def tables(self, deepest: float) -> tuple[ModelTables, bool]:
        """The kernel's tables for indentations up to ``deepest`` (m), and whether they are close.

        Close: every table kept its tolerance with the knots that it may have. ValueError, with a
        sentence, where a law cannot be a table.
        """
        size, cutting = int(self.values["table_size"]), self.cutting
        length, response = self.values["blade_length"], cutting.response
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
            moving_blades=self.moving,
            upper_face=self.upper_face_m,
            fracture_energy=self.fracture_energy,
            kappa=self.kappa,
            closure=self.closure,
            rate_damping=self.damping,
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
        _state("one", (name,), {name: float(value)}, rng)
        for value in QUANTITIES[name].values(count)
        for _ in range(repeats)
    ]


def in_pair(first: str, second: str, count: int, rng: np.random.Generator) -> list[State]:
    """A grid of ``count`` by ``count`` values of two quantities over their extreme ranges."""
    return [
        _state("pair", (first, second), {first: float(a), second: float(b)}, rng)
        for a in QUANTITIES[first].values(count)
        for b in QUANTITIES[second].values(count)
    ]


def random_state(rng: np.random.Generator) -> State:
    """A state whose quantities are all drawn from their extreme ranges."""
    drawn = {name: QUANTITIES[name].draw(rng, extreme=True) for name in SWEPT}
    return _state("random", (), drawn, rng)


def _state(
    plan: Plan, swept: tuple[str, ...], given: Mapping[str, float], rng: np.random.Generator
) -> State:
    values = {name: QUANTITIES[name].draw(rng, extreme=False) for name in SWEPT} | dict(given)
    choices: NDArray[np.int64] = rng.integers(0, 4, 5)
    by_depth = "contact" not in swept and bool("indentation" in swept or choices[4] >= 2)
    return State(
        plan,
        swept,
        values,
        1 if choices[0] < 2 else 2,
        "work" if choices[1] < 3 else "eq4",
        "power" if choices[2] < 2 else "exponential",
        bool(choices[3] < 3),
        by_depth,
    )
