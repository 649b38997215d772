"""What a probe found, as recordings and workspaces keep it."""

from scissorcal.recording.probe import (
    PROBE_KEY,
    Estimate,
    ProbeResult,
    probe_from_dict,
    probe_of,
)

REAL_TIME = "real_time"
"""Fact: 1 where the probe ran on a port, 0 in virtual time."""

__all__ = ["PROBE_KEY", "REAL_TIME", "Estimate", "ProbeResult", "probe_from_dict", "probe_of"]
