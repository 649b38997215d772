"""Count what a recording holds of the recipe's plan, and what a fit uses of it, as plain values."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Mask
from scissorcal.device.capture import planned
from scissorcal.device.completeness import planned_excitation_s
from scissorcal.device.coverage import NEEDED_S, CoverageGrid, coverage_of
from scissorcal.device.session import identity_of
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
from scissorcal.recipe.load import parse_recipe
from scissorcal.recipe.requirements import LITTLE, CaptureKind
from scissorcal.recipe.schema import Capture, Recipe
from scissorcal.recording.recording import Recording
from scissorcal.recording.until import UntilMark

Labels = NDArray[np.int64]


def count_recorded(recording: Recording, recipe: Recipe, kind: CaptureKind) -> dict[str, Any]:
    """Count what one recording holds of its plan, as plain values.

    The plan is the recipe's, or the list that was designed for this recording. Gives nothing for a
    recording without a device's identity, such as an import: no plan of this project made it.
    """
    if not recording.device:
        return {}
    recipe = _as_planned(recording, recipe)
    by_hand, grid = _grid(recording, recipe, kind)
    label = _labels(recording)
    grid.add(recording.samples[label >= 0])
    until = UntilMark.last_of(recording.marks)
    if until is None:
        strokes, sheets = _plan(
            recipe, identity_of(recording.device, recording.source), kind, by_hand
        )
    else:
        strokes, sheets = _chosen(recording)
    whole = _whole(recording, label)
    return {
        "by_hand": by_hand,
        "stop": recording.stop,
        "directions": list(grid.directions),
        "speeds": list(grid.speeds),
        "openings": [list(cell) for cell in grid.cells],
        "needed_s": grid.needed_s,
        "seconds": grid.seconds.tolist(),
        "planned": strokes,
        "planned_sheets": sheets,
        "recorded": _named(recording, whole),
        "sheets": _sheets(recording, whole),
        "excitation_s": _excitation(recording, label),
        "planned_excitation_s": planned_excitation_s(recipe, kind),
        "designed": _designed_capture(recording) is not None,
        "until": until.as_dict() if until else None,
    }


def _designed_capture(recording: Recording) -> Capture | None:
    """The list that a recording was designed with; None for one that the recipe lists."""
    if not recording.recipe_toml:
        return None
    try:
        capture = parse_recipe(recording.recipe_toml, judged=False).capture
    except InputError:  # of another version, whose list is not known here
        return None
    return capture if capture.plan == "designed" else None


def count_used(
    recording: Recording, recipe: Recipe, kind: CaptureKind, spans: NDArray[np.int64]
) -> dict[str, Any]:
    """Count what a fit uses of one recording, on the cells of :func:`count_recorded`.

    ``spans`` (k, 2) are the first and one past the last sample of each part that is used, as
    ``FitResult.used`` has them. A stroke counts as used where at least half of its samples are. Of
    a cut, where the blades are free of the material until they reach it, that is half of the
    samples from the first that is used, and of these at least the seconds that a cell needs. Which
    part of a return stroke touches the material is not known here, so a cut's are not counted.
    """
    if not recording.device:
        return {}
    _, grid = _grid(recording, _as_planned(recording, recipe), kind)
    label = _labels(recording)
    used = _mask(spans, len(label))
    grid.add(recording.samples[label >= 0], used[label >= 0])
    enough = _used(recording, label, used, kind)
    return {
        "seconds": grid.seconds.tolist(),
        "strokes": _named(recording, enough),
        "sheets": _sheets(recording, enough),
        "excitation_s": _excitation(recording, np.where(used, label, -1)),
    }


def _as_planned(recording: Recording, recipe: Recipe) -> Recipe:
    """The recipe with the captures that this recording was planned with."""
    if UntilMark.last_of(recording.marks) is not None:
        return _with_chosen(recording, recipe)
    designed = _designed_capture(recording)
    return recipe if designed is None else recipe.model_copy(update={"capture": designed})


def _with_chosen(recording: Recording, recipe: Recipe) -> Recipe:
    """The recipe with the speeds of strokes that were chosen while they were captured."""
    closing = [s.speed for s in recording.strokes if s.kind in ("closing", "press")]
    speeds = tuple(sorted(set(closing)))
    if not speeds:
        return recipe
    kind = "friction" if recording.kind == "friction" else "cut"
    part = getattr(recipe.capture, kind).model_copy(update={"speeds_rad_per_s": speeds})
    capture = recipe.capture.model_copy(update={kind: part})
    return recipe.model_copy(update={"capture": capture})


def _chosen(recording: Recording) -> tuple[list[list[Any]], list[int]]:
    """As :func:`_plan`, of strokes that were chosen while they were captured: what was stated."""
    every = {stroke.index for stroke in recording.strokes}
    sheets = _sheets(recording, every)
    return _named(recording, every), sheets if recording.kind == "cut" else []


def _grid(recording: Recording, recipe: Recipe, kind: CaptureKind) -> tuple[bool, CoverageGrid]:
    """Whether a hand moved the blades, and the cells of the plan."""
    identity = identity_of(recording.device, recording.source)
    if kind != "cut":
        return False, coverage_of(recipe, identity, kind)
    planned = {round(speed, 9) for speed in recipe.capture.cut.speeds_rad_per_s}
    closing = [s for s in recording.strokes if s.kind in ("closing", "press")]
    by_hand = bool(closing) and all(round(s.speed, 9) not in planned for s in closing)
    return by_hand, coverage_of(recipe, identity, kind, hand=by_hand)


def _labels(recording: Recording) -> Labels:
    return np.asarray(recording.samples["stroke"], dtype=np.int64)


def _mask(spans: NDArray[np.int64], size: int) -> Mask:
    edges = np.zeros(size + 1, dtype=np.int64)
    np.add.at(edges, spans[:, 0], 1)
    np.add.at(edges, spans[:, 1], -1)
    return np.cumsum(edges)[:size] > 0


def _plan(
    recipe: Recipe, identity: Identity, kind: CaptureKind, by_hand: bool
) -> tuple[list[list[Any]], list[int]]:
    """Kind and speed of each planned stroke, and the closing strokes planned for each sheet.

    A hand has no planned speeds. Presses have no sheets: all are made on one piece.
    """
    capture = recipe.capture.cut
    if by_hand:
        return [], [capture.strokes_per_sheet] * capture.sheets
    strokes = [s for s in planned(recipe, identity, kind).strokes if s.kind != "excitation"]
    closing = [s.sheet for s in strokes if kind == "cut" and s.kind == "closing"]
    sheets = [closing.count(sheet) for sheet in sorted(set(closing))]
    return [[s.kind, s.speed] for s in strokes], sheets


def _whole(recording: Recording, label: Labels) -> set[int]:
    """The strokes that were recorded to their end: other samples follow them, and they cut."""
    return set(np.unique(label).tolist()) - {-1, *label[-1:].tolist()} - recording.unloaded


def _used(recording: Recording, label: Labels, used: Mask, kind: CaptureKind) -> set[int]:
    """The strokes of which a fit uses enough; see :func:`count_used`."""
    tick = _tick(recording)
    needed = NEEDED_S / tick if tick > 0 else np.inf
    found = set()
    for stroke in recording.strokes:
        own = used[label == stroke.index]
        if kind == "cut":
            own = own[np.argmax(own) :] if own.any() and stroke.kind != "opening" else own[:0]
        least = needed if kind == "cut" else 1
        if np.count_nonzero(own) >= max(least, LITTLE * len(own)):
            found.add(stroke.index)
    return found


def _named(recording: Recording, chosen: set[int]) -> list[list[Any]]:
    """Kind and speed of the strokes that are chosen."""
    return [
        [s.kind, s.speed] for s in recording.strokes if s.kind != "excitation" and s.index in chosen
    ]


def _sheets(recording: Recording, chosen: set[int]) -> list[int]:
    """Closing strokes that are chosen, for each sheet of the recording in order."""
    closing = [s for s in recording.strokes if s.kind in ("closing", "press") and s.sheet >= 0]
    return [
        sum(s.sheet == sheet and s.index in chosen for s in closing)
        for sheet in sorted({s.sheet for s in closing})
    ]


def _excitation(recording: Recording, label: Labels) -> float:
    """Seconds of the samples that are labelled as excitation."""
    wanted = [s.index for s in recording.strokes if s.kind == "excitation"]
    return _tick(recording) * float(np.isin(label, wanted).sum())


def _tick(recording: Recording) -> float:
    """Seconds between two samples, from whole microseconds, so that their sum is exact."""
    time_us = recording.samples["device_time_us"]
    return 1e-6 * float(np.median(np.diff(time_us))) if len(time_us) > 1 else 0.0
