"""A plate between two moving blades that need not lie in their middle, in float64.

It shares no code with the kernel, whose two blades are symmetric. Each blade presses the plate
from its own side with its own indentation along the plate's normal; the plate gives way along that
normal against a support of ``support_N_per_m`` and stands where its energy is least; the crack runs
until the energy of both edges and the support, at that balance, no longer pays for it.
"""

import math
from dataclasses import dataclass

from scipy.optimize import brentq

from scissorcal.kernel import ModelTables
from tests.kernel.reference_model import Curve


@dataclass(frozen=True)
class Held:
    """The state: opening, pitch of the plate, and the middle of its near edge, from the pivot."""

    opening: float
    pitch: float
    edge_x: float
    edge_y: float


class TwoBlades:
    """Two blades and a plate of ``thickness_m``."""

    def __init__(self, tables: ModelTables, thickness_m: float, support_N_per_m: float) -> None:
        self.tables, self.thickness = tables, thickness_m
        self.support = support_N_per_m
        self._edge, self._response = Curve(tables.edge), Curve(tables.response)

    def depths(self, at: Held, crack: float, given: float) -> tuple[float, float]:
        """Indentations of upper and lower edge, of a plate that gave way by ``given`` (m)."""
        middle_x = at.edge_x + crack * math.cos(at.pitch) - given * math.sin(at.pitch)
        middle_y = at.edge_y + crack * math.sin(at.pitch) + given * math.cos(at.pitch)
        return tuple(self._inside(at, side, middle_x, middle_y) for side in (1.0, -1.0))  # type: ignore[return-value]

    def _inside(self, at: Held, side: float, middle_x: float, middle_y: float) -> float:
        """Seen from the plate's middle at the crack, the edge's place under this face."""
        turn = 0.5 * at.opening

        def seen(station: float) -> tuple[float, float]:
            offset = self._edge.at(station)[0]
            x = station * math.cos(turn) - offset * math.sin(turn) - middle_x
            y = side * (station * math.sin(turn) + offset * math.cos(turn)) - middle_y
            along = x * math.cos(at.pitch) + y * math.sin(at.pitch)
            return along, -x * math.sin(at.pitch) + y * math.cos(at.pitch)

        station = brentq(lambda s: seen(s)[0], -0.3, 0.5, xtol=1e-15, rtol=8.9e-16)
        return 0.5 * self.thickness - side * seen(station)[1]

    def energy(self, at: Held, crack: float, given: float) -> float:
        """Of both edges and the support."""
        pressed = sum(self._response.area(d) for d in self.depths(at, crack, given) if d > 0.0)
        return pressed + 0.5 * self.support * given**2

    def balance(self, at: Held, crack: float) -> float:
        """Where the plate stands: the forces of edges and support cancel."""

        def force(given: float) -> float:
            upper, lower = self.depths(at, crack, given)
            push = [self._response.at(d)[0] if d > 0.0 else 0.0 for d in (upper, lower)]
            return push[0] - push[1] + self.support * given

        return float(brentq(force, -0.03, 0.03, xtol=1e-13))

    def least(self, at: Held, crack: float) -> float:
        """Energy at the balance."""
        return self.energy(at, crack, self.balance(at, crack))

    def running_torque(self, at: Held) -> tuple[float, float]:
        """Torque and crack where it has run to: the release equals what the material takes."""
        step = 1e-6

        def excess(crack: float) -> float:
            fall = self.least(at, crack - step) - self.least(at, crack + step)
            return fall / (2.0 * step) - self.tables.fracture_energy

        inner = self._last_pressed(at)
        crack = float(brentq(excess, inner - 3e-3, inner, xtol=1e-12))
        up, down = (
            self.least(Held(at.opening + by, at.pitch, at.edge_x, at.edge_y), crack)
            for by in (step, -step)
        )
        return -(up - down) / (2.0 * step), crack

    def _last_pressed(self, at: Held) -> float:
        """The crack at which the plate just touches both edges."""

        def both(crack: float) -> float:
            return sum(self.depths(at, crack, 0.0))

        return float(brentq(both, -0.05, 0.4, xtol=1e-12))
