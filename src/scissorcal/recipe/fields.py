"""Types of keys in a recipe: numbers within bounds, lists, and names from a table."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, Strict
from pydantic_core import CoreSchema, core_schema


class OneOf:
    """One of some names: a literal whose names come from a table."""

    def __init__(self, *names: str) -> None:
        self.names = names

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.literal_schema(list(self.names))


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=1000)]
Range = Annotated[tuple[Finite, Finite], Strict(False)]

Length_mm = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]
"""No blade, handle or contact of scissors is longer than a metre: beyond it a unit went wrong."""

BETWEEN_percent = 2.0
"""Usual difference between recordings of one rig. Two of one positioning system gave
masses 1.5 % apart (EMPS; decision 075)."""
Between_percent = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]

Thickness_mm = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
Speed_rad_per_s = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
Speed_mm_per_s = Annotated[float, Field(gt=0, le=500, allow_inf_nan=False)]
MOST_SPEEDS = 100
"""Speeds that a list of a recipe holds."""
Speeds = Annotated[
    tuple[Speed_rad_per_s, ...], Strict(False), Field(min_length=1, max_length=MOST_SPEEDS)
]
SlidingSpeeds = Annotated[
    tuple[Speed_mm_per_s, ...], Strict(False), Field(min_length=1, max_length=MOST_SPEEDS)
]
