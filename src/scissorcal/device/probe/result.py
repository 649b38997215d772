"""What a probe found, as recordings and workspaces keep it."""

from scissorcal.recording.probe import (
    PROBE_KEY,
    Estimate,
    ProbeResult,
    probe_from_dict,
    probe_of,
)

__all__ = ["PROBE_KEY", "Estimate", "ProbeResult", "probe_from_dict", "probe_of"]
