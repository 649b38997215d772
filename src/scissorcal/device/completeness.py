"""What a capture planned against what was recorded: cells of motion, strokes, excitation.

Plain values in, so that a plan is judged without loading arrays; `device.counting` makes them.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Any

from scissorcal.recipe.requirements import CaptureKind
from scissorcal.recipe.schema import Recipe

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


def _cells(counts: Sequence[Counts]) -> tuple[CellCount, ...]:
    if not counts:
        return ()
    first = counts[0]
    same = [count for count in counts if count["openings"] == first["openings"]]
    return tuple(
        CellCount(
            direction,
            speed,
            (degrees(low), degrees(high)),
            first["needed_s"],
            sum(count["seconds"][d][s][c] for count in same),
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
