"""Parts of a capture whose strokes are chosen one after the other. Pure functions."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.paths import PathBuilder, Reference
from scissorcal.device.trajectory import Plan, Segment, friction_plan
from scissorcal.kernel import Identity
from scissorcal.recipe.requirements import (
    APPROACH_SPEED,
    DWELL_S,
    SETTLE_S,
    TURN_ACCELERATION,
    DesignedKind,
)
from scissorcal.recipe.schema import CaptureCut, CaptureFriction, Recipe
from scissorcal.recording import Stroke


@dataclass(frozen=True)
class Part:
    """Motion without a pause, with its strokes as the recording numbers them.

    ``then_s`` are the seconds of strokes that are expected after it, for the progress shown.
    """

    segment: Segment
    strokes: tuple[Stroke, ...]
    then_s: float = 0.0

    @property
    def fresh(self) -> bool:
        """Whether a fresh piece is put in before it."""
        return self.segment.load == "sheet"


@dataclass(frozen=True)
class ChosenStroke:
    """A stroke that comes next: its speed (rad/s), its place in its sheet from 0, its sheet.

    ``first`` is its number in the recording; ``fresh`` has a fresh piece put in before it.
    """

    speed: float
    place: int
    sheet: int
    first: int
    fresh: bool


def sweep_part(
    recipe: Recipe,
    identity: Identity,
    speeds: tuple[float, ...],
    *,
    first: int,
    advance: float = 0.0,
    excitation_s: float = 0.0,
) -> Part:
    """Empty sweeps, closing and opening at each speed (rad/s), then an excitation if it has time.

    They move as a plan of friction moves, every second sweep from the middle of the range in three
    strokes; ``first`` is the number of the part's first stroke.
    """
    wanted = recipe.capture.friction.model_copy(
        update={
            "speeds_rad_per_s": speeds,
            "repeats": 1,
            "excitation_s": excitation_s or recipe.capture.friction.excitation_s,
        }
    )
    plan = friction_plan(with_capture(recipe, "friction", wanted), identity, advance)
    count = len(plan.strokes) - (excitation_s <= 0.0)
    (whole,) = plan.segments
    return _numbered(plan, whole, range(count), first)


def stroke_part(recipe: Recipe, identity: Identity, stroke: ChosenStroke, places: int) -> Part:
    """One stroke through material (or one press) and its return.

    A sheet has room for ``places``, as ``strokes_per_sheet`` of a recipe. The stroke begins
    where the one before it left the crack; a press, which may come after any other, with the blades
    clear of the material at every place.
    """
    wanted = recipe.capture.cut.model_copy(
        update={"speeds_rad_per_s": (stroke.speed,), "strokes_per_sheet": places, "sheets": 1}
    )
    plan = cut_plan(with_capture(recipe, "cut", wanted), identity)
    (whole,) = plan.segments
    request = (
        f"Put in a fresh piece of {recipe.material.name} (piece {stroke.sheet + 1}), its near "
        "edge at the mark; the blades stand open before it."
        if recipe.scene.cut
        else whole.request
    )
    load = replace(
        whole,
        load="sheet" if stroke.fresh else "nothing",
        sheet=stroke.sheet,
        request=request if stroke.fresh else "",
    )
    part = _numbered(plan, load, (2 * stroke.place, 2 * stroke.place + 1), stroke.first)
    return part if recipe.scene.cut else _from_clear(part, whole.reference, plan.tick_s)


def part_seconds(part: Part, identity: Identity) -> float:
    """Seconds of a part's motion, without what a person does before it."""
    return 1e-6 * identity.tick_us * len(part.segment.reference)


def _from_clear(part: Part, whole: Reference, tick_s: float) -> Part:
    """A press that begins at its place with the blades as wide as any press of a capture opens."""
    reference_of_part = part.segment.reference
    begin = int(np.flatnonzero(reference_of_part.stroke >= 0)[0])
    press = Reference(*(axis[begin:] for axis in vars(reference_of_part).values()))
    path = PathBuilder(float(whole.opening.max()), float(press.advance[0]), tick_s)
    path.rest(DWELL_S)
    path.open_to(float(press.opening[0]), APPROACH_SPEED, TURN_ACCELERATION)
    path.rest(SETTLE_S)
    reference = Reference.joined([path.reference(), press])
    return replace(part, segment=replace(part.segment, reference=reference))


def _numbered(plan: Plan, segment: Segment, wanted: Iterable[int], first: int) -> Part:
    """The strokes ``wanted`` of a segment, numbered from ``first``, with the pause before them."""
    labels = segment.reference.stroke
    kept = tuple(wanted)
    inside = np.isin(stroke_of_tick(labels), kept)
    table = np.full(labels.max() + 2, -1, dtype=np.int32)
    table[list(kept)] = np.arange(first, first + len(kept))
    whole = segment.reference
    cut = Reference(
        whole.opening[inside],
        whole.opening_rate[inside],
        whole.advance[inside],
        table[labels[inside]],
    )
    rest = PathBuilder(float(cut.opening[-1]), float(cut.advance[-1]), plan.tick_s)
    rest.rest(DWELL_S)
    strokes = tuple(
        replace(plan.strokes[label], index=first + number, sheet=segment.sheet)
        for number, label in enumerate(kept)
    )
    return Part(replace(segment, reference=Reference.joined([cut, rest.reference()])), strokes)


def stroke_of_tick(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """The stroke of each tick (n,), a pause's being the one after it; -1 after the last one."""
    marked = np.flatnonzero(labels >= 0)
    following = np.searchsorted(marked, np.arange(len(labels)))
    return np.append(labels[marked], np.int32(-1))[following]


def with_capture(
    recipe: Recipe, kind: DesignedKind, wanted: CaptureFriction | CaptureCut
) -> Recipe:
    """The recipe with another list of one kind of capture."""
    capture = recipe.capture.model_copy(update={kind: wanted})
    return recipe.model_copy(update={"capture": capture})
