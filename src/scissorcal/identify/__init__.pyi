from .columns import LogOptions as LogOptions
from .columns import read_log as read_log
from .exports import TARGETS as TARGETS
from .exports import export_text as export_text
from .exports import off_by as off_by
from .exports import result_of as result_of
from .gaps import Gap as Gap
from .joint import Held as Held
from .joint import Identified as Identified
from .joint import compare as compare
from .joint import identify as identify
from .page import page_of as page_of
from .page import panels_of as panels_of
from .ripple import Ripple as Ripple
from .ripple import ripples_of as ripples_of
from .sensors import Sensors as Sensors
from .sensors import corrected as corrected
from .sensors import estimate_delay as estimate_delay
from .simple import SimpleLaw as SimpleLaw
from .simple import simple_law as simple_law

__all__ = [
    "TARGETS",
    "Gap",
    "Held",
    "Identified",
    "LogOptions",
    "Sensors",
    "SimpleLaw",
    "compare",
    "corrected",
    "export_text",
    "identify",
    "page_of",
    "panels_of",
    "read_log",
    "simple_law",
]
