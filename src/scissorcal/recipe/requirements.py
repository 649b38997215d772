"""What a scene requires: captures to take, fits to run, tables to build, and what is left out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from scissorcal.errors import InputError
from scissorcal.recipe.schema import Recipe

CaptureKind = Literal["friction", "friction-advance", "cut"]
DesignedKind = Literal["friction", "cut"]
"""Captures whose strokes can be chosen by what they are worth to the scene's torque."""
GeometryKind = Literal["camera", "blade", "plate"]

LITTLE = 0.5
"""Of what is recorded: where a fit uses a smaller share of a stroke, that does not count as used;
where it does of a speed's motion, the speed is named."""


@dataclass(frozen=True)
class Requirement:
    """One thing that the scene needs or does without, and the reason in a sentence."""

    name: str
    why: str


@dataclass(frozen=True)
class Requirements:
    """Everything that follows from a scene, in the order in which it is done.

    ``captures`` are of the rig, and ``fits`` are fitted to them; of ``geometry`` photographs are
    taken, and it is fitted to these. ``left_out`` names what is neither asked for, nor fitted, nor
    shipped.
    """

    captures: tuple[Requirement, ...]
    fits: tuple[Requirement, ...]
    tables: tuple[Requirement, ...]
    left_out: tuple[Requirement, ...]
    geometry: tuple[Requirement, ...] = ()

    def needs_capture(self, name: CaptureKind) -> bool:
        return any(item.name == name for item in self.captures)

    def needs_geometry(self, name: GeometryKind) -> bool:
        return any(item.name == name for item in self.geometry)


def requirements(recipe: Recipe) -> Requirements:
    """Derive from a recipe what has to be captured, fitted and built.

    A scene that renders no friction ships no friction table, and still captures and fits friction:
    what the motor measures while it cuts is cutting *and* friction, so the response of the material
    cannot be separated from the friction of the pivot unless that is known from an empty stroke.
    A scene that only presses needs neither toughness nor fracture. A linear joint carries no
    blades: it has friction and inertia, and nothing is cut with it. Mass and friction of the
    carriage are needed where a force along the cut is rendered with friction.

    >>> from scissorcal.recipe.load import builtin_recipe
    >>> needs = requirements(builtin_recipe("press-only"))
    >>> [item.name for item in needs.tables], [item.name for item in needs.left_out][:2]
    (['edge', 'response', 'friction'], ['fracture', 'translation force'])
    """
    if recipe.rig.joint == "linear":
        return _linear_joint()
    scene = recipe.scene
    verb = "cut" if scene.cut else "pressed"
    why_friction = (
        "rendered, and taken off the torque measured with material between the blades"
        if scene.render_friction
        else "not rendered, but what is measured with material between the blades contains it"
    )
    tables = [
        Requirement("edge", "where the blades touch the plate at each opening"),
        Requirement("response", "force of the plate against indentation"),
    ]
    left_out = []
    if scene.cut:
        tables.append(Requirement("fracture", "when the crack advances (scene.cut = true)"))
    else:
        left_out.append(
            Requirement("fracture", "nothing is cut (scene.cut = false): no toughness, no crack")
        )
    if scene.render_friction:
        why = "rendered (scene.render_friction = true)"
        if set(scene.render) == {"translation_force"}:
            why += (
                ", although a translation force has none: where the handles carry no motor, set it "
                "to false"
            )
        tables.append(Requirement("friction", why))
    else:
        left_out.append(Requirement("friction table", "scene.render_friction = false"))
    if "translation_force" not in scene.render:
        left_out.append(
            Requirement("translation force", 'scene.render does not name "translation_force"')
        )
    advance = _advance(recipe)
    geometry = _geometry(recipe)
    if not any(item.name == "blade" for item in geometry):
        left_out.append(Requirement("blade photographs", 'rig.edge.source = "recipe"'))
    if not any(item.name == "plate" for item in geometry):
        left_out.append(Requirement("plate pose", 'scene.plate_pose = "known"'))
    return Requirements(
        captures=(
            Requirement("friction", why_friction),
            *advance,
            Requirement("cut", f"{recipe.material.name} is {verb} in this scene"),
        ),
        fits=(
            Requirement("friction", why_friction),
            *advance,
            Requirement("cut", "response and toughness" if scene.cut else "response only"),
        ),
        tables=tuple(tables),
        left_out=tuple(left_out),
        geometry=geometry,
    )


def _advance(recipe: Recipe) -> tuple[Requirement, ...]:
    """Friction of the carriage, where a hand feels it beside a rendered force."""
    scene = recipe.scene
    if "translation_force" not in scene.render or not scene.render_friction:
        return ()
    why = "a force along the cut is rendered with friction, and the carriage's own comes on top"
    return (Requirement("friction-advance", why),)


def _geometry(recipe: Recipe) -> tuple[Requirement, ...]:
    """What photographs are wanted of, in the order in which they are fitted."""
    blade = recipe.rig.edge.source == "photographs"
    plate = recipe.scene.plate_pose == "estimated"
    wanted = []
    if blade or plate:
        wanted.append(Requirement("camera", "photographs are measured through it"))
    if blade:
        why = 'the edge is taken from photographs (rig.edge.source = "photographs")'
        wanted.append(Requirement("blade", why))
    if plate:
        why = 'where the plate stands is estimated (scene.plate_pose = "estimated")'
        wanted.append(Requirement("plate", why))
    return tuple(wanted)


def _linear_joint() -> Requirements:
    why = "friction and inertia of the joint"
    reason = "a linear joint carries no blades (rig.joint = linear)"
    return Requirements(
        captures=(Requirement("friction", why),),
        fits=(Requirement("friction", why),),
        tables=(),
        left_out=tuple(Requirement(name, reason) for name in ("cut", "package")),
    )


def capture_facts(recipe: Recipe, kind: CaptureKind) -> Mapping[str, object]:
    """Return what a capture of one kind recorded, as far as the recipe says it.

    Where these differ between the recipe at capture and the recipe now, the recording is of
    something else and is no longer used. Settings that only say how much to record (speeds,
    repeats, sheets) are not among them: what was recorded stays true.
    """
    rig = recipe.rig
    if kind == "friction-advance":
        return {"rig.joint": rig.joint}
    facts: dict[str, object] = {
        "rig.joint": rig.joint,
        "rig.moving": rig.moving,
        "rig.handle_radius_mm": rig.handle_radius_mm,
    }
    if kind == "cut":
        facts["material.name"] = recipe.material.name
        facts["material.thickness_mm"] = recipe.material.thickness_mm
        facts["scene.cut"] = recipe.scene.cut
    return facts


def command_words(what: str) -> str:
    """What commands call a capture, a fit or a verification of this name.

    >>> command_words("friction-advance"), command_words("cut")
    ('friction --axis advance', 'cut')
    """
    return {"friction-advance": "friction --axis advance"}.get(what, what)


LEAST_RAMP_S = 0.03
DWELL_S = 0.1
SETTLE_S = 0.3

TURN_ACCELERATION = 20.0
"""Peak acceleration of a stroke's ramps, rad/s^2."""

APPROACH_SPEED = 0.3
ADVANCE_SPEED = 0.08
ADVANCE_ACCELERATION = 0.8
OPENING_SPEED = 1.0
"""Speed at which the blades open again after a cut, rad/s; at most the scene's."""


def ramp_time(speed: float, acceleration: float) -> float:
    """Seconds of one ramp from rest to ``speed`` with a peak of ``acceleration``."""
    return max(LEAST_RAMP_S, math.pi * speed / (2.0 * acceleration))


def ramp_way(speed: float, acceleration: float) -> float:
    """Displacement of one ramp from rest to ``speed``."""
    return 0.5 * speed * ramp_time(speed, acceleration)


def glide_speed(length: float, speed: float, acceleration: float) -> float:
    """Cruising speed over a length, slower than ``speed`` where it is too short to reach that."""
    return min(speed, length / LEAST_RAMP_S, math.sqrt(2.0 * acceleration * length / math.pi))


def glide_time(length: float, speed: float, acceleration: float) -> float:
    """Seconds from rest to rest over a length, ramps included."""
    if length == 0.0:
        return 0.0
    cruise = glide_speed(length, speed, acceleration)
    return ramp_time(cruise, acceleration) + length / cruise


RATE_HZ = 1000.0
BYTES_A_SAMPLE = 60
"""Measured: recordings of the virtual rig's friction and cuts have 52 and 56 bytes a sample."""

LONGEST_MIN = 240.0
"""Half a working day. Captures of the built-in recipes take 3 minutes: beyond this a speed or a
number went wrong, unless somebody says that it is meant."""

MOST_MIN = 24.0 * 60.0
"""A plan is held in memory, 28 bytes a tick: a day at 1 kHz has 2.4 GB."""


@dataclass(frozen=True)
class CaptureCost:
    """Cost of one capture as the recipe lists it; ``causes`` are the keys that it follows from."""

    kind: CaptureKind
    minutes: float
    samples: float
    bytes: float
    causes: str

    @property
    def sentence(self) -> str:
        """Minutes, samples and megabytes.

        >>> CaptureCost("friction", 2.0, 120_000, 7_200_000, "").sentence
        'at most 2.0 min, 120,000 samples, 7.2 MB'
        """
        if self.minutes > MOST_MIN:
            return f"{self.minutes / MOST_MIN:.3g} days"
        size = self.bytes / 1e6
        return (
            f"at most {self.minutes:,.{1 if self.minutes < 10 else 0}f} min, "
            f"{self.samples:,.0f} samples, {size:,.{1 if size < 10 else 0}f} MB"
        )


def capture_cost(recipe: Recipe, kind: CaptureKind) -> CaptureCost:
    """What a capture takes, with the time that the recipe gives a person.

    ``recipe`` may be one with a designed list.
    """
    capture = recipe.capture
    if kind == "friction":
        seconds = _sweeps_s(recipe) + capture.friction.excitation_s + capture.handling_s
        causes = (
            f"capture.friction.speeds_rad_per_s = {_listed(capture.friction.speeds_rad_per_s)}, "
            f"repeats = {capture.friction.repeats}, "
            f"excitation_s = {capture.friction.excitation_s:g}"
        )
    elif kind == "friction-advance":
        slides = capture.friction_advance
        seconds = _slides_s(recipe) + slides.excitation_s + capture.handling_s
        causes = (
            f"capture.friction_advance.speeds_mm_per_s = {_listed(slides.speeds_mm_per_s)}, "
            f"repeats = {slides.repeats}, excitation_s = {slides.excitation_s:g}"
        )
    else:
        pieces = capture.cut.sheets if recipe.scene.cut else 1
        seconds = _strokes_s(recipe) + pieces * capture.handling_s
        causes = (
            f"capture.cut.speeds_rad_per_s = {_listed(capture.cut.speeds_rad_per_s)}, "
            f"sheets = {capture.cut.sheets}, strokes_per_sheet = {capture.cut.strokes_per_sheet}, "
            f"capture.handling_s = {capture.handling_s:g}"
        )
    samples = RATE_HZ * seconds
    return CaptureCost(kind, seconds / 60.0, samples, BYTES_A_SAMPLE * samples, causes)


def refuse_long(cost: CaptureCost, free_bytes: float, *, meant: bool = False) -> None:
    """Raise InputError where a capture would take longer than anybody means, or fill the disk.

    ``meant`` allows up to a day. ``free_bytes`` are those of the disk.
    """
    longest = MOST_MIN if meant else LONGEST_MIN
    if cost.minutes > longest:
        meant = meant or cost.minutes > MOST_MIN
        hint = "" if meant else ", or give --yes-long if it is meant"
        raise InputError(
            f"The capture of {cost.kind} would take {cost.sentence}; at most "
            f"{longest / 60.0:g} hours are allowed. It follows from {cost.causes}: correct these"
            f"{hint}. Nothing was moved."
        )
    if cost.bytes > free_bytes:
        raise InputError(
            f"The capture of {cost.kind} would take {cost.sentence}, and the disk has "
            f"{free_bytes / 1e6:,.1f} MB left: free some space. Nothing was moved."
        )


def _sweeps_s(recipe: Recipe) -> float:
    low, high = recipe.scene.opening_rad
    speeds, repeats = recipe.capture.friction.speeds_rad_per_s, recipe.capture.friction.repeats
    first, second = (
        sum(
            _sweep_s(speed, high - low, place % 2 == 1) for place, speed in enumerate(speeds, begun)
        )
        for begun in (0, 1)
    )
    back = glide_time(high - low, APPROACH_SPEED, TURN_ACCELERATION)
    strokes_s = first * ((repeats + 1) // 2) + second * (repeats // 2)
    return strokes_s + back + 2.0 * DWELL_S + SETTLE_S


def _sweep_s(speed: float, travel: float, from_middle: bool) -> float:
    """Both ways over a range of openings; from its middle one of them in two strokes."""
    over = ramp_way(speed, TURN_ACCELERATION)
    length = travel + 2.0 * over
    whole = glide_time(length, speed, TURN_ACCELERATION)
    approach = glide_time(length, APPROACH_SPEED, TURN_ACCELERATION) + 3.0 * DWELL_S
    if not from_middle:
        return approach + 2.0 * whole
    half = 0.5 * length + over
    turned = glide_time(half, APPROACH_SPEED, TURN_ACCELERATION)
    return approach + turned + whole + 2.0 * glide_time(half, speed, TURN_ACCELERATION) + DWELL_S


def _slides_s(recipe: Recipe) -> float:
    slides = recipe.capture.friction_advance
    length = 1e-3 * slides.travel_mm
    pass_s = sum(
        2.0 * (glide_time(length, 1e-3 * speed, ADVANCE_ACCELERATION) + DWELL_S)
        for speed in slides.speeds_mm_per_s
    )
    back = glide_time(length, ADVANCE_SPEED, ADVANCE_ACCELERATION)
    return slides.repeats * pass_s + back + 2.0 * DWELL_S + SETTLE_S


def _strokes_s(recipe: Recipe) -> float:
    """Every stroke over the whole range of openings, the carriage over the sheet after each."""
    low, high = recipe.scene.opening_rad
    cut = recipe.capture.cut
    opening_speed = min(OPENING_SPEED, recipe.scene.opening_rate_rad_per_s[1])
    moved = 1e-3 * recipe.material.sheet_length_mm + recipe.rig.edge.length_m
    pauses = 2.0 * DWELL_S + SETTLE_S
    strokes, turn = cut.sheets * cut.strokes_per_sheet, TURN_ACCELERATION
    times = [glide_time(high - low, speed, turn) for speed in cut.speeds_rad_per_s]
    if recipe.scene.cut:
        moving = _in_turn(times, strokes) + strokes * glide_time(high - low, opening_speed, turn)
    else:  # a press opens as slowly as it closes, after a way to its place
        pressing = 2.0 * cut.sheets * _in_turn(times, cut.strokes_per_sheet)
        moving = pressing + 2.0 * strokes * glide_time(high - low, OPENING_SPEED, turn)
    # the ways of the carriage between a sheet's strokes add up to its length; then it returns
    slides = cut.strokes_per_sheet * SETTLE_S + 2.0 * glide_time(
        moved, ADVANCE_SPEED, ADVANCE_ACCELERATION
    )
    return moving + strokes * pauses + cut.sheets * (slides + 2.0 * DWELL_S)


def _in_turn(times: list[float], count: int) -> float:
    """Sum over ``count`` strokes that take these times in turn, the slowest where one is over."""
    rounds, rest = divmod(count, len(times))
    return rounds * sum(times) + sum(sorted(times, reverse=True)[:rest])


def _listed(speeds: tuple[float, ...]) -> str:
    shown = ", ".join(f"{speed:g}" for speed in speeds[:4])
    return f"[{shown}{', ...' if len(speeds) > 4 else ''}]"
