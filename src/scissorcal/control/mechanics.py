"""What is known of a rig that presses: its tip, both axes, its delay."""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.control.contact_loop import ContactLoop
from scissorcal.control.surface_path import Foot
from scissorcal.kernel import AxisFriction, Identity
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.friction import AxisLaw, FrictionLaw, angle_slope, friction_level

FASTEST_rad_per_s = 10.0
FASTEST_m_per_s = 0.5
"""Rates up to which friction is tabulated: those of a tip whose plate was taken away, too."""


@dataclass(frozen=True, eq=False)
class RigMechanics:
    """A rig that presses with its upper blade's tip.

    ``opening`` and ``advance`` are the axes as identified; ``friction_sd`` (N m) is the standard
    deviation of the opening's friction while it slides. ``delay_s`` passes from a measurement to
    the effort that answers it, motor included; ``torque_sd`` (N m) is a measured torque's noise,
    ``torque_zero_Nm`` and ``handle_zero_N`` are what the sensors show with motors off and nobody at
    the handles.
    """

    tip: BladePoint
    opening: AxisLaw
    advance: AxisLaw
    friction_sd: float
    delay_s: float
    torque_sd: float
    torque_zero_Nm: float = 0.0
    handle_zero_N: float = 0.0

    def mass_at(self, foot: Foot, opening: float) -> float:
        """Mass (kg) that a surface meets along its normal: 1 / (n^T J D^-1 J^T n)."""
        press = self.press_at(foot, opening)
        mobility = press[0] ** 2 / self.opening.inertia + press[1] ** 2 / self.advance.inertia
        return float(1.0 / mobility)

    def press_at(self, foot: Foot, opening: float) -> Array:
        """J^T n (2,): torque and force on the axes of a newton along the contour's normal."""
        jacobian = self.tip.jacobian((opening, 0.0))[:2]
        return np.asarray(jacobian.T @ np.array(foot.normal))

    def slide_at(self, foot: Foot, opening: float) -> Array:
        """J^T t (2,): torque and force on the axes of a newton along the contour."""
        jacobian = self.tip.jacobian((opening, 0.0))[:2]
        return np.asarray(jacobian.T @ np.array((foot.normal[1], -foot.normal[0])))

    def opening_at(self, height: float) -> float | None:
        """Opening (rad) at which the tip stands at a height (m) over the pivot; None if at none."""
        reach = math.hypot(self.tip.station_m, self.tip.offset_m)
        if not abs(height) <= reach:
            return None
        beta = math.asin(height / reach) - math.atan2(self.tip.offset_m, self.tip.station_m)
        return beta * self.tip.moving_blades

    def advance_at(self, x: float, opening: float) -> float:
        """Advance (m) at which the tip stands at x, the blades at ``opening``."""
        return x - float(self.tip.place((opening, 0.0))[0])


def axis_friction(law: FrictionLaw, fastest: float) -> AxisFriction:
    """A friction law as the servo takes it: sizes over the rate each way, and a factor by place.

    The factor is the law's own up to its second power. What the law has of a load, or of a place
    in another way, is left out.
    """
    rates = AxisFriction.rates(fastest)
    rates[0] = 1e-9
    sizes = [friction_level(law, sign, rates)[0] for sign in (1.0, -1.0)]
    centre, width = law.angle_center, 1e-3
    slope = float(angle_slope(law, centre))
    bend = float(angle_slope(law, centre + width) - angle_slope(law, centre - width)) / (4 * width)
    return AxisFriction(
        fastest=fastest,
        positive=tuple(np.maximum(sizes[0], 0.0).tolist()),
        negative=tuple(np.maximum(sizes[1], 0.0).tolist()),
        slope=slope,
        bend=bend,
        centre=centre,
    )


def contact_loop(
    rig: RigMechanics,
    identity: Identity,
    stiffness: float,
    mass: float,
    lever: float,
    cutoffs: tuple[float, float],
) -> ContactLoop:
    """The loop that presses at one place of a path; ``cutoffs`` (Hz) filter rate and force."""
    return ContactLoop(
        stiffness_N_per_m=stiffness,
        mass_kg=mass,
        viscous_N_s_per_m=0.0,
        delay_s=rig.delay_s,
        motor_lag_s=0.0,
        tick_s=identity.tick_us * 1e-6,
        rate_cutoff_Hz=cutoffs[0],
        force_cutoff_Hz=cutoffs[1],
        step_m=identity.opening_resolution * lever,
    )
