"""What a capture planned against what was recorded, and what a fit uses of it.

Cells of motion, strokes, sheets and excitation. Plain values in, so that a plan is judged without
loading arrays; `device.counting` makes them.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import degrees
from typing import Any

from scissorcal.device.counts import (
    AnyCell,
    AnyStrokes,
    CarriageCellCount,
    CarriageStrokeCount,
    CellCount,
    ExcitationCount,
    SheetCount,
    StrokeCount,
    SummaryRow,
    motion_of,
)
from scissorcal.recipe.requirements import LITTLE, CaptureKind, command_words
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.until import UntilMark

SAME = 1e-9
"""Shares that differ by less are one: of percents in a recipe and in a mark."""

NAMED = 3
"""Ranges of opening that a sentence lists before it only counts them."""

Counts = Mapping[str, Any]


@dataclass(frozen=True)
class Completeness:
    """Planned, recorded and used, over all recordings of one kind.

    ``missing`` has one sentence for each thing that the plan has and the recordings lack,
    ``little_used`` one for each speed of which the fit uses less than half of the motion. Return
    strokes of a cut can be missing, and are not among ``strokes``: of how many of their samples a
    fit could make use is not known here.
    """

    cells: tuple[AnyCell, ...] = ()
    strokes: tuple[AnyStrokes, ...] = ()
    sheets: tuple[SheetCount, ...] = ()
    missing: tuple[str, ...] = ()
    little_used: tuple[str, ...] = ()
    excitation: ExcitationCount | None = None

    @property
    def summary(self) -> tuple[SummaryRow, ...]:
        """Strokes and ranges of opening by direction and speed, strokes by sheet, excitation."""
        strokes = [SummaryRow(motion_of(row), "strokes", *_counts(row)) for row in self.strokes]
        sheets = [
            SummaryRow(f"sheet {row.sheet}", "closing strokes", *_counts(row))
            for row in self.sheets
        ]
        ranges = [_ranges(motion, row) for motion, row in _by_speed(self.cells).items()]
        excitation = [_excitation(self.excitation)] if self.excitation else []
        return (*strokes, *ranges, *sheets, *excitation)


def completeness(
    counts: Sequence[Counts],
    recipe: Recipe,
    kind: CaptureKind,
    used: Sequence[Counts] | None = None,
) -> Completeness:
    """Put the counts of several recordings together, and name what is missing or hardly used.

    ``used`` has, for each of ``counts``, what a fit uses of that recording, empty where that is not
    known. Recordings by hand have no planned speeds: the strokes through each sheet are counted
    alone. Presses have no sheets, unless by hand. A recording of a designed list is judged by that.
    A capture until the tolerance builds on the recordings before it: the last one says for all such
    whether it was reached.
    """
    taken = [None] * len(counts) if used is None else list(used)
    pairs = [(count, use or None) for count, use in zip(counts, taken, strict=True) if count]
    last = [count["until"] for count, _ in pairs if count.get("until")][-1:]
    pairs = [({**c, "until": last[0]} if c.get("until") else c, use) for c, use in pairs]
    own = [bool(pair[0].get("designed") or pair[0].get("until")) for pair in pairs]
    listed = [pair for pair, alone in zip(pairs, own, strict=True) if not alone]
    each = [[pair] for pair, alone in zip(pairs, own, strict=True) if alone]
    return _joined([_of_one_plan(part, recipe, kind) for part in (listed, *each) if part])


def _joined(parts: Sequence[Completeness]) -> Completeness:
    """What several plans asked for, one after the other; each designed list is one."""
    if len(parts) < 2:
        return parts[0] if parts else Completeness()
    excited = [part.excitation for part in parts if part.excitation is not None]
    return Completeness(
        cells=tuple(cell for part in parts for cell in part.cells),
        strokes=tuple(row for part in parts for row in part.strokes),
        sheets=_numbered([row for part in parts for row in part.sheets]),
        missing=tuple(dict.fromkeys(sentence for part in parts for sentence in part.missing)),
        little_used=tuple(dict.fromkeys(text for part in parts for text in part.little_used)),
        excitation=ExcitationCount(
            sum(one.planned_s for one in excited),
            sum(one.recorded_s for one in excited),
            _sum(one.used_s for one in excited),
        )
        if excited
        else None,
    )


def _numbered(sheets: Sequence[SheetCount]) -> tuple[SheetCount, ...]:
    return tuple(replace(row, sheet=place + 1) for place, row in enumerate(sheets))


def _of_one_plan(pairs: "_Pairs", recipe: Recipe, kind: CaptureKind) -> Completeness:
    """Judge recordings of one plan together."""
    driven = [(count, use) for count, use in pairs if not count["by_hand"]]
    cells = _cells(driven, kind)
    strokes = _strokes(pairs, driven, recipe, kind)
    sheets = _sheets(pairs, (driven or pairs)[0][0]["planned_sheets"])
    missing = [*_missing_cells(cells), *_missing_strokes(strokes), *_missing_sheets(sheets)]
    until = pairs[0][0].get("until")
    if until:
        missing = _missing_tolerance(UntilMark.of(until), recipe, kind)
    excitation = None
    planned_s = planned_excitation_s(recipe, kind)
    if pairs[0][0].get("designed"):
        planned_s = pairs[0][0]["planned_excitation_s"]
    if kind != "cut" and planned_s > 0 and not until:
        excitation = ExcitationCount(
            planned_s,
            sum(count["excitation_s"] for count, _ in pairs),
            _sum(use and use["excitation_s"] for _, use in pairs),
        )
        if excitation.missing:
            found, wanted = excitation.recorded_s, excitation.planned_s
            missing.append(f"excitation: {found:.1f} s of {wanted:g} s recorded")
    if not missing and all(count.get("stop") for count, _ in pairs):
        stop = str(pairs[-1][0]["stop"]).replace("_", " ").lower()
        missing.append(f"an undisturbed end: the servo stopped the last capture ({stop})")
    return Completeness(
        cells,
        tuple(row for row in strokes if kind != "cut" or row.kind != "opening"),
        sheets,
        tuple(missing),
        tuple(_little_used(cells)),
        excitation,
    )


def _missing_tolerance(mark: UntilMark, recipe: Recipe, kind: CaptureKind) -> list[str]:
    """What a capture until the tolerance lacks, by the recipe's tolerance and confidence now."""
    if not mark.reached:
        return [f"the scene's tolerance: {mark.sentence}"]
    tolerance = 0.01 * recipe.scene.tolerance_percent
    confidence = 0.01 * recipe.scene.confidence_percent
    if mark.tolerance <= tolerance + SAME and mark.confidence >= confidence - SAME:
        return []
    return [
        f"the scene's tolerance: the capture ended within {100 * mark.tolerance:g} % at "
        f"{100 * mark.confidence:g} % confidence, and the recipe now asks for "
        f"{100 * tolerance:g} % at {100 * confidence:g} %: run 'scissorcal capture "
        f"{command_words(kind)} --until-tolerance' once more"
    ]


_Pairs = Sequence[tuple[Counts, Counts | None]]


def planned_excitation_s(recipe: Recipe, kind: CaptureKind) -> float:
    """Seconds of excitation that the recipe plans for captures of friction, 0 for cuts."""
    if kind == "cut":
        return 0.0
    capture = recipe.capture
    friction = capture.friction if kind == "friction" else capture.friction_advance
    return friction.excitation_s


def _cells(pairs: _Pairs, kind: CaptureKind) -> tuple[AnyCell, ...]:
    if not pairs:
        return ()
    first = pairs[0][0]
    same = [pair for pair in pairs if pair[0]["openings"] == first["openings"]]
    slides = kind == "friction-advance"
    row = CarriageCellCount if slides else CellCount
    return tuple(
        row(
            direction,
            1e3 * speed if slides else speed,
            (1e3 * low, 1e3 * high) if slides else (degrees(low), degrees(high)),
            first["needed_s"],
            sum(count["seconds"][d][s][c] for count, _ in same),
            _sum(use and use["seconds"][d][s][c] for _, use in same),
        )
        for d, direction in enumerate(first["directions"])
        for s, speed in enumerate(first["speeds"])
        for c, (low, high) in enumerate(first["openings"])
    )


def _strokes(
    pairs: _Pairs, driven: _Pairs, recipe: Recipe, kind: CaptureKind
) -> tuple[AnyStrokes, ...]:
    if not driven:
        capture = recipe.capture.cut
        found = sum(way != "opening" for count, _ in pairs for way, _ in count["recorded"])
        used = _sum(use and sum(k != "opening" for k, _ in use["strokes"]) for _, use in pairs)
        planned = capture.sheets * capture.strokes_per_sheet
        return (StrokeCount("closing", float("nan"), planned, found, used),)
    planned_strokes = Counter((way, speed) for way, speed in driven[0][0]["planned"])
    recorded = Counter((way, speed) for count, _ in driven for way, speed in count["recorded"])
    slides = kind == "friction-advance"
    row = CarriageStrokeCount if slides else StrokeCount
    return tuple(
        row(
            way,
            1e3 * speed if slides else speed,
            number,
            recorded[way, speed],
            _sum(use and use["strokes"].count([way, speed]) for _, use in driven),
        )
        for (way, speed), number in planned_strokes.items()
    )


def _sheets(pairs: _Pairs, planned: Sequence[int]) -> tuple[SheetCount, ...]:
    """Put the planned sheets to those with the most strokes; further ones were not planned."""
    if not planned:
        return ()
    found: list[tuple[int, int | None]] = [
        (int(recorded), None if use is None else int(use["sheets"][number]))
        for count, use in pairs
        for number, recorded in enumerate(count["sheets"])
    ]
    known = all(use is not None for _, use in pairs)
    found += [(0, 0 if known else None)] * (len(planned) - len(found))
    fullest = sorted(range(len(found)), key=lambda place: -found[place][0])
    wanted = dict(zip_longest(fullest, sorted(planned, reverse=True), fillvalue=0))
    return tuple(
        SheetCount(place + 1, wanted[place], recorded, used)
        for place, (recorded, used) in enumerate(found)
    )


def _sum(values: Iterable[Any]) -> Any:
    """The sum; None where any value is."""
    known = list(values)
    return None if None in known else sum(known)


def _by_speed(cells: Sequence[AnyCell]) -> dict[str, list[AnyCell]]:
    """Cells by direction and speed, in words."""
    found: dict[str, list[AnyCell]] = {}
    for cell in cells:
        found.setdefault(motion_of(cell), []).append(cell)
    return found


def _counts(row: AnyStrokes | SheetCount) -> tuple[int, int, int | None]:
    return row.planned, row.recorded, row.used


def _ranges(motion: str, row: Sequence[AnyCell]) -> SummaryRow:
    recorded_s, used_s = sum(c.recorded_s for c in row), _sum(c.used_s for c in row)
    return SummaryRow(
        motion,
        f"ranges of {row[0].of}",
        len(row),
        sum(cell.recorded_s >= cell.needed_s for cell in row),
        None if used_s is None else _filled(row),
        f"{recorded_s:.3g} s recorded" + ("" if used_s is None else f", {used_s:.3g} s used"),
    )


def _excitation(count: ExcitationCount) -> SummaryRow:
    """Whole seconds, rounded down where some are missing.

    How much a fit can use of a signal that turns all the time is stated, not judged.
    """
    planned = max(1, round(count.planned_s))
    recorded = min(int(count.recorded_s), planned - 1) if count.missing else planned
    motion = f"{count.recorded_s:.3g} s recorded"
    motion += "" if count.used_s is None else f", {count.used_s:.3g} s used"
    return SummaryRow("excitation", "s of excitation", planned, recorded, None, motion)


def _filled(cells: Sequence[AnyCell]) -> int:
    """Of how many cells the fit uses enough."""
    return sum(cell.used_s is not None and cell.used_s >= cell.needed_s for cell in cells)


def _little_used(cells: Sequence[AnyCell]) -> list[str]:
    sentences = []
    for motion, row in _by_speed(cells).items():
        recorded = sum(cell.recorded_s for cell in row)
        used = _sum(cell.used_s for cell in row)
        if used is None or used >= LITTLE * recorded:
            continue
        reached = [cell for cell in row if cell.recorded_s >= cell.needed_s]
        sentences.append(
            f"{motion}: {used:.2g} s of {recorded:.3g} s of motion are used, "
            f"in {_filled(reached)} of {len(reached)} ranges of {row[0].of}"
        )
    return sentences


def _missing_cells(cells: Sequence[AnyCell]) -> list[str]:
    thin = _by_speed([cell for cell in cells if cell.recorded_s < cell.needed_s])
    sentences = []
    for motion, rows in thin.items():
        ranges = [f"{row.range[0]:.0f}-{row.range[1]:.0f}" for row in rows]
        listed = ", ".join(ranges[:NAMED]) + (" ..." if len(ranges) > NAMED else "")
        sentences.append(
            f"{motion}: {len(rows)} ranges of {rows[0].of} ({listed} {rows[0].unit}) have "
            f"less than {rows[0].needed_s:g} s of motion"
        )
    return sentences


def _missing_strokes(strokes: Sequence[AnyStrokes]) -> list[str]:
    short: dict[tuple[str, int, int], list[float]] = {}
    for row in strokes:
        if row.recorded < row.planned:
            short.setdefault((row.kind, row.recorded, row.planned), []).append(row.speed)
    sentences = []
    for (kind, recorded, planned), speeds in short.items():
        at = ", ".join(f"{speed:g}" for speed in speeds if speed == speed)
        each = " each" if len(speeds) > 1 else ""
        of_speed = f" at {at} {strokes[0].rate_unit}" if at else ""
        sentences.append(f"{kind} strokes{of_speed}: {recorded} of {planned} recorded{each}")
    return sentences


def _missing_sheets(sheets: Sequence[SheetCount]) -> list[str]:
    short: dict[tuple[int, int], list[int]] = {}
    for row in sheets:
        if row.recorded < row.planned:
            short.setdefault((row.recorded, row.planned), []).append(row.sheet)
    return [
        f"sheet{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}: {recorded} of "
        f"{planned} closing strokes recorded{' each' if len(numbers) > 1 else ''}"
        for (recorded, planned), numbers in short.items()
    ]
