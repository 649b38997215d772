"""Recorded time that a fit does not use, by stroke and speed, with the reason."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Mask
from scissorcal.calibration.signals.segments import bridge, by_label
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.recipe.requirements import LITTLE
from scissorcal.recording.recording import Recording

Masks = tuple[Mask, ...]
Spans = NDArray[np.int64]

GAP, EDGE, INVALID = "gap", "edge of a piece", "invalid sensor value"
SLOW, OTHER = "rest or too slow", "no window"


@dataclass(frozen=True)
class UsageRow:
    """One stroke: seconds recorded, seconds used, and what became of the others, by reason.

    ``stroke`` counts across recordings, -1 for what lies between strokes; ``speed`` is the nominal
    one in rad/s or m/s, NaN where there is none.
    """

    recording: str
    stroke: int
    speed: float
    recorded_s: float
    used_s: float
    reasons: Mapping[str, float]

    @property
    def share(self) -> float:
        """Share of the recorded time that is used."""
        return self.used_s / self.recorded_s if self.recorded_s > 0 else 0.0


@dataclass(frozen=True)
class Usage:
    """What a fit uses of its recordings, stroke by stroke.

    ``spans`` has an array (k, 2) for each recording: first and one past the last sample of each
    part of it that is used.
    """

    rows: tuple[UsageRow, ...]
    spans: tuple[Spans, ...] = ()

    @property
    def _by_speed(self) -> tuple[UsageRow, ...]:
        """The strokes of one speed together, slowest first, ``stroke`` and ``recording`` left out.

        What lies between strokes and strokes without a single speed come last, as one row.
        """
        speeds = np.round([row.speed for row in self.rows], 6)
        rows = []
        for speed in np.unique(speeds):
            same = np.isnan(speeds) if np.isnan(speed) else speeds == speed
            rows.append(_together([self.rows[i] for i in np.flatnonzero(same)], float(speed)))
        return tuple(rows)

    @property
    def lost(self) -> Mapping[str, float]:
        """Seconds that are not used, by reason, over all recordings."""
        return _together(list(self.rows), float("nan")).reasons

    @property
    def counted(self) -> str:
        """How many seconds were recorded, are used, and went by which reason, the largest first."""
        whole = _together(list(self.rows), float("nan"))
        parts = sorted(whole.reasons.items(), key=lambda item: -item[1])
        listed = "; ".join(f"{seconds:.3g} s {reason}" for reason, seconds in parts)
        return f"Of {whole.recorded_s:.3g} s recorded, {whole.used_s:.3g} s are used; {listed}"

    @property
    def sentence(self) -> str:
        """How much of the strokes is used, and of which speed least, with the main reason."""
        strokes = [row for row in self.rows if row.stroke >= 0] or list(self.rows)
        whole = _together(strokes, float("nan"))
        text = f"{whole.used_s:.3g} s of {whole.recorded_s:.3g} s recorded in strokes are used."
        speeds = Usage(tuple(strokes))._by_speed
        if not speeds:
            return text
        worst = min(speeds, key=lambda row: row.share)
        if worst.share >= LITTLE or not worst.reasons:
            return text
        reason = max(worst.reasons, key=lambda name: worst.reasons[name])
        at = "without a single speed" if np.isnan(worst.speed) else f"at {worst.speed:.3g} per s"
        return (
            f"{text} Least is used of the strokes {at}: {worst.used_s:.2g} s of "
            f"{worst.recorded_s:.3g} s, mostly because of: {reason} "
            f"({worst.reasons[reason]:.3g} s)."
        )


def count_usage(
    recordings: tuple[Recording, ...], used: Masks, reasons: Mapping[str, Masks]
) -> Usage:
    """Count what is used by stroke, and why the rest is not.

    ``used`` masks the samples (m,) of each recording, ``reasons`` does so for each reason; the
    first reason that holds for a sample counts, "no window" where none does.

    >>> import numpy as np
    >>> from scissorcal.recording.recording import SAMPLE_DTYPE
    >>> samples = np.zeros(1000, SAMPLE_DTYPE)
    >>> samples["device_time_us"] = np.arange(1000) * 1000
    >>> recording = Recording("friction", samples, source="a.mcap")
    >>> half = np.arange(1000) < 500
    >>> count_usage((recording,), (half,), {"rest or too slow": (~half,)}).rows[0].reasons
    {'rest or too slow': 0.5}
    """
    rows = []
    offset = 0
    for index, recording in enumerate(recordings):
        time = recording.device_time_s
        tick = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        stroke = np.asarray(recording.samples["stroke"], dtype=np.int64)
        why = np.full(len(stroke), len(reasons))
        for number, masks in reversed(list(enumerate(reasons.values()))):
            why[masks[index]] = number
        names = [*reasons, OTHER]
        for label, here in by_label(stroke).items():
            taken = used[index][here]
            left = np.bincount(why[here[~taken]], minlength=len(names))
            known = recording.strokes[label] if 0 <= label < len(recording.strokes) else None
            rows.append(
                UsageRow(
                    recording=recording.source,
                    stroke=int(label) + offset if label >= 0 else -1,
                    speed=known.speed if known else float("nan"),
                    recorded_s=tick * len(here),
                    used_s=tick * np.count_nonzero(taken),
                    reasons={
                        name: round(tick * int(count), 9)
                        for name, count in zip(names, left, strict=True)
                        if count
                    },
                )
            )
        offset += len(recording.strokes)
    return Usage(tuple(rows), tuple(_spans(mask) for mask in used))


def usage_of_windows(recordings: tuple[Recording, ...], every: Windows, usable: Masks) -> Usage:
    """Count what moving windows use of their recordings, each for its bin.

    ``every`` are all windows of the recordings, ``usable`` the masks (m,) of samples that no sensor
    made invalid.
    """
    width = max(1, round(every.bins.bin_s / every.tick_s))
    length = len(every.weights)
    used, gap, edge, invalid, slow = ([], [], [], [], [])
    windows = start = 0
    for recording, good in zip(recordings, usable, strict=True):
        bridged = bridge(recording, good)
        size = len(bridged.recorded)
        masks = {name: np.zeros(size, dtype=bool) for name in ("used", GAP, INVALID, SLOW)}
        inside, covered = np.zeros(size, dtype=bool), np.zeros(size, dtype=bool)
        bad = np.concatenate([[0], np.cumsum(~bridged.usable)])
        made = np.concatenate([[0], np.cumsum(~bridged.recorded)])
        for low, high in bridged.pieces:
            inside[low:high] = True
            count = int(np.count_nonzero(every.first[windows:] < start + high - low))
            first = every.first[windows : windows + count] - start + low
            moving = every.bins.moving[windows : windows + count]
            parted = made[first + length] > made[first]
            touched = bad[first + length] > bad[first]
            begin = first + (length - width) // 2
            for name, chosen in (
                ("used", moving),
                (GAP, ~moving & parted),
                (INVALID, ~moving & touched & ~parted),
                (SLOW, ~moving & ~touched),
            ):
                masks[name][(begin[chosen, None] + np.arange(width)).ravel()] = True
            covered[(begin[:, None] + np.arange(width)).ravel()] = True
            windows, start = windows + count, start + high - low
        real = bridged.recorded
        used.append(masks["used"][real])
        gap.append((masks[GAP] | ~inside)[real])
        edge.append((inside & ~covered)[real])
        invalid.append(masks[INVALID][real])
        slow.append(masks[SLOW][real])
    reasons = {GAP: gap, EDGE: edge, INVALID: invalid, SLOW: slow}
    return count_usage(
        recordings, tuple(used), {name: tuple(masks) for name, masks in reasons.items()}
    )


def _spans(mask: Mask) -> Spans:
    change = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return change.reshape(-1, 2).astype(np.int64)


def _together(rows: list[UsageRow], speed: float) -> UsageRow:
    reasons: dict[str, float] = {}
    for row in rows:
        for name, seconds in row.reasons.items():
            reasons[name] = reasons.get(name, 0.0) + seconds
    recorded, used = sum(row.recorded_s for row in rows), sum(row.used_s for row in rows)
    return UsageRow("", -1, speed, recorded, used, reasons)
