from .build import ReportFiles as ReportFiles
from .build import build_report as build_report
from .build import document_of as document_of
from .build import document_of_fit as document_of_fit
from .build import read_twin as read_twin
from .build import sign_page as sign_page
from .build import twin_text as twin_text
from .build import write_comparison as write_comparison
from .comparison import Comparison as Comparison
from .comparison import Side as Side
from .comparison import compare as compare
from .document import ReportDocument as ReportDocument
from .extremes import WRONG_LOOK as WRONG_LOOK
from .extremes import extremes_panels as extremes_panels
from .extremes import map_chart as map_chart
from .extremes import refusals_panel as refusals_panel
from .inputs import Cell as Cell
from .inputs import Evidence as Evidence
from .inputs import Geometry as Geometry
from .numbers import short as short
from .panel import Panel as Panel
from .panel import panel_text as panel_text
from .panel import panels_text as panels_text
from .subjects.closing import posterior_sha256 as posterior_sha256
from .subjects.closing import trust_check_sha256 as trust_check_sha256
from .subjects.plate_pose import plate_panels as plate_panels
from .subjects.posterior import parameters_panel as parameters_panel
from .subjects.scene import scene_sentence as scene_sentence

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
