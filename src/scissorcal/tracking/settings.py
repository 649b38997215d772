"""What the filter assumes of plate, camera and contact: standard deviations and times, in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.aliases import Array

if TYPE_CHECKING:
    from scissorcal.recipe.plate_surface import PlateTracking
    from scissorcal.recipe.schema import Recipe


CAMERA_GATE = 22.458
"""Chi-square of 6 degrees of freedom that 0.1 % exceed."""
CONTACT_GATE = 10.828
"""Chi-square of 1 degree of freedom that 0.1 % exceed."""
FORCE_GATE = 13.816
"""Chi-square of 2 degrees of freedom that 0.1 % exceed."""


@dataclass(frozen=True)
class PlateMotion:
    """How the plate moves: velocities that fluctuate around 0 and keep for a time.

    A first-order Gauss-Markov process in each axis (Bar-Shalom, Li and Kirubarajan 2001, section
    8.2, doi:10.1002/0471221279): standard deviation and correlation time. A plate at rest is a
    case of it. ``still`` leaves velocities out altogether.
    """

    speed_m_per_s: float = 0.02
    spin_rad_per_s: float = math.radians(5.0)
    time_s: float = 0.5
    still: bool = False


@dataclass(frozen=True)
class CameraErrors:
    """What all pictures share: how the camera's poses are off, in the rig's axes; and the gate.

    The biases of turn and place are constant; 0 takes the camera as exact but for its noise.
    ``shared`` (6, 6), of rotation vector (rad) and place (m), takes the place of both where it is
    known from the camera's fit.
    """

    turn_bias_rad: float = math.radians(0.1)
    place_bias_m: float = 0.3e-3
    shared: tuple[tuple[float, ...], ...] | None = None
    gate: float = CAMERA_GATE
    refused_until_restart: int = 15

    @property
    def bias_covariance(self) -> Array:
        """Covariance (6, 6) of the bias: rotation vector (rad), then place (m)."""
        if self.shared is not None:
            return np.array(self.shared)
        return np.diag(np.repeat([self.turn_bias_rad, self.place_bias_m], 3) ** 2)


@dataclass(frozen=True)
class ContactErrors:
    """What contact rows assume.

    ``turn_bias_rad`` and ``place_bias_m`` are constant, in each of the rig's axes: how the rig's
    own places are turned (about the plate's origin) and shifted, by the tip's length, the blade's
    edge, encoders that err alike at the same place. ``white_m`` is new in each row, ``slow_m``
    fluctuates with ``slow_time_s`` (a first-order process: the tip's wear, its play). The plate
    gives way by ``compliance_m_per_N`` times the force, known to ``compliance_sd_m_per_N``.
    ``force_filter_s`` smooths the force that the compliance is regressed on, and ``force_sd_N`` is
    the noise of the raw one. ``bilinear_time_s`` is the time over which the second-order terms of
    rows repeat themselves; 0 leaves those terms out.
    """

    turn_bias_rad: float = math.radians(0.2)
    place_bias_m: float = 0.05e-3
    white_m: float = 0.02e-3
    slow_m: float = 0.1e-3
    slow_time_s: float = 2.0
    compliance_m_per_N: float = 1e-4
    compliance_sd_m_per_N: float = 2e-5
    force_sd_N: float = 0.05
    force_filter_s: float = 0.15
    bilinear_time_s: float = 0.1
    least_force_N: float = 0.3
    gate: float = CONTACT_GATE
    refused_until_restart: int = 100


@dataclass(frozen=True)
class ForceErrors:
    """What rows of the force's direction assume: a mean over ``every_s``, and friction.

    ``noise_N`` is that of one sample. ``zero_sd_N`` says how well the zero of the force sensor is
    known; where it is None no row is taken. The zero is a state: one of 0.05 N takes away nearly
    all that the direction tells, and the filter finds that by itself.
    """

    zero_sd_N: float | None = None
    noise_N: float = 0.05
    least_force_N: float = 1.0
    least_speed_m_per_s: float = 2e-3
    every_s: float = 0.1
    friction: float = 0.2
    friction_sd: float = 0.1
    gate: float = FORCE_GATE


@dataclass(frozen=True)
class TrackingSettings:
    """All assumptions of a filter. ``horizon_s`` is how late a picture may be."""

    plate: PlateMotion = PlateMotion()
    camera: CameraErrors = CameraErrors()
    contact: ContactErrors = ContactErrors()
    force: ForceErrors = ForceErrors()
    horizon_s: float = 0.5


def settings_of(recipe: Recipe, shared: Array | None = None) -> TrackingSettings:
    """The settings of a recipe, of its tables ``[plate.tracking]`` and ``[plate.touch]``.

    ``shared`` (6, 6) is the covariance of what all pictures share, by the fits of the camera and of
    the rig's card (None where these state none); the recipe's numbers take its place.

    >>> from scissorcal.recipe.load import builtin_recipe
    >>> round(1e3 * settings_of(builtin_recipe("paper-80gsm")).camera.place_bias_m, 3)
    0.3
    """
    tracking, touch = recipe.plate.tracking, recipe.plate.touch
    compliance = 1e-3 / touch.stiffness_N_per_mm
    motion = PlateMotion(
        tracking.speed_mm_per_s * 1e-3,
        math.radians(tracking.turn_deg_per_s),
        tracking.motion_time_s,
    )
    contact = ContactErrors(
        turn_bias_rad=math.radians(tracking.contact_bias_deg),
        place_bias_m=tracking.contact_bias_mm * 1e-3,
        white_m=tracking.contact_white_mm * 1e-3,
        slow_m=tracking.contact_slow_mm * 1e-3,
        slow_time_s=tracking.contact_slow_s,
        compliance_m_per_N=compliance,
        compliance_sd_m_per_N=0.01 * tracking.compliance_sd_percent * compliance,
        force_sd_N=tracking.contact_force_sd_N,
        least_force_N=tracking.least_contact_N,
    )
    force = ForceErrors(
        zero_sd_N=tracking.force_zero_sd_N,
        friction=touch.friction,
        friction_sd=tracking.friction_sd,
    )
    return TrackingSettings(motion, _camera_errors(tracking, shared), contact, force)


def _camera_errors(tracking: PlateTracking, shared: Array | None) -> CameraErrors:
    """What the recipe states of the camera's bias, and for the rest what the fits do."""
    usual = CameraErrors()
    turn, place = tracking.camera_bias_deg, tracking.camera_bias_mm
    turn_sd = usual.turn_bias_rad if turn == "auto" else math.radians(turn)
    place_sd = usual.place_bias_m if place == "auto" else place * 1e-3
    camera = CameraErrors(turn_sd, place_sd)
    if shared is None or "auto" not in (turn, place):
        return camera
    stated = np.array([*[turn != "auto"] * 3, *[place != "auto"] * 3])
    bias = np.where(stated[:, None] | stated, camera.bias_covariance, shared)
    return CameraErrors(turn_sd, place_sd, tuple(tuple(row) for row in bias.tolist()))
