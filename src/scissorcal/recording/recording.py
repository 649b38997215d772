"""A recording in memory: arrays with time first, strokes, and provenance."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import needs_extra
from scissorcal.recording.header import Joint, Kind, Stroke, StrokeKind
from scissorcal.recording.layout import SAMPLE_DTYPE, column_name, fields

if TYPE_CHECKING:
    import pandas as pd

STOP_MARK = "stop"
UNLOADED_MARK = "unloaded stroke"

__all__ = ["SAMPLE_DTYPE", "Joint", "Kind", "Recording", "Stroke", "StrokeKind"]


@dataclass(frozen=True)
class Recording:
    """A capture or an import: samples, strokes, and where they come from.

    ``samples`` has SAMPLE_DTYPE, shape (N,). For a linear joint ``opening`` holds metres and
    ``motor_torque`` newtons, as ``joint`` says. ``device`` is the identity that the rig stated
    (empty for imports), ``recipe_toml`` the recipe's text at capture, ``content_hash`` the
    SHA-256 of the file it was read from. ``notes`` are sentences on the capture and on what reading
    it found (recovered end, garbled frames, gaps), for the report; ``particular`` are those of an
    import that are of this log and not of how all are read (not stored). ``marks`` are facts by
    name, as the capture wrote them; see ``stop`` and ``unloaded``. ``beside`` is how many rows each
    channel beside the samples has, by its topic (``read_telemetry`` reads them).
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
    particular: tuple[str, ...] = ()
    marks: tuple[tuple[str, str], ...] = ()
    beside: Mapping[str, int] = field(default_factory=dict)

    @property
    def stop(self) -> str:
        """Name of the servo's stop that ended the capture (StopReason); empty if none did."""
        return next((value for name, value in self.marks if name == STOP_MARK), "")

    @property
    def unloaded(self) -> frozenset[int]:
        """Indices of the closing strokes of a cut in which nothing was cut."""
        return frozenset(int(value) for name, value in self.marks if name == UNLOADED_MARK)

    def __repr__(self) -> str:
        """One line: kind, length, strokes and source."""
        return (
            f"<{self.kind} recording: {len(self.samples)} samples, {self.duration_s:.1f} s, "
            f"{len(self.strokes)} strokes, {self.joint.kind} joint, {self.source or 'in memory'}>"
        )

    def to_pandas(self) -> "pd.DataFrame":
        """Return the samples as a table, one row per sample, the unit in each column's name.

        The columns are those of ``scissorcal export``: ``opening_rad`` (``opening_m`` for a linear
        joint), ``motor_torque_Nm`` and so on; ``time_s`` is the device clock from the first sample.
        Raises InputError where pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            array = "use recording.samples, a NumPy array with the same fields"
            raise needs_extra("to_pandas()", "pandas", "analysis", array) from None
        return pd.DataFrame(columns(self))

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


def columns(recording: Recording) -> dict[str, NDArray[Any]]:
    """Return the samples by column, each (N,): the fields by :func:`column_name`, and ``time_s``.

    >>> from scissorcal.recording.layout import empty_samples
    >>> list(columns(Recording("cut", empty_samples(2))))[3:6]
    ['device_time_us', 'time_s', 'opening_rad']
    """
    by_name: dict[str, NDArray[Any]] = {}
    for channel in fields():
        name = column_name(channel, recording.joint)
        by_name[name] = np.ascontiguousarray(recording.samples[channel])
        if channel == "device_time_us":
            by_name["time_s"] = recording.device_time_s
    return by_name
