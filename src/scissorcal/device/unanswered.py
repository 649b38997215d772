"""What blades may reach on a torque that no further command corrects, until the device brakes."""

import math

from scissorcal.errors import DeviceError
from scissorcal.kernel import Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import Estimate

MOST_ENERGY_J = 0.5
"""Of a blow on a hand or its fingers: ISO/TS 15066:2016 allows 140 N there, twice that for a brief
contact, and has 75 N/mm for their stiffness, which is F^2 / (2 k) = 0.52 J."""


def refuse_unanswered(recipe: Recipe, identity: Identity, inertia: Estimate | None) -> str:
    """Refuse a rig whose blades a last command may throw, before a motor runs.

    Until the device brakes, after ``rig.line.brake_after_ms`` = t, the largest torque T of commands
    brings free blades of inertia I to T t / I, and to no more energy than T times their travel. At
    the rate that is stated they hold MOST_ENERGY_J: sqrt(2 E / I), 69 rad/s for 2.1e-4 kg m^2.

    Raises DeviceError where even the upper end of the inertia's interval is too fast. Returns a
    sentence where only its lower end is, or where no inertia is known; else an empty one.
    """
    torque = min(recipe.limits.torque_Nm, identity.torque_limit)
    brake_s = 1e-3 * recipe.rig.line.brake_after_ms
    if torque * (identity.opening_max - identity.opening_min) <= MOST_ENERGY_J:
        return ""
    # blades of T^2 t^2 / (2 E) or more hold no more than E then
    enough = (torque * brake_s) ** 2 / (2.0 * MOST_ENERGY_J)
    if inertia is None:
        return (
            f"It is not known how fast the blades get within rig.line.brake_after_ms = "
            f"{1e3 * brake_s:g} without a new command: the probe found no inertia. Blades of less "
            f"than {1e6 * enough:.3g} kg mm^2 would be too fast."
        )
    low, high = inertia.interval
    if low >= enough:
        return ""
    most_torque = math.sqrt(2.0 * MOST_ENERGY_J * max(low, 0.0)) / brake_s
    most_ms = 1e3 * math.sqrt(2.0 * MOST_ENERGY_J * max(low, 0.0)) / torque
    cure = (
        f"Set limits.torque_Nm to {_down(most_torque)} or less, or rig.line.brake_after_ms to "
        f"{_down(most_ms)} or less."
    )
    if high < enough:
        rate, most = torque * brake_s / inertia.mean, math.sqrt(2.0 * MOST_ENERGY_J / inertia.mean)
        raise DeviceError(
            f"Without a new command the blades ({1e6 * inertia.mean:.3g} kg mm^2) would reach "
            f"{rate:.0f} rad/s before the device brakes: limits.torque_Nm = {torque:g} acts for "
            f"rig.line.brake_after_ms = {1e3 * brake_s:g}. At more than {most:.0f} rad/s they hold "
            f"{MOST_ENERGY_J:g} J, which may hurt a hand. {cure}"
        )
    return (
        "It is not known well enough how fast the blades get within rig.line.brake_after_ms = "
        f"{1e3 * brake_s:g} without a new command: their inertia is {1e6 * max(low, 0.0):.3g} to "
        f"{1e6 * high:.3g} kg mm^2, and {1e6 * enough:.3g} would do. Run 'scissorcal device probe' "
        f"again, or be on the safe side: {cure[0].lower()}{cure[1:]}"
    )


def _down(value: float) -> str:
    """Two digits, rounded down, so that the stated value is one that is taken."""
    if value <= 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / step * (1.0 + 1e-9)) * step:.6g}"
