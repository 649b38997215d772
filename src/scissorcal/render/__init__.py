"""The rendering loop on a rig: limits, ramp, watchdog, telemetry, and verdicts at the end."""

from scissorcal.render.engine import VirtualStrokes, open_writer, render
from scissorcal.render.latency import latency_of
from scissorcal.render.result import AppliedLimits, RenderResult

__all__ = [
    "AppliedLimits",
    "RenderResult",
    "VirtualStrokes",
    "latency_of",
    "open_writer",
    "render",
]
