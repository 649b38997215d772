"""The plan of a capture: references and strokes from the recipe. Pure functions.

A plan is a sequence of segments. Between two segments the motors are off and a person clears
the blades or loads material; each segment ends in the pose in which the next one is loaded.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.device.paths import PathBuilder, Reference, SwingLimits, multisine
from scissorcal.errors import InputError
from scissorcal.kernel import Capability, Identity
from scissorcal.recipe.pace import (
    ADVANCE_ACCELERATION,
    ADVANCE_SPEED,
    APPROACH_SPEED,
    DWELL_S,
    SETTLE_S,
    TURN_ACCELERATION,
    ramp_way,
)
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Stroke, StrokeKind

Load = Literal["nothing", "sheet"]

OPENING_MARGIN_RAD = np.radians(1.0)
LEAST_RANGE_RAD = np.radians(3.0)

SWING_BAND_HZ = (1.0, 15.0)
SWING_ACCELERATION = 80.0
EMPTY_REQUEST = "Take everything out from between the blades: this capture needs them empty."


@dataclass(frozen=True)
class Segment:
    """Motion without a pause, and what is between the blades during it.

    ``sheet`` counts fresh pieces of material, -1 where the blades are empty. ``request`` asks a
    person for what must be done before it starts.
    """

    reference: Reference
    load: Load
    sheet: int
    request: str


@dataclass(frozen=True)
class Plan:
    """Everything that a capture will do: segments in order, and the strokes that they contain."""

    segments: tuple[Segment, ...]
    strokes: tuple[Stroke, ...]
    tick_s: float

    @property
    def duration_s(self) -> float:
        """Seconds of planned motion, without approaches and pauses for loading."""
        return self.tick_s * sum(len(segment.reference) for segment in self.segments)


class StrokeList:
    """Numbers the planned strokes."""

    def __init__(self) -> None:
        self.all: list[Stroke] = []

    def add(self, kind: StrokeKind, speed: float = float("nan"), sheet: int = -1) -> int:
        """Add a stroke and return its index."""
        self.all.append(Stroke(len(self.all), kind, float(speed), sheet))
        return len(self.all) - 1


def friction_plan(recipe: Recipe, identity: Identity, advance: float = 0.0) -> Plan:
    """Plan empty sweeps at every speed in both directions, then an excitation for the inertia.

    Every repeat has all speeds, so that an interrupted capture has them too. Every second sweep,
    and of each speed that of every second repeat, begins in the middle of the range and ends there.
    Ramps lie outside the scene's range of openings where the rig's stops leave room. ``advance``
    (m) is the fixed position of the carriage.
    """
    refuse_linear(recipe)
    stops = usable_opening(identity)
    low, high = opening_range(recipe, identity)
    capture = recipe.capture.friction
    tick_s = identity.tick_us * 1e-6
    strokes = StrokeList()
    advance = float(np.clip(advance, identity.advance_min, identity.advance_max))
    path = PathBuilder(high, advance, tick_s)
    path.rest(DWELL_S)
    for repeat in range(capture.repeats):
        for place, speed in enumerate(capture.speeds_rad_per_s, repeat):
            over = ramp_way(speed, TURN_ACCELERATION)
            ends = max(stops[0], low - over), min(stops[1], high + over)
            if place % 2 == 0:
                _sweep_from_top(path, strokes, speed, ends)
            else:
                _sweep_from_middle(path, strokes, speed, ends, closing=place % 4 == 1)
    path.open_to(0.5 * (low + high), APPROACH_SPEED, TURN_ACCELERATION)
    path.rest(SETTLE_S)
    limits = SwingLimits(0.45 * (high - low), max(capture.speeds_rad_per_s), SWING_ACCELERATION)
    way, rate = multisine(capture.excitation_s, SWING_BAND_HZ, limits, tick_s)
    path.swing(way, rate, strokes.add("excitation"))
    path.rest(DWELL_S)
    segment = Segment(path.reference(), "nothing", -1, EMPTY_REQUEST)
    return Plan((segment,), tuple(strokes.all), tick_s)


def _sweep_from_top(
    path: PathBuilder, strokes: StrokeList, speed: float, ends: tuple[float, float]
) -> None:
    """Closing and opening over the whole range, from where the blades stand widest."""
    bottom, top = ends
    path.open_to(top, APPROACH_SPEED, TURN_ACCELERATION)
    path.rest(DWELL_S)
    path.open_to(bottom, speed, TURN_ACCELERATION, strokes.add("closing", speed))
    path.rest(DWELL_S)
    path.open_to(top, speed, TURN_ACCELERATION, strokes.add("opening", speed))
    path.rest(DWELL_S)


def _sweep_from_middle(
    path: PathBuilder,
    strokes: StrokeList,
    speed: float,
    ends: tuple[float, float],
    *,
    closing: bool,
) -> None:
    """The range both ways from its middle, ``closing`` or opening first; the first way in two.

    Friction builds up after each reversal (docs/model.md). Were there reversals at the ends alone,
    a dependence of friction on the opening would explain it as well. So the blades come to the
    middle from the other side, and turn there.
    """
    middle = 0.5 * (ends[0] + ends[1])
    over = ramp_way(speed, TURN_ACCELERATION)
    first, last = ends if closing else (ends[1], ends[0])
    sense = 1.0 if closing else -1.0
    begin = float(np.clip(middle + sense * over, *ends))
    end = float(np.clip(middle - sense * over, *ends))
    kinds: tuple[StrokeKind, StrokeKind] = ("closing", "opening")
    there, back = kinds if closing else kinds[::-1]
    path.open_to(0.5 * (middle + first), APPROACH_SPEED, TURN_ACCELERATION)
    path.open_to(begin, APPROACH_SPEED, TURN_ACCELERATION)
    path.rest(DWELL_S)
    for kind, goal in ((there, first), (back, last), (there, end)):
        path.open_to(goal, speed, TURN_ACCELERATION, strokes.add(kind, speed))
        path.rest(DWELL_S)


def approach(opening: float, advance: float, start: Reference, tick_s: float) -> Reference:
    """Path from the rig's position to the start of a reference: blades first, then the carriage."""
    path = PathBuilder(opening, advance, tick_s)
    path.open_to(float(start.opening[0]), APPROACH_SPEED, TURN_ACCELERATION)
    path.rest(DWELL_S)
    path.advance_to(float(start.advance[0]), ADVANCE_SPEED, ADVANCE_ACCELERATION)
    path.rest(SETTLE_S)
    return path.reference()


def check_reference(reference: Reference, identity: Identity) -> None:
    """Raise InputError unless a reference is finite, steady and within the device's limits."""
    for name, values in (
        ("opening", reference.opening),
        ("opening_rate", reference.opening_rate),
        ("advance", reference.advance),
    ):
        if not np.all(np.isfinite(values)):
            raise InputError(f"The planned {name} is not finite: check the recipe's ranges.")
    for name, values, low, high, unit in (
        ("opening", reference.opening, identity.opening_min, identity.opening_max, "rad"),
        ("advance", reference.advance, identity.advance_min, identity.advance_max, "m"),
    ):
        if values.min() < low or values.max() > high:
            raise InputError(
                f"The planned {name} goes from {values.min():.4g} to {values.max():.4g} {unit}, "
                f"the device allows {low:.4g} to {high:.4g} {unit}: narrow the recipe's ranges."
            )


def usable_opening(identity: Identity) -> tuple[float, float]:
    """Openings that a plan may use: the device's limits less a margin, in rad."""
    return identity.opening_min + OPENING_MARGIN_RAD, identity.opening_max - OPENING_MARGIN_RAD


def opening_range(recipe: Recipe, identity: Identity) -> tuple[float, float]:
    """The scene's openings, clipped to what the device allows, in rad."""
    stops, scene = usable_opening(identity), recipe.scene.opening_rad
    low, high = max(stops[0], scene[0]), min(stops[1], scene[1])
    if high - low < LEAST_RANGE_RAD:
        wanted = " to ".join(f"{value:g}" for value in recipe.scene.opening_deg)
        allowed = " to ".join(f"{np.degrees(value):.3g}" for value in stops)
        raise InputError(
            f"scene.opening_deg asks for {wanted} degrees, the device allows {allowed}: "
            "the two must share at least 3 degrees."
        )
    return low, high


def refuse_linear(recipe: Recipe) -> None:
    """Raise InputError for a linear joint, which no capture drives."""
    if recipe.rig.joint == "linear":
        raise InputError(
            'rig.joint = "linear": a capture drives a rotary rig. Record the linear joint with its '
            "own tools and bring the log in with 'scissorcal import'."
        )


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
