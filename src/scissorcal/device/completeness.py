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

from scissorcal.recipe.requirements import LITTLE, CaptureKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.until import UntilMark

EXCITATION_SHARE = 0.95
"""Share of the planned excitation that must be recorded: its ramps are labelled as pauses."""

SAME = 1e-9
"""Shares that differ by less are one: of percents in a recipe and in a mark."""

NAMED = 3
"""Ranges of opening that a sentence lists before it only counts them."""

Counts = Mapping[str, Any]


@dataclass(frozen=True)
class CellCount:
    """One planned cell: direction, speed and range of opening, with seconds needed and recorded.

    ``used_s`` is what the fit uses; None where there is no fit.
    """

    direction: str
    speed_rad_per_s: float
    opening_deg: tuple[float, float]
    needed_s: float
    recorded_s: float
    used_s: float | None = None


@dataclass(frozen=True)
class StrokeCount:
    """Strokes of one kind and speed: planned, recorded whole, and used by the fit."""

    kind: str
    speed_rad_per_s: float
    planned: int
    recorded: int
    used: int | None = None


@dataclass(frozen=True)
class SheetCount:
    """Closing strokes through one sheet, numbered across recordings: planned, recorded, used.

    Sheets that the plan has and the recordings lack come last; of sheets beyond the plan's number,
    those with the fewest strokes have none planned.
    """

    sheet: int
    planned: int
    recorded: int
    used: int | None = None


@dataclass(frozen=True)
class ExcitationCount:
    """Seconds of excitation: planned, recorded, and used by the fit."""

    planned_s: float
    recorded_s: float
    used_s: float | None = None

    @property
    def missing(self) -> bool:
        """Whether less is recorded than a whole capture labels."""
        return self.recorded_s < EXCITATION_SHARE * self.planned_s


@dataclass(frozen=True)
class SummaryRow:
    """How many ``unit`` of one motion or sheet are planned, recorded and used, for people."""

    name: str
    unit: str
    planned: int
    recorded: int
    used: int | None
    motion: str = ""


@dataclass(frozen=True)
class Completeness:
    """Planned, recorded and used, over all recordings of one kind.

    ``missing`` has one sentence for each thing that the plan has and the recordings lack,
    ``little_used`` one for each speed of which the fit uses less than half of the motion. Return
    strokes of a cut can be missing, and are not among ``strokes``: of how many of their samples a
    fit could make use is not known here.
    """

    cells: tuple[CellCount, ...] = ()
    strokes: tuple[StrokeCount, ...] = ()
    sheets: tuple[SheetCount, ...] = ()
    missing: tuple[str, ...] = ()
    little_used: tuple[str, ...] = ()
    excitation: ExcitationCount | None = None

    @property
    def summary(self) -> tuple[SummaryRow, ...]:
        """Strokes and ranges of opening by direction and speed, strokes by sheet, excitation."""
        strokes = [
            SummaryRow(_motion(row.kind, row.speed_rad_per_s), "strokes", *_counts(row))
            for row in self.strokes
        ]
        sheets = [
            SummaryRow(f"sheet {row.sheet}", "closing strokes", *_counts(row))
            for row in self.sheets
        ]
        ranges = [_ranges(*key, row) for key, row in _by_speed(self.cells).items()]
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
    cells = _cells(driven)
    strokes = _strokes(pairs, driven, recipe)
    sheets = _sheets(pairs, (driven or pairs)[0][0]["planned_sheets"])
    missing = [*_missing_cells(cells), *_missing_strokes(strokes), *_missing_sheets(sheets)]
    until = pairs[0][0].get("until")
    if until:
        missing = _missing_tolerance(UntilMark.of(until), recipe, kind)
    excitation = None
    planned_s = recipe.capture.friction.excitation_s
    if pairs[0][0].get("designed"):
        planned_s = pairs[0][0]["planned_excitation_s"]
    if kind == "friction" and planned_s > 0 and not until:
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
        tuple(row for row in strokes if kind == "friction" or row.kind != "opening"),
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
        f"{kind} --until-tolerance' once more"
    ]


_Pairs = Sequence[tuple[Counts, Counts | None]]


def _cells(pairs: _Pairs) -> tuple[CellCount, ...]:
    if not pairs:
        return ()
    first = pairs[0][0]
    same = [pair for pair in pairs if pair[0]["openings"] == first["openings"]]
    return tuple(
        CellCount(
            direction,
            speed,
            (degrees(low), degrees(high)),
            first["needed_s"],
            sum(count["seconds"][d][s][c] for count, _ in same),
            _sum(use and use["seconds"][d][s][c] for _, use in same),
        )
        for d, direction in enumerate(first["directions"])
        for s, speed in enumerate(first["speeds"])
        for c, (low, high) in enumerate(first["openings"])
    )


def _strokes(pairs: _Pairs, driven: _Pairs, recipe: Recipe) -> tuple[StrokeCount, ...]:
    if not driven:
        capture = recipe.capture.cut
        found = sum(kind != "opening" for count, _ in pairs for kind, _ in count["recorded"])
        used = _sum(use and sum(k != "opening" for k, _ in use["strokes"]) for _, use in pairs)
        planned = capture.sheets * capture.strokes_per_sheet
        return (StrokeCount("closing", float("nan"), planned, found, used),)
    planned_strokes = Counter((kind, speed) for kind, speed in driven[0][0]["planned"])
    recorded = Counter((kind, speed) for count, _ in driven for kind, speed in count["recorded"])
    return tuple(
        StrokeCount(
            kind,
            speed,
            number,
            recorded[kind, speed],
            _sum(use and use["strokes"].count([kind, speed]) for _, use in driven),
        )
        for (kind, speed), number in planned_strokes.items()
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


def _by_speed(cells: Sequence[CellCount]) -> dict[tuple[str, float], list[CellCount]]:
    found: dict[tuple[str, float], list[CellCount]] = {}
    for cell in cells:
        found.setdefault((cell.direction, cell.speed_rad_per_s), []).append(cell)
    return found


def _motion(direction: str, speed_rad_per_s: float) -> str:
    known = speed_rad_per_s == speed_rad_per_s
    return f"{direction} at {speed_rad_per_s:g} rad/s" if known else f"{direction} by hand"


def _counts(row: StrokeCount | SheetCount) -> tuple[int, int, int | None]:
    return row.planned, row.recorded, row.used


def _ranges(direction: str, speed: float, row: Sequence[CellCount]) -> SummaryRow:
    recorded_s, used_s = sum(c.recorded_s for c in row), _sum(c.used_s for c in row)
    return SummaryRow(
        _motion(direction, speed),
        "ranges of opening",
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


def _filled(cells: Sequence[CellCount]) -> int:
    """Of how many cells the fit uses enough."""
    return sum(cell.used_s is not None and cell.used_s >= cell.needed_s for cell in cells)


def _little_used(cells: Sequence[CellCount]) -> list[str]:
    sentences = []
    for (direction, speed), row in _by_speed(cells).items():
        recorded = sum(cell.recorded_s for cell in row)
        used = _sum(cell.used_s for cell in row)
        if used is None or used >= LITTLE * recorded:
            continue
        reached = [cell for cell in row if cell.recorded_s >= cell.needed_s]
        sentences.append(
            f"{_motion(direction, speed)}: {used:.2g} s of {recorded:.3g} s of motion are used, "
            f"in {_filled(reached)} of {len(reached)} ranges of opening"
        )
    return sentences


def _missing_cells(cells: Sequence[CellCount]) -> list[str]:
    thin = _by_speed([cell for cell in cells if cell.recorded_s < cell.needed_s])
    sentences = []
    for (direction, speed), rows in thin.items():
        ranges = [f"{row.opening_deg[0]:.0f}-{row.opening_deg[1]:.0f}" for row in rows]
        listed = ", ".join(ranges[:NAMED]) + (" ..." if len(ranges) > NAMED else "")
        sentences.append(
            f"{_motion(direction, speed)}: {len(rows)} ranges of opening ({listed} deg) have "
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
