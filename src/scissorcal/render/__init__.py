"""The rendering loop on a rig: limits, ramp, watchdog, telemetry, and verdicts at the end."""

from scissorcal.render.engine import VirtualStrokes, open_writer, render
from scissorcal.render.result import AppliedLimits, RenderResult, latency_of

__all__ = [
    "AppliedLimits",
    "RenderResult",
    "VirtualStrokes",
    "latency_of",
    "open_writer",
    "render",
]
