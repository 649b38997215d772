"""Which states a run tries, in which order, and what one job of it does."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import zip_longest

import numpy as np

from scissorcal.bench.extremes.cells import Found, all_cells, try_cell
from scissorcal.bench.extremes.compare import Compared, compare_kernel, compare_model
from scissorcal.bench.extremes.quantities import QUANTITIES
from scissorcal.bench.extremes.states import (
    SWEPT,
    State,
    everyday_state,
    in_pair,
    one_at_a_time,
    random_state,
)

PAIRS = (
    ("opening", "taper"),
    ("opening", "curvature"),
    ("indentation", "exponent"),
    ("kappa", "exponent"),
    ("thickness", "indentation"),
    ("toughness", "force"),
    ("blade_length", "nick"),
    ("table_size", "exponent"),
)
"""Pairs of quantities that meet in one formula, each drawn as a map of errors."""

CHUNK = 8
"""States of one job: enough to outweigh handing it to another process."""


SLOW_FROM = 0.1
"""Size of a run below which slow cells are left out."""


@dataclass(frozen=True)
class Extent:
    """How many states a run tries.

    ``values`` of each quantity, one at a time, in ``repeats`` everyday states each; ``grid`` values
    of either of a pair; ``random`` states with all quantities extreme, and ``everyday`` ones.
    ``slow`` cells are run, too, unless it is false.
    """

    values: int = 13
    repeats: int = 4
    grid: int = 9
    random: int = 1500
    everyday: int = 500
    slow: bool = True

    @classmethod
    def of_size(cls, size: float) -> "Extent":
        """The default times a size; below a tenth without slow cells."""
        whole = cls()
        side = math.sqrt(size)
        return cls(
            values=max(3, round(whole.values * side)),
            repeats=max(1, round(whole.repeats * side)),
            grid=max(3, round(whole.grid * side)),
            random=max(1, round(whole.random * size)),
            everyday=max(1, round(whole.everyday * size)),
            slow=size >= SLOW_FROM,
        )

    @property
    def states(self) -> int:
        """Number of states of all plans."""
        return len(planned(self, 0))


@dataclass(frozen=True)
class Job:
    """States to compare, or the name of a cell to run, with the seed."""

    states: tuple[State, ...] = ()
    cell: str = ""
    seed: int = 0


@dataclass(frozen=True)
class Tried:
    """What was found of one state."""

    state: State
    compared: tuple[Compared, ...]


@dataclass(frozen=True)
class Done:
    """What a job found, and the seconds that it took where it ran."""

    tried: tuple[Tried, ...] = ()
    cell: str = ""
    found: Found | None = field(default=None)
    seconds: float = 0.0


def jobs(extent: Extent, seed: int) -> Iterator[Job]:
    """The jobs of a run, in an order in which a run that ends early has tried some of everything.

    Cells of all parts, shuffled, in turn with states of all plans, shuffled, while there are both.
    """
    order = np.random.default_rng([seed, 1])
    states, cells = planned(extent, seed), all_cells()
    shuffled = [states[k] for k in order.permutation(len(states))]
    chunks = [tuple(shuffled[at : at + CHUNK]) for at in range(0, len(shuffled), CHUNK)]
    names = [
        cells[k].name for k in order.permutation(len(cells)) if extent.slow or not cells[k].slow
    ]
    for chunk, name in zip_longest(chunks, names):
        if name is not None:
            yield Job(cell=name, seed=seed)
        if chunk is not None:
            yield Job(states=chunk, seed=seed)


def planned(extent: Extent, seed: int) -> list[State]:
    """All states of a run; the same for the same extent and seed."""
    rng = np.random.default_rng([seed, 0])
    states = [everyday_state(rng) for _ in range(extent.everyday)]
    states += [random_state(rng) for _ in range(extent.random)]
    for name in SWEPT:
        states += one_at_a_time(name, extent.values, extent.repeats, rng)
    for first, second in PAIRS:
        states += in_pair(first, second, extent.grid, rng)
    return states


def do(job: Job) -> Done:
    """Do one job."""
    began = time.monotonic()
    if job.cell:
        cell = next(one for one in all_cells() if one.name == job.cell)
        done = Done(cell=cell.name, found=try_cell(cell, job.seed))
    else:
        done = Done(tuple(try_state(state) for state in job.states))
    return replace(done, seconds=time.monotonic() - began)


def try_state(state: State) -> Tried:
    """Compare model, kernel and tables at one state."""
    return Tried(state, (compare_model(state), *compare_kernel(state)))


def unit_of(name: str) -> str:
    """Unit of a quantity; empty where it has none."""
    unit = QUANTITIES[name].unit
    return "" if unit == "1" else unit
