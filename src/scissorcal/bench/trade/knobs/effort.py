"""Effort of the fits: draft, standard, thorough."""

from dataclasses import replace
from typing import get_args

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import DRAFT_NOTE, PROCESSOR
from scissorcal.bench.trade.knobs.fit_knob import FitKnob
from scissorcal.bench.trade.point import Setting
from scissorcal.calibration import result

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
