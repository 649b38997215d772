"""Inputs that must be refused: each is tried, and what takes it without a word is wrong."""

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from benchmarks.extremes.cells import Found, refusal, worst_of
from benchmarks.extremes.long_runs import FIRST, LAST, scissors, scissors_tables, walk_law

from scissorcal.kernel import Kernel, Table, walk_crack


def refused_tables(rng: np.random.Generator) -> Found:
    """Numbers and tables that a kernel must not take."""
    sound = scissors_tables({"kappa": 0.7})
    falling = _table([0.0, 1.0], [0.0, -1.0], [-1.0, -1.0])
    changes: dict[str, Any] = {
        "kappa": (0.0, -1.0, 1.5, math.nan),
        "fracture_energy": (-1.0, math.nan, 1e39),
        "rate_damping": (-1.0, math.inf),
        "upper_face": (math.nan, math.inf),
        "moving_blades": (0, 3),
        "closure": ("other",),
        "friction_rate_eps": (0.0, -1.0, math.nan, 1e-60),
        "tip_station": (0.0, -1.0, math.nan),
        "opening_min": (math.nan, 4.0),
        "response": (falling,),
        "friction_opening": (falling,),
        "friction_angle": (falling,),
    }
    tries: list[Callable[[], object]] = [
        lambda n=name, v=value: Kernel(dataclasses.replace(sound, **{n: v}))  # type: ignore[misc]
        for name, values in changes.items()
        for value in values
    ]
    rows: tuple[list[float], ...] = (
        [0.0],
        [0.0, 0.0],
        [1.0, 0.0],
        [0.0, math.nan],
        list(map(float, range(257))),
    )
    tries += [partial(_table, row, [0.0] * len(row), [0.0] * len(row)) for row in rows]
    return _each(tries)


def refused_walks(rng: np.random.Generator) -> Found:
    """Laws and motions that a crack's walk must not take."""
    state = scissors({"kappa": 0.7})
    opening, advance = np.linspace(FIRST, LAST, 50), np.full(50, -0.01)
    broken = opening.copy()
    broken[7] = math.nan
    laws: dict[str, Any] = {
        "tick_s": (0.0, -1e-3, math.nan),
        "kappa": (-0.5, 1.5, math.nan),
        "upper_face_m": (math.nan, math.inf),
        "damping_s_per_m": (-1.0, math.nan),
        "tough_step": (0.0, math.nan),
        "tough": (np.array([]), np.array([math.nan]), np.array([-1.0])),
        "moving_blades": (0, 3),
    }
    tries: list[Callable[[], object]] = [
        lambda n=name, v=value: walk_crack(walk_law(state, **{n: v}), opening, advance)  # type: ignore[misc]
        for name, values in laws.items()
        for value in values
    ]
    law = walk_law(state)
    tries += [
        lambda: walk_crack(law, broken, advance),
        lambda: walk_crack(law, opening, broken),
        lambda: walk_crack(law, opening, advance, place=math.nan),
    ]
    return _each(tries)


def _table(*rows: list[float]) -> Table:
    return Table(*(np.array(row, dtype=np.float32) for row in rows))


def _each(tries: list[Callable[[], object]]) -> Found:
    """Refused where all are; wrong where one is taken, or refused without a sentence."""
    found = []
    for number, one in enumerate(tries):
        try:
            one()
        except Exception as error:  # noqa: BLE001 - judged by what it says
            found.append(refusal(error))
        else:
            found.append(Found("wrong", f"input {number + 1} of {len(tries)} was taken"))
    return worst_of(found)
