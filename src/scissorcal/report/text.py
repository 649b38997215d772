"""Panels for the terminal: sentence, rows in columns, verdicts with their limits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

from scissorcal.report.numbers import short, unit_text
from scissorcal.report.panel import Panel, columns
from scissorcal.verdicts import Verdict

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
    lines = [head, *_rows(panel), *(verdict_line(verdict) for verdict in panel.verdicts)]
    lines += [f"  {note}" for note in panel.notes]
    return "\n".join(lines)


def limit_text(verdict: Verdict) -> str:
    """The limit of a verdict with its direction, as "at most 0.05"; empty where it has none."""
    if verdict.threshold is None:
        return ""
    return f"{verdict.limit} {short(verdict.threshold)}".strip()


def verdict_line(verdict: Verdict) -> str:
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
