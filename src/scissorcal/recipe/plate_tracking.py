"""What the tracking of a plate's pose assumes: how the plate moves, and how sensors err."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scissorcal.recipe.priors import Section

_Size = Annotated[float, Field(gt=0, le=1e4, allow_inf_nan=False)]
_SizeOrNone = Annotated[float, Field(ge=0, le=1e4, allow_inf_nan=False)]
_SdOrFit = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)] | Literal["auto"]

CLAMPED_mm_per_s, CLAMPED_deg_per_s = 0.01, 0.002
"""How a clamped plate creeps."""
LONGEST_DELAY_MS = 1000
"""Of a camera, either way: a pose that is predicted for longer says little."""


class PlateTracking(Section):
    """What 'scissorcal track' assumes of plate, camera and contact: standard deviations and times.

    Keys with ``_sd`` in their name are standard deviations; so are those of speed and turn, which
    say how fast a plate usually moves, and of the camera's and the contact's errors. "auto" takes
    an error that all pictures share from the fits of the camera and of the rig's card.
    """

    speed_mm_per_s: _Size = Field(
        default=CLAMPED_mm_per_s,
        description="usual speed of the plate in each axis: a clamped one creeps by thermal "
        "expansion and by cutting forces, less than the camera sees; 20 where a hand holds it",
    )
    turn_deg_per_s: _Size = Field(
        default=CLAMPED_deg_per_s,
        description="usual rate of its turning about each axis: 0.01 mm/s at 0.3 m from where it "
        "is clamped; 5 where a hand holds it",
    )
    motion_time_s: _Size = Field(
        default=0.5,
        description="how long it keeps a velocity: hands change direction about twice a second",
    )
    camera_bias_mm: _SdOrFit = Field(
        default="auto",
        description="constant error of place in all pictures; 0.3 where the camera's file has no "
        "covariance: 0.1 % of scale at 0.3 m",
    )
    camera_bias_deg: _SdOrFit = Field(
        default="auto",
        description="constant error of turn in all pictures; 0.1 where the camera's file has no "
        "covariance: what 'fit plate' finds between halves of real pictures",
    )
    camera_delay_ms: Annotated[
        float, Field(ge=-LONGEST_DELAY_MS, le=LONGEST_DELAY_MS, allow_inf_nan=False)
    ] = Field(
        default=0.0,
        description="from a picture's exposure to its time stamp, beyond the shortest delay of its "
        "arrival, which times of arrival cannot show; 'scissorcal track' measures it where it can",
    )
    contact_bias_mm: _SizeOrNone = Field(
        default=0.05,
        description="constant error of the tip's place in each axis: the length of a blade, its "
        "edge as it was photographed; 0 where it is known to be exact",
    )
    contact_bias_deg: _SizeOrNone = Field(
        default=0.2,
        description="constant turn of the rig's own places: errors of encoders and edge that are "
        "the same at the same place; 0.07 mm over 20 mm",
    )
    contact_white_mm: _Size = Field(
        default=0.02,
        description="error of the tip's place that is new at each contact: steps of the encoders, "
        "20 um at a tip 75 mm out where the opening is known to 0.015 deg",
    )
    contact_slow_mm: _Size = Field(
        default=0.1,
        description="error of the tip's place that changes slowly: play of the pivot, blades that "
        "bend, a rounded tip",
    )
    contact_slow_s: _Size = Field(
        default=2.0, description="how long that error stays: a few strokes of a tip"
    )
    compliance_sd_percent: _SizeOrNone = Field(
        default=20.0,
        description="how well 1 / plate.touch.stiffness_N_per_mm is known, by which plate and tip "
        "give way to a force: a fifth, as gains of 'control' need it to a quarter",
    )
    least_contact_N: _Size = Field(
        default=0.3,
        description="least force that counts as a contact: twice what dry friction of the pivot "
        "hides at the tip (10 mN m at 75 mm)",
    )
    contact_force_sd_N: _Size = Field(
        default=0.05,
        description="noise of the force at the tip: 4 mN m of torque at 75 mm",
    )
    friction_sd: _SizeOrNone = Field(
        default=0.1,
        description="how well plate.touch.friction is known: a half; for the direction of forces",
    )
    force_zero_sd_N: _SizeOrNone | None = Field(
        default=None,
        description="for an arm that measures the whole force on its tool (from Python; the rig "
        "measures none): how well that sensor's zero is known; "
        "without it the direction of forces is not used (0.05 N takes away what it tells)",
    )
