"""What a capture planned against what was recorded: cells of motion, strokes, excitation."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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

EXCITATION_SHARE = 0.95
"""Share of the planned excitation that must be recorded: its ramps are labelled as pauses."""

NAMED = 3
"""Ranges of opening that a sentence lists before it only counts them."""

Counts = Mapping[str, Any]


@dataclass(frozen=True)
class CellCount:
    """One planned cell: direction, speed and range of opening, with seconds needed and recorded."""

    direction: str
    speed_rad_per_s: float
    opening_deg: tuple[float, float]
    needed_s: float
    recorded_s: float


@dataclass(frozen=True)
class StrokeCount:
    """Strokes of one kind and speed: how many the plan has, and how many were recorded whole."""

    kind: str
    speed_rad_per_s: float
    planned: int
    recorded: int


@dataclass(frozen=True)
class Completeness:
    """Planned against recorded, over all recordings of one kind.

    ``missing`` has one sentence for each thing that the plan has and the recordings lack.
    """

    cells: tuple[CellCount, ...]
    strokes: tuple[StrokeCount, ...]
    missing: tuple[str, ...]


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


def completeness(counts: Sequence[Counts], recipe: Recipe, kind: CaptureKind) -> Completeness:
    """Put the counts of several recordings together and name what is missing.

    Recordings by hand have no planned speeds: the strokes through each sheet are counted alone.
    """
    counts = [count for count in counts if count]
    if not counts:
        return Completeness((), (), ())
    driven = [count for count in counts if not count["by_hand"]]
    cells = _cells(driven)
    strokes = _strokes(counts, driven, recipe)
    missing = [*_missing_cells(cells), *_missing_strokes(strokes)]
    if kind == "friction":
        wanted = recipe.capture.friction.excitation_s
        found = sum(count["excitation_s"] for count in counts)
        if found < EXCITATION_SHARE * wanted:
            missing.append(f"excitation: {found:.1f} s of {wanted:g} s recorded")
    return Completeness(cells, strokes, tuple(missing))


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


def _cells(counts: Sequence[Counts]) -> tuple[CellCount, ...]:
    if not counts:
        return ()
    first = counts[0]
    same = [count for count in counts if count["openings"] == first["openings"]]
    seconds = np.sum([np.asarray(count["seconds"]) for count in same], axis=0)
    return tuple(
        CellCount(
            direction,
            speed,
            (float(np.degrees(low)), float(np.degrees(high))),
            first["needed_s"],
            float(seconds[d, s, c]),
        )
        for d, direction in enumerate(first["directions"])
        for s, speed in enumerate(first["speeds"])
        for c, (low, high) in enumerate(first["openings"])
    )


def _strokes(
    counts: Sequence[Counts], driven: Sequence[Counts], recipe: Recipe
) -> tuple[StrokeCount, ...]:
    if not driven:
        capture = recipe.capture.cut
        found = sum(kind != "opening" for count in counts for kind, _ in count["recorded"])
        return (
            StrokeCount("closing", float("nan"), capture.sheets * capture.strokes_per_sheet, found),
        )
    planned = Counter((kind, speed) for kind, speed in driven[0]["planned"])
    recorded = Counter((kind, speed) for count in driven for kind, speed in count["recorded"])
    return tuple(
        StrokeCount(kind, speed, number, recorded[kind, speed])
        for (kind, speed), number in planned.items()
    )


def _missing_cells(cells: Sequence[CellCount]) -> list[str]:
    thin: dict[tuple[str, float], list[CellCount]] = {}
    for cell in cells:
        if cell.recorded_s < cell.needed_s:
            thin.setdefault((cell.direction, cell.speed_rad_per_s), []).append(cell)
    sentences = []
    for (direction, speed), rows in thin.items():
        ranges = [f"{row.opening_deg[0]:.0f}-{row.opening_deg[1]:.0f}" for row in rows]
        listed = ", ".join(ranges[:NAMED]) + (" ..." if len(ranges) > NAMED else "")
        sentences.append(
            f"{direction} at {speed:g} rad/s: {len(rows)} ranges of opening ({listed} deg) have "
            f"less than {rows[0].needed_s:g} s of motion"
        )
    return sentences


def _missing_strokes(strokes: Sequence[StrokeCount]) -> list[str]:
    short: dict[tuple[str, int, int], list[float]] = {}
    for row in strokes:
        if row.recorded < row.planned:
            short.setdefault((row.kind, row.recorded, row.planned), []).append(row.speed_rad_per_s)
    sentences = []
    for (kind, recorded, planned), speeds in short.items():
        at = ", ".join(f"{speed:g}" for speed in speeds if speed == speed)
        each = " each" if len(speeds) > 1 else ""
        of_speed = f" at {at} rad/s" if at else ""
        sentences.append(f"{kind} strokes{of_speed}: {recorded} of {planned} recorded{each}")
    return sentences
