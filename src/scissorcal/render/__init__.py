"""The rendering loop on a rig: limits, ramp, watchdog, telemetry, and verdicts at the end."""

from scissorcal.render.admission import Admission, admit_package
from scissorcal.render.engine import Rendering, VirtualStrokes, open_writer, render
from scissorcal.render.pose_placer import PoseReport
from scissorcal.render.result import AppliedLimits, RenderResult, latency_of
from scissorcal.render.rig_facts import RigFacts
from scissorcal.tracking.plate_pose import PlatePose, PoseSource

__all__ = [
    "Admission",
    "AppliedLimits",
    "PlatePose",
    "PoseReport",
    "PoseSource",
    "RenderResult",
    "Rendering",
    "RigFacts",
    "VirtualStrokes",
    "admit_package",
    "latency_of",
    "open_writer",
    "render",
]
