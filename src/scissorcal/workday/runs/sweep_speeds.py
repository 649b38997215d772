"""Which of a recipe's speeds of empty sweeps a rig can make and its encoder shows."""

import math

from scissorcal.calibration.signals.filtering import rate_floor_of_step
from scissorcal.calibration.signals.weak_form import RATE_BAND
from scissorcal.device.capture_gains import Probed, capture_gains
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import ProbeResult
from scissorcal.workday.stock import LEAST_FLOORS

NEXT = 1.2
"""A planned speed that is at most so many times the slowest usable one takes its place."""


def with_usable_sweeps(
    recipe: Recipe, identity: Identity, probe: ProbeResult | None
) -> tuple[Recipe, str]:
    """The recipe without sweeps that are too slow for a rig, and why; the same and "" without any.

    Too slow are speeds below 1.5 times the floor of the fit's rate, below which the encoder does
    not show the sense of motion, and speeds at which the probe's friction makes the blades stick
    and slip whatever the gains (``capture_gains``). The slowest usable speed takes their place.
    Raises InputError where that is above every planned speed, DeviceError as ``capture_gains``.
    """
    floor, sticks = sweep_bounds(recipe, identity, probe)
    slowest = _rounded_up(max(floor, sticks))
    planned = recipe.capture.friction.speeds_rad_per_s
    slow = [speed for speed in planned if speed < max(floor, sticks)]
    if not slow:
        return recipe, ""
    kept = tuple(speed for speed in planned if speed not in slow)
    listed = ", ".join(f"{speed:g}" for speed in slow)
    cause = (
        f"an encoder with a step of {identity.opening_resolution:.2g} rad tells the sense of "
        f"motion from {floor / LEAST_FLOORS:.2g} rad/s on"
        if floor >= sticks
        else f"below {sticks:.2g} rad/s this rig's blades stick and slip at any gains that its "
        "delay allows"
    )
    if not kept:
        raise InputError(
            f"Every planned sweep is too slow ({listed} rad/s): {cause}. Raise "
            f"capture.friction.speeds_rad_per_s to {slowest:g} and more, or lower "
            "fit.friction.cutoff_Hz."
        )
    instead = min(kept) > NEXT * slowest
    speeds = (slowest, *kept) if instead else kept
    friction = recipe.capture.friction.model_copy(update={"speeds_rad_per_s": speeds})
    capture = recipe.capture.model_copy(update={"friction": friction})
    replaced = f" {slowest:g} rad/s takes their place." if instead else ""
    return recipe.model_copy(update={"capture": capture}), (
        f"Sweeps at {listed} rad/s are left out: {cause}. The slowest usable speed is about "
        f"{slowest:g} rad/s.{replaced}"
    )


def sweep_bounds(
    recipe: Recipe, identity: Identity, probe: ProbeResult | None
) -> tuple[float, float]:
    """Speeds (rad/s) below which an empty sweep is too slow: for the encoder, for the rig's gains.

    The second, with two digits, is 0 where nothing is known of it. Raises DeviceError as
    ``capture_gains``, InputError where the blades would stick at any speed.
    """
    cutoff_Hz = recipe.fit.friction.cutoff_Hz
    floor = LEAST_FLOORS * _rate_floor(identity.opening_resolution, cutoff_Hz, identity)
    sticks = capture_gains(recipe, identity, "friction", Probed.of(probe)).sticks_below
    if math.isinf(sticks):
        raise InputError(
            "No empty sweep of this rig is steady: within the margins that its delay allows, no "
            "gains stand friction that falls with speed. Shorten the adapter's latency timer, "
            "raise the baud rate, or take a faster tick, and probe again."
        )
    return floor, _rounded_up(sticks)


def sliding_below_encoder(recipe: Recipe, identity: Identity) -> str:
    """Which planned speeds of the carriage a fit will not use, as a sentence; empty for none.

    Below the rate's floor, which the encoder's step and the fit's cutoff give, the sign of the
    rate is noise.
    """
    cutoff_Hz = recipe.fit.friction_advance.cutoff_Hz
    floor = _rate_floor(identity.advance_resolution, cutoff_Hz, identity)
    planned = recipe.capture.friction_advance.speeds_mm_per_s
    slow = ", ".join(f"{speed:g}" for speed in planned if speed <= 1e3 * floor)
    if not slow:
        return ""
    return (
        f"Sweeps at {slow} mm/s will not be used: an encoder with a step of "
        f"{1e6 * identity.advance_resolution:.2g} um tells the sense of motion from "
        f"{1e3 * floor:.2g} mm/s on. Leave them out of capture.friction_advance.speeds_mm_per_s, "
        "or lower fit.friction_advance.cutoff_Hz."
    )


def _rate_floor(resolution: float, cutoff_Hz: float, identity: Identity) -> float:
    return rate_floor_of_step(resolution, RATE_BAND * cutoff_Hz, 1e6 / identity.tick_us)


def _rounded_up(speed: float) -> float:
    """Up to two digits, as people write it.

    >>> _rounded_up(0.0811), _rounded_up(0.12)
    (0.082, 0.12)
    """
    if not 0.0 < speed < math.inf:
        return speed
    digit = 10.0 ** (math.floor(math.log10(speed)) - 1)
    return float(f"{math.ceil(speed / digit - 1e-9) * digit:.2g}")
