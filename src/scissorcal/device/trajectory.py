"""The plan of a capture: references and strokes from the recipe. Pure functions.

A plan is a sequence of segments. Between two segments the motors are off and a person clears
the blades or loads material; each segment ends in the pose in which the next one is loaded.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.device.paths import PathBuilder, Reference, SwingLimits, multisine
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
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
