"""Reports: what was fitted and whether to trust it, as one offline page and its JSON twin."""

from scissorcal.report.build import (
    ReportFiles,
    build_report,
    document_of,
    document_of_fit,
    sign_page,
    write_comparison,
)
from scissorcal.report.comparison import Comparison, Side, compare
from scissorcal.report.document import ReportDocument
from scissorcal.report.inputs import Cell, Evidence, Geometry
from scissorcal.report.panel import Panel
from scissorcal.report.subjects.closing import posterior_sha256, trust_check_sha256
from scissorcal.report.text import panel_text, panels_text
from scissorcal.report.twin import read_twin

__all__ = [
    "Cell",
    "Comparison",
    "Evidence",
    "Geometry",
    "Panel",
    "ReportDocument",
    "ReportFiles",
    "Side",
    "build_report",
    "compare",
    "document_of",
    "document_of_fit",
    "panel_text",
    "panels_text",
    "posterior_sha256",
    "read_twin",
    "sign_page",
    "trust_check_sha256",
    "write_comparison",
]
