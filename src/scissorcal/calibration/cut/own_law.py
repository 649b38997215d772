"""A cut's fit with a response law of one's own, as the fit of a spline that any room can read."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError
from scissorcal.model import (
    ResponseLaw,
    draw_columns,
    fit_knots,
    law_parameters,
    refuse_falling,
    response_of,
)

CHECKED = 50
"""Draws of a law's prior at which it must rise, beside its own numbers."""


def refuse_unusable(law: ResponseLaw, reference_m: float) -> None:
    """Refuse a law that leaves nothing open, gives no number or falls, before a long fit.

    Raises InputError or ModelError, sentences.
    """
    stated = law_parameters(law)
    if not any(sd > 0.0 for _, sd in stated.values()):
        raise InputError(
            f"The law {type(law).__name__} leaves nothing to fit: give a number and its standard "
            "deviation, the prior, for what the data are to tell."
        )
    columns = draw_columns(stated, np.random.default_rng(0), CHECKED)
    refuse_falling(law, fit_knots(reference_m), columns)


def as_spline_fit(fit: FitResult, law: ResponseLaw) -> FitResult:
    """The fit with the law's response as a spline, and the law's own parameters as derived ones.

    So packages, reports and files need not know the law: its code is in no file. Draw by draw the
    spline has the law's force at its knots (:func:`scissorcal.model.response_of`).
    """
    stated = law_parameters(law)
    names = [parameter.name for parameter in fit.parameters]
    own = [index for index, name in enumerate(names) if name in stated]
    kept = [index for index, name in enumerate(names) if name not in stated]
    reference = float(fit.structure["reference_indentation_m"])

    def columns(rows: Array) -> Array:
        given = {n: np.full(len(rows), value) for n, (value, _) in stated.items()}
        given |= {names[index]: rows[:, index] for index in own}
        response = response_of(law, given, reference)
        spline = [np.asarray(response.force), np.asarray(response.exponent)]
        spline += list(np.asarray(response.shape).T)
        return np.column_stack([*spline, rows[:, kept]])

    draws, point = columns(fit.draws), columns(fit.map_point[None, :])[0]
    prior = None if fit.prior_draws is None else columns(fit.prior_draws)
    knots = tuple(float(knot) for knot in fit_knots(reference))
    shapes = [f"response_shape_{index}" for index in range(1, len(knots) - 1)]
    spline_names = ["response_force", "response_exponent", *shapes]
    parameters = tuple(
        FittedParameter(
            name,
            "N" if name == "response_force" else "1",
            identifiability=_narrowed(draws[:, index], prior, index),
            meaning=f"of the spline through {type(law).__name__}",
            **FittedParameter.summary_of(draws[:, index]),
        )
        for index, name in enumerate(spline_names)
    )
    derived = tuple(fit.parameters[index] for index in own)
    before = fit.derived_draws
    derived_draws = fit.draws[:, own] if before is None else np.hstack([fit.draws[:, own], before])
    return replace(
        fit,
        parameters=(*parameters, *(fit.parameters[index] for index in kept)),
        draws=draws,
        map_point=point,
        prior_draws=prior,
        structure=_as_spline(fit.structure, knots),
        candidates=tuple(_as_spline(row, knots) for row in fit.candidates),
        derived=(*derived, *fit.derived),
        derived_draws=derived_draws,
    )


def as_law_fit(fit: FitResult, law: ResponseLaw) -> FitResult:
    """The fit of :func:`as_spline_fit` in the law's own parameters again, to simulate and refit it.

    Its best point has them at their medians. Raises InputError where the fit is of another law.
    """
    wanted = [name for name, (_, sd) in law_parameters(law).items() if sd > 0.0]
    names = [parameter.name for parameter in fit.derived]
    if fit.derived_draws is None or not fit.candidate.startswith(f"{type(law).__name__} "):
        raise InputError(
            f"This fit is of another law ({fit.candidate}) than {type(law).__name__}: give the law "
            "that it was fitted with."
        )
    at = [names.index(name) for name in wanted if name in names]
    if len(at) < len(wanted):
        missing = ", ".join(name for name in wanted if name not in names)
        raise InputError(
            f"This fit has no draws of {missing}, so {type(law).__name__} was changed since: fit "
            "again, or give the law as it was."
        )
    kept = [i for i, p in enumerate(fit.parameters) if not p.name.startswith("response_")]
    own = fit.derived_draws[:, at]
    structure = {n: v for n, v in fit.structure.items() if n != "response_knots_m"}
    return replace(
        fit,
        parameters=(*(fit.derived[i] for i in at), *(fit.parameters[i] for i in kept)),
        draws=np.hstack([own, fit.draws[:, kept]]),
        map_point=np.concatenate([np.median(own, axis=0), fit.map_point[kept]]),
        prior_draws=None,
        structure={**structure, "response": "own", "response_law": law},
    )


def of_own_law(fit: FitResult) -> str:
    """The name of the law of one's own that a fit is of; empty for a family of the recipe's."""
    name = fit.candidate.partition(" response")[0]
    return name if fit.structure.get("response") == "spline" and name != "spline" else ""


def _narrowed(draws: Array, prior: Array | None, index: int) -> float:
    """The posterior's width over the prior's; 1 where either does not vary."""
    width = 0.0 if prior is None else float(np.std(prior[:, index]))
    return min(1.0, float(np.std(draws)) / width) if width > 0.0 else 1.0


def _as_spline(choices: Mapping[str, Any], knots: tuple[float, ...]) -> dict[str, Any]:
    """Choices of a law without the object; nested ones, too."""
    plain: dict[str, Any] = {}
    for name, value in choices.items():
        if name == "response_law":
            plain["response_knots_m"] = knots
        elif name == "response" and value == "own":
            plain[name] = "spline"
        else:
            plain[name] = _as_spline(value, knots) if isinstance(value, Mapping) else value
    return plain
