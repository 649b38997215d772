"""Reports: what was fitted and whether to trust it, as one offline page and its JSON twin."""

from scissorcal.report.build import (
    ReportFiles,
    build_report,
    facts_of,
    side_of_fit,
    write_comparison,
)
from scissorcal.report.comparison import Comparison, Side, compare, side_of
from scissorcal.report.inputs import (
    Fact,
    FactSheet,
    Geometry,
    RecordingSummary,
    sheet_from_mapping,
    summarise_recording,
)
from scissorcal.report.sections.provenance import posterior_sha256
from scissorcal.report.twin import read_twin

__all__ = [
    "Comparison",
    "Fact",
    "FactSheet",
    "Geometry",
    "RecordingSummary",
    "ReportFiles",
    "Side",
    "build_report",
    "compare",
    "facts_of",
    "posterior_sha256",
    "read_twin",
    "sheet_from_mapping",
    "side_of",
    "side_of_fit",
    "summarise_recording",
    "write_comparison",
]
