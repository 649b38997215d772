"""What a manifest states about its tables and its fits: how stored, how far off, from which law."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, Strict, model_validator

from scissorcal.recipe.schema import FrictionLawName, FrictionTerm

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
Text = Annotated[str, Field(max_length=10_000)]
Range = tuple[Finite, Finite]


class Section(BaseModel):
    """Base of every object in the manifest: frozen, no unknown keys, no conversions, no NaN."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True
    )


class StoredRow(Section):
    """A row of a table in 16-bit numbers q: its values are offset + scale q, in float32."""

    offset: Finite
    scale: NonNegative


class TableBound(Section):
    """How fine one table is, and how far it is from its law, in the table's unit.

    ``tolerance`` is what it was made for, as a share of its value. ``largest_seen`` was found by a
    dense search, ``proved`` holds everywhere between its ends: null where no proof is known.
    """

    table: Annotated[str, Field(pattern=r"^[a-z_]{1,40}$")]
    unit: Annotated[str, Field(max_length=40)]
    knots: Annotated[int, Field(ge=2)]
    number_format: Literal["float32", "int16"]
    tolerance: Positive
    largest_seen: NonNegative
    proved: NonNegative | None


class Bound(Section):
    """How far the kernel's float32 tables may be from the exact model in float64.

    ``largest_seen_Nm`` was found on ``points`` places of the scene independent of the tables'
    knots; ``stated_Nm`` is twice that and is what the package promises. ``share`` is the stated
    bound over ``scene_torque_Nm``, the largest torque in the scene; ``allowed_share`` is the part
    of the scene's tolerance that tables may use up. Torques are compared as they are rendered,
    within the torque limit, and at rates of at least ``from_rate_rad_per_s``, below which friction
    is smoothed deliberately. Points where the model itself jumps are left out: within 0.1 mm of the
    blade's tip, and where the edges are so nearly parallel that no force advances the crack; and
    where the response would exceed 1e5 N.
    """

    largest_seen_Nm: NonNegative
    stated_Nm: NonNegative
    scene_torque_Nm: NonNegative
    share: NonNegative
    allowed_share: Positive
    points: Annotated[int, Field(ge=1)]
    table_tolerance: Positive
    from_rate_rad_per_s: NonNegative
    proved_Nm: NonNegative | None = None
    not_proved: tuple[Text, ...] = ()
    tables: Annotated[tuple[TableBound, ...], Field(max_length=16)] = ()


class EdgeStructure(Section):
    """The edge that a cut was fitted with, from the recipe or photographs.

    Parameters of the fit that begin with ``edge_`` take the place of what stands here.
    """

    family: Literal["line", "arc", "cubic", "spline"]
    offset_m: Finite
    taper_rad: Finite
    length_m: Positive
    curvature_per_m: Finite
    bend_per_m2: Finite = 0.0
    spline_m: Annotated[tuple[Finite, ...], Strict(False), Field(max_length=64)] = ()
    spline_start_m: Finite = 0.0

    @model_validator(mode="after")
    def _spline_has_weights(self) -> EdgeStructure:
        if (self.family == "spline") != (len(self.spline_m) > 0):
            raise ValueError('an edge has weights in spline_m where its family is "spline" only')
        return self


class CutStructure(Section):
    """The discrete choices of a cut fit."""

    response: Literal["power", "exponential", "spline"]
    response_knots_m: Annotated[tuple[Positive, ...], Strict(False), Field(max_length=16)] = ()
    rate_damping: bool = False
    fracture: Literal["none", "smooth", "rippled"]
    closure: Literal["work", "eq4"]
    reference_indentation_m: Positive
    moving_blades: Literal[1, 2]
    upper_face_m: NonNegative
    edge: EdgeStructure

    @model_validator(mode="after")
    def _knots_ascend(self) -> CutStructure:
        knots = self.response_knots_m
        ascend = all(low < high for low, high in pairwise(knots))
        if (self.response == "spline") != (len(knots) > 2) or not ascend:
            raise ValueError("response_knots_m belong to a spline, ascend, and are three or more")
        return self


class FrictionStructure(Section):
    """The discrete choices of a friction fit."""

    law: FrictionLawName
    symmetric: bool
    angle_center: Finite
    adopt: Annotated[tuple[FrictionTerm, ...], Strict(False)] = ()


class Parameter(Section):
    """A fitted parameter: ``value`` is what the tables were compiled at, the rest its posterior."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_^*|()]{1,40}$")]
    unit: Annotated[str, Field(max_length=40)]
    value: Finite
    mean: Finite
    sd: NonNegative
    q05: Finite
    q50: Finite
    q95: Finite


STATED_SOURCE = "stated numbers, no recording"
"""The only source of a record whose numbers a person stated (:mod:`scissorcal.stated`)."""


class FitRecord(Section):
    """A fit that went into the package; its draws stand in ``draws/<what>.npy``.

    ``parameters`` are in the order of the draws' columns. ``warnings`` are the fit's failed
    verdicts, word for word, ``left_out`` the parts of its law that the tables do not render.
    """

    candidate: Annotated[Text, Field(validation_alias=AliasChoices("candidate", "rung"))]
    effort: Literal["draft", "standard", "thorough"]
    inputs_hash: Annotated[str, Field(max_length=200)]
    sources: tuple[Text, ...]
    parameters: Annotated[tuple[Parameter, ...], Field(min_length=1, max_length=128)]
    warnings: tuple[Text, ...]
    left_out: tuple[Text, ...] = ()

    @property
    def stated(self) -> bool:
        """Whether its numbers were stated, not fitted."""
        return self.sources == (STATED_SOURCE,)


class CutRecord(FitRecord):
    structure: CutStructure


class FrictionRecord(FitRecord):
    structure: FrictionStructure
