"""All recommended settings at once, measured, beside the present ones."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import (
    PROCESSOR,
    expected_fits_s,
    fit_case,
    fits_errors,
    fits_outcome,
)
from scissorcal.bench.trade.knob import make_knob
from scissorcal.bench.trade.models import held_law, model_of_law, package_costs, tables_of
from scissorcal.bench.trade.pictures import fit_edge
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.bench.trade.torque import WORST, model_torque, scene_places
from scissorcal.package.average import AverageTorque
from scissorcal.package.compile import Compiled, scene_ranges
from scissorcal.package.exact import ExactModel

TOGETHER = "together"
PRESENT, RECOMMENDED = "present settings", "recommended settings"

BUILD_S = 5.0
"""Seconds to choose laws and tables and to time a step: a first guess for the schedule."""


class Together:
    """The whole chain, fits, laws and tables as a package's build makes them from the fits.

    Once with the present settings, and once with all recommended ones.

    ``choices`` are the recommended label of each knob that is `Knob.combined`. Errors are of what
    the tables render, against the most accurate fits of the knob ``effort``.
    """

    name = TOGETHER
    title = "All recommended settings at once"
    cost = PROCESSOR
    error = WORST
    against = "the most thorough effort"
    of_torque, stand_in, combined = True, True, True

    def __init__(self, choices: tuple[tuple[str, str], ...]) -> None:
        self.choices = choices

    def missing(self, case: Case) -> str:
        """Every scene has it."""
        return ""

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """The present settings, and the recommended ones."""
        return (
            Setting(PRESENT, 0.0, {}, present=True),
            Setting(RECOMMENDED, 1.0, dict(self.choices)),
        )

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with every knob at its choice, but for the edge of other photographs."""
        chosen = case
        for name, label in setting.value.items():
            knob, own = _choice(case, name, label)
            if not own.present:
                chosen = knob.applied(chosen, own)
        return chosen

    def expected_s(self, case: Case, setting: Setting) -> float:
        """The fits as they are now, which the recommended ones seldom exceed, and the package."""
        return expected_chain_s(case)

    def repeats(self, case: Case, setting: Setting) -> int:
        """Once."""
        return 1

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Fit, build as a package is built, time a step, and evaluate the tables over the scene."""
        chosen, seconds = self.prepared(case, setting, repeat)
        rng = np.random.default_rng([case.seed, repeat])
        cut, friction, costs, rejected = fit_case(chosen, repeat)
        costs[PROCESSOR] = Quantity(costs[PROCESSOR].value + seconds, "s")
        outcome: dict[str, Any] = fits_outcome(chosen, cut, friction)
        if cut is not None:
            model = model_of_law(held_law(chosen, cut, friction))
            compiled = tables_of(chosen, model)
            costs |= package_costs(chosen, model, compiled, rng)
            outcome["rendered"] = rendered_torque(chosen, model, compiled)
        return Sample(costs, outcome, rejected=rejected)

    def prepared(self, case: Case, setting: Setting, repeat: int) -> tuple[Case, float]:
        """The case with every choice, the edge of other photographs too; seconds for that edge."""
        chosen = self.applied(case, setting)
        if "photographs" not in setting.value:
            return chosen, 0.0
        _, own = _choice(case, "photographs", setting.value["photographs"])
        resolution = own.value["count"], own.value["factor"]
        rng = np.random.default_rng([case.seed, repeat])
        edge, seconds = fit_edge(case, resolution, rng)
        return replace(chosen, edge=edge.edge_posterior), seconds

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of parameters, of the tables' torque, and of the fits' band."""
        if reference is None:
            return {}
        outcome = {
            **sample.outcome,
            "torque": sample.outcome.get("rendered", sample.outcome["torque"]),
        }
        return fits_errors(case, replace(sample, outcome=outcome), reference)


def expected_chain_s(case: Case) -> float:
    """Seconds that the fits of a case and a package of them are expected to take."""
    return expected_fits_s(case) + BUILD_S


def _choice(case: Case, name: str, label: str) -> tuple[Any, Setting]:
    """A knob and one of its settings."""
    knob = make_knob(name)
    return knob, next(one for one in knob.settings(case) if one.label == label)


def rendered_torque(case: Case, model: ExactModel, compiled: Compiled) -> list[float | None]:
    """Torque of the tables at the places of the scene; None beyond the blade."""
    points = scene_places(case)
    ranges = scene_ranges(case.recipe)
    average = AverageTorque(compiled.mechanics, ranges, compiled.arrays)
    limit = case.recipe.limits.torque_Nm
    found = average.torque(points.opening, points.opening_rate, points.contact)
    exact = model_torque(case, model, points)
    torque = np.clip(found, -limit, limit)
    return [
        None if np.isnan(known) else float(value)
        for known, value in zip(exact, torque, strict=True)
    ]
