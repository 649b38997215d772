"""Length of the windows over which a fit of friction averages data and law alike."""

from dataclasses import replace

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import PROCESSOR
from scissorcal.bench.trade.knobs.fit_knob import FitKnob
from scissorcal.bench.trade.point import Setting
from scissorcal.calibration.signals.filtering import knot_samples

FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)
"""The cutoff over the present one: windows from eight times as long to a quarter as long."""


class Window(FitKnob):
    """Windows by their cutoff; the reference are the shortest, which keep the most of the data."""

    name = "window"
    title = "Windows of the friction fit"
    cost = PROCESSOR
    against = "the shortest windows"

    def missing(self, case: Case) -> str:
        """Every scene with a fit of friction has it."""
        if case.friction:
            return ""
        return "No fit averages over windows: the scene needs no fit of friction."

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Cutoffs around the present one whose windows differ by a sample at least."""
        present = case.recipe.fit.friction.cutoff_Hz
        rate_Hz = 1.0 / float(np.median(np.diff(case.friction[0].device_time_s)))
        found: dict[int, Setting] = {}
        for place, factor in enumerate(FACTORS, start=1):
            cutoff = factor * present
            knot = knot_samples(cutoff, rate_Hz)
            if knot not in found or factor == 1.0:
                label = f"{cutoff:.4g} Hz"
                found[knot] = Setting(label, cutoff, cutoff, "both fits", factor == 1.0, place)
        return tuple(found.values())

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with another fit.friction.cutoff_Hz."""
        friction = case.recipe.fit.friction.model_copy(update={"cutoff_Hz": setting.value})
        fit = case.recipe.fit.model_copy(update={"friction": friction})
        return replace(case, recipe=case.recipe.model_copy(update={"fit": fit}))
