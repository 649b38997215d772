"""What a manifest states about its tables: how they are stored, and how far they may be off."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

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
