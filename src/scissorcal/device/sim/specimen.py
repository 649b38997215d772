"""Specimens: the true properties of a virtual rig, its blades, the sheet and the hand.

A specimen is a TOML file under ``recipes/specimens``. The simulation reads it; a fit never
does. The keys have the units; the properties that end in ``_m`` or ``_rad`` give SI.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from scissorcal.device.sim.wave import Wave
from scissorcal.foreign.formats import SPECIMEN
from scissorcal.recipe.library import specimen_path
from scissorcal.recipe.load import load_toml

FORMAT = "scissorcal-specimen/1"

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
Range = tuple[Finite, Finite]
WavePoint = tuple[
    Annotated[float, Field(ge=-500, le=500, allow_inf_nan=False)],
    Annotated[float, Field(ge=-50, le=50, allow_inf_nan=False)],
]


def load_specimen(name_or_path: str | Path) -> Specimen:
    """Read a specimen by its name (``office-paper``) or from a file that ends in ``.toml``.

    Raises InputError, with the file, the line, the key and a suggestion, where it is missing or
    invalid.

    >>> load_specimen("office-paper").material.response
    'power'
    """
    text = str(name_or_path)
    path = Path(text) if text.endswith(".toml") else specimen_path(text)
    return load_toml(path, Specimen, SPECIMEN)


class Section(BaseModel):
    """Base of every table of a specimen: frozen, strict about keys and numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Blade(Section):
    """The cutting edge e(s) = offset + s tan(taper) + curvature s^2 / 2 of one blade.

    ``moving`` says which blades turn. ``tip_fade_mm`` is the length beyond the tip over which
    the edge lets go of the sheet: a tip is rounded, and a force that ended in a step would make
    energy. ``wave_mm`` are points [station, departure] of a smooth curve that is added to a line:
    a natural cubic spline, straight beyond its ends.
    """

    moving: Literal["both", "upper"] = "both"
    family: Literal["line", "arc"] = "line"
    offset_mm: Annotated[float, Field(ge=-50, le=50)]
    taper_deg: Annotated[float, Field(ge=-20, le=20)]
    curvature_per_m: Annotated[float, Field(ge=-5, le=5)] = 0.0
    length_mm: Annotated[float, Field(ge=10, le=500)]
    wave_mm: Annotated[tuple[WavePoint, ...], Field(min_length=3, max_length=200)] | None = None
    tip_fade_mm: Annotated[float, Field(ge=0.1, le=20)] = 1.0

    @model_validator(mode="after")
    def _curvature_needs_arc(self) -> Blade:
        if self.family == "line" and self.curvature_per_m != 0.0:
            raise ValueError('curvature_per_m needs family = "arc"')
        return self

    @model_validator(mode="after")
    def _wave_is_one_on_a_line(self) -> Blade:
        if self.wave_mm is None:
            return self
        if self.family != "line":
            raise ValueError('wave_mm needs family = "line": it is added to a straight edge')
        if any(end[0] <= start[0] for start, end in pairwise(self.wave_mm)):
            raise ValueError("wave_mm must have stations that rise strictly, from pivot to tip")
        return self

    @property
    def wave(self) -> Wave | None:
        """What departs from the line, in metres; None for a plain line or arc."""
        if self.wave_mm is None:
            return None
        return Wave([(1e-3 * station, 1e-3 * value) for station, value in self.wave_mm])

    @property
    def moving_blades(self) -> int:
        return 2 if self.moving == "both" else 1


class Friction(Section):
    """Friction of the opening axis, with its own levels for opening and for closing.

    F = sgn(w) [Fc + S exp(-(w / w_s)^2) + Fv |w|] [1 + a_1 (theta - c) + a_2 (theta - c)^2];
    at rest it holds against anything up to (Fc + S) times the angle's factor.
    """

    coulomb_opening_Nm: NonNegative
    coulomb_closing_Nm: NonNegative
    viscous_opening_Nm_s_per_rad: NonNegative
    viscous_closing_Nm_s_per_rad: NonNegative
    stribeck_Nm: NonNegative = 0.0
    stribeck_rate_rad_per_s: Annotated[float, Field(ge=1e-3, allow_inf_nan=False)] = 0.07
    angle_slope_per_rad: Finite = 0.0
    angle_curvature_per_rad2: Finite = 0.0
    angle_center_deg: Finite = 30.0


class AdvanceAxis(Section):
    """The axis along the cut: a carriage with dry and viscous friction between two stops."""

    mass_kg: Positive = 0.8
    coulomb_N: NonNegative = 0.8
    viscous_N_s_per_m: NonNegative = 4.0
    range_mm: Range = (-80.0, 250.0)


class Mechanism(Section):
    """Inertia, friction, stops and handle of the opening axis, and the advance axis."""

    inertia_kg_m2: Annotated[float, Field(ge=1e-6, allow_inf_nan=False)]
    torque_offset_Nm: Finite = 0.0
    handle_radius_mm: Positive = 60.0
    opening_range_deg: Range = (8.0, 55.0)
    friction: Friction
    advance: AdvanceAxis = AdvanceAxis()

    @model_validator(mode="after")
    def _ranges_ascend(self) -> Mechanism:
        low, high = self.opening_range_deg
        if not 0.1 <= low < high <= 85.0:
            raise ValueError("opening_range_deg must be [low, high] with 0.1 <= low < high <= 85")
        low, high = self.advance.range_mm
        if not low < high:
            raise ValueError("advance.range_mm must be [low, high] with low < high")
        law = self.friction
        for end in self.opening_range_deg:
            away = math.radians(end - law.angle_center_deg)
            if 1.0 + away * (law.angle_slope_per_rad + away * law.angle_curvature_per_rad2) < 0.05:
                raise ValueError(
                    f"friction.angle_slope_per_rad and angle_curvature_per_rad2 leave almost no "
                    f"friction at {end:g} deg: make them smaller"
                )
        return self


class Motor(Section):
    """Both motors: their limits, how late they follow, their cogging, and the brake.

    Cogging turns with the opening axis; a motor behind a capstan cogs many times per turn.
    """

    torque_limit_Nm: Positive = 1.5
    force_limit_N: Positive = 40.0
    lag_ms: Annotated[float, Field(ge=0.05, le=100)] = 1.0
    cogging_Nm: NonNegative = 3.0e-4
    cogging_periods_per_turn: NonNegative = 252.0
    brake_Nm_s_per_rad: NonNegative = 0.02
    brake_N_s_per_m: NonNegative = 60.0


class Sensors(Section):
    """Steps, zeros, noise and clock of the measurements.

    Torque and handle force carry white noise plus a slow first-order autoregressive part, each
    given by its standard deviation; ``noise_time_ms`` is the latter's time constant.
    """

    opening_step_rad: Positive = 2.0 * math.pi / 131072
    advance_step_um: Positive = 1.0
    torque_zero_Nm: Finite = 0.0
    torque_white_Nm: NonNegative = 8.0e-4
    torque_slow_Nm: NonNegative = 5.0e-4
    force_zero_N: Finite = 0.0
    force_white_N: NonNegative = 0.010
    force_slow_N: NonNegative = 0.006
    noise_time_ms: Annotated[float, Field(ge=1.0, le=1e4)] = 12.0
    handle_force_limit_N: Positive = 60.0
    clock_drift_ppm: Annotated[float, Field(ge=-500, le=500)] = 30.0


class Material(Section):
    """The plate: its response to the edge, and its toughness where it can be cut.

    ``response_force_N`` is the force at the reference indentation. Without
    ``toughness_J_per_m2`` nothing is cut. The crack starts at the local toughness and stops at
    ``kappa`` times it; the local toughness is the mean one times 1 + variation xi(X), with xi a
    smooth random field of unit variance whose mean over the sheet is exactly zero.
    """

    name: str
    thickness_mm: Annotated[float, Field(gt=0, le=50)]
    sheet_length_mm: Annotated[float, Field(ge=1, le=2000)] = 200.0
    response: Literal["power", "exponential"]
    response_force_N: Annotated[float, Field(ge=1e-3, le=1e3)]
    response_exponent: Annotated[float, Field(ge=0.1, le=20)]
    reference_indentation_mm: Annotated[float, Field(ge=0.01, le=20)] = 0.3
    rate_damping_N_s_per_m: Annotated[float, Field(ge=0, le=100)] = 0.0
    toughness_J_per_m2: Annotated[float, Field(ge=0.1, le=1e6)] | None = None
    kappa: Share = 1.0
    toughness_variation: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    correlation_length_mm: Annotated[float, Field(ge=0.2, le=100)] = 1.5

    @property
    def fracture_energy(self) -> float | None:
        """Mean energy per metre of cut, J_c h, in newtons; None where nothing is cut."""
        if self.toughness_J_per_m2 is None:
            return None
        return self.toughness_J_per_m2 * self.thickness_mm * 1e-3

    @property
    def reference_m(self) -> float:
        return self.reference_indentation_mm * 1e-3


class TouchedPlate(Section):
    """A plate that the upper blade's tip touches, where the wire puts it in (MATERIAL = 2).

    Its frame has z out of its face and its origin on it. A level plate has x along the rig's and
    z along the rig's y; ``pitch_deg`` turns it about the rig's z, then ``yaw_deg`` about y and
    ``roll_deg`` about x, each in the turned frame. A cylinder's axis lies along the plate's y, it
    and a sphere bulge towards the blades; ``extent_mm`` is where the plate begins and ends along
    its x. Drift and sway begin when it is put in, the step ``step_at_s`` later. The turns of step
    and sway are about the rig's z at the plate's origin.
    """

    surface: Literal["plane", "cylinder", "sphere"] = "plane"
    radius_mm: Annotated[float, Field(ge=1, le=1e5, allow_inf_nan=False)] | None = None
    place_mm: tuple[Finite, Finite, Finite]
    pitch_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    yaw_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    roll_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    extent_mm: Range = (0.0, 100.0)
    stiffness_N_per_mm: Annotated[float, Field(ge=0.1, le=200)] = 10.0
    damping_N_s_per_m: Annotated[float, Field(ge=0, le=200)] = 10.0
    friction: Annotated[float, Field(ge=0, le=1)] = 0.2
    drift_mm_per_s: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    step_mm: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    step_turn_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    step_at_s: NonNegative = 1.0
    sway_mm: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    sway_turn_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    sway_Hz: Annotated[float, Field(gt=0, le=10)] = 0.3

    @model_validator(mode="after")
    def _surface_is_whole(self) -> TouchedPlate:
        if (self.radius_mm is None) != (self.surface == "plane"):
            raise ValueError("radius_mm is needed for a cylinder or sphere, and for those alone")
        if not self.extent_mm[0] < self.extent_mm[1]:
            raise ValueError("plate.extent_mm must be [begin, end] with begin < end")
        return self

    @property
    def moves(self) -> bool:
        sways = (*self.sway_mm, self.sway_turn_deg)
        return any((*self.drift_mm_per_s, *self.step_mm, self.step_turn_deg, *sways))


class Hand(Section):
    """A virtual hand: springs towards smooth strokes, with tremor and limited strength.

    Where nothing can be cut, the hand presses ``press_depth_mm`` deep at ``press_contact_mm``
    from the pivot instead of closing all the way.
    """

    open_deg: Positive = 50.0
    closed_deg: Positive = 12.0
    opening_speed_rad_per_s: Positive = 1.0
    advance_speed_mm_per_s: Positive = 80.0
    pause_s: NonNegative = 0.15
    stiffness_Nm_per_rad: NonNegative = 4.0
    damping_Nm_s_per_rad: NonNegative = 0.04
    strength_N: Positive = 20.0
    advance_stiffness_N_per_m: NonNegative = 2000.0
    advance_damping_N_s_per_m: NonNegative = 60.0
    advance_strength_N: Positive = 25.0
    tremor_N: NonNegative = 0.12
    tremor_Hz: Annotated[float, Field(ge=1, le=100)] = 9.0
    margin_mm: Positive = 1.0
    press_depth_mm: Positive = 1.0
    press_contact_mm: Positive = 40.0


class Specimen(Section):
    """A whole specimen. ``format`` names the schema's version."""

    format: Literal["scissorcal-specimen/1"]
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    description: str = ""
    blade: Blade
    mechanism: Mechanism
    motor: Motor = Motor()
    sensors: Sensors = Sensors()
    material: Material
    plate: TouchedPlate | None = None
    hand: Hand = Hand()

    @model_validator(mode="after")
    def _hand_stays_between_stops(self) -> Specimen:
        low, high = self.mechanism.opening_range_deg
        if not low < self.hand.closed_deg < self.hand.open_deg < high:
            raise ValueError(
                "hand.closed_deg < hand.open_deg must lie within mechanism.opening_range_deg"
            )
        return self

    @model_validator(mode="after")
    def _edge_stays_below_upright(self) -> Specimen:
        blade = self.blade
        widest = self.mechanism.opening_range_deg[1] / blade.moving_blades
        taper = math.tan(math.radians(blade.taper_deg))
        wave = blade.wave
        end_mm = blade.length_mm + blade.tip_fade_mm
        leans = [(0.0, taper), (end_mm, taper + blade.curvature_per_m * end_mm * 1e-3)]
        if wave is not None:
            leans = [(1e3 * at, taper + slope) for at, slope in (wave.least, wave.largest)]
        for station_mm, slope in leans:
            lean = math.degrees(math.atan(slope))
            if not -80.0 < widest + lean < 80.0:
                raise ValueError(
                    f"the edge stands almost upright at {station_mm:g} mm when the blades are "
                    "wide open: lower blade.taper_deg, blade.curvature_per_m, the slopes of "
                    "blade.wave_mm or the opening range"
                )
        return self

    @property
    def upper_face_m(self) -> float:
        """Height of the plate's upper face: h/2 where both blades move, h where one does."""
        h = self.material.thickness_mm * 1e-3
        return h / 2 if self.blade.moving == "both" else h
