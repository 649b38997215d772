"""A blade in a sheet in 50 digits: where its edge stands, where a crack rests, torque and energy.

Written from the equations of docs/model.md, one place at a time. Where there is no answer (the edge
stands upright before it comes to lie over the contact) there is none here either.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from scissorcal.bench.extremes.exact_laws import Curve, Force, Number, mp, root, scouted

PARTS = 8
"""Places in each piece of a bent edge at which its release is looked at."""
DOUBLINGS = range(-3, 30)
"""Places are looked for within 2^29 blade lengths."""


@dataclass(frozen=True)
class Blade:
    """Everything that fixes a cut.

    ``toughness`` is J_c h, 0 where nothing is cut; ``parallel`` the slope up to which edges count
    as parallel, ``tip`` the station from which on there is no force.
    """

    edge: Curve
    response: Force
    moving: int
    upper_face: Number
    toughness: Number
    kappa: Number
    closure: str
    damping: Number
    tip: Number
    parallel: Number

    def turned(self, opening: Number, upper: Number = 0, toughness: Number = 0) -> "Turned":
        """The blade at an opening; ``upper`` is added to the face, ``toughness`` is a share."""
        law = replace(
            self,
            upper_face=self.upper_face + upper,
            toughness=self.toughness * (1 + toughness),
        )
        beta = opening / self.moving
        return Turned(law, mp.sin(beta), mp.cos(beta))


@dataclass(frozen=True)
class Spot:
    """A place of the edge in the material; ``stored`` is that of all moving blades."""

    station: Number
    x: Number
    y: Number
    rise: Number
    run: Number
    taper: Number
    depth: Number
    force: Number
    stored: Number

    @property
    def slope(self) -> Number:
        """tan(psi)."""
        return self.rise / self.run

    @property
    def lever(self) -> Number:
        """x + phi tan(psi)."""
        return self.x + self.y * self.slope


@dataclass(frozen=True)
class Turned:
    """A blade at one opening."""

    law: Blade
    sine: Number
    cosine: Number

    @cached_property
    def scout(self) -> "Turned":
        """The same of floats."""
        return scouted(self)

    def spot(self, station: Number) -> Spot:
        """All about one place of the edge."""
        offset, taper = self.law.edge.at(station)
        y = station * self.sine + offset * self.cosine
        depth = self.law.upper_face - y
        force = stored = 0 * y
        if depth > 0:
            force, stored = self.law.response.at(depth)
        return Spot(
            station,
            station * self.cosine - offset * self.sine,
            y,
            self.sine + taper * self.cosine,
            self.cosine - taper * self.sine,
            taper,
            depth,
            force,
            stored * self.law.moving,
        )

    def over(self, contact: Number) -> tuple[Spot | None, float]:
        """The edge's place over a contact, and the least dx/ds from the pivot to there.

        None where the edge stands upright before it comes to lie over the contact.
        """
        scout, goal = self.scout, float(contact)
        outwards = self.x_at(mp.mpf(0)) < contact
        least = scout.run_at(0.0)
        for low, high in scout.pieces(0.0, outwards):
            x = scout.x_at(high)
            least = min(least, scout.least_run(*sorted((low, high))))
            past = x >= goal if outwards else x <= goal
            if past and scout.least_run(*sorted((low, high))) > 0.0:
                wide = 1e-9 * (abs(low) + abs(high))
                ends = sorted((mp.mpf(low), mp.mpf(high)))
                place = root(
                    lambda s: self.x_at(s) - contact, ends[0] - wide, ends[1] + wide
                )  # a bracket of floats, made a little wider
                within = scout.least_run(*sorted((low, float(place))))
                return self.spot(place), min(within, scout.run_at(0.0))
            if least <= 0.0:
                return self._before_upright(contact, low, high, outwards)
        return None, -1.0

    def _before_upright(
        self, contact: Number, low: float, high: float, outwards: bool, closer: int = 4
    ) -> tuple[Spot | None, float]:
        """As `over`, within the piece in which the edge comes to stand upright.

        The part in which it does is looked at ``closer`` and closer.
        """
        step = (high - low) / 256
        for k in range(256):
            near, far = low + k * step, low + (k + 1) * step
            if self.scout.least_run(*sorted((near, far))) <= 0.0:
                if not closer:
                    return None, -1.0
                return self._before_upright(contact, near, far, outwards, closer - 1)
            x = self.scout.x_at(far)
            if x >= float(contact) if outwards else x <= float(contact):
                place = root(lambda s: self.x_at(s) - contact, mp.mpf(near), mp.mpf(far))
                return self.spot(place), self.scout.least_run(*sorted((low, float(place))))
        return None, -1.0

    def least_run_of_blade(self) -> float:
        """Least dx/ds between the ends of the blade, or of its table."""
        scout = self.scout
        ends = sorted({0.0, scout.law.tip, *scout.law.edge.breaks})
        return float(min(scout.least_run(a, b) for a, b in itertools.pairwise(ends)))

    def released(self, spot: Spot) -> Number:
        """Energy released per metre of crack."""
        if spot.slope <= self.law.parallel:
            return 0 * spot.force
        return self.law.moving * spot.force * spot.slope

    def rests(
        self, start: Spot, target: "Callable[[Turned, Spot], Number]"
    ) -> tuple[Spot, bool, bool]:
        """The first place outwards whose release is at most the target.

        Also whether it lies before the tip (else the tip's place is given), and whether the release
        rises again anywhere farther out. ``target`` is a function of a turned blade and a place.
        """
        scout = self.scout
        place = float(start.station)
        before = scout.spot(place)
        level = scout.released(before) - target(scout, before)
        found: tuple[float, float] | None = None
        rises = False
        for low, high in scout.pieces(place, True):
            for part in self._parts(low, min(high, scout.law.tip)):
                spot = scout.spot(part)
                now = scout.released(spot) - target(scout, spot)
                rises = rises or now > level + 1e-3 * abs(level)
                if found is None and now <= 0.0:
                    found = before.station, part
                before, level = spot, now
            if high >= scout.law.tip:
                break
        if found is None:
            return self.spot(self.law.tip), False, rises

        def excess(s: Number) -> Number:
            spot = self.spot(s)
            return self.released(spot) - target(self, spot)

        low = max(mp.mpf(found[0]), start.station)
        if excess(low) <= 0:
            return self.spot(low), True, rises
        return self.spot(root(excess, low, mp.mpf(found[1]))), True, rises

    def torque(self, spot: Spot, rate: Number) -> Number:
        """Torque of the response at a place, rate damping included."""
        force = self._damped(spot, rate)
        if self.law.closure == "eq4":
            return force * spot.x / mp.sqrt(1 + spot.taper**2)
        return force * spot.lever

    def push(self, spot: Spot, rate: Number) -> Number:
        """Force on the pivot along the cut."""
        return -self.law.moving * self._damped(spot, rate) * spot.slope

    def x_at(self, s: Number) -> Number:
        """x of a station."""
        return s * self.cosine - self.law.edge.at(s)[0] * self.sine

    def run_at(self, s: Number) -> Number:
        """dx/ds at a station."""
        return self.cosine - self.law.edge.at(s)[1] * self.sine

    def least_run(self, low: Number, high: Number) -> Number:
        """Least dx/ds between two stations of one piece, where it is a parabola."""
        inner = 1e-12 * (high - low)  # both ends as the piece between them has them
        first, last = self.run_at(low + inner), self.run_at(high - inner)
        bend = 2 * (first + last - 2 * self.run_at((low + high) / 2))
        least = min(first, last)
        if bend > 0:
            t = (1 - (last - first) / bend) / 2
            if 0 < t < 1:
                least = min(least, first - bend * t * t)
        return least

    def pieces(self, start: Number, outwards: bool) -> Sequence[tuple[Number, Number]]:
        """Pieces of the edge from a station on, to far beyond the blade."""
        way = 1 if outwards else -1
        ends = {start, *(start + way * self.law.tip * 2.0**k for k in DOUBLINGS)}
        ends |= {b for b in (*self.law.edge.breaks, self.law.tip) if (b - start) * way > 0}
        ordered = sorted(ends, key=lambda s: (s - start) * way)
        return list(itertools.pairwise(ordered))

    def _damped(self, spot: Spot, rate: Number) -> Number:
        deepening = -spot.lever * rate / self.law.moving
        return spot.force * max(1 + self.law.damping * deepening, 0 * spot.force)

    def _parts(self, low: Number, high: Number) -> list[Number]:
        parts = PARTS if self.law.edge.breaks else 2
        return [low + (high - low) * k / parts for k in range(1, parts + 1)]


def mean_target(turned: Turned, spot: Spot) -> Number:
    """J_c h times the mean force of a ripple over its peak."""
    law = turned.law
    if law.kappa == 1 or spot.slope <= law.parallel:
        return law.toughness
    peak = law.toughness / (law.moving * spot.slope)
    top, bottom = law.response.inverse(peak), law.response.inverse(law.kappa * peak)
    if not top > bottom:
        return law.toughness
    work = law.response.at(top)[1] - law.response.at(bottom)[1]
    return law.toughness * work / (top - bottom) / peak


def peak_target(turned: Turned, spot: Spot) -> Number:
    """J_c h."""
    return turned.law.toughness + 0 * spot.force


def kept_target(turned: Turned, spot: Spot) -> Number:
    """kappa J_c h."""
    return turned.law.kappa * turned.law.toughness + 0 * spot.force
