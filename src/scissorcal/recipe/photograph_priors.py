"""Priors of the fits of photographs: of the camera, of a blade's edge, of the plate's pose.

Every default is an argument about boards, printers, cameras and blades. Shapes and roughness of a
blade are in shares of its length, so that one default serves photographs with and without a scale;
the length itself is measured and no parameter of the fit. A key with ``_sd`` in its name is the
standard deviation of a quantity that is normal about zero.
"""

from typing import Annotated

from pydantic import Field

from scissorcal.recipe.priors import LogNormalPrior, Section

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
