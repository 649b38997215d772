"""Size and number format of the tables: bytes and time of a step against the exact model."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.models import (
    BYTES,
    STEP,
    central,
    measured_tables,
    nothing_rendered,
    tables_of,
)
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.bench.trade.torque import AVERAGE, WORST
from scissorcal.errors import MissingError
from scissorcal.package.compile import TOLERANCE, compile_model
from scissorcal.package.records import Bound
from scissorcal.package.stated_bound import stated_bound
from scissorcal.package.table_cost import CostAndError, TableCost
from scissorcal.package.tables import NumberFormat

RANDOM_STEP = "step at random states"
INSTRUCTIONS, WORST_INSTRUCTIONS = "instructions a step", "instructions a step, worst"
BOUND_CHECK = "bound share"
"""As `package.check` calls it."""
RANDOM_WORST = "torque at random states, worst"
TOLERANCES: Mapping[str, tuple[float, ...]] = {
    "float32": (1e-1, 1e-2, 1e-3, 1e-4, 1e-5),
    "int16": (1e-1, 1e-2, 1e-3, 1e-4),
    "float64": (1e-2, 1e-4, 1e-6),
}
"""Tolerances of each table as a share of its value, coarsest first. Finer ones change nothing:
16 bits resolve 3e-5 of a row's range, and float32 rounds torques by 1e-6."""


class Tables:
    """How finely tables follow the laws, and how their numbers are stored.

    "Smallest that fit" is what a package's build searches: a tolerance and a format for each table,
    the fewest bytes whose stated bound fits the scene's tolerance.

    Counted against the exact model in float64 without tables; float64 tables show what the number
    format alone costs, no package holds them. A setting whose stated bound is beyond what a
    package's build allows fails that check: it is measured, and not recommended.
    """

    name = "tables"
    title = "Tables: size and number format"
    cost = BYTES
    error = WORST
    against = "the exact model in float64, without tables"
    of_torque, stand_in, combined = True, False, True

    def missing(self, case: Case) -> str:
        """Where nothing is rendered there are no tables."""
        return nothing_rendered(case)

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Number formats, each with tolerances from coarse to fine; the search; the present one."""
        own = (case.number_format, _present(case))
        formats: tuple[NumberFormat, ...] = get_args(NumberFormat)
        searched = [
            Setting(
                f"{form}, smallest that fit",
                0.0,
                {"number_format": form, "tolerance": None},
                f"{form}, smallest that fit",
                (form, None) == own,
            )
            for form in ("int16", "float32")
        ]
        fixed = [
            Setting(
                f"{form}, tolerance {100.0 * tolerance:g} %",
                -float(np.log10(tolerance)),
                {"number_format": form, "tolerance": tolerance},
                form,
                (form, tolerance) == own,
            )
            for form in formats
            for tolerance in sorted({*TOLERANCES[form], *_own(own, form)}, reverse=True)
        ]
        return (*searched, *fixed)

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case whose package is compiled so; float64 leaves it as it is.

        Without a tolerance the search for the smallest tables decides.
        """
        form, tolerance = setting.value["number_format"], setting.value["tolerance"]
        if form == "float64":
            return case
        scene = case.recipe.scene.model_copy(update={"simplify": True})
        recipe = case.recipe if tolerance else case.recipe.model_copy(update={"scene": scene})
        return replace(case, recipe=recipe, table_tolerance=tolerance, number_format=form)

    def expected_s(self, case: Case, setting: Setting) -> float:
        """Compiling and counting takes most of it, and double precision is emulated."""
        return 12.0 if setting.value["number_format"] == "float64" else 3.0

    def repeats(self, case: Case, setting: Setting) -> int:
        """Each repeat has other random states; float64 is no setting of a package."""
        return 1 if setting.value["number_format"] == "float64" else 3

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Compile the present fits so, and measure the tables."""
        model, form = central(case), setting.value["number_format"]
        tolerance = setting.value["tolerance"]
        if form == "float64":
            made = compile_model(model, case.recipe, tolerance=tolerance, number_format=form)
        else:
            made = tables_of(self.applied(case, setting), model)
        rng = np.random.default_rng([case.seed, repeat])
        found = measured_tables(case, model, made, rng)
        if found.grid is None or found.random is None:
            raise MissingError(f"{setting.label}: not measured: {found.cost.not_timed}.")
        refused = form != "float64" and _beyond(stated_bound(model, made, case.recipe))
        return Sample(
            _costs(found.cost),
            _outcome(found),
            _notes(found.cost),
            (BOUND_CHECK,) if refused else (),
        )

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of the rendered mean torque: over an even grid, and at random states."""
        found = sample.outcome
        values = {AVERAGE: found["average"], WORST: found["worst"], RANDOM_WORST: found["random"]}
        return {
            name: Error(value, "N m", value / found["largest"]) for name, value in values.items()
        }


def _beyond(bound: Bound) -> bool:
    return bound.share > bound.allowed_share


def _present(case: Case) -> float | None:
    """The tolerance that a package of the case has; None where the search decides."""
    if case.table_tolerance is None and not case.recipe.scene.simplify:
        return TOLERANCE
    return case.table_tolerance


def _own(own: tuple[str, float | None], form: str) -> tuple[float, ...]:
    return (own[1],) if own[0] == form and own[1] is not None else ()


def _costs(cost: TableCost) -> dict[str, Quantity]:
    costs = {
        BYTES: Quantity(float(cost.bytes), "B"),
        "knots": Quantity(float(sum(cost.knots.values())), ""),
    }
    if cost.ram_bytes:
        costs["decoded bytes"] = Quantity(float(cost.ram_bytes), "B")
    for name, timing in ((STEP, cost.stroke_ns), (RANDOM_STEP, cost.random_ns)):
        if timing is not None:
            costs[name] = Quantity(timing.median, "ns")
    if cost.instructions is not None:
        costs[INSTRUCTIONS] = Quantity(float(cost.instructions.stroke), "")
        costs[WORST_INSTRUCTIONS] = Quantity(float(cost.instructions.worst), "")
    return costs


def _outcome(found: CostAndError) -> dict[str, Any]:
    assert found.grid is not None
    assert found.random is not None
    return {
        "average": found.grid.average_Nm,
        "worst": max(found.grid.worst_Nm, found.random.worst_Nm),
        "random": found.random.worst_Nm,
        "largest": found.scene_torque_Nm,
    }


def _notes(cost: TableCost) -> tuple[str, ...]:
    knots = ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in cost.knots.items())
    notes = [f"Knots: {knots}."]
    if cost.instructions is None:
        notes.append(f"Instructions of a Cortex-M4F: not measured: {cost.not_counted}")
    return tuple(notes)
