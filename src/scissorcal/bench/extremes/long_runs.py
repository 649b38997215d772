"""A long run of a kernel: whether energy is neither made nor lost, and the crack never recedes."""

import dataclasses
import itertools
from functools import partial

import numpy as np

from scissorcal.bench.extremes.compare import KERNEL_EPS, VALUE_ROUNDINGS, Judgement
from scissorcal.kernel import Kernel, ModelTables, StepFlag

STEP_rad = 1e-5
STROKES = 3
WITHDRAWN = 0.36
"""Share of the whole stroke by which the blades withdraw after each part of it."""
ROUNDING_m = 1e-7
"""Some ten float32 roundings of a place on the blade: a contact that falls by less stands still."""

Ends = tuple[float, float]
"""The openings (rad) between which the blades move."""


def strokes(tables: ModelTables, ends: Ends, contact: float) -> Judgement:
    """Close, withdraw and close farther; compare the blades' work with the kernel's books.

    Friction and rate damping lose energy that a step does not report, so that the blades are
    without. The balance is stated to 16 roundings of the work and what the trapezoid over steps
    leaves: half a step times the change of torque in it, and where a crack with a ripple ran also
    a tooth's drop and a rounding of its place.
    """
    bare = dataclasses.replace(tables, render_friction=False, rate_damping=0.0)
    judged = partial(Judgement, "strokes")
    last, first = ends
    turns = [first]
    for stroke in range(STROKES):
        lowest = first - (first - last) * (stroke + 1) / STROKES
        turns += [lowest, min(lowest + WITHDRAWN * (first - last), first)]
    path = [
        np.linspace(a, b, int(abs(b - a) / STEP_rad), endpoint=False)
        for a, b in itertools.pairwise(turns)
    ]
    opening = np.concatenate(path).astype(np.float32).astype(np.float64)
    kernel = Kernel(bare)
    kernel.reset(crack=0.0)
    out = kernel.step_many(opening, -1.0, -contact)
    if not all(np.isfinite(out[name]).all() for name in out.dtype.names or ()):
        return judged("wrong", "an output is not finite")
    if np.any(out["flags"] & StepFlag.INVALID):
        return judged("refused", "INVALID: the edge leans back")
    crack, torque = (out[name].astype(np.float64) for name in ("contact", "torque"))
    reached = out["flags"] & StepFlag.BEYOND_TIP == 0
    if np.any(np.diff(crack[reached]) < -ROUNDING_m) or np.any(out["fracture_J"] < 0):
        return judged("wrong", "the crack recedes")
    turn, mean = np.diff(opening), 0.5 * (torque[1:] + torque[:-1])
    gross = float(np.sum(np.abs(mean * turn)))
    if gross == 0.0:
        return judged("wrong", "nothing was touched, so that nothing is compared")
    spent = np.sum(out["fracture_J"][1:].astype(np.float64) + out["arrest_J"][1:])
    kept = float(out["stored_J"][-1]) - float(out["stored_J"][0])
    away = abs(float(-np.sum(mean * turn) - spent) - kept)
    change = np.abs(np.diff(torque))
    ran = (out["flags"][1:] & StepFlag.ADVANCED != 0) & (tables.kappa < 1.0)
    drop = np.where(ran, np.abs(torque[1:]) * (1.0 / max(tables.kappa, KERNEL_EPS) - 1.0), 0.0)
    rounded = np.sum(ran) * KERNEL_EPS * float(np.max(np.abs(crack))) * tables.fracture_energy
    rounded += VALUE_ROUNDINGS * KERNEL_EPS * gross
    allowed = float(np.sum((0.5 * change + drop) * np.abs(turn)) + rounded)
    words = f"energy balance: error {away / gross:.2g}, stated {allowed / gross:.2g}"
    return judged("right" if away <= allowed else "wrong", words, away / gross)
