"""What the blade's tip meets where it presses on the plate."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scissorcal.recipe.priors import Section


class Touch(Section):
    """What the tip meets where it presses on the plate ('scissorcal control').

    ``stiffness_N_per_mm`` decides the gains, which hold within a quarter of it: 10 is a tip on hard
    plastic through a thin blade. ``friction`` is that between tip and plate, ``peak_N`` by how much
    a touch may press harder than it shall, which limits the speed of the approach.
    """

    stiffness_N_per_mm: Annotated[float, Field(ge=0.1, le=1000, allow_inf_nan=False)] = 10.0
    friction: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.2
    peak_N: Annotated[float, Field(ge=0.3, le=50, allow_inf_nan=False)] = 1.0
