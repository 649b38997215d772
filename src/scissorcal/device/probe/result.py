"""What a probe found, as recordings and workspaces keep it."""

from scissorcal.recording.probe import (
    PROBE_KEY,
    Estimate,
    ProbeResult,
    probe_from_dict,
    probe_of,
)

LINE = "the line, before a motor runs"
SENSORS = "the sensors, before a motor runs"
MOTORS = "the motors, before they run in earnest"
"""What checks of a probe guard begins so."""
REAL_TIME = "real_time"
"""Fact: 1 where the probe ran on a port, 0 in virtual time."""

__all__ = ["LINE", "MOTORS", "PROBE_KEY", "REAL_TIME", "SENSORS", "Estimate", "ProbeResult"]
__all__ += ["probe_from_dict", "probe_of"]
