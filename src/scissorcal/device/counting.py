"""Count what a recording holds of the recipe's plan, as plain values."""

from typing import Any

import numpy as np

from scissorcal.device.capture import identity_of
from scissorcal.device.coverage import CoverageGrid, cut_coverage, friction_coverage
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.trajectory import friction_plan
from scissorcal.kernel import Identity
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording


def count_recorded(recording: Recording, recipe: Recipe, kind: CaptureKind) -> dict[str, Any]:
    """Count what one recording holds of the recipe's plan, as plain values.

    Gives nothing for a recording without a device's identity, such as an import: no plan of this
    project made it.
    """
    if not recording.device:
        return {}
    identity = identity_of(recording.device)
    by_hand = kind == "cut" and _by_hand(recording, recipe)
    grid = _grid(recipe, identity, kind, by_hand)
    samples = recording.samples
    label = np.asarray(samples["stroke"])
    grid.add(samples[label >= 0])
    strokes = [] if by_hand else _planned(recipe, identity, kind)
    return {
        "by_hand": by_hand,
        "directions": list(grid.directions),
        "speeds": list(grid.speeds),
        "openings": [list(cell) for cell in grid.cells],
        "needed_s": grid.needed_s,
        "seconds": grid.seconds.tolist(),
        "planned": strokes,
        "recorded": _recorded(recording, label),
        "excitation_s": _excitation(recording, label),
    }


def _grid(recipe: Recipe, identity: Identity, kind: CaptureKind, by_hand: bool) -> CoverageGrid:
    if kind == "friction":
        return friction_coverage(recipe, identity)
    return cut_coverage(recipe, identity, hand=by_hand)


def _by_hand(recording: Recording, recipe: Recipe) -> bool:
    """Whether the strokes have speeds that no plan of this recipe gives them."""
    planned = {round(speed, 9) for speed in recipe.capture.cut.speeds_rad_per_s}
    closing = [s for s in recording.strokes if s.kind in ("closing", "press")]
    return bool(closing) and all(round(s.speed, 9) not in planned for s in closing)


def _planned(recipe: Recipe, identity: Identity, kind: CaptureKind) -> list[list[Any]]:
    plan = friction_plan if kind == "friction" else cut_plan
    strokes = plan(recipe, identity).strokes
    return [[s.kind, s.speed] for s in strokes if s.kind != "excitation"]


def _recorded(recording: Recording, label: "np.ndarray[Any, Any]") -> list[list[Any]]:
    """Kind and speed of each stroke that was recorded to its end: other samples follow it."""
    found = []
    for stroke in recording.strokes:
        here = np.flatnonzero(label == stroke.index)
        if stroke.kind != "excitation" and len(here) and here[-1] + 1 < len(label):
            found.append([stroke.kind, stroke.speed])
    return found


def _excitation(recording: Recording, label: "np.ndarray[Any, Any]") -> float:
    time = recording.device_time_s
    tick = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    wanted = [s.index for s in recording.strokes if s.kind == "excitation"]
    return tick * float(np.isin(label, wanted).sum())
