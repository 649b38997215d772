"""Which states a run tries, and how each is compared."""

import math
import warnings
from dataclasses import dataclass

import numpy as np
from benchmarks.extremes.cells import refusal
from benchmarks.extremes.states import (
    SWEPT,
    everyday_state,
    fitted_tables,
    in_pair,
    one_at_a_time,
    random_state,
)

from scissorcal.bench.extremes.compare import (
    LEAST_RUN,
    PARALLEL_KERNEL,
    Judgement,
    Reference,
    compare_kernel,
    compare_model,
    errors_of,
)
from scissorcal.bench.extremes.exact_laws import NotComparedError
from scissorcal.bench.extremes.states import State, blade_of_law, blade_of_tables
from scissorcal.kernel import Kernel, ModelTables
from scissorcal.model import edge_height
from scissorcal.package.exact import ExactModel

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


def try_state(state: State) -> tuple[Judgement, ...]:
    """Compare model, kernel and tables at one state."""
    model = compare_model(state)
    try:
        tables, close = fitted_tables(state, _deepest(state))
        Kernel(tables)
    except ValueError as error:
        refused = refusal(error)
        sentence = _without_numbers(refused.sentence)
        kinds = ("kernel", "tables")
        return (model, *(Judgement(kind, refused.outcome, sentence) for kind in kinds))
    return model, compare_kernel(state, tables), compare_tables(state, tables, close)


def compare_tables(state: State, tables: ModelTables, close: bool) -> Judgement:
    """The exact step of the tables against the exact step of the law: their approximation."""
    approximate = blade_of_tables(tables, PARALLEL_KERNEL)
    try:
        given = Reference(approximate, state, LEAST_RUN, tables).at()
        law = blade_of_law(state.cutting, PARALLEL_KERNEL)
        truth = Reference(law, state, LEAST_RUN, tables).at()
    except NotComparedError as error:
        return Judgement("tables", "not compared", str(error))
    if not given["stands"] or not truth["stands"]:
        return Judgement("tables", "refused", "no edge stands over the contact")
    words = "" if close else "fit_table: not met, too few knots for the law"
    return Judgement(
        "tables",
        "right" if close else "flagged",
        words,
        *errors_of(given["torque"], truth["torque"]),
    )


def _deepest(state: State) -> float:
    """The deepest indentation that a state needs, as `package.compile` would find it."""
    model = ExactModel(state.cutting, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        settled = model.settled(state.opening, state.contact)
        beta = model.blade_angle(state.opening)
        depths = [
            state.cutting.upper_face_m - float(edge_height(state.cutting.edge, place, beta).height)
            for place in (np.asarray(state.contact), settled)
        ]
    return max([*(d for d in depths if math.isfinite(d) and d > 0.0), 1e-9])


def _without_numbers(sentence: str) -> str:
    """A sentence less its own numbers, so that those of many states are one."""
    return " ".join(
        "..." if any(c.isdigit() for c in word) and not word.startswith("1e") else word
        for word in sentence.split()
    )
