"""What the tables of a package cost, as several knobs count it."""

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Quantity
from scissorcal.errors import ScissorcalError
from scissorcal.package.compile import Compiled
from scissorcal.package.exact import ExactModel
from scissorcal.package.table_cost import CostAndError, cost_and_error

BYTES, STEP = "table bytes", "step"

TIMINGS = 5
"""Repeats of a timing, whose median counts."""


def package_costs(
    case: Case, model: ExactModel, made: Compiled, rng: np.random.Generator
) -> dict[str, Quantity]:
    """Bytes of the tables, and the time of a step (ns) where a compiler measures it.

    Raises what `measured_tables` raises.
    """
    cost = measured_tables(case, model, made, rng, count_instructions=False).cost
    costs = {BYTES: Quantity(float(cost.bytes), "B")}
    if cost.stroke_ns is not None:
        costs[STEP] = Quantity(cost.stroke_ns.median, "ns")
    return costs


def measured_tables(
    case: Case,
    model: ExactModel,
    made: Compiled,
    rng: np.random.Generator,
    *,
    count_instructions: bool = True,
) -> CostAndError:
    """What `package.table_cost` measures of tables; ScissorcalError where the compiler fails."""
    try:
        return cost_and_error(
            model,
            case.recipe,
            made,
            rng,
            repeats=TIMINGS,
            count_instructions=count_instructions,
        )
    except RuntimeError as error:
        raise ScissorcalError(f"The step could not be measured: {error}") from error
