"""The recipe's schema: what a lab writes down about its rig, material and scene.

Units stand in the keys, as people write them (millimetres, degrees); the properties that end in
``_m`` or ``_rad`` give the same in SI for the rooms behind. Unknown keys and non-finite numbers
are refused.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from scissorcal.recipe.edge import Edge as Edge
from scissorcal.recipe.fields import (
    BETWEEN_percent,
    Between_percent,
    Count,
    Length_mm,
    NonNegative,
    Positive,
    Range,
    Speeds,
    Thickness_mm,
)
from scissorcal.recipe.friction import (
    AdvanceSettings,
    CaptureFrictionAdvance,
    FitFrictionAdvance,
)
from scissorcal.recipe.friction import CaptureFriction as CaptureFriction
from scissorcal.recipe.friction import FitFriction as FitFriction
from scissorcal.recipe.friction import FrictionLawName as FrictionLawName
from scissorcal.recipe.friction import FrictionTerm as FrictionTerm
from scissorcal.recipe.plate_layers import Plate, refuse_impossible_layers
from scissorcal.recipe.priors import (
    BladePriors,
    CameraPriors,
    CutPriors,
    LogNormalPrior,
    PlatePriors,
    Section,
)

Rendered = Literal["torque", "handle_force", "translation_force"]


class Control(Section):
    """Gains by which a motor-driven capture tracks its trajectory.

    "auto" takes them from the inertia, the friction and the delay that the probe of the rig found.
    Numbers are used as they are, and refused where the loop would be unstable.
    """

    opening_kp_Nm_per_rad: Positive | Literal["auto"] = "auto"
    opening_kd_Nm_s_per_rad: NonNegative | Literal["auto"] = "auto"
    opening_ki_Nm_per_rad_s: NonNegative | Literal["auto"] = "auto"
    advance_kp_N_per_m: Positive | Literal["auto"] = "auto"
    advance_kd_N_s_per_m: NonNegative | Literal["auto"] = "auto"
    advance_ki_N_per_m_s: NonNegative | Literal["auto"] = "auto"


class Line(Section):
    """The serial line to the device, and how long it waits for this computer.

    ``baud`` is the rate that the device is built for (USB devices ignore it). ``brake_after_ms``:
    without a command for so long the device brakes and latches a fault. Blades that nobody holds
    gain torque x time / inertia meanwhile, so the shortest that this computer keeps is the best:
    10 ms where the loop has real-time priority; elsewhere 'scissorcal device doctor' recommends
    one from what it measures (a computer that is late by 20 ms when it is busy needs 25 to 50).
    """

    baud: Annotated[int, Field(ge=9600, le=12_000_000)] = 921600
    brake_after_ms: Annotated[float, Field(ge=1, le=1000, allow_inf_nan=False)] = 10.0


class Probe(Section):
    """How far the probe may go before the first motor run, and how long it counts.

    The blades are pushed by growing torques up to ``largest_torque_Nm`` until they move, each push
    no farther than ``largest_angle_deg`` nor faster than ``largest_rate_rad_per_s``. A probe of the
    same rig counts for ``max_age_h``.
    """

    largest_torque_Nm: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] = 0.15
    largest_angle_deg: Annotated[float, Field(gt=0, le=30, allow_inf_nan=False)] = 3.5
    largest_rate_rad_per_s: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] = 1.5
    max_age_h: Annotated[float, Field(ge=0, le=168, allow_inf_nan=False)] = 4.0


class Rig(Section):
    """The device: which blades move, the handle, and the blade.

    ``motor_sign = -1`` turns the motor's torque round, commanded and measured, for a motor whose
    wires are swapped.
    ``opening_zero_sd_deg`` says how well the zero of the opening (where the centrelines of the
    blades meet) is known, as by a homing switch; half a millimetre at each tip where not given.
    ``hand_damping_N_s_per_m`` is what a hand adds to each handle at least, and what a rendering
    counts on; 0 asks for stability without a hand. The default is chosen: below what an arm showed
    (6.5 N s/m, doi:10.1038/srep18004).
    """

    joint: Literal["rotary", "linear"] = "rotary"
    moving: Literal["both", "upper"] = "both"
    handle_radius_mm: Length_mm = 60.0
    opening_zero_sd_deg: Annotated[float, Field(ge=0, le=45, allow_inf_nan=False)] | None = None
    hand_damping_N_s_per_m: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)] = 4.0
    edge: Edge
    control: Control = Control()
    line: Line = Line()
    motor_sign: Literal[1, -1] = 1
    probe: Probe = Probe()

    @property
    def moving_blades(self) -> int:
        return 2 if self.moving == "both" else 1

    @property
    def hand_damping_Nm_s_per_rad(self) -> float:  # noqa: N802
        """Damping of the opening by a hand: each handle moves by its radius times theta / m."""
        radius_m = self.handle_radius_mm * 1e-3
        return self.hand_damping_N_s_per_m * radius_m**2 / self.moving_blades


class Material(Section):
    """The plate that is cut or pressed. Its near edge is the zero of ``advance``.

    ``thickness_sd_mm`` says how well the thickness is known (standard deviation). Where it is
    given, the fit of a cut states the toughness J_c beside the fracture energy J_c h.
    """

    name: str
    thickness_mm: Thickness_mm
    thickness_sd_mm: Annotated[float, Field(ge=0, le=50, allow_inf_nan=False)] | None = None
    sheet_length_mm: Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False)] = 200.0

    @model_validator(mode="after")
    def _thickness_is_known_to_half(self) -> Material:
        if self.thickness_sd_mm is not None and self.thickness_sd_mm > 0.5 * self.thickness_mm:
            raise ValueError(
                f"thickness_sd_mm = {self.thickness_sd_mm:g} is more than half of thickness_mm = "
                f"{self.thickness_mm:g}: measure the plate better, or leave thickness_sd_mm out"
            )
        return self


class Scene(Section):
    """What is rendered, over which ranges, how fast and how well.

    ``simplify`` keeps the richest candidate and finest tables where false. ``number_format`` is
    that of the tables: "int16" halves their bytes in flash, and a program decodes them into RAM
    before it starts; without ``simplify`` they are "float32".
    """

    cut: bool = True
    render: Annotated[tuple[Rendered, ...], Strict(False), Field(min_length=1)] = ("torque",)
    render_friction: bool = True
    closure: Literal["work", "eq4"] = "work"
    plate_pose: Literal["known", "estimated"] = "known"
    opening_deg: Range
    opening_rate_rad_per_s: Range
    contact_mm: Range
    loop_rate_Hz: Annotated[float, Field(ge=1, le=100_000, allow_inf_nan=False)] = 1000.0
    tolerance_percent: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] = 7.0
    confidence_percent: Annotated[float, Field(gt=50, lt=100)] = 95.0
    simplify: bool = True
    number_format: Literal["float32", "int16"] = "float32"

    @model_validator(mode="after")
    def _ranges_ascend(self) -> Scene:
        for name in ("opening_deg", "opening_rate_rad_per_s", "contact_mm"):
            low, high = getattr(self, name)
            if not 0 <= low < high:
                raise ValueError(f"{name} must be [low, high] with 0 <= low < high")
        if self.opening_deg[1] > 180:
            raise ValueError("opening_deg must not exceed 180: it is the angle between the blades")
        if self.opening_rate_rad_per_s[1] > 100:
            raise ValueError("opening_rate_rad_per_s must not exceed 100: no hand closes faster")
        if self.contact_mm[1] > 1000:
            raise ValueError("contact_mm must not exceed 1000: it is a place along the blades")
        return self

    @property
    def opening_rad(self) -> tuple[float, float]:
        low, high = self.opening_deg
        return math.radians(low), math.radians(high)

    @property
    def contact_m(self) -> tuple[float, float]:
        low, high = self.contact_mm
        return low * 1e-3, high * 1e-3


class Limits(Section):
    """What the loop never exceeds, whatever the model says.

    It stops where the torque has been at its limit for ``held_at_limit_s``, less the time below it.
    """

    torque_Nm: Annotated[float, Field(gt=0, le=1e3, allow_inf_nan=False)] = 1.0
    torque_slew_Nm_per_s: Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)] = 200.0
    force_N: Annotated[float, Field(gt=0, le=1e5, allow_inf_nan=False)] = 30.0
    force_slew_N_per_s: Annotated[float, Field(gt=0, le=1e8, allow_inf_nan=False)] = 5000.0
    engagement_ramp_s: Annotated[float, Field(gt=0, le=60, allow_inf_nan=False)] = 0.5
    held_at_limit_s: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] = 2.0


class CaptureCut(Section):
    """Strokes through fresh material at stated speeds, or presses where nothing is cut."""

    speeds_rad_per_s: Speeds = (0.1, 0.25, 0.6)
    strokes_per_sheet: Count = 4
    sheets: Count = 3


class Capture(Section):
    """What 'scissorcal capture' takes. ``plan = "designed"``: the strokes that narrow the band of
    the scene's torque the most for their time ('scissorcal plan --explain' shows them); "listed":
    the speeds and numbers below; "auto": listed where the recipe gives any of them for that
    capture, else designed. ``handling_s`` is what a person needs to clear the blades, or to put in
    a fresh piece: it counts in a design's minutes.
    """

    plan: Literal["auto", "designed", "listed"] = "auto"
    handling_s: Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False)] = 20.0
    friction: CaptureFriction = CaptureFriction()
    friction_advance: CaptureFrictionAdvance = CaptureFrictionAdvance()
    cut: CaptureCut = CaptureCut()

    def designed(self, kind: Literal["friction", "cut"]) -> bool:
        """Whether a capture of this kind takes a designed list.

        >>> Capture().designed("cut"), Capture(cut=CaptureCut(sheets=2)).designed("cut")
        (True, False)
        """
        if self.plan == "auto":
            return kind not in self.model_fields_set
        return self.plan == "designed"


class FitCut(Section):
    """Families of the response and of fracture; "auto" compares them.

    The ``"spline"`` of the response has three parameters more, which most data leave to their
    priors: so ``"auto"`` compares the power law and the exponential, ``"auto+spline"`` all three.
    ``rate_damping = "fit"`` lets the force at the edge grow with the speed at which the blade sinks
    in, ``"auto"`` compares laws with and without; ``rate_damping_s_per_m`` is its prior.
    ``load_share`` does the same for friction of the pivot that grows with the cut's torque.
    ``lack_of_fit_percent`` is by how much the law may be wrong in each kind of segment (loading,
    unloading, running, teeth) without the data showing it; it widens every interval. The default
    is what it was wrong by on days of two rigs whose truth is known.
    ``between_recordings_percent`` is by how much two recordings of one material usually differ, as
    for ``fit.friction``.
    """

    response: Literal["auto", "power", "exponential", "spline", "auto+spline"] = "auto"
    fracture: Literal["auto", "smooth", "rippled"] = "auto"
    reference_indentation_mm: Annotated[float, Field(ge=1e-6, le=100, allow_inf_nan=False)] = 0.3
    response_force_N: LogNormalPrior = LogNormalPrior(median=2.0, factor_90=20.0)
    response_exponent: LogNormalPrior = LogNormalPrior(median=1.5, factor_90=3.0)
    rate_damping: Literal["none", "fit", "auto"] = "none"
    load_share: Literal["none", "fit", "auto"] = "auto"
    lack_of_fit_percent: Annotated[float, Field(ge=0, le=20, allow_inf_nan=False)] = 0.05
    rate_damping_s_per_m: LogNormalPrior = LogNormalPrior(median=3.0, factor_90=20.0)
    toughness_J_per_m2: LogNormalPrior | None = None
    critic: bool = True
    between_recordings_percent: Between_percent = BETWEEN_percent
    priors: CutPriors = CutPriors()

    @property
    def between_recordings(self) -> float:
        """Usual difference between recordings, as a share."""
        return 0.01 * self.between_recordings_percent


class FitCamera(Section):
    priors: CameraPriors = CameraPriors()


class FitBlade(Section):
    priors: BladePriors = BladePriors()


class FitPlate(Section):
    priors: PlatePriors = PlatePriors()


class Fit(Section):
    effort: Literal["draft", "standard", "thorough"] = "standard"
    camera: FitCamera = FitCamera()
    blade: FitBlade = FitBlade()
    plate: FitPlate = FitPlate()
    friction: FitFriction = FitFriction()
    friction_advance: FitFrictionAdvance = FitFrictionAdvance()
    cut: FitCut = FitCut()

    @property
    def advance(self) -> AdvanceSettings:
        """Settings of the carriage's fit, with the priors of friction."""
        return self.friction_advance.with_priors(self.friction.priors)


class Recipe(Section):
    """A whole recipe. ``format`` names the schema's version.

    ``unusual`` are keys whose numbers are meant although they are far from the everyday range, such
    as "rig.handle_radius_mm"; without it they are refused where the recipe is read.
    """

    format: Literal["scissorcal-recipe/1"]
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    description: str = ""
    specimen: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")] | None = None
    unusual: Annotated[tuple[str, ...], Strict(False)] = Field(default=(), exclude=True)
    rig: Rig
    material: Material
    scene: Scene
    plate: Plate = Plate()
    limits: Limits = Limits()
    capture: Capture = Capture()
    fit: Fit = Fit()

    @model_validator(mode="after")
    def _toughness_only_where_cut(self) -> Recipe:
        if self.scene.cut and self.fit.cut.toughness_J_per_m2 is None:
            raise ValueError(
                "fit.cut.toughness_J_per_m2 is missing: a scene that cuts (scene.cut = true) "
                "needs a prior for it, for example { median = 3000, factor_90 = 10 }"
            )
        if not self.scene.cut and self.fit.cut.toughness_J_per_m2 is not None:
            raise ValueError(
                "fit.cut.toughness_J_per_m2 is set, but scene.cut = false: nothing is cut, so "
                "remove the prior or set scene.cut = true"
            )
        return self

    @model_validator(mode="after")
    def _layers_can_be_cut(self) -> Recipe:
        refuse_impossible_layers(self.plate, self.scene.plate_pose, self.rig.joint)
        return self

    @property
    def upper_face_m(self) -> float:
        """Height of the plate's upper face: h/2 where both blades move, h where one does."""
        h = self.material.thickness_mm * 1e-3
        return h / 2 if self.rig.moving == "both" else h
