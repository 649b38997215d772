from .admission import Admission as Admission
from .admission import admit_package as admit_package
from .admission import rendered_tables as rendered_tables
from .derating import needs_on as needs_on
from .derating import softened as softened
from .engine import REQUEST as REQUEST
from .engine import Rendering as Rendering
from .engine import VirtualStrokes as VirtualStrokes
from .engine import open_writer as open_writer
from .engine import render as render
from .pose_placer import PoseReport as PoseReport
from .result import AppliedLimits as AppliedLimits
from .result import RenderResult as RenderResult
from .result import latency_of as latency_of
from .rig_facts import RigFacts as RigFacts
from .rig_facts import with_probe as with_probe

__all__ = [
    "Admission",
    "AppliedLimits",
    "PoseReport",
    "RenderResult",
    "Rendering",
    "RigFacts",
    "VirtualStrokes",
    "admit_package",
    "latency_of",
    "open_writer",
    "render",
]
