"""The walk of a crack in plain Python, by roots that scipy finds: slow, and written apart."""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from scissorcal.model import Cutting, edge_height


@dataclass
class Walk:
    """A crack's place, what running took (J), how often it ran, and means over each tick."""

    place: float = 0.0
    lost: float = 0.0
    jumps: int = 0
    torque: list[float] = field(default_factory=list)
    push: list[float] = field(default_factory=list)
    places: list[float] = field(default_factory=list)


def walk(cutting: Cutting, tough, opening, advance, place: float = 0.0) -> Walk:
    """Walk over samples; ``tough`` gives the energy per length at a place. Rippled or pressed."""
    found = Walk(place, places=[place])
    for begin, end in zip(
        zip(opening[:-1], advance[:-1], strict=True),
        zip(opening[1:], advance[1:], strict=True),
        strict=True,
    ):
        _tick(cutting, tough, begin, end, found)
    return found


def _tick(cutting, tough, begin, end, found):
    def motion(s):
        return begin[0] + s * (end[0] - begin[0]), begin[1] + s * (end[1] - begin[1])

    def over(s):
        return released(cutting, *motion(s), found.place) - tough(found.place)

    total, pushed, s = 0.0, 0.0, 0.0
    while s < 1.0:
        to = 1.0
        starts = cutting.fracture_energy is not None and over(1.0) > 0.0
        if starts:
            to = brentq(over, s, 1.0, xtol=1e-15) if over(s) < 0.0 else s
        total += mean(cutting, motion, found.place, s, to, 0)
        pushed += mean(cutting, motion, found.place, s, to, 1)
        s = to
        if starts:
            _run(cutting, tough(found.place), *motion(s), found)
    found.torque.append(total)
    found.push.append(pushed)
    found.places.append(found.place)


def mean(cutting, motion, place, low, high, which):
    """Share of a tick's mean that lies between two times, by Simpson's rule."""
    if not high > low:
        return 0.0
    three = [felt(cutting, *motion(s), place)[which] for s in (low, 0.5 * (low + high), high)]
    return (high - low) * (three[0] + 4.0 * three[1] + three[2]) / 6.0


def felt(cutting, opening, advance, place):
    """Torque, and force on the sledge."""
    view = edge_height(cutting.edge, place - advance, opening / cutting.moving_blades)
    force = float(cutting.response.force_at(cutting.upper_face_m - view.height))
    lever = float(view.lever)
    if cutting.closure == "eq4":
        taper = float(cutting.edge.slope_at(view.station))
        lever = (place - advance) / np.sqrt(1.0 + taper**2)
    return force * lever, cutting.moving_blades * force * float(view.slope)


def released(cutting, opening, advance, place):
    return max(felt(cutting, opening, advance, place)[1], 0.0)


def stored(cutting, opening, advance, place):
    view = edge_height(cutting.edge, place - advance, opening / cutting.moving_blades)
    depth = cutting.upper_face_m - view.height
    return cutting.moving_blades * float(cutting.response.energy_at(depth))


def _run(cutting, energy, opening, advance, found):
    before = stored(cutting, opening, advance, found.place)
    target = cutting.kappa * energy

    def away(place):
        return released(cutting, opening, advance, place) - target

    far = found.place + 1e-4
    while away(far) > 0.0:
        far += 1e-4
    found.place = brentq(away, found.place, far, xtol=1e-16)
    found.lost += before - stored(cutting, opening, advance, found.place)
    found.jumps += 1
