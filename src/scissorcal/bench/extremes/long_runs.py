"""Long runs: whether energy is neither made nor lost, and the crack never recedes."""

import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from scissorcal.bench.extremes.cells import Found, judged, worst_of
from scissorcal.bench.extremes.states import State, everyday_state
from scissorcal.kernel import CrackLaw, Curve, Kernel, StepFlag, walk_crack
from scissorcal.model import Response, edge_height, settled_contact

CLOSING_rad = 1e-5
STROKES = 3
ROUNDING_m = 1e-7
"""Some ten float32 roundings of a place on the blade: a contact that falls by less stands still."""
EVERYDAY: Mapping[str, float] = {
    "edge_offset": -0.008,
    "taper": 0.035,
    "curvature": 0.0,
    "nick": 0.0,
    "blade_length": 0.075,
    "rate_damping": 0.0,
    "contact": 0.3,
    "table_size": 128.0,
    "thickness": 2e-4,
    "force": 5.0,
    "exponent": 1.6,
    "toughness": 3e3,
}
FIRST, LAST = 0.85, 0.3
"""Openings of the strokes; each goes a third farther than the one before, and withdraws."""


def scissors(values: Mapping[str, float], rng: np.random.Generator) -> State:
    """Everyday scissors of two moving blades that cut, with some values changed."""
    base = everyday_state(rng)
    own = {**EVERYDAY, **values}
    return dataclasses.replace(
        base, values=own, moving=2, closure="work", family="power", cut=True, by_depth=False
    )


def energy_of_strokes(
    values: Mapping[str, float], rng: np.random.Generator, step: float, allowed: float
) -> Found:
    """Close, withdraw and close farther; compare the blades' work with the kernel's books."""
    state = scissors(values, rng)
    kernel = Kernel(state.tables(_deepest(state))[0])
    turns = [FIRST]
    for stroke in range(STROKES):
        lowest = FIRST - (FIRST - LAST) * (stroke + 1) / STROKES
        turns += [lowest, min(lowest + 0.2, FIRST)]
    path = np.concatenate(
        [np.linspace(a, b, int(abs(b - a) / step), endpoint=False) for a, b in _pairs(turns)]
    )
    opening = path.astype(np.float32).astype(np.float64)
    kernel.reset(crack=0.0)
    start = kernel.step(opening[0], 0.0, -0.01)
    out = kernel.step_many(opening[1:], -1.0, -0.01)
    if not all(np.isfinite(out[name]).all() for name in out.dtype.names or ()):
        return Found("wrong", "an output is not finite", states=len(opening))
    if np.any(out["flags"] & StepFlag.INVALID):
        return Found("refused", "INVALID: the edge leans back", states=len(opening))
    crack = out["contact"].astype(np.float64)
    reached = out["flags"] & StepFlag.BEYOND_TIP == 0
    if np.any(np.diff(crack[reached]) < -ROUNDING_m) or np.any(out["fracture_J"] < 0):
        return Found("wrong", "the crack recedes", states=len(opening))
    torque = np.concatenate([[start.torque], out["torque"].astype(np.float64)])
    work = -np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(opening))
    spent = np.sum(out["fracture_J"].astype(np.float64) + out["arrest_J"].astype(np.float64))
    kept = float(out["stored_J"][-1]) - start.stored_J
    gross = np.sum(np.abs(0.5 * (torque[1:] + torque[:-1]) * np.diff(opening)))
    if gross == 0.0:
        return Found("wrong", "nothing was cut, so nothing is compared", states=len(opening))
    return judged(abs(work - spent - kept) / gross, allowed, "energy balance", len(opening))


def energy_of_throw(inertia: float, rng: np.random.Generator, allowed: float) -> Found:
    """Throw blades of an inertia (kg m^2) at the sheet; compare kinetic energy with the books.

    The rate is such that they come to rest within the blade. The opening falls by 1e-5 rad a step;
    the rate follows from the torque by the midpoint rule on its square, so that the step takes
    exactly the trapezoid of the torque.
    """
    state = scissors({"kappa": 1.0}, rng)
    kernel = Kernel(state.tables(_deepest(state))[0])
    kernel.reset(crack=0.0)
    opening, first = FIRST, kernel.step(FIRST, 0.0, -0.01)
    energy = kinetic = 0.02
    torque, spent, steps, out = float(first.torque), 0.0, 0, first
    while kinetic > 0.0 and opening > LAST:
        near = float(np.float32(opening - CLOSING_rad))
        rate = -math.sqrt(2.0 * kinetic / inertia)
        out = kernel.step(near, rate, -0.01)
        if out.flags & StepFlag.INVALID:
            return Found("wrong", f"refused at a rate of {rate:.2g} rad/s")
        kinetic -= 0.5 * (torque + out.torque) * (opening - near)
        spent += out.fracture_J + out.arrest_J
        opening, torque, steps = near, float(out.torque), steps + 1
    away = abs(energy - kinetic - spent - (out.stored_J - first.stored_J)) / energy
    return judged(away, allowed, f"inertia {inertia:.1g} kg m^2", steps)


def hostile_inputs(rng: np.random.Generator) -> Found:
    """Steps of 1e-5 to 1 s with gaps, duplicates, backward jumps, NaN and infinities."""
    state = scissors({"kappa": 0.7, "rate_damping": 5.0}, rng)
    kernel = Kernel(state.tables(_deepest(state))[0])
    kernel.reset(crack=0.0)
    count = 20_000
    ticks = 10.0 ** rng.uniform(-5, 0, count) * rng.choice([0.0, 1.0, 1.0, 1.0, -1.0], count)
    opening = 0.55 + 0.3 * np.cos(np.cumsum(rng.uniform(0.0, 0.02, count)))
    opening[rng.integers(0, count, 50)] = rng.choice([np.nan, np.inf, -np.inf, 4.0, 1e30], 50)
    with np.errstate(all="ignore"):
        rate = np.diff(opening, prepend=opening[0]) / ticks
    crack, wrong = kernel.crack, ""
    for theta, speed in zip(opening.tolist(), rate.tolist(), strict=True):
        out = kernel.step(theta, speed, -0.01)
        refused = bool(out.flags & StepFlag.INVALID)
        bad = not math.isfinite(theta) or not math.isfinite(speed) or abs(theta) > math.pi
        if not (math.isfinite(out.torque) and math.isfinite(out.force)):
            wrong = "an output is not finite"
        elif bad and not (refused and out.torque == 0.0 and kernel.crack == crack):
            wrong = f"opening {theta:.3g}, rate {speed:.3g} was not refused"
        elif kernel.crack < crack:
            wrong = "the crack recedes"
        crack = kernel.crack
    if wrong:
        return Found("wrong", wrong, states=count)
    return Found("refused", "INVALID: an opening or rate that is not finite", states=count)


def walk_of_strokes(rng: np.random.Generator) -> Found:
    """The float64 walk of a crack: its work against what it stored and lost."""
    found = []
    for kappa in (1e-3, 0.1, 0.7, 0.999, 1.0):
        law = walk_law(scissors({"kappa": kappa}, rng))
        opening = np.concatenate([np.linspace(FIRST, LAST, 1200), np.linspace(LAST, FIRST, 1200)])
        path = walk_crack(law, opening, np.full(opening.shape, -0.01), place=0.02)
        work = -float(np.sum(path.torque * np.diff(opening)))
        if np.any(np.diff(path.place) < 0.0):
            found.append(Found("wrong", "the crack recedes", states=len(opening)))
            continue
        away = abs(work - path.stored - path.lost) / abs(work)
        found.append(judged(away, 1e-3, f"kappa {kappa:g}", len(opening)))
    return worst_of(found)


def walk_law(state: State, **changes: Any) -> CrackLaw:
    """The law of a state as a crack's walk takes it, with some fields changed."""
    edge, response = state.cutting.edge, state.cutting.response
    length = float(state.values["blade_length"])
    line = Curve(0.0, length, edge.offset_at([0.0, length]), edge.slope_at([0.0, length]))
    logs = np.array([-20.0, 0.0])
    power = float(np.asarray(response.exponent))
    law = CrackLaw(
        edge=line,
        response=Curve(-20.0, 20.0, np.log(response.force_at(np.exp(logs))), np.full(2, power)),
        energy=Curve(-20.0, 20.0, np.log(response.energy_at(np.exp(logs))), np.full(2, power + 1)),
        moving_blades=state.moving,
        upper_face_m=state.upper_face_m,
        closure="work",
        fracture="smooth" if state.kappa == 1.0 else "rippled",
        kappa=state.kappa,
        damping_s_per_m=0.0,
        tick_s=1e-3,
        tough=np.full(2, state.fracture_energy),
        tough_first=0.0,
        tough_step=1.0,
    )
    return dataclasses.replace(law, **changes)


def _deepest(state: State) -> float:
    """The deepest indentation of the strokes: where the crack runs, or all of it without a run."""
    law = state.cutting
    response: Response = law.response
    opening = np.linspace(LAST, FIRST, 50)
    smooth = dataclasses.replace(law, kappa=1.0)
    place = settled_contact(smooth, opening)
    known = np.where(np.isfinite(place), place, 0.0)
    depth = law.upper_face_m - edge_height(law.edge, known, opening / law.moving_blades).height
    return max(float(np.max(depth)), float(response.indentation_at(1.0)))


def _pairs(turns: list[float]) -> list[tuple[float, float]]:
    return list(itertools.pairwise(turns))
