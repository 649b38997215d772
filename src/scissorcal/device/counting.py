"""Count what a recording holds of the recipe's plan, and what a fit uses of it, as plain values."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.capture import identity_of
from scissorcal.device.coverage import CoverageGrid, cut_coverage, friction_coverage
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.trajectory import friction_plan
from scissorcal.kernel import Identity
from scissorcal.recipe.requirements import CaptureKind
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
    strokes = [] if by_hand else _planned(recipe, identity_of(recording.device), kind)
    return {
        "by_hand": by_hand,
        "directions": list(grid.directions),
        "speeds": list(grid.speeds),
        "openings": [list(cell) for cell in grid.cells],
        "needed_s": grid.needed_s,
        "seconds": grid.seconds.tolist(),
        "planned": strokes,
        "recorded": _recorded(recording, label),
        "sheets": _sheets(recording, label, np.ones(len(label), dtype=bool)),
        "excitation_s": _excitation(recording, label),
    }


def count_used(
    recording: Recording, recipe: Recipe, kind: CaptureKind, spans: NDArray[np.int64]
) -> dict[str, Any]:
    """Count what a fit uses of one recording, on the cells of :func:`count_recorded`.

    ``spans`` (k, 2) are the first and one past the last sample of each part that is used, as
    ``FitResult.used`` has them.
    """
    if not recording.device:
        return {}
    _, grid = _grid(recording, recipe, kind)
    label = _labels(recording)
    used = _mask(spans, len(label))
    grid.add(recording.samples[label >= 0], used[label >= 0])
    return {
        "seconds": grid.seconds.tolist(),
        "strokes": [
            [stroke.kind, stroke.speed]
            for stroke in recording.strokes
            if stroke.kind != "excitation" and np.any(used & (label == stroke.index))
        ],
        "sheets": _sheets(recording, label, used),
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


def _planned(recipe: Recipe, identity: Identity, kind: CaptureKind) -> list[list[Any]]:
    plan = friction_plan if kind == "friction" else cut_plan
    strokes = plan(recipe, identity).strokes
    return [[s.kind, s.speed] for s in strokes if s.kind != "excitation"]


def _recorded(recording: Recording, label: Labels) -> list[list[Any]]:
    """Kind and speed of each stroke that was recorded to its end: other samples follow it."""
    found = []
    for stroke in recording.strokes:
        here = np.flatnonzero(label == stroke.index)
        if stroke.kind != "excitation" and len(here) and here[-1] + 1 < len(label):
            found.append([stroke.kind, stroke.speed])
    return found


def _sheets(recording: Recording, label: Labels, counted: Mask) -> list[int]:
    """Closing strokes with samples that count, for each sheet of the recording in order."""
    with_samples = set(np.unique(label[counted]).tolist())
    closing = [s for s in recording.strokes if s.kind in ("closing", "press") and s.sheet >= 0]
    return [
        sum(s.sheet == sheet and s.index in with_samples for s in closing)
        for sheet in sorted({s.sheet for s in closing})
    ]


def _excitation(recording: Recording, label: Labels) -> float:
    time = recording.device_time_s
    tick = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    wanted = [s.index for s in recording.strokes if s.kind == "excitation"]
    return tick * float(np.isin(label, wanted).sum())
