"""The model of a case: of its fits, of a package of them; its tables and what they cost."""

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Quantity
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError, ScissorcalError
from scissorcal.kernel import ModelTables
from scissorcal.package.compile import (
    TOLERANCE,
    Compiled,
    compile_model,
    kernel_tables,
    scene_ranges,
)
from scissorcal.package.exact import ExactModel, central_model, pick_draws
from scissorcal.package.friction_tables import rendered_fits
from scissorcal.package.simplest.law import Law
from scissorcal.package.simplest.model import simplest_model
from scissorcal.package.smallest_tables import smallest_tables
from scissorcal.package.table_cost import CostAndError, cost_and_error


def nothing_rendered(case: Case) -> str:
    """Say in a sentence why a case has no model of torque; empty where it has one."""
    if case.recipe.rig.joint == "linear":
        return "A linear joint carries no blades, so nothing is rendered."
    if case.cut_fit is None:
        return "There is no fit of the material, so nothing is rendered."
    if case.friction_fit is None and case.recipe.scene.render_friction:
        return "There is no fit of friction, so what the scene renders is not known."
    return ""


def central(case: Case) -> ExactModel:
    """The exact model that a package of a case's fits holds, with scalar parameters.

    Raises MissingError where `nothing_rendered` says why there is none.
    """
    if why := nothing_rendered(case):
        raise MissingError(why)
    return model_of_law(present_law(case))


def fitted_model(case: Case) -> ExactModel:
    """The exact model of a case's fits as they stand, with scalar parameters.

    Raises MissingError where `nothing_rendered` says why there is none.
    """
    if why := nothing_rendered(case):
        raise MissingError(why)
    assert case.cut_fit is not None
    return model_of_law(central_law(case, case.cut_fit, case.friction_fit))


def present_law(case: Case) -> Law:
    """The law that a package of a case's fits holds, at the MAP point; the fits' own if not known.

    ValueError without a fit of the material.
    """
    if case.held is not None:
        return case.held
    if case.cut_fit is None:
        raise ValueError("There is no fit of the material.")
    return central_law(case, case.cut_fit, case.friction_fit)


def held_law(case: Case, cut: FitResult, friction: FitResult | None) -> Law:
    """The law that a package of these fits would hold, at its best point.

    As the package's build makes it: the simplest that is enough for the scene, or the law of the
    fits as they stand where ``scene.simplify`` is false. Raises InputError where the fitted law
    cannot be compiled.
    """
    cut, rendered = rendered_fits(cut, friction if case.recipe.scene.render_friction else None)
    if not case.recipe.scene.simplify:
        return central_law(case, cut, rendered)
    draws = pick_draws(cut, rendered, np.random.default_rng(case.seed))
    found = simplest_model(case.recipe, cut, rendered, draws)
    return central_law(case, found.cut, found.friction)


def central_law(case: Case, cut: FitResult, friction: FitResult | None) -> Law:
    """The law of fits at their MAP points alone, friction only where the scene renders it."""
    rendered = friction if case.recipe.scene.render_friction else None
    fits = [fit for fit in (cut, rendered) if fit is not None]
    none = {f"draws/{fit.what}.npy": np.empty((0, len(fit.parameters))) for fit in fits}
    return Law.of_fits(cut, rendered, none)


def model_of_law(law: Law) -> ExactModel:
    """The exact model of a law at its MAP point, with scalar parameters."""
    return central_model(law.cut, law.friction)


def compiled(case: Case, model: ExactModel) -> Compiled:
    """Compile a model to float32 tables of one tolerance.

    The case's tolerance, or the fixed one: without a search for the smallest tables, so that models
    compare.
    """
    tolerance = TOLERANCE if case.table_tolerance is None else case.table_tolerance
    return compile_model(model, case.recipe, tolerance=tolerance)


def kernel_model(case: Case) -> ModelTables:
    """The model that a package of a case's fits holds, `compiled`, as the kernel takes it."""
    found = compiled(case, central(case))
    return kernel_tables(found.mechanics, scene_ranges(case.recipe), found.arrays)


def tables_of(case: Case, model: ExactModel) -> Compiled:
    """Tables of the case's tolerance and number format.

    Without a tolerance they are as a package's build makes them: the smallest whose bound fits the
    scene, or of the fixed tolerance where ``scene.simplify`` is false.
    """
    if case.table_tolerance is None and case.recipe.scene.simplify:
        return smallest_tables(model, case.recipe, number_format=case.number_format)
    tolerance = TOLERANCE if case.table_tolerance is None else case.table_tolerance
    return compile_model(model, case.recipe, tolerance=tolerance, number_format=case.number_format)


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
