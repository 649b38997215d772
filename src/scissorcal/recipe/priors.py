"""The forms of a prior in a recipe, and the priors of friction, of a cut and of photographs.

Every default is an argument about machines of the kind, or about boards, printers, cameras and
blades, written beside its number (that of a row of friction in
:mod:`scissorcal.model.friction_terms`); none is taken from the data that a fit judges. Shapes and
roughness of a blade are in shares of its length, so that one default serves photographs with and
without a scale; the length itself is measured and no parameter of the fit. A key with ``_sd`` in
its name is the standard deviation of a quantity that is normal about zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, create_model

from scissorcal.model.friction_terms import ADOPTED, PARAMETERS, ZERO
from scissorcal.model.terms import IDENTITY, LOG, LOGIT, JointKind, Prior, Term, Transform


class Section(BaseModel):
    """Base of every table of the recipe: frozen, strict about keys, types and numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class AnyPrior(Section):
    """A prior, normal in its ``transform``: two keys, its centre and then its width."""

    transform: ClassVar[Transform]

    def normal(self) -> tuple[float, float]:
        """Mean and standard deviation of what the transform makes of the quantity."""
        centre, width = (getattr(self, name) for name in type(self).model_fields)
        return self.transform.normal_prior(centre, width)


class LogNormalPrior(AnyPrior):
    """A positive quantity, log-normal: ``median``, and the factor that holds 90 % of it.

    ``{ median = 3000, factor_90 = 10 }`` says: between 300 and 30000 with 90 % probability.
    """

    transform = LOG
    median: Annotated[float, Field(ge=1e-9, le=1e9, allow_inf_nan=False)]
    factor_90: Annotated[float, Field(gt=1, le=1e6, allow_inf_nan=False)]

    @property
    def log_sd(self) -> float:
        """Standard deviation of the logarithm."""
        return self.normal()[1]


class NormalPrior(AnyPrior):
    """A quantity of either sign, normal with ``mean`` and standard deviation ``sd``."""

    transform = IDENTITY
    mean: Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]
    sd: Annotated[float, Field(ge=1e-12, le=1e9, allow_inf_nan=False)]


class LogitNormalPrior(AnyPrior):
    """A share between 0 and 1: its ``median``, and the factor that holds 90 % of its odds.

    ``{ median = 0.7, odds_factor_90 = 5 }``: odds of 7 to 3, times or over 5, are 0.32 and 0.92.
    """

    transform = LOGIT
    median: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)]
    odds_factor_90: Annotated[float, Field(gt=1, le=1e6, allow_inf_nan=False)]


_FORMS: tuple[type[AnyPrior], ...] = (LogNormalPrior, NormalPrior, LogitNormalPrior)


class FrictionPriors(Section):
    """Priors of a friction fit for one kind of joint, by the keys of the table's rows."""

    def of(self, term: Term, kind: JointKind) -> tuple[float, float]:
        """Mean and standard deviation of a row's unconstrained parameter (ticks for a delay)."""
        prior: AnyPrior = getattr(self, term.prior_key(kind))
        return prior.normal()

    def adopted(self, kind: JointKind) -> float:
        """Standard deviation of what an adopted term adds at the reference motion."""
        prior: NormalPrior = getattr(self, _adopted_key(kind))
        return prior.sd

    def zero(self, kind: JointKind) -> float:
        """Standard deviation of the drive's zero where no idle second shows it."""
        prior: NormalPrior = getattr(self, _zero_key(kind))
        return prior.sd


def _adopted_key(kind: JointKind) -> str:
    """The recipe's name of the prior that adopted terms share."""
    return "adopted_Nm" if kind == "rotary" else "adopted_N"


def _zero_key(kind: JointKind) -> str:
    """The recipe's name of the prior of the drive's zero."""
    return "zero_Nm" if kind == "rotary" else "zero_N"


def _section(name: str, kind: JointKind) -> type[FrictionPriors]:
    """A section with one key for every row of the table that has a prior."""
    fields: dict[str, Any] = {}
    for term in PARAMETERS.values():
        if term.prior is not None:
            fields[term.prior_key(kind)] = _field(term.transform, term.prior, kind, term.meaning)
    fields[_adopted_key(kind)] = _field(IDENTITY, ADOPTED, kind, "effort of an adopted term")
    zero = "zero of the drive without an idle second"
    fields[_zero_key(kind)] = _field(IDENTITY, ZERO, kind, zero)
    made = create_model(name, __base__=FrictionPriors, **fields)
    made.__doc__ = f"Priors of a friction fit to a {kind} joint."
    return made


def _field(transform: Transform, prior: Prior, kind: JointKind, meaning: str) -> tuple[Any, Any]:
    *numbers, why = prior.of(kind)
    form = next(form for form in _FORMS if form.transform is transform)
    stated = form(**dict(zip(form.model_fields, numbers, strict=True)))
    return form, Field(default=stated, description=f"{meaning}: {why}")


if TYPE_CHECKING:
    RotaryFrictionPriors = FrictionPriors
    LinearFrictionPriors = FrictionPriors
else:
    RotaryFrictionPriors = _section("RotaryFrictionPriors", "rotary")
    LinearFrictionPriors = _section("LinearFrictionPriors", "linear")


class JointPriors(Section):
    """Priors of a friction fit by kind of joint; a fit takes those of its recording's joint."""

    rotary: RotaryFrictionPriors = RotaryFrictionPriors()
    linear: LinearFrictionPriors = LinearFrictionPriors()

    def of(self, kind: JointKind) -> FrictionPriors:
        """Priors for one kind of joint."""
        return self.rotary if kind == "rotary" else self.linear


class CutPriors(Section):
    """Priors of what a cut's fit infers beside force, exponent and toughness."""

    kappa: LogitNormalPrior = Field(
        default=LogitNormalPrior(median=0.7, odds_factor_90=5.2),
        description="share of the fracture energy at which a running crack stops: 0.31 to 0.92",
    )
    rest_phase: NormalPrior = Field(
        default=NormalPrior(mean=0.65, sd=0.25),
        description="where in the cycle cracks rest, 0 just after a jump and 1 before the next: "
        "blades that yield stall where the torque is highest",
    )
    rest_spread: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.2, factor_90=5.2),
        description="spread of that in cycles: 0.29 is uniform, blades that stall leave less; wide,"
        " or the scatter of rests would decide kappa",
    )
    toughness_variation: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.04, factor_90=3.2),
        description="relative variation of the toughness along a sheet",
    )
    toughness_variation_length_mm: LogNormalPrior = Field(
        default=LogNormalPrior(median=1.5, factor_90=2.3),
        description="length over which the toughness varies: that of fibres and threads",
    )
    sheet_variation: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.004, factor_90=5.2),
        description="relative variation of the toughness between sheets: 0.08 to 2 %",
    )
    noise_scale: LogNormalPrior = Field(
        default=LogNormalPrior(median=1.0, factor_90=1.4),
        description="noise of elastic segments over that of the empty sweeps",
    )
    response_shape: NormalPrior = Field(
        default=NormalPrior(mean=0.0, sd=0.5),
        description="change of a spline's log exponent from one interval to the next",
    )
    torque_delay_ticks: NormalPrior = Field(
        default=NormalPrior(mean=0.08, sd=0.06),
        description="a motor that lags by 0 to 2 ticks is late by 0 to 0.13",
    )
    load_share: NormalPrior = Field(
        default=NormalPrior(mean=0.0, sd=0.1),
        description="share of the cut's torque that friction adds: up to 0.1 in jaw tools",
    )
    friction_sd_floor_Nm: Annotated[float, Field(gt=0, le=1e3, allow_inf_nan=False)] = Field(
        default=1e-4,
        description="least sd of friction in a stroke: levels differ by stroke and speed by more "
        "than the empty sweeps' posterior says",
    )


_Size = Annotated[float, Field(gt=0, le=1e4, allow_inf_nan=False)]
_SizeOrNone = Annotated[float, Field(ge=0, le=1e4, allow_inf_nan=False)]
_ShareOrNone = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]


class CameraPriors(Section):
    """Priors of a camera's fit. Its own parameters have none: a board determines them."""

    bulge_sd_mm: _Size = Field(
        default=1.0,
        description="how far the board's middle stands out, along its width and its height: a "
        "sheet glued to something stiff bends less",
    )


class PrintPriors(Section):
    """What is unknown of a printed target."""

    print_scale_sd_percent: _SizeOrNone = Field(
        default=0.1,
        description="error of the printer's scale along each axis: 0.1 mm in 100 mm, that of a "
        "laser printer; 0 where the print was measured",
    )


class PlatePriors(PrintPriors):
    """Priors of the plate's pose, and of the pose in each picture of a track."""

    corner_sd_px: _Size = Field(
        default=0.05,
        description="error of a corner of which there is one photograph: sharp corners are found "
        "to 0.02 to 0.2 px",
    )
    corner_weight: _SizeOrNone = Field(
        default=2.0,
        description="how many residuals corner_sd_px counts for: as many as a lone marker has left",
    )


class BladePriors(PrintPriors):
    """Priors of an edge: of what moves a whole photograph, of its shape, of its errors' sizes."""

    tone_sd_percent: _SizeOrNone = Field(
        default=12.0,
        description="shift of a border in shares of its blur, since a camera's tone curve differs "
        "from sRGB",
    )
    grain_percent: _ShareOrNone = Field(
        default=50.0,
        description="share of a border point's noise that its neighbours have too, by streaks of "
        "brushed metal",
    )
    scale_sd_percent: _SizeOrNone = Field(
        default=0.5, description="error of a scale that is stated where no mat is seen (--scale)"
    )
    tilt_sd_deg: _SizeOrNone = Field(
        default=4.0,
        description="tilt of the camera about each axis where no mat shows it: held by hand above "
        "the sheet",
    )
    pair_length_sd_percent: _SizeOrNone = Field(
        default=1.0,
        description="difference of the two blades of a pair in length: ground to one length, worn "
        "and sharpened apart",
    )
    pivot_sd_px: _SizeOrNone = Field(
        default=1.0, description="error of a pivot that is stated where no hole shows it (--pivot)"
    )
    offset_sd_percent: _Size = Field(
        default=40.0,
        description="edge offset at the pivot in shares of the blade's length: an edge lies within "
        "the blade's width",
    )
    slope_sd: _Size = Field(
        default=0.3, description="slope of the edge against the centreline: a taper of 17 deg"
    )
    curvature_sd_per_length: _Size = Field(
        default=0.1,
        description="curvature times length: the slope changes by that from pivot to tip, 6 deg",
    )
    bend_sd_per_length2: _Size = Field(
        default=0.4,
        description="change of the curvature times length squared: the slope changes by half of "
        "that, 11 deg",
    )
    bending_per_length: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.1, factor_90=26.8),
        description="size of a spline's curvature times length: that of an arc, and any between "
        "straight and serrated",
    )
    noise_factor: LogNormalPrior = Field(
        default=LogNormalPrior(median=1.2, factor_90=1.93),
        description="noise of edge points over what the residuals of each say: these miss what "
        "neighbours share",
    )
    roughness_percent: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.004, factor_90=11.8),
        description="sd of the edge about its family in shares of the length: 3 um of 75 mm is a "
        "ground edge, 30 um one that was hand-sharpened",
    )
    roughness_length_percent: LogNormalPrior = Field(
        default=LogNormalPrior(median=2.0, factor_90=2.68),
        description="length over which the roughness is alike in shares of the blade's: 1.5 mm of "
        "75 mm, 0.6 to 4 mm",
    )
    streak_percent: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.003, factor_90=7.2),
        description="sd of what neighbours in one photograph share, by compression and light, in "
        "shares of the length: 0.04 px where the blade is 1200 px long",
    )
    between_percent: LogNormalPrior = Field(
        default=LogNormalPrior(median=0.007, factor_90=11.8),
        description="sd between photographs in shares of the length: on the mat they agree to "
        "micrometres, those of two blades may differ by a tenth",
    )
