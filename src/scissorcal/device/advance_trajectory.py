"""The plan of a capture of the carriage's friction: sweeps and an excitation of the advance."""

from scissorcal.device.paths import PathBuilder, SwingLimits, multisine
from scissorcal.device.trajectory import Plan, Segment, StrokeList, opening_range, refuse_linear
from scissorcal.errors import InputError
from scissorcal.kernel import Capability, Identity
from scissorcal.recipe.pace import ADVANCE_ACCELERATION, ADVANCE_SPEED, DWELL_S, SETTLE_S
from scissorcal.recipe.schema import Recipe

ADVANCE_MARGIN_M = 5e-3
LEAST_TRAVEL_M = 10e-3
"""Twice by how far a carriage may fall behind before it counts as standing."""

HEAVIEST_KG = 1.6
"""A carriage with a pair of scissors, its guide and belt weighs half of it; it may weigh double."""
FORCE_SHARE = 0.4
"""Share of the force limit that may accelerate the heaviest carriage: friction takes its part."""
LEAST_ACCELERATION = 0.1

SLIDE_BAND_HZ = (1.0, 8.0)
"""Faster, and how the force follows its command would count as mass."""
AMPLITUDE_SHARE = 0.45


def advance_plan(recipe: Recipe, identity: Identity) -> Plan:
    """Plan sweeps of the carriage at every speed, forward and backward, then an excitation.

    The blades stand open, as wide as the scene has them. Every repeat has all speeds. Raises
    InputError where the carriage has no room, or no force to be moved by; `refuse_without_motor`
    does where it has no motor.
    """
    refuse_linear(recipe)
    low, high = advance_range(recipe, identity)
    capture, tick_s = recipe.capture.friction_advance, identity.tick_us * 1e-6
    acceleration = largest_acceleration(recipe, identity)
    ramps = min(ADVANCE_ACCELERATION, acceleration)
    speeds = sliding_speeds(recipe)
    strokes = StrokeList()
    path = PathBuilder(opening_range(recipe, identity)[1], low, tick_s)
    path.rest(DWELL_S)
    for _ in range(capture.repeats):
        for speed in speeds:
            path.advance_to(high, speed, ramps, strokes.add("forward", speed))
            path.rest(DWELL_S)
            path.advance_to(low, speed, ramps, strokes.add("backward", speed))
            path.rest(DWELL_S)
    path.advance_to(0.5 * (low + high), ADVANCE_SPEED, ramps)
    path.rest(SETTLE_S)
    limits = SwingLimits(AMPLITUDE_SHARE * (high - low), max(speeds), acceleration)
    way, _ = multisine(capture.excitation_s, SLIDE_BAND_HZ, limits, tick_s)
    path.slide(way, strokes.add("excitation"))
    path.rest(DWELL_S)
    request = (
        "Take everything out from between the blades and out of the carriage's way: it moves by "
        f"{1e3 * (high - low):.0f} mm, the blades open."
    )
    segment = Segment(path.reference(), "nothing", -1, request)
    return Plan((segment,), tuple(strokes.all), tick_s)


def sliding_speeds(recipe: Recipe) -> tuple[float, ...]:
    """Speeds of the planned sweeps, in m/s."""
    return tuple(1e-3 * speed for speed in recipe.capture.friction_advance.speeds_mm_per_s)


def advance_range(recipe: Recipe, identity: Identity) -> tuple[float, float]:
    """Advances (m) that the capture sweeps: its travel, in the middle of the carriage's stops.

    Raises InputError where less than 10 mm are left.
    """
    low, high = identity.advance_min + ADVANCE_MARGIN_M, identity.advance_max - ADVANCE_MARGIN_M
    wanted = 1e-3 * recipe.capture.friction_advance.travel_mm
    travel, middle = min(wanted, high - low), 0.5 * (low + high)
    if travel >= LEAST_TRAVEL_M:
        return middle - 0.5 * travel, middle + 0.5 * travel
    if wanted < LEAST_TRAVEL_M:
        raise InputError(
            f"capture.friction_advance.travel_mm = {1e3 * wanted:g} is too little for friction to "
            f"slide: set it to {1e3 * LEAST_TRAVEL_M:g} or more."
        )
    raise InputError(
        f"The carriage's stops are {1e3 * (identity.advance_max - identity.advance_min):.3g} mm "
        f"apart, and this capture needs {1e3 * (LEAST_TRAVEL_M + 2 * ADVANCE_MARGIN_M):g}: correct "
        "advance_min and advance_max in the device's firmware if the carriage can move farther."
    )


def largest_acceleration(recipe: Recipe, identity: Identity) -> float:
    """Acceleration (m/s^2) that the force limit allows for a carriage of 1.6 kg.

    Raises InputError where that is too little to tell the mass.
    """
    force = min(recipe.limits.force_N, identity.force_limit)
    found = FORCE_SHARE * force / HEAVIEST_KG
    if found < LEAST_ACCELERATION:
        source = "limits.force_N" if recipe.limits.force_N <= force else "the device's force_limit"
        least = LEAST_ACCELERATION * HEAVIEST_KG / FORCE_SHARE
        raise InputError(
            f"A force of {force:g} N ({source}) is too little to accelerate a carriage: this "
            f"capture needs {least:.2g} N."
        )
    return found


def refuse_without_motor(identity: Identity) -> None:
    """Raise InputError for a rig that cannot push its carriage."""
    if not identity.capabilities & Capability.ADVANCE_MOTOR or identity.force_limit <= 0.0:
        raise InputError(
            f"{identity.name} {identity.serial} has no advance motor (capability ADVANCE_MOTOR, "
            "force_limit above 0), so nothing can push its carriage: leave out --axis advance. If "
            "it has one, state it in the device's identity."
        )
