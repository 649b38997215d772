"""The strokes that a rig could take next: what each would tell, and the seconds it takes."""

from collections.abc import Mapping

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.known import CutBasis
from scissorcal.calibration.design import (
    CaptureList,
    Information,
    Offer,
    PlannedMotion,
    Stock,
    cut_information,
    friction_information,
    planned_cut,
    planned_friction,
)
from scissorcal.calibration.design.state import CutState, FrictionState
from scissorcal.calibration.signals.filtering import rate_floor_of_step
from scissorcal.calibration.signals.weak_form import RATE_BAND
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.drive import IDLE_S
from scissorcal.device.parts import stroke_of_tick, with_capture
from scissorcal.device.trajectory import Plan, Segment, friction_plan
from scissorcal.kernel import Capability, Identity
from scissorcal.recipe.schema import Recipe

SWEEP_SPEEDS, CUT_SPEEDS = 5, 3
"""Speeds on offer, evenly in the logarithm over the scene's rates: of empty sweeps, of strokes."""
CUT_FROM, CUT_TO = 2.0, 0.6
"""Strokes through material go from this multiple of the scene's slowest rate to this one of its
fastest: slower ones take long, and faster ones show few samples a tooth."""
EXCITATION_S = 4.0
"""Excitation that a designed capture has: the inertia is then known to 1.5 %. It is felt nowhere in
a scene's torque, and the fit of a cut takes it off where blades accelerate."""
MOST_PLACES = 6
RETURN_S = 3.0
"""Time to return to where the next piece is loaded, and to approach."""
LEAST_FLOORS = 1.5
"""A sweep must be faster than the rate's floor by this factor, so that most of it counts."""


def capture_stock(
    recipe: Recipe,
    identity: Identity,
    friction: FrictionState,
    cut: CutState,
    slowest_sweep: float = 0.0,
) -> Stock:
    """Offer empty sweeps, and strokes through material (or presses), at speeds of the scene.

    Sweeps are at ``slowest_sweep`` (rad/s) and faster: below it the rig's blades stick and slip.
    Each stroke is planned as a capture plans it, moved as planned, and judged by the likelihood
    that the fits use. Raises what planning raises (DeviceError, InputError).
    """
    sweeps, excitation = _sweeps(recipe, identity, friction, slowest_sweep)
    strokes = _strokes(recipe, identity, friction, cut)
    handling = recipe.capture.handling_s
    loads = handling + RETURN_S if recipe.scene.cut else 0.0
    return Stock(
        sweeps=sweeps,
        excitation=excitation,
        excitation_s=EXCITATION_S,
        strokes=strokes,
        piece_s=loads,
        begin_s=2.0 * IDLE_S + handling,
        rotates=not recipe.scene.cut,
    )


def designed_recipe(recipe: Recipe, captures: CaptureList) -> Recipe:
    """The recipe with a list in its captures' keys; what the list lacks stays as it is.

    Sweeps come in the list's order, once each; strokes in the order of the pieces.
    """
    capture = recipe.capture
    friction, cut = capture.friction, capture.cut
    if captures.speeds:
        friction = friction.model_copy(
            update={
                "speeds_rad_per_s": tuple(sorted(captures.speeds)),
                "repeats": 1,
                "excitation_s": EXCITATION_S,
            }
        )
    if captures.pieces:
        every = tuple(speed for piece in captures.pieces for speed in piece)
        speeds = tuple(sorted(set(every))) if not recipe.scene.cut else every
        cut = cut.model_copy(
            update={
                "speeds_rad_per_s": speeds,
                "strokes_per_sheet": len(captures.pieces[0]),
                "sheets": len(captures.pieces),
            }
        )
    listed = capture.model_copy(update={"friction": friction, "cut": cut})
    return recipe.model_copy(update={"capture": listed})


def listed_captures(
    recipe: Recipe, identity: Identity, friction: FrictionState, cut: CutState
) -> tuple[tuple[Information, Information], float]:
    """What the captures that a recipe lists would tell of friction and of the cut; the seconds."""
    sweeps, strokes = friction_plan(recipe, identity), cut_plan(recipe, identity)
    none = Information.none(len(friction.knowledge.point))
    of_friction = sum(_information_of_sweeps(recipe, identity, friction, sweeps).values(), none)
    of_cut = Information.none(len(cut.knowledge.point))
    for segment in strokes.segments:
        by_stroke = _information_of_strokes(recipe, identity, friction, cut, strokes, segment)
        of_cut = sum(by_stroke.values(), of_cut)
    seconds = sum(seconds_at_rig(recipe, plan) for plan in (sweeps, strokes))
    return (of_friction, of_cut), seconds


def seconds_at_rig(recipe: Recipe, plan: Plan) -> float:
    """Seconds that a planned capture takes, with what a person does: as the stock counts them."""
    handling = recipe.capture.handling_s
    pieces = sum(segment.load == "sheet" for segment in plan.segments)
    loads = pieces * (handling + RETURN_S) if recipe.scene.cut else 0.0
    return plan.duration_s + 2.0 * IDLE_S + handling + loads


def nominal_identity(recipe: Recipe) -> Identity:
    """What is assumed of a rig that stated nothing yet: room for the scene, 1 kHz, 17 bits."""
    low, high = recipe.scene.opening_rad
    margin = 0.1
    return Identity(
        nonce_echo=0,
        name="assumed",
        serial="",
        capabilities=int(Capability.ADVANCE_MOTOR),
        firmware_version=0,
        tick_us=1000,
        torque_limit=recipe.limits.torque_Nm,
        force_limit=recipe.limits.force_N,
        opening_min=max(low - margin, 0.0),
        opening_max=high + margin,
        advance_min=-2.0 * recipe.rig.edge.length_m,
        advance_max=recipe.material.sheet_length_mm * 1e-3,
        opening_resolution=2.0 * np.pi / 2**17,
        advance_resolution=1e-6,
        handle_radius=recipe.rig.handle_radius_mm * 1e-3,
    )


def _sweeps(
    recipe: Recipe, identity: Identity, friction: FrictionState, slowest_sweep: float
) -> tuple[dict[float, Offer], Offer]:
    """Pairs of sweeps by speed, and the excitation, from one planned capture of all."""
    band_Hz = RATE_BAND * recipe.fit.friction.cutoff_Hz
    floor = rate_floor_of_step(identity.opening_resolution, band_Hz, 1e6 / identity.tick_us)
    slow, fast = recipe.scene.opening_rate_rad_per_s
    slowest = max(slow, LEAST_FLOORS * floor, slowest_sweep)
    speeds = _rounded(np.geomspace(slowest, max(fast, 1.5 * slowest), SWEEP_SPEEDS))
    wanted = recipe.capture.friction.model_copy(
        update={"speeds_rad_per_s": speeds, "repeats": 1, "excitation_s": EXCITATION_S}
    )
    plan = friction_plan(with_capture(recipe, "friction", wanted), identity)
    by_stroke = _information_of_sweeps(recipe, identity, friction, plan)
    none = Information.none(len(friction.knowledge.point))
    seconds = _seconds_by_stroke(plan.segments[0], plan)

    def offer(*strokes: int) -> Offer:
        parts = [by_stroke.get(stroke, none) for stroke in strokes]
        return Offer(sum(parts, none), sum(seconds.get(stroke, 0.0) for stroke in strokes))

    sweeps = {
        speed: offer(*(stroke.index for stroke in plan.strokes if stroke.speed == speed))
        for speed in speeds
    }
    return sweeps, offer(plan.strokes[-1].index)


def _strokes(
    recipe: Recipe, identity: Identity, friction: FrictionState, cut: CutState
) -> dict[tuple[float, int], Offer]:
    """Strokes by speed and place in the sheet, from a planned sheet for each speed."""
    slow, fast = recipe.scene.opening_rate_rad_per_s
    ends = (min(CUT_FROM * slow, CUT_TO * fast), CUT_TO * fast)
    known = cut.knowledge
    found = {}
    none = Information.none(len(known.point))
    for speed in _rounded(np.geomspace(*ends, CUT_SPEEDS)):
        wanted = recipe.capture.cut.model_copy(
            update={"speeds_rad_per_s": (speed,), "strokes_per_sheet": MOST_PLACES, "sheets": 1}
        )
        plan = cut_plan(with_capture(recipe, "cut", wanted), identity)
        (segment,) = plan.segments
        by_stroke = _information_of_strokes(recipe, identity, friction, cut, plan, segment)
        seconds = _seconds_by_stroke(segment, plan)
        for place in range(len(plan.strokes) // 2):
            both = (2 * place, 2 * place + 1)
            tells = sum((by_stroke.get(stroke, none) for stroke in both), none)
            found[speed, place] = Offer(tells, sum(seconds.get(stroke, 0.0) for stroke in both))
    return found


def _information_of_sweeps(
    recipe: Recipe, identity: Identity, friction: FrictionState, plan: Plan
) -> dict[int, Information]:
    (segment,) = plan.segments
    known = friction.knowledge
    design = planned_friction(
        _motion(segment, plan, identity),
        recipe.fit.friction,
        friction.structure,
        known.layout,
        known.point,
        friction.zero_sd,
    )
    return friction_information(design, known.point, friction.noise, friction.stroke_sd)


def _information_of_strokes(
    recipe: Recipe,
    identity: Identity,
    friction: FrictionState,
    cut: CutState,
    plan: Plan,
    segment: Segment,
) -> dict[int, Information]:
    """Empty where a fit would find no unloading."""
    known = cut.knowledge
    design = planned_cut(
        _motion(segment, plan, identity),
        CutBasis(recipe, cut.geometry, friction.known),
        cut.law,
        cut.structure,
        known.layout,
        known.point,
    )
    return cut_information(design, known.point) if design else {}


def _motion(segment: Segment, plan: Plan, identity: Identity) -> PlannedMotion:
    reference = segment.reference
    return PlannedMotion(
        opening=reference.opening,
        advance=reference.advance,
        stroke=reference.stroke.astype(np.int64),
        sheet=np.full(len(reference), segment.sheet, dtype=np.int64),
        strokes=plan.strokes,
        tick_s=plan.tick_s,
        opening_step=identity.opening_resolution,
        advance_step=identity.advance_resolution,
    )


def _seconds_by_stroke(segment: Segment, plan: Plan) -> Mapping[int, float]:
    """Seconds of each stroke, with the pause before it; what follows the last one counts to it."""
    owner = stroke_of_tick(segment.reference.stroke)
    owner[owner < 0] = owner[owner >= 0][-1]
    strokes, counts = np.unique(owner, return_counts=True)
    return {
        int(stroke): plan.tick_s * int(count) for stroke, count in zip(strokes, counts, strict=True)
    }


def _rounded(speeds: Array) -> tuple[float, ...]:
    """Speeds as people write them: three digits."""
    return tuple(dict.fromkeys(float(f"{speed:.3g}") for speed in speeds))
