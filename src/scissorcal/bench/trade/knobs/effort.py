"""Knobs of both fits: their effort (draft, standard, thorough) and the windows of friction."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import get_args

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import (
    DRAFT_NOTE,
    PROCESSOR,
    expected_fits_s,
    fits_errors,
    measure_fits,
)
from scissorcal.bench.trade.point import Error, Sample, Setting
from scissorcal.bench.trade.torque import BAND_WORST
from scissorcal.calibration import result
from scissorcal.calibration.signals.filtering import knot_samples


class FitKnob(ABC):
    """Both fits are made anew with a setting; errors are those of parameters and of torque."""

    error = BAND_WORST
    of_torque, stand_in, combined = True, True, True

    @abstractmethod
    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with this setting."""

    def expected_s(self, case: Case, setting: Setting) -> float:
        """By the number of samples that the setting leaves, and by its effort."""
        return expected_fits_s(self.applied(case, setting))

    def repeats(self, case: Case, setting: Setting) -> int:
        """Once: equal data and equal random numbers give equal fits."""
        return 1

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Both fits with this setting."""
        return measure_fits(self.applied(case, setting), repeat)

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of parameters and of torque, against the reference."""
        return fits_errors(case, sample, reference) if reference else {}


EFFORTS: tuple[result.Effort, ...] = get_args(result.Effort)
REPEATS = {"draft": 3, "standard": 3, "thorough": 2}
"""Thorough effort is repeated to show its own sampling error: the first is the reference."""


class Effort(FitKnob):
    """How the posterior is computed; the reference is the most thorough effort that was made."""

    name = "effort"
    title = "Effort of the fits"
    cost = PROCESSOR
    against = "the most thorough effort"

    def missing(self, case: Case) -> str:
        """Every scene with a fit has it."""
        return ""

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Draft, standard and thorough."""
        return tuple(
            Setting(
                effort,
                place,
                effort,
                "both fits",
                present=effort == case.effort,
                accuracy=place,
                remark=DRAFT_NOTE if effort == "draft" else "",
            )
            for place, effort in enumerate(EFFORTS, start=1)
        )

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with another effort."""
        return replace(case, effort=setting.value)

    def repeats(self, case: Case, setting: Setting) -> int:
        """Three times; thorough twice."""
        return REPEATS[setting.label]


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
