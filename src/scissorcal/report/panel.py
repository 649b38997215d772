"""A panel: what most of the report's parts are made of, a heading, words, figures and a table."""

from dataclasses import dataclass

from scissorcal.report.pictures import Picture
from scissorcal.report.svg import Svg


@dataclass(frozen=True)
class Column:
    """A column's heading; numbers are set flush right."""

    heading: str
    number: bool = False


@dataclass(frozen=True)
class Row:
    """A row of finished texts, the first of which names it.

    ``anchor`` leads to the stroke of that address, empty for none; ``marked`` rows stand out.
    """

    cells: tuple[str, ...]
    anchor: str = ""
    marked: bool = False


@dataclass(frozen=True)
class Table:
    """A table with the sentence that explains it."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Panel:
    """One part of the page. ``lead`` are sentences on top; ``finding`` the one that matters.

    ``wide`` figures are not shrunk below a legible width: they scroll sideways on a phone.
    ``pictures`` are photographs, drawn on.
    """

    anchor: str
    title: str
    lead: tuple[str, ...] = ()
    finding: str = ""
    figures: tuple[Svg, ...] = ()
    table: Table | None = None
    wide: bool = False
    pictures: tuple[Picture, ...] = ()


def absent(anchor: str, title: str, why: str) -> Panel:
    """A part whose facts are not there, with the sentence that says how to have them."""
    return Panel(anchor, title, (why,))


def columns(*headings: str) -> tuple[Column, ...]:
    """Columns from headings; all but the first hold numbers, except those that start with "=".

    >>> [(column.heading, column.number) for column in columns("Stroke", "Rms [N m]", "=Kind")]
    [('Stroke', False), ('Rms [N m]', True), ('Kind', False)]
    """
    first, *others = headings
    rest = [Column(name.removeprefix("="), not name.startswith("=")) for name in others]
    return (Column(first), *rest)
