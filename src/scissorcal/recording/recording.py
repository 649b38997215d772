"""A recording in memory: arrays with time first, strokes, provenance, and its summary."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import needs_extra
from scissorcal.recording.header import Joint, Kind, Stroke, StrokeKind
from scissorcal.recording.layout import MEASURED, SAMPLE, SAMPLE_DTYPE, column_name, unit_of
from scissorcal.recording.strokes import EDGE_S, GAP_FACTOR, edge_samples, is_short, long_enough

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

    @classmethod
    def from_arrays(
        cls,
        *,
        time_s: ArrayLike,
        opening_rad: ArrayLike | None = None,
        opening_m: ArrayLike | None = None,
        torque_Nm: ArrayLike | None = None,
        force_N: ArrayLike | None = None,
        **more: Any,
    ) -> Self:
        """Make a recording of arrays (n,), with strokes found from the motion, as an import does.

        A rotary joint has ``opening_rad``, which grows when the blades open, and ``torque_Nm`` of
        the motor, positive when it opens them; a linear one ``opening_m`` and ``force_N``. ``more``
        takes ``kind`` ("friction", "cut"), ``notes``, ``handle_force_N`` with ``handle_radius_m``,
        ``min_travel`` (rad, or m) and ``allow_gaps``, as `ImportOptions` has them; of a cut
        ``advance_m`` and ``sheet``, which counts fresh pieces of material from 0 (a number, or one
        for each sample, -1 where none is loaded). Raises InputError for arrays of other lengths, a
        number that is not finite, a time that repeats or falls, and a name that there is not.

        >>> time_s = np.arange(0.0, 8.0, 0.005)
        >>> Recording.from_arrays(
        ...     time_s=time_s,
        ...     opening_rad=0.5 + 0.3 * np.cos(np.pi * time_s / 2),
        ...     torque_Nm=-0.01 * np.sign(np.sin(np.pi * time_s / 2)),
        ... )
        <friction recording: 1600 samples, 8.0 s, 4 strokes, rotary joint, in memory>
        """
        from scissorcal.recording import recording_from_arrays

        named = {
            "time_s": time_s,
            "opening_rad": opening_rad,
            "opening_m": opening_m,
            "torque_Nm": torque_Nm,
            "force_N": force_N,
        }
        return cls(**vars(recording_from_arrays(named, more)))

    @classmethod
    def from_pandas(
        cls, table: "pd.DataFrame", columns: Mapping[str, str] | None = None, **more: Any
    ) -> Self:
        """Make a recording of a table with a row for each sample; see `from_arrays`.

        Columns are those of `to_pandas` (``time_s``, ``opening_rad``, ``motor_torque_Nm``, ...), or
        those that ``columns`` names by channel, their units in their headings:
        ``{"time": "t [ms]", "opening": "angle_deg", "motor_torque": "current torque [mNm]"}``.
        Strokes are found anew. Raises InputError as `from_arrays`, and for a column that there is
        not.
        """
        from scissorcal.recording import recording_from_pandas

        return cls(**vars(recording_from_pandas(table, columns, more)))

    def to_pandas(self) -> "pd.DataFrame":
        """Return the samples as a table, one row per sample, the unit in each column's name.

        The columns are those of ``scissorcal export``: ``opening_rad`` (``opening_m`` for a linear
        joint), ``motor_torque_Nm`` and so on; ``time_s`` is the device clock from the first sample.
        Which sheet is cut is not among them: add a column ``sheet`` for `from_pandas`.
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
    for channel in SAMPLE:
        name = column_name(channel.name, recording.joint)
        by_name[name] = np.ascontiguousarray(recording.samples[channel.name])
        if channel.name == "device_time_us":
            by_name["time_s"] = recording.device_time_s
    return by_name


KNOT_S = 0.0049
"""Knot distance of a fit's windows at the usual cutoff of 75 Hz; a window lasts three of them."""


@dataclass(frozen=True)
class Gaps:
    """Frames that the device sent and the recording lacks.

    ``places`` counts the jumps of the sequence number, ``missing`` the frames lost in them;
    ``longest`` frames are lost in the longest one, which begins at ``longest_at_s``.
    """

    places: int
    missing: int
    longest: int
    longest_at_s: float


@dataclass(frozen=True)
class GapCost:
    """What gaps cost a fit: ``lost_s`` of ``recorded_s``, about; ``bridged`` of ``gaps`` are short.

    A window that touches a bridged gap is lost; at a longer one an edge on either side is, and so
    is a stretch between two of them that is too short.
    """

    gaps: int
    bridged: int
    lost_s: float
    recorded_s: float

    @property
    def sentence(self) -> str:
        """The cost in words."""
        return (
            f"A fit of friction bridges gaps of up to {EDGE_S:g} s (here {self.bridged} of "
            f"{self.gaps}), uses no window that touches one, and leaves out {EDGE_S:g} s on either "
            f"side of a longer one: about {self.lost_s:.3g} s of {self.recorded_s:.3g} s."
        )


@dataclass(frozen=True)
class ChannelRange:
    """Smallest and largest value of one channel, in ``unit``."""

    channel: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class StrokeSummary:
    """One stroke as planned (or found) and as recorded: its samples and travel."""

    stroke: Stroke
    samples: int
    travel: float


@dataclass(frozen=True)
class RecordingSummary:
    """What ``recording show`` prints; ``rate_Hz`` is from the median step of the device clock.

    ``beside`` is how many rows each channel beside the samples has.
    """

    source: str
    content_hash: str
    kind: str
    joint: str
    samples: int
    duration_s: float
    rate_Hz: float
    gaps: Gaps
    strokes: tuple[StrokeSummary, ...]
    ranges: tuple[ChannelRange, ...]
    notes: tuple[str, ...]
    beside: dict[str, int]


def summary(recording: Recording) -> RecordingSummary:
    """Sum up a recording; every number is finite, also for an empty one (then 0)."""
    samples = recording.samples
    steps = np.diff(samples["device_time_us"])
    step_us = float(np.median(steps)) if len(steps) else 0.0
    return RecordingSummary(
        source=recording.source,
        content_hash=recording.content_hash,
        kind=recording.kind,
        joint=recording.joint.kind,
        samples=len(samples),
        duration_s=recording.duration_s,
        rate_Hz=1e6 / step_us if step_us > 0 else 0.0,
        gaps=find_gaps(samples),
        strokes=_strokes(recording),
        ranges=tuple(_range(recording, channel) for channel in MEASURED),
        notes=recording.notes,
        beside=dict(recording.beside),
    )


def find_gaps(samples: NDArray[np.void]) -> Gaps:
    """Find jumps of the sequence number (which wraps at 2**32) in samples, shape (N,)."""
    if len(samples) < 2:
        return Gaps(0, 0, 0, 0.0)
    lost = missing_frames(samples["sequence"])
    worst = int(np.argmax(lost))
    time = samples["device_time_us"]
    longest = int(lost[worst])
    at_s = float(time[worst] - time[0]) * 1e-6 if longest else 0.0
    return Gaps(int(np.count_nonzero(lost)), int(lost.sum()), longest, at_s)


def missing_frames(sequence: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """Frames missing between each two of ``sequence`` (n,), which wraps at 2**32; shape (n - 1,).

    A step back by less than half the range is a repeated or reordered frame, not 4e9 lost ones.

    >>> missing_frames(np.array([2**32 - 2, 2**32 - 1, 0, 3, 3])).tolist()
    [0, 0, 2, 0]
    """
    numbers = sequence.astype(np.int64)
    lost = (numbers[1:] - numbers[:-1] - 1) % 2**32
    return np.where(lost < 2**31, lost, 0)


def gap_note(samples: NDArray[np.void]) -> tuple[str, ...]:
    """One sentence on missing frames; none where no frame is missing."""
    gaps = find_gaps(samples)
    if not gaps.places:
        return ()
    where = "1 gap" if gaps.places == 1 else f"{gaps.places} gaps"
    return (
        f"{gaps.missing} frames are missing in {where}, the longest "
        f"({gaps.longest} frames) at {gaps.longest_at_s:.3f} s.",
    )


def gap_cost(time_s: Array) -> GapCost:
    """What the gaps of a clock (n,) cost, n > 1."""
    step = np.diff(time_s)
    usual = float(np.median(step))
    gaps = step > GAP_FACTOR * usual
    bridged = gaps & is_short(step, usual)
    ends = np.concatenate([[0], np.flatnonzero(gaps & ~bridged) + 1, [len(time_s)]])
    edge, window = edge_samples(1.0 / usual) * usual, 3 * max(1, round(KNOT_S / usual)) * usual
    lost = 0.0
    for low, high in pairwise(ends):
        inside = bridged[low : high - 1]
        count = (high - low) * usual
        whole = long_enough(int(high - low + np.sum(step[low : high - 1][inside]) / usual), usual)
        windows = (window - usual) * np.count_nonzero(inside)
        at_ends = edge * (int(low > 0) + int(high < len(time_s)))
        lost += min(count, windows + at_ends) if whole else count
    return GapCost(
        int(np.count_nonzero(gaps)), int(np.count_nonzero(bridged)), lost, usual * len(time_s)
    )


def _strokes(recording: Recording) -> tuple[StrokeSummary, ...]:
    """Samples and travel of each stroke, in one pass over the samples, sorted by stroke."""
    labels = recording.samples["stroke"]
    order = np.argsort(labels, kind="stable")
    moved = "advance" if recording.kind == "friction-advance" else "opening"
    place, labels = recording.samples[moved][order], labels[order]
    numbers = [stroke.index for stroke in recording.strokes]
    first = np.searchsorted(labels, numbers, side="left")
    after = np.searchsorted(labels, numbers, side="right")
    return tuple(
        StrokeSummary(stroke, int(end - start), _travel(place[start:end]))
        for stroke, start, end in zip(recording.strokes, first, after, strict=True)
    )


def _travel(place: NDArray[np.float64]) -> float:
    return float(place.max() - place.min()) if len(place) else 0.0


def _range(recording: Recording, channel: str) -> ChannelRange:
    values = recording.samples[channel]
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    return ChannelRange(channel, unit_of(channel, recording.joint), low, high)
