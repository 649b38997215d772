"""Times and lags: percentiles, counts that do not grow, and the lag that a hand feels."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Histogram, LagCounts, Mode

QuantileMethod = Literal["linear", "inverted_cdf"]

_PER_OCTAVE = 64
_OCTAVES = 32
_SHARES = (0.5, 0.99, 0.999, 1.0)


@dataclass(frozen=True)
class Percentiles:
    """Middle and tail of a set of times, in the unit that its holder states; NaN if unknown."""

    p50: float
    p99: float
    p999: float
    worst: float

    @classmethod
    def of(cls, times: NDArray[np.float64], method: QuantileMethod = "linear") -> "Percentiles":
        """Of times (n,); ``method`` as `numpy.quantile` has it."""
        if len(times) == 0:
            return cls(math.nan, math.nan, math.nan, math.nan)
        quantiles = np.quantile(times, _SHARES, method=method)
        return cls(*(float(value) for value in quantiles))

    @classmethod
    def counted(cls, histogram: Histogram) -> "Percentiles":
        """Of times in us that the loop has counted."""
        return cls(
            histogram.quantile(0.5),
            histogram.quantile(0.99),
            histogram.quantile(0.999),
            histogram.largest_us if histogram.total else math.nan,
        )


class TimeHistogram:
    """Counts times in bins of 1.1 %, 64 to the octave from 1 us on, in memory that does not grow.

    A percentile is the upper edge of its bin, so at most 1.1 % too long and never too short; the
    worst is exact.

    >>> times = TimeHistogram()
    >>> times.add(np.array([20_000, 30_000, 1_000_000]))
    >>> times.percentiles_us().worst
    1000.0
    """

    def __init__(self) -> None:
        self.total = 0
        self._largest_ns = 0
        self._counts = np.zeros(_PER_OCTAVE * _OCTAVES, dtype=np.int64)

    def add(self, times_ns: NDArray[np.integer[Any]]) -> None:
        """Count times in nanoseconds, shape (n,), all above 0."""
        if len(times_ns) == 0:
            return
        octaves = np.log2(np.maximum(times_ns * 1e-3, 1.0))
        bins = np.minimum(_PER_OCTAVE * octaves, len(self._counts) - 1).astype(np.int64)
        self._counts += np.bincount(bins, minlength=len(self._counts))
        self.total += len(times_ns)
        self._largest_ns = max(self._largest_ns, int(np.max(times_ns)))

    def percentiles_us(self) -> Percentiles:
        """Middle and tail in microseconds."""
        worst = self._largest_ns * 1e-3
        ranks = np.ceil(np.array(_SHARES[:3]) * self.total)
        bins = np.searchsorted(np.cumsum(self._counts), np.maximum(ranks, 1.0))
        edges = np.minimum(2.0 ** ((bins + 1) / _PER_OCTAVE), worst)
        return Percentiles(*(float(edge) for edge in [*edges, worst]))


@dataclass(frozen=True)
class FeltLag:
    """How old the state is that the command in force answers, at each tick of the device.

    ``ticks``: sequence of the tick less ``echo_sequence`` of the newest command that was sent
    before its state arrived; 1 in a loop that always answers in time. ``held_share`` of the
    ticks had no new command. ``transport_ms`` is the shortest round trip of the line, measured
    before the start, which no loop avoids. ``ms`` adds it to the ticks: no tick felt more, and
    those whose command arrived just before it felt up to ``transport_ms`` less.

    Ticks with the motors on count where there are any, else those with the motors off.
    ``by_device``: the device renders by itself, and the lag is that of its order of a tick.
    """

    ticks: Percentiles
    held_share: float
    transport_ms: float
    ms: Percentiles
    by_device: bool = False

    @classmethod
    def of_device(cls, tick_s: float) -> "FeltLag":
        """Of a device that answers each tick's measurement within it, and holds that for a tick."""
        ticks, ms = Percentiles(*[1.0] * 4), Percentiles(*[1e3 * tick_s] * 4)
        return cls(ticks=ticks, held_share=0.0, transport_ms=0.0, ms=ms, by_device=True)

    @classmethod
    def of(cls, lag: LagCounts, tick_s: float, transport_s: float) -> "FeltLag":
        """From the counts of a servo; NaN where no tick was counted or no round trip measured."""
        modes = [int(mode) for mode in Mode if mode is not Mode.IDLE]
        if not lag.counts[modes].any():
            modes = [int(Mode.IDLE)]
        counts = lag.counts[modes].sum(axis=0)
        total, worst = int(counts.sum()), float(lag.worst[modes].max())
        if total == 0:
            unknown = Percentiles.of(np.zeros(0))
            return cls(unknown, math.nan, 1e3 * transport_s, unknown)
        ranks = np.ceil(np.array(_SHARES[:3]) * total)
        found = np.searchsorted(np.cumsum(counts), ranks) + 1.0
        found[found >= len(counts)] = worst  # the last bin holds all that is longer
        ticks = [*(float(value) for value in found), worst]
        return cls(
            ticks=Percentiles(*ticks),
            held_share=float(lag.held[modes].sum()) / total,
            transport_ms=1e3 * transport_s,
            ms=Percentiles(*(1e3 * (value * tick_s + transport_s) for value in ticks)),
        )

    @property
    def sentence(self) -> str:
        """The figures in a line for a person."""
        ticks, ms = self.ticks, self.ms
        if self.by_device:
            return (
                f"1 tick of felt lag ({ms.worst:.3g} ms): the device renders by itself, whatever "
                "this computer does."
            )
        if math.isnan(ticks.p50):
            return "Felt lag: not measured, no command was sent."
        text = (
            f"{ticks.p50:g} to {ticks.worst:g} ticks of felt lag (middle to worst; 99 % within "
            f"{ticks.p99:g}); {100 * self.held_share:.2g} % of the ticks without a new command"
        )
        if math.isnan(self.transport_ms):
            return f"{text}; the line's round trip could not be measured."
        return (
            f"{text}; with the line's round trip of {self.transport_ms:.2g} ms at most "
            f"{ms.p50:.3g} to {ms.worst:.3g} ms."
        )


@dataclass(frozen=True)
class LoopRights:
    """What the system granted the loop's process: real-time priority, and memory kept in RAM."""

    realtime: bool
    memory_locked: bool

    @property
    def sentence(self) -> str:
        """Both facts, and the remedy for what was refused."""
        had = "real-time priority" if self.realtime else "no real-time priority"
        kept = "its memory locked" if self.memory_locked else "its memory not locked"
        text = f"The loop ran with {had} and {kept}."
        wanted = [
            line
            for line, granted in (
                ("@dialout - rtprio 50", self.realtime),
                ("@dialout - memlock unlimited", self.memory_locked),
            )
            if not granted
        ]
        if not wanted:
            return text
        lines = " and ".join(f"'{line}'" for line in wanted)
        return f"{text} To grant it: {lines} in /etc/security/limits.d/scissorcal.conf."
