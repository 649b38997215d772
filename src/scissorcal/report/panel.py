"""A panel: one subject as it is shown to a person, on the page, in the terminal and as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any, Literal

from scissorcal.report.numbers import (
    NOT_AVAILABLE,
    Number,
    decimals_for,
    display,
    finite,
    finite_each,
    short,
    significant,
    unit_text,
    with_decimals,
)
from scissorcal.verdicts import Verdict

Kind = Literal["line", "band", "points", "bars", "cells"]
Look = Literal[
    "closing", "opening", "excitation", "press", "blue", "vermillion", "green", "purple", "orange",
    "ink", "muted",
]  # fmt: skip
Style = Literal["full", "dashed", "dotted", "open"]


@dataclass(frozen=True)
class Value:
    """One named value of a row: a number in ``unit``, or ``text`` in its place.

    ``sd`` is its standard deviation, ``low`` and ``high`` its interval. Without an ``sd`` it is
    written with ``digits`` significant digits; counts are written in full.

    >>> str(Value("mean", 0.012345, "N m", sd=0.00021)), str(Value("used", 12))
    ('0.01235 ± 0.00021', '12')
    """

    name: str
    number: float | int | None = None
    unit: str = ""
    sd: Number = None
    low: Number = None
    high: Number = None
    text: str = ""
    digits: int = 3

    def __str__(self) -> str:
        """The value as people read it, without its unit."""
        if self.text:
            return self.text
        if isinstance(self.number, int):
            return display(self.number)
        if self.number is None:
            return NOT_AVAILABLE
        if self.sd is None and self.low is None:
            return significant(self.number, self.digits)
        spread = self.sd
        if spread is None and self.low is not None and self.high is not None:
            spread = 0.5 * (self.high - self.low)
        place = decimals_for(spread, self.number)
        words = with_decimals(self.number, place)
        if self.sd is not None:
            words += f" ± {with_decimals(self.sd, decimals_for(self.sd, self.sd))}"
        if self.low is not None and self.high is not None:
            words += f" ({with_decimals(self.low, place)} to {with_decimals(self.high, place)})"
        return words


@dataclass(frozen=True)
class Row:
    """Named values of one thing. ``name`` identifies a row within its panel.

    ``anchor`` is the row's own address on the page, ``link`` that of what it is about; ``note`` a
    sentence below it. ``marked`` rows stand out.
    """

    name: str
    values: tuple[Value, ...] = ()
    note: str = ""
    link: str = ""
    anchor: str = ""
    marked: bool = False

    def value(self, name: str) -> Value | None:
        """The value of this name; None where the row has none."""
        return next((value for value in self.values if value.name == name), None)


@dataclass(frozen=True)
class Axis:
    """An axis with its unit; ``categories`` (with ``links``) name its places 0, 1 ..."""

    label: str
    unit: str = ""
    log: bool = False
    reverse: bool = False
    low: Number = None
    high: Number = None
    categories: tuple[str, ...] = ()
    links: tuple[str, ...] = ()


@dataclass(frozen=True)
class Series:
    """A named curve, band, set of points, bars or cells; arrays share one length.

    ``low`` and ``high`` bound ``y`` (``x`` where the y axis has categories); ``cells`` carry their
    value in ``value``; ``labels`` are written beside points. ``toggle`` says that a reader may
    switch it on and off.
    """

    name: str
    kind: Kind
    x: tuple[Number, ...]
    y: tuple[Number, ...]
    low: tuple[Number, ...] = ()
    high: tuple[Number, ...] = ()
    value: tuple[Number, ...] = ()
    labels: tuple[str, ...] = ()
    look: Look = "ink"
    style: Style = "full"
    group: str = ""
    toggle: bool = False


@dataclass(frozen=True)
class Chart:
    """Series over shared axes. ``caption`` says what is drawn, ``small`` charts stand in a row."""

    id: str
    title: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    caption: str = ""
    small: bool = False


@dataclass(frozen=True)
class Picture:
    """A photograph that was drawn on: its file's name, caption, and in words what it shows.

    On the page it is at most ``widest_px`` wide: as fits draw them, so that lines stay sharp.
    """

    file: str
    title: str
    caption: str
    alt: str
    widest_px: int = 1000


@dataclass(frozen=True)
class Panel:
    """One subject: a sentence that matters, rows, charts of series, verdicts.

    ``part`` is the part of the report that it belongs to, ``notes`` are further sentences,
    ``caption`` explains the rows.
    """

    id: str
    part: str
    title: str
    sentence: str = ""
    rows: tuple[Row, ...] = ()
    charts: tuple[Chart, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    notes: tuple[str, ...] = ()
    caption: str = ""
    pictures: tuple[Picture, ...] = ()

    def row(self, name: str) -> Row | None:
        """The row of this name; None where there is none."""
        return next((row for row in self.rows if row.name == name), None)


def columns(rows: Sequence[Row]) -> tuple[tuple[str, str], ...]:
    """Name and common unit of each column of a table of rows; no unit where rows differ.

    >>> columns([Row("a", (Value("rms", 1.0, "N"),)), Row("b", (Value("rms", 2.0, "N"),))])
    (('rms', 'N'),)
    """
    units: dict[str, set[str]] = {}
    for row in rows:
        for value in row.values:
            units.setdefault(value.name, set())
            if not value.text:
                units[value.name].add(value.unit)
    return tuple(
        (name, next(iter(found)) if len(found) == 1 else "") for name, found in units.items()
    )


def number(name: str, value: Any, unit: str = "", **more: Any) -> Value:
    """A value whose numbers are made finite: NaN and infinities become None."""
    spreads = {key: finite(more.pop(key)) for key in _SPREADS if key in more}
    return Value(name, finite(value), unit, **{**spreads, **more})


def percent_of(name: str, share: Any, digits: int = 2, **more: Any) -> Value:
    """A share as a value in percent."""
    shares = {key: None if finite(entry) is None else 100.0 * entry for key, entry in more.items()}
    found = finite(share)
    return number(name, None if found is None else 100.0 * found, "%", digits=digits, **shares)


def count(name: str, value: int | None) -> Value:
    """A whole number; not available where there is none."""
    return Value(name, None if value is None else int(value))


def words(name: str, text: str) -> Value:
    """A value in words."""
    return Value(name, text=text)


def curve(name: str, x: Iterable[Any], y: Iterable[Any], look: Look = "ink", **more: Any) -> Series:
    """A line through (x, y); what is not finite is a gap."""
    return Series(name, "line", finite_each(x, 5), finite_each(y, 5), look=look, **more)


def band(
    name: str,
    x: Iterable[Any],
    low: Iterable[Any],
    high: Iterable[Any],
    look: Look = "ink",
    **more: Any,
) -> Series:
    """A shaded band between two curves."""
    ends = (finite_each(low, 5), finite_each(high, 5))
    middle = tuple(
        None if a is None or b is None else 0.5 * (a + b) for a, b in zip(*ends, strict=True)
    )
    return Series(name, "band", finite_each(x, 5), middle, *ends, look=look, **more)


def points(
    name: str, x: Iterable[Any], y: Iterable[Any], look: Look = "blue", **more: Any
) -> Series:
    """Marks at (x, y), with error bars where ``low`` and ``high`` are given."""
    more.update({key: finite_each(more[key], 5) for key in ("low", "high") if key in more})
    return Series(name, "points", finite_each(x, 5), finite_each(y, 5), look=look, **more)


def absent(id_: str, part: str, title: str, why: str) -> Panel:
    """A panel whose facts are not there, with the sentence that says how to have them."""
    return Panel(id_, part, title, notes=(why,))


def clean(verdict: Verdict) -> Verdict:
    """A verdict with numbers that JSON can hold."""
    return replace(verdict, value=finite(verdict.value), threshold=finite(verdict.threshold))


_SPREADS = ("sd", "low", "high")


MARKS = {"pass": "pass", "fail": "FAIL", "not_evaluated": "----"}
MOST_ROWS = 40
LARGEST_WIDTH = 120
"""Characters of a table without the notes of its rows; columns beyond it are left to the page."""


def panels_text(panels: Sequence[Panel]) -> str:
    """Several panels, an empty line between them."""
    return "\n\n".join(panel_text(panel) for panel in panels)


def panel_text(panel: Panel) -> str:
    """One panel; charts and pictures are left to the page.

    >>> from scissorcal.report.panel import Row, Value
    >>> row = Row("coulomb", (Value("mean", 0.0213, "N m", sd=0.0002),))
    >>> print(panel_text(Panel("p", "friction", "Parameters", "One.", rows=(row,))))
    Parameters: One.
               mean [N m]
      coulomb  0.02130 ± 0.00020
    """
    head = f"{panel.title}: {panel.sentence}" if panel.sentence else panel.title
    lines = [head, *_rows(panel), *(_verdict_line(verdict) for verdict in panel.verdicts)]
    lines += [f"  {note}" for note in panel.notes]
    return "\n".join(lines)


def limit_text(verdict: Verdict) -> str:
    """The limit of a verdict with its direction, as "at most 0.05"; empty where it has none."""
    if verdict.threshold is None:
        return ""
    return f"{verdict.limit} {short(verdict.threshold)}".strip()


def _verdict_line(verdict: Verdict) -> str:
    """One verdict: outcome, check, value with its limit, reason."""
    check = f"{verdict.scope} {verdict.check}"
    parts = (f"  {MARKS[verdict.status]}", check, verdict.limited, verdict.why)
    return "  ".join(part for part in parts if part)


def _rows(panel: Panel) -> list[str]:
    if not panel.rows:
        return []
    heads = columns(panel.rows)
    table = [["", *(f"{n} [{unit_text(u)}]" if u else n for n, u in heads)]]
    for row in panel.rows[:MOST_ROWS]:
        cells = [row.name]
        for name, unit in heads:
            value = row.value(name)
            stated = unit_text(value.unit) if value and not unit and not value.text else ""
            cells.append("" if value is None else f"{value} {stated}".strip())
        table.append(cells)
    widths = [max(len(line[i]) for line in table) for i in range(len(table[0]))]
    ends = accumulate(2 + width for width in widths)
    shown = max(2, sum(end <= LARGEST_WIDTH for end in ends))
    notes = ["", *(row.note for row in panel.rows)]
    lines = [
        f"  {'  '.join([*map(str.ljust, line[:shown], widths), note])}".rstrip()
        for line, note in zip(table, notes, strict=False)
    ]
    if shown < len(widths):
        lines.append(f"  ... and {len(widths) - shown} more columns")
    if len(panel.rows) > MOST_ROWS:
        lines.append(f"  ... and {len(panel.rows) - MOST_ROWS} more")
    return lines
