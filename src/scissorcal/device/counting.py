"""Count what a recording holds of the recipe's plan, and what a fit uses of it, as plain values."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.capture import identity_of
from scissorcal.device.coverage import NEEDED_S, CoverageGrid, cut_coverage, friction_coverage
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.trajectory import friction_plan
from scissorcal.kernel import Identity
from scissorcal.recipe.requirements import LITTLE, CaptureKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording

Mask = NDArray[np.bool_]
Labels = NDArray[np.int64]


def count_recorded(recording: Recording, recipe: Recipe, kind: CaptureKind) -> dict[str, Any]:
    """Count what one recording holds of the recipe's plan, as plain values.

    Gives nothing for a recording without a device's identity, such as an import: no plan of this
    project made it.
    """
    if not recording.device:
        return {}
    by_hand, grid = _grid(recording, recipe, kind)
    label = _labels(recording)
    grid.add(recording.samples[label >= 0])
    strokes, sheets = _plan(recipe, identity_of(recording.device), kind, by_hand)
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
    }


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
    _, grid = _grid(recording, recipe, kind)
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


def _grid(recording: Recording, recipe: Recipe, kind: CaptureKind) -> tuple[bool, CoverageGrid]:
    """Whether a hand moved the blades, and the cells of the plan."""
    identity = identity_of(recording.device)
    if kind == "friction":
        return False, friction_coverage(recipe, identity)
    planned = {round(speed, 9) for speed in recipe.capture.cut.speeds_rad_per_s}
    closing = [s for s in recording.strokes if s.kind in ("closing", "press")]
    by_hand = bool(closing) and all(round(s.speed, 9) not in planned for s in closing)
    return by_hand, cut_coverage(recipe, identity, hand=by_hand)


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
    plan = friction_plan if kind == "friction" else cut_plan
    strokes = [s for s in plan(recipe, identity).strokes if s.kind != "excitation"]
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
