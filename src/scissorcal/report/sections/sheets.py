"""Sections made elsewhere (a package, a run of the loop), taken over as they are."""

import re
from dataclasses import dataclass

from scissorcal.report.inputs import FactSheet
from scissorcal.report.numbers import Scalar, scalar
from scissorcal.report.sections.verdicts import VerdictRow, row_of


@dataclass(frozen=True)
class FactRow:
    """One line; ``unit`` is empty where none applies."""

    label: str
    value: Scalar
    unit: str


@dataclass(frozen=True)
class SheetSection:
    """One sheet; its anchor holds only letters, digits and hyphens."""

    title: str
    anchor: str
    facts: tuple[FactRow, ...]
    verdicts: tuple[VerdictRow, ...]
    notes: tuple[str, ...]


def take_sheet(sheet: FactSheet) -> SheetSection:
    """Take a sheet over, with values that JSON can hold and an anchor that a page can."""
    return SheetSection(
        sheet.title,
        "sheet-" + re.sub(r"[^A-Za-z0-9]+", "-", sheet.anchor).strip("-"),
        tuple(FactRow(fact.label, scalar(fact.value), fact.unit) for fact in sheet.facts),
        tuple(row_of(verdict) for verdict in sheet.verdicts),
        sheet.notes,
    )
