"""Reports: what was fitted and whether to trust it, as one offline page and its JSON twin."""

from scissorcal.report.build import ReportFiles, build_report
from scissorcal.report.inputs import (
    Fact,
    FactSheet,
    RecordingSummary,
    sheet_from_mapping,
    summarise_recording,
)

__all__ = [
    "Fact",
    "FactSheet",
    "RecordingSummary",
    "ReportFiles",
    "build_report",
    "sheet_from_mapping",
    "summarise_recording",
]
