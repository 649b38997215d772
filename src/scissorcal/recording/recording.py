"""A recording in memory: arrays with time first, strokes, and provenance."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording.header import Joint, Kind, Stroke, StrokeKind
from scissorcal.recording.layout import SAMPLE_DTYPE

__all__ = ["SAMPLE_DTYPE", "Joint", "Kind", "Recording", "Stroke", "StrokeKind"]


@dataclass(frozen=True)
class Recording:
    """A capture or an import: samples, strokes, and where they come from.

    ``samples`` has SAMPLE_DTYPE, shape (N,). For a linear joint ``opening`` holds metres and
    ``motor_torque`` newtons, as ``joint`` says. ``device`` is the identity that the rig stated
    (empty for imports), ``recipe_toml`` the recipe's text at capture, ``content_hash`` the
    SHA-256 of the file it was read from. ``notes`` are sentences on the capture and on what reading
    it found (recovered end, garbled frames, gaps), for the report.
    """

    kind: Kind
    samples: NDArray[np.void]
    strokes: tuple[Stroke, ...] = ()
    joint: Joint = field(default_factory=Joint)
    handle_radius_m: float = float("nan")
    device: Mapping[str, Any] = field(default_factory=dict)
    recipe_toml: str = ""
    source: str = ""
    content_hash: str = ""
    notes: tuple[str, ...] = ()

    @property
    def device_time_s(self) -> NDArray[np.float64]:
        """Device clock in seconds from the first sample, shape (N,)."""
        ticks = self.samples["device_time_us"]
        return (ticks - ticks[0]) * 1e-6 if len(ticks) else np.zeros(0)

    @property
    def duration_s(self) -> float:
        """Length of the recording on the device clock, in seconds."""
        time = self.device_time_s
        return float(time[-1]) if len(time) else 0.0

    @property
    def drive_effort(self) -> NDArray[np.float64]:
        """Torque (or force) that drives the joint: motor minus handle_radius times handle force.

        Opening is positive; a hand that closes the handles gives a positive handle force.
        """
        motor: NDArray[np.float64] = np.asarray(self.samples["motor_torque"], dtype=np.float64)
        hand = np.asarray(self.samples["handle_force"], dtype=np.float64)
        if np.isnan(self.handle_radius_m):
            return motor
        return motor - self.handle_radius_m * hand
