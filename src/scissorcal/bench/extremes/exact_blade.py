"""A blade in a sheet in 50 digits: where its edge stands, where a crack rests, torque and energy.

Written from the equations of docs/model.md, one place at a time. Where there is no answer (the edge
stands upright before it comes to lie over the contact) there is none here either.
"""

import itertools
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from scissorcal.bench.extremes.exact_laws import (
    Curve,
    Force,
    Number,
    TableForce,
    mp,
    root,
    scouted,
)

PARTS = 8
"""Places in each piece of a bent edge at which its release is looked at."""
DOUBLINGS = range(-3, 30)
"""Places are looked for within 2^29 blade lengths."""
CLOSE = 1e-9
"""Share of its station to which the place is known at which an edge comes to stand upright."""


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
    """A place of the edge in the material, and the force of one blade there."""

    station: Number
    x: Number
    y: Number
    rise: Number
    run: Number
    taper: Number
    depth: Number
    force: Number

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
        force = self.law.response.at(depth) if depth > 0 else 0 * y
        return Spot(
            station,
            station * self.cosine - offset * self.sine,
            y,
            self.sine + taper * self.cosine,
            self.cosine - taper * self.sine,
            taper,
            depth,
            force,
        )

    def over(self, contact: Number) -> tuple[Spot | None, float]:
        """The edge's place over a contact, and the least dx/ds from the pivot to there.

        None where the edge stands upright before it comes to lie over the contact.
        """
        scout, goal = self.scout, float(contact)
        outwards = self._x_at(mp.mpf(0)) < contact
        least = scout._run_at(0.0)
        ahead = deque(scout.pieces(0.0, outwards) if least > 0.0 else ())
        while ahead:
            low, high = ahead.popleft()
            middle, wide = (low + high) / 2, CLOSE * (abs(low) + abs(high))
            run = scout.least_run(*sorted((low, high)))
            if run <= 0.0 and abs(high - low) < wide + CLOSE * scout.law.tip:
                break
            if run <= 0.0:
                ahead.extendleft([(middle, high), (low, middle)])
                continue
            x = scout._x_at(high)
            if x >= goal if outwards else x <= goal:
                ends = sorted((mp.mpf(low), mp.mpf(high)))  # of floats, so a little wider
                place = root(lambda s: self._x_at(s) - contact, ends[0] - wide, ends[1] + wide)
                within = scout.least_run(*sorted((low, float(place))))
                return self.spot(place), min(least, within)
            least = min(least, run)
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

    def excess(self, station: Number, share: Number | None) -> Number:
        """By how much the release at a station is above the target."""
        spot = self.spot(station)
        return self.released(spot) - self.target(spot, share)

    def target(self, spot: Spot, share: Number | None) -> Number:
        """A share of J_c h; None is that of the mean force of a ripple over its peak."""
        law = self.law
        if share is not None or law.kappa == 1 or spot.slope <= law.parallel:
            return law.toughness * (1 if share is None else share)
        assert not isinstance(law.response, TableForce)
        peak = law.toughness / (law.moving * spot.slope)
        top, bottom = law.response.inverse(peak), law.response.inverse(law.kappa * peak)
        if not top > bottom:
            return law.toughness
        work = law.response.energy(top) - law.response.energy(bottom)
        return law.toughness * work / (top - bottom) / peak

    def rests(self, start: Spot, share: Number | None) -> tuple[Spot, bool, bool]:
        """The first place outwards whose release is at most the target.

        Also whether it lies before the tip (else the tip's place is given), and whether the release
        rises again anywhere farther out.
        """
        scout = self.scout
        before = place = float(start.station)
        level = scout.excess(place, share)
        bracket: tuple[float, float] | None = None
        rises = False
        for low, high in scout.pieces(place, True):
            for part in self._parts(low, min(high, scout.law.tip)):
                now = scout.excess(part, share)
                rises = rises or now > level + 1e-3 * abs(level)
                if bracket is None and now <= 0.0:
                    bracket = before, part
                before, level = part, now
            if high >= scout.law.tip:
                break
        if bracket is None:
            return self.spot(self.law.tip), False, rises

        low = max(mp.mpf(bracket[0]), start.station)
        if self.excess(low, share) > 0:
            low = root(lambda s: self.excess(s, share), low, mp.mpf(bracket[1]))
        return self.spot(low), True, rises

    def torque(self, spot: Spot, rate: Number) -> Number:
        """Torque of the response at a place, rate damping included."""
        force = self._damped(spot, rate)
        if self.law.closure == "eq4":
            return force * spot.x / mp.sqrt(1 + spot.taper**2)
        return force * spot.lever

    def _x_at(self, s: Number) -> Number:
        """x of a station."""
        return s * self.cosine - self.law.edge.at(s)[0] * self.sine

    def _run_at(self, s: Number) -> Number:
        """dx/ds at a station."""
        return self.cosine - self.law.edge.at(s)[1] * self.sine

    def least_run(self, low: Number, high: Number) -> Number:
        """Least dx/ds between two stations of one piece, where it is a parabola."""
        inner = 1e-12 * (high - low)  # both ends as the piece between them has them
        first, last = self._run_at(low + inner), self._run_at(high - inner)
        bend = 2 * (first + last - 2 * self._run_at((low + high) / 2))
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
