"""A blade on a plate anywhere, in float64, built from points in the rig's frame.

Written apart from the C core: no blade is turned into the plate's frame. The plate's face is a
line of points, the blade's edge a curve of points, and the indentation their distance along the
face's normal at the crack, by secants along the blade. Torque, force and pulls are central
differences of the stored energy, and the crack runs to where its difference along the plate has
fallen to what the material takes.
"""

import math
from dataclasses import dataclass

from scissorcal.kernel import ModelTables, Section
from tests.kernel.reference_model import Curve

STEP = 1e-6
"""Of central differences, rad and m."""


@dataclass
class Placed:
    """The rig's state and the plate's section."""

    opening: float
    advance: float
    edge_x: float
    edge_y: float
    pitch: float
    stretch: float
    thickening: float

    @classmethod
    def of(cls, section: Section, opening: float, advance: float) -> "Placed":
        numbers = (section.edge_x, section.edge_y, section.pitch)
        return cls(opening, advance, *numbers, section.stretch, section.thickening)

    def moved(self, name: str, by: float) -> "Placed":
        changed = dict(vars(self))
        changed[name] += by
        return Placed(**changed)


class ReferencePlate:
    """A plate with a crack, ``crack`` metres from its near edge along its own cut."""

    def __init__(self, tables: ModelTables, crack: float = 0.0) -> None:
        self.tables, self.crack = tables, crack
        self.m = tables.moving_blades
        self._edge, self._response = Curve(tables.edge), Curve(tables.response)
        self._friction = [Curve(t) for t in (tables.friction_opening, tables.friction_closing)]
        self._angle = Curve(tables.friction_angle)

    def depth(self, at: Placed, crack: float) -> float:
        """How far the edge stands inside the face at a crack, along the face's normal (m)."""
        tip_x = at.edge_x + at.stretch * crack * math.cos(at.pitch)
        tip_y = at.edge_y + at.stretch * crack * math.sin(at.pitch)
        turn = at.opening / self.m

        def seen(station: float) -> tuple[float, float]:
            """Of the blade's point from the tip: along the face, and into it."""
            offset = self._edge.at(station)[0]
            x = at.advance + station * math.cos(turn) - offset * math.sin(turn) - tip_x
            y = station * math.sin(turn) + offset * math.cos(turn) - tip_y
            along = x * math.cos(at.pitch) + y * math.sin(at.pitch)
            return along, x * math.sin(at.pitch) - y * math.cos(at.pitch)

        before, station = 0.0, 0.05
        place = seen(before)[0]
        for _ in range(60):
            along, inside = seen(station)
            if abs(along) < 1e-16 or along == place:
                return inside
            before, station = station, station - along * (station - before) / (along - place)
            place = along
        raise ArithmeticError("the edge has no point over the crack")

    def energy(self, at: Placed, crack: float) -> float:
        """Stored in all edges (J)."""
        depth = self.depth(at, crack)
        return self.m * self._response.area(depth) if depth > 0.0 else 0.0

    def slope(self, at: Placed, crack: float, name: str) -> float:
        """Central difference of the energy by a number of the state, or by the crack."""
        if name == "crack":
            up, down = self.energy(at, crack + STEP), self.energy(at, crack - STEP)
        else:
            up = self.energy(at.moved(name, STEP), crack)
            down = self.energy(at.moved(name, -STEP), crack)
        return (up - down) / (2.0 * STEP)

    def release(self, at: Placed, crack: float) -> float:
        """Energy that a metre of section releases (N)."""
        return -self.slope(at, crack, "crack") / at.stretch

    def run_out(self, at: Placed, crack: float, target: float) -> float:
        """The next crack at which the release is no more than ``target``."""
        if self.release(at, crack) <= target:
            return crack
        low, step = crack, 1e-5
        while self.release(at, low + step) > target:
            low += step
        high = low + step
        while high - low > 1e-13:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.release(at, middle) > target else (low, middle)
        return high

    def step(self, at: Placed, rate: float) -> dict[str, float]:
        """As the kernel's step: torque and force, energies, pulls, and the crack moves on."""
        t = self.tables
        energy = t.fracture_energy * at.thickening
        fracture = arrest = 0.0
        if 0.0 < energy < self.release(at, self.crack):
            start = self.run_out(at, self.crack, energy)
            new, taken = start, energy
            if t.kappa < 1.0:
                stop = self.run_out(at, start, t.kappa * energy)
                runs = math.ceil((start - self.crack) / (stop - start))
                new, taken = self.crack + runs * (stop - start), t.kappa * energy
                lost = self.energy(at, start) - self.energy(at, stop)
                arrest = runs * max(lost - taken * at.stretch * (stop - start), 0.0)
            fracture = taken * at.stretch * (new - self.crack)
            self.crack = new
        by = {name: self.slope(at, self.crack, name) for name in ("opening", "advance")}
        pull = {
            name: self.slope(at, self.crack, name)
            for name in ("edge_x", "edge_y", "pitch", "stretch")
        }
        up = self.depth(at.moved("opening", STEP), self.crack)
        down = self.depth(at.moved("opening", -STEP), self.crack)
        deepening = (up - down) / (2.0 * STEP) * rate
        damped = max(1.0 + t.rate_damping * deepening, 0.0)
        friction = self.friction(at.opening, rate) if t.render_friction else 0.0
        return {
            "torque": -damped * by["opening"] - friction,
            "force": -damped * by["advance"],
            "stored_J": self.energy(at, self.crack),
            "fracture_J": fracture,
            "arrest_J": arrest,
            **{f"pull_{name}": value for name, value in pull.items()},
            "crack": self.crack,
        }

    def friction(self, opening: float, rate: float) -> float:
        eps = self.tables.friction_rate_eps
        level = self._friction[0 if rate > 0 else 1].held(max(abs(rate), eps))
        level *= min(abs(rate) / eps, 1.0) * self._angle.held(opening)
        return math.copysign(level, rate)


PLATE_COLUMNS = (
    "torque",
    "force",
    "stored_J",
    "fracture_J",
    "arrest_J",
    "pull_edge_x",
    "pull_edge_y",
    "pull_pitch",
    "pull_stretch",
    "crack",
)
