"""What a recipe says of friction: empty motion of both axes to capture, and laws to fit to it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field, Strict

from scissorcal.model.friction_terms import CANDIDATES, TERMS, law_names
from scissorcal.recipe.fields import (
    BETWEEN_percent,
    Between_percent,
    Count,
    Length_mm,
    OneOf,
    SlidingSpeeds,
    Speeds,
)
from scissorcal.recipe.priors import JointPriors, Section

FrictionLawName = Annotated[str, OneOf(*law_names())]
FrictionTerm = Annotated[str, OneOf(*(term.name for term in TERMS.values() if term.adoptable))]

OLD_LAW_KEY = "rung"
"""What ``law`` was called: it is still read, and the identities of stored results have it."""

ADVANCE_CANDIDATES = ("coulomb+viscous", "coulomb+viscous+presliding")
"""Laws of a carriage that are compared where the recipe names none, cheapest first.

Without viscous friction the mass would take its part. No load of a carriage is measured, and its
short travel hardly shows how friction changes with the place. Commands have no noise, so that
Stribeck friction would be taken for whatever else a law lacks, at a level that nothing determines:
name it where slow sweeps show it."""


class CaptureFriction(Section):
    """Empty closing and opening at several speeds, then excited motion for the inertia."""

    speeds_rad_per_s: Speeds = (0.05, 0.12, 0.3, 0.7, 1.5)
    repeats: Count = 2
    excitation_s: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] = 10.0


class CaptureFrictionAdvance(Section):
    """Empty motion of the carriage, both ways at several speeds, then excited motion for its mass.

    The blades stand open. Sweeps cover ``travel_mm`` in the middle of the carriage's stops.
    """

    speeds_mm_per_s: SlidingSpeeds = (5.0, 12.0, 30.0, 80.0)
    repeats: Count = 2
    excitation_s: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] = 8.0
    travel_mm: Length_mm = 60.0


class FrictionLaws(Section):
    """What the fits of friction of both axes may be told; see :class:`FitFriction`."""

    law: Annotated[
        str,
        OneOf("auto", *law_names()),
        Field(validation_alias=AliasChoices("law", OLD_LAW_KEY)),
    ] = "auto"
    symmetry: Literal["auto", "symmetric", "asymmetric"] = "auto"
    adopt: Annotated[tuple[FrictionTerm, ...], Strict(False)] = ()
    cutoff_Hz: Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False)] = 75.0
    critic: bool = True
    between_recordings_percent: Between_percent = BETWEEN_percent

    @property
    def between_recordings(self) -> float:
        """Usual difference between recordings, as a share."""
        return 0.01 * self.between_recordings_percent


class FitFriction(FrictionLaws):
    """``law = "auto"`` compares the candidate laws; ``symmetry = "auto"`` compares both.

    ``adopt`` adds terms that the critic proposed, by name. ``cutoff_Hz`` is where the weights of
    the windows, over which data and law are averaged alike, pass half; they are longer where the
    encoder is too coarse for that.
    ``critic`` searches the residuals for terms that the law lacks (at draft effort only where the
    command line asks for it).
    ``between_recordings_percent`` is by how much two recordings of one rig usually differ: the
    scale of the prior of their scatter, which counts from two recordings on.
    """

    priors: JointPriors = JointPriors()

    @property
    def candidates(self) -> tuple[str, ...]:
        """Laws that ``law = "auto"`` compares, cheapest first."""
        return CANDIDATES

    @property
    def lack_of_fit(self) -> float:
        """Share by which a law may be wrong without the data showing it."""
        return 0.0


class FitFrictionAdvance(FrictionLaws):
    """As ``fit.friction``, of the carriage, with the priors of a linear joint there.

    Its drive is the commanded force, which has no noise, so the data would claim more than a motor
    keeps: ``lack_of_fit_percent`` is by how much mass and levels may be wrong (sd) without the data
    showing it, as by how the force follows its command. That newtons are those of the command is
    not in it. Laws that differ by less than that are equivalent.
    """

    cutoff_Hz: Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False)] = 25.0
    lack_of_fit_percent: Annotated[float, Field(ge=0, le=20, allow_inf_nan=False)] = 1.0

    def with_priors(self, priors: JointPriors) -> AdvanceSettings:
        """The settings of a fit."""
        return AdvanceSettings(**{**self.model_dump(), "priors": priors})


class AdvanceSettings(FitFriction):
    """Settings of the carriage's fit: the table of the recipe, and the priors."""

    lack_of_fit_percent: float

    @property
    def candidates(self) -> tuple[str, ...]:
        """Laws that ``law = "auto"`` compares, cheapest first."""
        return ADVANCE_CANDIDATES

    @property
    def lack_of_fit(self) -> float:
        """Share by which a law may be wrong without the data showing it."""
        return 0.01 * self.lack_of_fit_percent


def as_first_named(settings: Any) -> Any:
    """Settings, as JSON has them, under the keys that identities of stored results have."""
    if isinstance(settings, list | tuple):
        return [as_first_named(item) for item in settings]
    if isinstance(settings, dict):
        return {
            OLD_LAW_KEY if key == "law" else key: as_first_named(item)
            for key, item in settings.items()
        }
    return settings
