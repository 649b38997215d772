"""The plate's upper surface, touches of it, and its tracking: recipe tables and surface."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign_text, reading
from scissorcal.foreign.formats import SURFACE
from scissorcal.recipe.priors import Section

if TYPE_CHECKING:
    from scissorcal.model.surface import ProbedSurface, Surface

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


SMALLEST_RADIUS_MM = 2.0
"""Contact with a surface that bends more is no longer at one point; :mod:`scissorcal.model.surface`
refuses probed surfaces by the same figure."""

_COLUMNS = ("x_mm", "y_mm", "z_mm")


class PlateSurface(Section):
    """The shape of the upper face, in the plate's frame: it passes level through the origin.

    ``cylinder``: ``axis_deg`` turns its axis from x towards y; 0 lays it along the cut.
    ``radius_mm`` is positive where the face bulges, negative where it is hollow. ``spline``: a
    height field through the probed points of ``file``, a CSV file with the columns x_mm, y_mm and
    z_mm beside the recipe; ``probe_sd_mm`` is their standard deviation along the normal.
    """

    kind: Literal["plane", "cylinder", "sphere", "spline"] = "plane"
    radius_mm: Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)] | None = None
    axis_deg: Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)] = 0.0
    file: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    probe_sd_mm: Annotated[float, Field(ge=1e-4, le=1, allow_inf_nan=False)] = 0.02

    @model_validator(mode="after")
    def _keys_fit_the_kind(self) -> PlateSurface:
        round_ = self.kind in ("cylinder", "sphere")
        if round_ and self.radius_mm is None:
            raise ValueError(f'kind = "{self.kind}" needs radius_mm, such as radius_mm = 50')
        if round_ and abs(self.radius_mm or 0.0) < SMALLEST_RADIUS_MM:
            raise ValueError(
                f"radius_mm = {self.radius_mm:g} must be at least {SMALLEST_RADIUS_MM:g}, or at "
                f'most -{SMALLEST_RADIUS_MM:g} for a hollow face; a flat one has kind = "plane"'
            )
        if self.kind == "spline" and self.file is None:
            raise ValueError(
                'kind = "spline" needs file, the probed points, such as file = "heights.csv"'
            )
        wanted = {
            "radius_mm": ("cylinder", "sphere"),
            "axis_deg": ("cylinder",),
            "file": ("spline",),
            "probe_sd_mm": ("spline",),
        }
        for key, kinds in wanted.items():
            stated = getattr(self, key) != type(self).model_fields[key].default
            if stated and self.kind not in kinds:
                named = " or ".join(f'"{kind}"' for kind in kinds)
                raise ValueError(f'{key} needs kind = {named}; here kind = "{self.kind}"')
        return self


class Touch(Section):
    """What the tip meets where it presses on the plate ('scissorcal control').

    ``stiffness_N_per_mm`` decides the gains, which hold within a quarter of it: 10 is a tip on hard
    plastic through a thin blade. ``friction`` is that between tip and plate, ``peak_N`` by how much
    a touch may press harder than it shall, which limits the speed of the approach.
    """

    stiffness_N_per_mm: Annotated[float, Field(ge=0.1, le=1000, allow_inf_nan=False)] = 10.0
    friction: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.2
    peak_N: Annotated[float, Field(ge=0.3, le=50, allow_inf_nan=False)] = 1.0


def plate_surface(settings: PlateSurface, folder: Path) -> Surface:
    """The surface of a recipe's plate; ``folder`` is the one of the recipe, for ``file``.

    Raises InputError, with file and line, where the probed points are no height field.

    >>> plate_surface(PlateSurface(kind="sphere", radius_mm=40.0), Path())
    Sphere(radius_m=0.04)
    """
    from scissorcal.model.surface import Cylinder, Plane, Sphere

    radius_m = (settings.radius_mm or 0.0) * 1e-3
    if settings.kind == "plane":
        return Plane()
    if settings.kind == "cylinder":
        return Cylinder(radius_m, math.radians(settings.axis_deg))
    if settings.kind == "sphere":
        return Sphere(radius_m)
    return probed_surface(folder / (settings.file or ""), settings.probe_sd_mm).surface


def probed_surface(path: Path, probe_sd_mm: float) -> ProbedSurface:
    """Fit a height field to the probed points of a CSV file with the columns x_mm, y_mm, z_mm.

    Raises InputError with the file, and the line or the place in mm, for what is no number and for
    what :func:`scissorcal.model.surface.fit_height_field` refuses.
    """
    from scissorcal.model.surface import fit_height_field

    lines, points = _read(path)
    try:
        return fit_height_field(points, probe_sd_mm * 1e-3, [f"line {line}" for line in lines])
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _read(path: Path) -> tuple[list[int], list[list[float]]]:
    """Lines and points in metres."""
    import csv

    if not path.exists():
        raise InputError(
            f"{path} does not exist: plate.surface.file in the recipe names it. Put the probed "
            f"points there, with the columns {', '.join(_COLUMNS)}."
        )
    rows = csv.reader(read_foreign_text(path, SURFACE).splitlines(), quoting=csv.QUOTE_NONE)
    with reading(path, SURFACE):
        return _points(path, rows)


def _points(path: Path, rows: Any) -> tuple[list[int], list[list[float]]]:
    head = [name.strip() for name in next(rows, [])]
    if sorted(head) != sorted(_COLUMNS):
        raise InputError(
            f"{path}, line 1: the columns must be {','.join(_COLUMNS)}, with one point on each "
            "line below them."
        )
    order = [head.index(name) for name in _COLUMNS]
    lines, points = [], []
    for row in rows:
        if not row:
            continue
        try:
            values = [float(row[place]) * 1e-3 for place in order]
        except (IndexError, ValueError):
            values = []
        if len(row) != len(_COLUMNS) or not all(map(math.isfinite, values)) or not values:
            raise InputError(
                f"{path}, line {rows.line_num}: '{','.join(row)[:60]}' is no probed point; write "
                "three finite numbers in mm, such as '10,-5,0.02'."
            )
        lines.append(rows.line_num)
        points.append(values)
    return lines, points
