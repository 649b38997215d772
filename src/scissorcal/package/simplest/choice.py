"""What a scene needs of the fitted laws, and what leaving the rest out saves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from scissorcal.calibration.result import FitResult
from scissorcal.package.simplest.model import Simplified
from scissorcal.package.simplest.record import (
    AspectRecord,
    NonNegative,
    Record,
    Simplification,
    TriedCandidate,
)
from scissorcal.package.simplest.step_times import step_times
from scissorcal.recipe.schema import Recipe

FORMAT: Literal["scissorcal-scene-choice/1"] = "scissorcal-scene-choice/1"


class Saving(Record):
    """What one omission saves besides bytes.

    ``step_ns`` is how much less a step of the kernel takes (below 0: more), as measured.
    ``capture_s`` is the planned motion that no other part of the model needs.
    """

    aspect: str
    step_ns: float
    capture_s: NonNegative


class SceneChoice(Record):
    """The record of a simplification with what it saves, as measured when this was written.

    Times of a step (ns, median of repeats) are of the tables of the fitted laws and of those used,
    on the computer of that run; ``step_ratio`` is the median of their ratios, and
    ``step_spread_ns`` half of their range between quartiles, the largest of all tables timed: less
    is not a difference. ``evaluations`` of the likelihood and ``candidates`` compared are those of
    each fit: a recipe that names the simpler law spares the comparison.
    """

    format: Literal["scissorcal-scene-choice/1"]
    identity: str
    simplification: Simplification
    savings: Annotated[tuple[Saving, ...], Field(max_length=8)]
    step_ns_fitted: NonNegative
    step_ns_used: NonNegative
    step_ratio: NonNegative
    step_spread_ns: NonNegative
    evaluations: Mapping[str, int]
    candidates: Mapping[str, int]

    def saving(self, aspect: str) -> Saving | None:
        """What the omission of this aspect saves; None where nothing was left out of it."""
        return next((row for row in self.savings if row.aspect == aspect), None)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What the scene needs, then aspect by aspect what was left out or why it stays."""
        record = self.simplification
        lines = [record.sentence]
        for row in record.aspects:
            if row.omitted:
                lines.append(self._omission(row))
            elif row.tried:
                lines.append(f"{row.aspect}: {row.fitted} stays; {_refused(row.tried[-1])}.")
        if record.omissions:
            lines.append(
                f"A step takes {self.step_ns_used:.0f} ns, {self.step_ratio:.2f} of the "
                f"{self.step_ns_fitted:.0f} ns of the fitted laws (half of the "
                f"repeats lie within ±{self.step_spread_ns:.2g} ns); tables and draws take "
                f"{record.bytes_after:,} of {record.bytes_before:,} bytes."
            )
        return tuple(lines)

    def _omission(self, row: AspectRecord) -> str:
        saved = self.saving(row.aspect)
        assert row.alone is not None
        assert saved is not None
        what = "friction" if row.aspect == "friction" else "cut"
        kept = f"{row.used} is enough" if row.used != "none" else "none is needed"
        return (
            f"{row.aspect}: {kept} where the data support {row.fitted}; alone it costs "
            f"{row.alone.words} and saves {row.saved_bytes:,} bytes, "
            f"{self._time(saved.step_ns)} and {saved.capture_s:.3g} s of capture. The fit of "
            f"{what} took "
            f"{self.evaluations.get(what, 0):,} evaluations for {self.candidates.get(what, 0)} "
            "candidates; a recipe that names the simpler one spares the others."
        )

    def _time(self, saved_ns: float) -> str:
        """What an omission saves of a step, where it exceeds the spread of the repeats."""
        if abs(saved_ns) <= self.step_spread_ns:
            return f"no time of a step that its repeats show (±{self.step_spread_ns:.2g} ns)"
        return f"{saved_ns:.1f} ns a step"


def scene_choice(
    recipe: Recipe,
    simplified: Simplified,
    fits: Mapping[str, FitResult | None],
    identity: str = "",
) -> SceneChoice:
    """Measure what a simplification saves: steps are timed here and now.

    ``fits`` are those that were simplified, by name; ``identity`` is what a workspace knows the
    result by.
    """
    omitted = [one for one in simplified.walked if one.after is not one.before]
    times = step_times(simplified.tables, recipe)
    savings = tuple(
        Saving(
            aspect=one.aspect,
            step_ns=times[index].median - times[index + 1].median,
            capture_s=spare_sweeps_s(recipe) if one.aspect == "friction" else 0.0,
        )
        for index, one in enumerate(omitted)
    )
    there = {what: fit for what, fit in fits.items() if fit is not None}
    return SceneChoice(
        format=FORMAT,
        identity=identity,
        simplification=simplified.record,
        savings=savings,
        step_ns_fitted=times[0].median,
        step_ns_used=times[-1].median,
        step_ratio=times[-1].ratio,
        step_spread_ns=0.5 * max(row.high - row.low for row in times),
        evaluations={what: _evaluations(fit.diagnostics) for what, fit in there.items()},
        candidates={what: len(fit.candidates) for what, fit in there.items()},
    )


def spare_sweeps_s(recipe: Recipe) -> float:
    """Seconds of planned friction sweeps at speeds that neither the scene nor the cut needs.

    A law of friction that is simpler over the scene needs no sweep outside of the scene's rates;
    the fit of the cut needs friction at the speeds of its strokes. Both directions and all repeats
    count, without ramps. A designed capture sweeps at the scene's rates only: it has none to spare.
    """
    scene, capture = recipe.scene, recipe.capture
    if capture.designed("friction"):
        return 0.0
    needed = [*scene.opening_rate_rad_per_s, *capture.cut.speeds_rad_per_s]
    spare = [v for v in capture.friction.speeds_rad_per_s if not min(needed) <= v <= max(needed)]
    low, high = scene.opening_rad
    return float(
        2 * capture.friction.repeats * (high - low) * np.sum(1.0 / np.array([*spare, math.inf]))
    )


def _refused(tried: TriedCandidate) -> str:
    """Why the richest of the candidates that were tried was not taken."""
    cost = f"{tried.name} would cost {tried.cost.words}"
    return f"{cost} and save nothing" if tried.verdict == "not cheaper" else cost


def _evaluations(diagnostics: Mapping[str, Any]) -> int:
    return int(diagnostics.get("evaluations", 0))
