"""The model's step in plain Python and float64, written apart from the C core.

It takes the same tables and follows the same definitions by other means: Hermite basis functions,
Newton steps on the edge without a bracket, the crack's run located by scanning, secants and
bisection. It is the truth behind the golden vectors and the plain Python that the kernel's speed is
compared with.
"""

import bisect
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from scissorcal.kernel import ModelTables

CAP = 1e6
PARALLEL = 1e-6
SHORTEST_RUN = 1e-7


class Curve:
    """A cubic Hermite table on floats: value, derivative, integral, straight beyond its ends."""

    def __init__(self, table: Any) -> None:
        self.x = [float(v) for v in table.x]
        self.y = [float(v) for v in table.y]
        self.d = [float(v) for v in table.slope]
        self.areas = [0.0]
        for i in range(len(self.x) - 1):
            w = self.x[i + 1] - self.x[i]
            mean = 0.5 * (self.y[i] + self.y[i + 1]) + w * (self.d[i] - self.d[i + 1]) / 12.0
            self.areas.append(self.areas[-1] + w * mean)

    def at(self, x: float) -> tuple[float, float]:
        xs = self.x
        if x <= xs[0]:
            return self.y[0] + self.d[0] * (x - xs[0]), self.d[0]
        if x >= xs[-1]:
            return self.y[-1] + self.d[-1] * (x - xs[-1]), self.d[-1]
        i = bisect.bisect_right(xs, x) - 1
        w = xs[i + 1] - xs[i]
        t = (x - xs[i]) / w
        u = 1.0 - t
        y0, y1, d0, d1 = self.y[i], self.y[i + 1], self.d[i], self.d[i + 1]
        value = y0 * u * u * (1 + 2 * t) + y1 * t * t * (3 - 2 * t) + w * t * u * (d0 * u - d1 * t)
        grade = 6 * t * u * (y1 - y0) / w + d0 * u * (1 - 3 * t) + d1 * t * (3 * t - 2)
        return value, grade

    def held(self, x: float) -> float:
        return self.at(min(max(x, self.x[0]), self.x[-1]))[0]

    def area(self, x: float) -> float:
        """Integral from the first knot; two-point Gauss is exact for a cubic."""
        xs = self.x
        i = min(max(bisect.bisect_right(xs, x) - 1, 0), len(xs) - 1)
        low = xs[i] if x >= xs[0] else xs[0]
        half, middle = 0.5 * (x - low), 0.5 * (x + low)
        spread = half / math.sqrt(3.0)
        return self.areas[i] + half * (self.at(middle - spread)[0] + self.at(middle + spread)[0])


class Place(NamedTuple):
    station: float
    x: float
    y: float
    slope: float
    taper: float


@dataclass
class Reference:
    """A model with a crack in it; :meth:`step` gives a dict with the kernel's field names."""

    tables: ModelTables
    crack: float = 0.0

    def __post_init__(self) -> None:
        t = self.tables
        self.edge, self.response = Curve(t.edge), Curve(t.response)
        self.f_open, self.f_close = Curve(t.friction_opening), Curve(t.friction_closing)
        self.f_angle = Curve(t.friction_angle)
        self.m = t.moving_blades
        self.detached = False

    def place(self, s: float, sine: float, cosine: float) -> Place:
        e, taper = self.edge.at(s)
        run = cosine - taper * sine
        return Place(
            s,
            s * cosine - e * sine,
            s * sine + e * cosine,
            (sine + taper * cosine) / run,
            taper,
        )

    def over(self, x: float, sine: float, cosine: float) -> Place:
        s = x
        for _ in range(100):
            place = self.place(s, sine, cosine)
            move = (place.x - x) / (cosine - place.taper * sine)
            s -= move
            if abs(move) < 1e-13 * (abs(s) + 1e-3):
                break
        return self.place(s, sine, cosine)

    def force(self, indentation: float) -> float:
        if indentation <= 0:
            return 0.0
        return min(max(self.response.at(indentation)[0], 0.0), CAP)

    def stored(self, indentation: float) -> float:
        return self.m * self.response.area(indentation) if indentation > 0 else 0.0

    def release(self, place: Place) -> float:
        if place.slope <= PARALLEL:
            return 0.0
        return self.m * self.force(self.tables.upper_face - place.y) * place.slope

    def run_out(self, target: float, start: Place, sine: float, cosine: float) -> Place | None:
        """First place outwards that releases no more than target; None if the tip comes first."""
        if self.release(start) <= target:
            return start
        low, tip = start.station, self.tables.tip_station
        stops = [k for k in self.edge.x if k > low]
        rise = sine + self.edge.d[-1] * cosine
        if rise > 0:
            end = self.place(self.edge.x[-1], sine, cosine)
            stops.append(max(end.station + (self.tables.upper_face - end.y) / rise, low) + 1e-12)
        for stop in stops:
            high = min(stop, tip)
            if self.release(self.place(high, sine, cosine)) <= target:
                return self._between(target, low, high, sine, cosine)
            if high >= tip:
                return None
            low = high
        return self.place(low, sine, cosine)

    def _between(self, target: float, low: float, high: float, sine: float, cosine: float) -> Place:
        """Where the release falls to target: secants through the bracket, else its middle."""
        over = self.release(self.place(low, sine, cosine)) - target
        under = self.release(self.place(high, sine, cosine)) - target
        while high - low > 1e-13:
            width = high - low
            for tried in (low + width * over / (over - under), 0.5 * (low + high)):
                station = min(max(tried, low + 0.4e-13), high - 0.4e-13)
                if not low < station < high:
                    continue
                excess = self.release(self.place(station, sine, cosine)) - target
                if excess > 0:
                    low, over = station, excess
                else:
                    high, under = station, excess
                if high - low < 0.1 * width:
                    break
        return self.place(high, sine, cosine)

    def friction(self, opening: float, rate: float) -> float:
        t = self.tables
        eps = t.friction_rate_eps
        table = self.f_open if rate > 0 else self.f_close
        level = table.held(max(abs(rate), eps)) * min(abs(rate) / eps, 1.0)
        return math.copysign(level * self.f_angle.held(opening), rate)

    def torque(self, place: Place, rate: float) -> tuple[float, float]:
        """Torque and force along the cut from the response at a place."""
        g = self.force(self.tables.upper_face - place.y)
        lever = place.x + place.y * place.slope
        g *= max(1.0 - self.tables.rate_damping * lever * rate / self.m, 0.0)
        arm = place.x / math.hypot(1.0, place.taper) if self.tables.closure == "eq4" else lever
        return g * arm, -self.m * g * place.slope

    def settled_torque(self, opening: float, rate: float, contact: float) -> float:
        sine, cosine = math.sin(opening / self.m), math.cos(opening / self.m)
        place: Place | None = self.over(contact, sine, cosine)
        assert place is not None
        if place.station >= self.tables.tip_station:
            place = None
        elif self.tables.fracture_energy > 0:
            place = self.run_out(self.tables.fracture_energy, place, sine, cosine)
        torque = 0.0 if place is None else self.torque(place, rate)[0]
        return torque - (self.friction(opening, rate) if self.tables.render_friction else 0.0)

    def step(self, opening: float, rate: float, advance: float) -> dict[str, float]:
        t = self.tables
        sine, cosine = math.sin(opening / self.m), math.cos(opening / self.m)
        place = self.over(self.crack - advance, sine, cosine)
        book = {"fracture_J": 0.0, "arrest_J": 0.0}
        depth = t.upper_face - place.y
        if place.station >= t.tip_station:
            if not self.detached:
                book["arrest_J"] = self.stored(depth)
            self.detached = True
        elif self.detached and depth <= 0:
            self.detached = False
        elif not self.detached and 0 < t.fracture_energy < self.release(place):
            place = self._fracture(place, advance, sine, cosine, book)
        touching = not self.detached and t.upper_face - place.y > 0
        torque, force = self.torque(place, rate) if touching else (0.0, 0.0)
        friction = -self.friction(opening, rate) if t.render_friction else 0.0
        indentation = t.upper_face - place.y
        return book | {
            "torque": torque + friction,
            "force": force,
            "contact": place.x,
            "indentation": indentation,
            "height": place.y,
            "response": self.force(indentation) if touching else 0.0,
            "friction_torque": friction,
            "stored_J": self.stored(indentation) if touching else 0.0,
        }

    def _fracture(
        self, place: Place, advance: float, sine: float, cosine: float, book: dict[str, float]
    ) -> Place:
        t = self.tables
        contact, depth = place.x, t.upper_face - place.y
        start = self.run_out(t.fracture_energy, place, sine, cosine)
        if start is None:
            tip = self.place(t.tip_station, sine, cosine)
            book["fracture_J"] = self._advance_to(advance + tip.x) * t.kappa * t.fracture_energy
            book["arrest_J"] = self.stored(depth)
            self.detached = True
            return tip
        stop = self.run_out(t.kappa * t.fracture_energy, start, sine, cosine)
        stop = self.place(t.tip_station, sine, cosine) if stop is None else stop
        length = stop.x - start.x
        if length <= SHORTEST_RUN:
            book["fracture_J"] = self._advance_to(advance + start.x) * t.fracture_energy
            return start
        runs = math.ceil((start.x - contact) / length)
        taken = t.kappa * t.fracture_energy * length
        released = self.stored(t.upper_face - start.y) - self.stored(t.upper_face - stop.y)
        moved = self._advance_to(advance + contact + runs * length)
        book["fracture_J"] = moved * taken / length
        book["arrest_J"] = runs * max(released - taken, 0.0)
        return self.over(contact + runs * length, sine, cosine)

    def _advance_to(self, crack: float) -> float:
        moved = max(crack - self.crack, 0.0)
        self.crack += moved
        return moved
