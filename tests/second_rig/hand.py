"""Paths of a hand that makes a plan's strokes in its own way: minimum jerk, uneven, trembling."""

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device import Plan

from .parameters import Rig
from .simulate import HAND, Timeline

PAUSE_S = 0.12
SLEDGE_SPEED = 0.07
OPENING_SPEED = 0.9
BACK_S = 1.2
SETTLE_S = 0.6
LEAD_M = 2e-3
SAG_RAD = 0.03
"""How much less than it means to the hand closes, for it holds the handles as through a spring."""
PEAK = 1.875
"""Peak over mean rate of a minimum-jerk movement."""


class _Path:
    """Joins minimum-jerk movements of blades and sledge."""

    def __init__(self, opening: float, advance: float, tick_s: float) -> None:
        self.here = np.array([opening, advance])
        self._tick = tick_s
        self.places: list[Array] = []
        self.rates: list[Array] = []

    def move(self, opening: float, advance: float, seconds: float) -> None:
        count = max(2, round(seconds / self._tick))
        share = np.arange(1, count + 1) / count
        way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        slope = 30.0 * share**2 * (1.0 - share) ** 2 / (count * self._tick)
        there = np.array([opening, advance])
        self.places.append(self.here + way[:, None] * (there - self.here))
        self.rates.append(slope[:, None] * (there - self.here))
        self.here = there

    def rest(self, seconds: float) -> None:
        self.move(float(self.here[0]), float(self.here[1]), seconds)


def hand_timeline(rig: Rig, plan: Plan, rng: np.random.Generator) -> Timeline:
    """Lay out a hand's strokes through every sheet of a plan, and its way back between them.

    Blades close from near the planned opening at a speed of their own, starting a little before
    where the planned stroke does (the person sees the cut's end). On the way back no sheet lies
    between the blades.
    """
    hand, sheets = rig.hand, []
    first = plan.segments[0].reference
    start = float(first.opening[0]), float(first.advance[0])
    path = _Path(*start, plan.tick_s)
    path.rest(SETTLE_S)
    sheets.append(np.full(len(path.places[-1]), plan.segments[0].sheet))
    for segment in plan.segments:
        begun = sum(len(part) for part in path.places)
        strokes = [s for s in plan.strokes if s.kind in ("closing", "press")]
        seen = np.inf  # how far the sheet seems to be cut, once a stroke has been made
        for stroke in strokes:
            ticks = np.flatnonzero(segment.reference.stroke == stroke.index)
            if len(ticks) == 0:
                continue
            top, bottom = segment.reference.opening[ticks[[0, -1]]]
            place = float(segment.reference.advance[ticks[0]])
            place = min(place, seen - crossing(rig, start[0]) - LEAD_M)
            place -= abs(hand.aim_m * rng.standard_normal())
            top = min(top + 0.5 * abs(hand.turn_rad * rng.standard_normal()), start[0])
            bottom += abs(hand.turn_rad * rng.standard_normal())
            speed = stroke.speed * np.exp(hand.unevenness * rng.standard_normal())
            path.move(start[0], place, abs(place - path.here[1]) / SLEDGE_SPEED + 0.2)
            path.move(top, place, 0.25)
            path.rest(PAUSE_S)
            path.move(bottom, place, PEAK * (top - bottom) / speed / 1.5)
            path.rest(PAUSE_S)
            path.move(start[0], place, PEAK * (top - bottom) / OPENING_SPEED)
            path.rest(PAUSE_S)
            if stroke.kind == "closing":
                seen = place + crossing(rig, bottom + SAG_RAD)
        path.rest(SETTLE_S)
        made = sum(len(part) for part in path.places) - begun
        sheets.append(np.full(made, segment.sheet))
        path.move(*start, BACK_S + abs(path.here[1] - start[1]) / SLEDGE_SPEED)
        path.rest(SETTLE_S)
        sheets.append(np.full(len(path.places[-1]) + len(path.places[-2]), -1))
    places, rates = np.concatenate(path.places), np.concatenate(path.rates)
    count = len(places)
    return Timeline(
        places[:, 0],
        rates[:, 0],
        places[:, 1],
        rates[:, 1],
        _tremor(rig, count, rng),
        np.full(count, HAND, np.int32),
        np.full(count, -1, np.int32),
        np.concatenate(sheets).astype(np.int32),
        np.zeros(count),
    )


def crossing(rig: Rig, opening: float) -> float:
    """Distance from the pivot (m) at which the edge crosses the sheet's upper face."""
    blades, beta = rig.blades, opening / rig.moving_blades
    s = np.linspace(0.0, blades.length_m, 4001)
    e = blades.offset_m + s * np.tan(blades.taper_rad)
    e += 0.5 * blades.curvature_per_m * s**2 + blades.cubic_per_m2 * s**3
    x, y = s * np.cos(beta) - e * np.sin(beta), s * np.sin(beta) + e * np.cos(beta)
    return float(np.interp(rig.upper_face_m, y, x))


def _tremor(rig: Rig, count: int, rng: np.random.Generator) -> Array:
    """Narrow-band noise around the tremor's frequency, with a given standard deviation in N."""
    from scipy.signal import lfilter

    angle = 2.0 * np.pi * rig.hand.tremor_Hz * rig.tick_s
    pole = np.exp(-2.0 * np.pi * 1.5 * rig.tick_s)
    shaped = lfilter([1.0], [1.0, -2.0 * pole * np.cos(angle), pole**2], rng.standard_normal(count))
    return np.asarray(rig.hand.tremor_N * shaped / max(float(np.std(shaped)), 1e-12))
