"""The teeth of a running crack: a periodic torque in the crack's own phase.

Between two jumps the edge sinks in by the same depth, so in the phase d(eta) / period the torque
repeats once per cycle at any speed. The signal's phase advance per cycle gives the ratio of the
true period to that of the parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.calibration.cut.path_work import Material
from scissorcal.calibration.cut.segments import Segments, Stretch, carriage_share

Complex = NDArray[np.complex128]

SUBDIVISIONS = 32
HALF_CYCLE = SUBDIVISIONS // 2
WINDOW_CYCLES = 5
"""Cycles of the Hann windows. Phases are compared one window apart, so that they share no sample
and aperiodic parts cancel on average."""
LOCAL_CYCLES = 6.0
LEAST_TICKS = 3.5
"""Least samples per tooth of a stroke; below, teeth and samples alias."""
FASTEST_RATIO = (0.7, 1.4)
SCAN = (0.25, 2.5)
SCAN_STEP = 0.04
COHERENT = 16.0
"""Power that keeps its phase over what noise leaves. Without a line it is exponential with mean
1, so that one stroke speed in ten million passes by chance."""
ONE_WINDOW, ONE_AND_A_HALF = 2 * WINDOW_CYCLES, 3 * WINDOW_CYCLES
"""Distances of windows in half cycles. A frequency that gains one cycle too many over a window
gains one and a half over the longer distance: there its phases oppose."""
FURTHEST_ALIAS = 4
"""Steps of one cycle per window by which a search may be off: it begins within 0.25 to 2.5."""
OVERLAP = 4.0
"""Windows half a cycle apart that count as one: the sum of the Hann window's squared
autocorrelation."""
SHOWN = 4.0
"""Gain from which one stretch is used."""
SPEEDS_DIFFER = 1.5
SAME_PERIOD = 0.03
HARMONICS = (2, 3)
HARMONIC_POWER = 0.25
PERIOD_SD = 0.001
"""Relative error of the period's formula and of unevenness within a tooth: what 40 simulated cuts
had beside the jackknife's error (decision 191)."""


@dataclass(frozen=True)
class PhaseSignal:
    """One stretch in the crack's phase: ``phase`` (n,) in cycles, ``torque`` (n,) in N m.

    ``ends`` (k + 1,) are the samples between its segments.
    """

    stretch: int
    stroke_speed: float
    phase: Array
    torque: Array
    ends: Integers

    @cached_property
    def weight(self) -> Array:
        """What each sample adds to an integral of torque over the phase (n,)."""
        return np.asarray((self.torque - np.mean(self.torque)) * np.gradient(self.phase))


@dataclass(frozen=True)
class Line:
    """A detected line: the true period is ``ratio`` times the expected one, with ``sd``.

    ``log_period`` is the mean logarithm of the period (rad) over the stretches ``stretches``, where
    the mean logarithm of the torque (N m) is ``log_torque``: phases follow the local torque, so the
    period is that of a sheet so tough, whatever this one is. ``weights`` has (k,) for the segments
    of each of them: means are of the places that show the line, as its frequency is. ``gain`` is
    the power that keeps its phase over what noise would leave. ``speeds`` has rows of stroke speed
    (rad/s), the ratio that it gives and its gain. ``half`` and ``third`` are the powers at a half
    and a third of the line's frequency over its own.
    """

    ratio: float
    sd: float
    log_period: float
    log_torque: float
    stretches: tuple[int, ...]
    weights: tuple[Array, ...]
    gain: float
    speeds: tuple[tuple[float, float, float], ...]
    half: float
    third: float

    @property
    def at_two_speeds(self) -> bool:
        """Whether two different speeds show the line at one period, unlike aliased counts."""
        shown = [(speed, ratio) for speed, ratio, gain in self.speeds if gain > COHERENT]
        return any(
            a[0] > SPEEDS_DIFFER * b[0] and abs(np.log(a[1] / b[1])) < SAME_PERIOD
            for a in shown
            for b in shown
        )


def phase_signals(
    segments: Segments,
    materials: tuple[Material, ...],
    geometry: Geometry,
    log_periods: Sequence[Array],
    expected: Sequence[Array],
    growth: float,
) -> tuple[PhaseSignal, ...]:
    """Phase and torque along each stretch, from its segments' ``log_periods`` (rad).

    ``expected`` are the segments' mean torques as they would be measured; where the material is
    tougher than on average the period is longer by the torque's ratio to the power ``growth``
    (1 / n for a power law).
    """
    signals = []
    for index, stretch in enumerate(segments.stretches):
        motion = segments.motions[stretch.motion]
        local = _local_ratio(stretch, expected[index], float(np.exp(np.mean(log_periods[index]))))
        period = np.exp(log_periods[index]) * np.clip(local, *FASTEST_RATIO) ** growth
        low, high = int(stretch.ends[0]), int(stretch.ends[-1])
        middles = 0.5 * (stretch.ends[1:] + stretch.ends[:-1])
        at = np.interp(np.arange(low, high), middles, period)
        moved = np.diff(motion.advance[low : high + 1])
        moved = moved * carriage_share(motion, geometry, low, high)
        path = np.diff(motion.opening[low : high + 1]) - moved
        phase = np.concatenate([[0.0], np.cumsum(-path / at)])
        torque = motion.torque[low : high + 1]
        signals.append(PhaseSignal(index, stretch.speed, phase, torque, stretch.ends - low))
    return tuple(signals)


def find_line(
    signals: Sequence[PhaseSignal],
    log_periods: Sequence[Array],
    expected: Sequence[Array],
    near: bool = False,
) -> Line | None:
    """Detect the teeth; None where no stroke shows them.

    The phase's true advance is searched over ``SCAN`` of the expected one, by the power that keeps
    its phase from window to window (the pulse-pair estimator of the mean frequency, Zrnic 1979,
    IEEE Trans. Geosci. Electron. GE-17, 113); the error is a jackknife over strokes, and
    ``PERIOD_SD``.
    ``log_periods`` (k,) and ``expected`` torque (k,) of the segments are those that the phases were
    worked out with; ``near`` says that the expected period is right to some percent, and needs no
    search.
    """
    resolved = [s for s in signals if _ticks_per_cycle(s) >= LEAST_TICKS * SCAN[0]]
    if not resolved:
        return None
    frequency = 1.0
    if not near:
        scan = np.exp(np.arange(np.log(SCAN[0]), np.log(SCAN[1]), SCAN_STEP))
        gains = np.array([_shown(resolved, float(f)) for f in scan])
        if not np.any(gains > 0):
            return None
        frequency = _fundamental(resolved, float(scan[int(np.argmax(gains))]))
    else:
        frequency = _refined(resolved, frequency)
    pairs = {s.stretch: p for s in resolved if (p := _pairs(s, frequency)) is not None}
    if not pairs:
        return None
    kept = {index: pair for index, pair in pairs.items() if _gain([pair]) > SHOWN}
    sums = np.array([pair.sum() / np.abs(pair).mean() for pair in kept.values()])
    if len(sums) == 0 or _gain(list(kept.values())) < COHERENT:
        return None
    shift = np.angle(sums.sum()) / (2 * np.pi * WINDOW_CYCLES)
    jackknife = _jackknife(sums)
    where = tuple(kept)
    by_stretch = {s.stretch: s for s in resolved}
    weights = tuple(_weights(by_stretch[i], kept[i], frequency) for i in where)
    frequency *= 1.0 + float(shift)

    def mean(logs: Sequence[Array]) -> float:
        return float(
            np.average(np.concatenate([logs[i] for i in where]), weights=np.concatenate(weights))
        )

    chosen = [s for s in resolved if s.stretch in kept]
    power = coherent_power(chosen, frequency)
    return Line(
        ratio=1.0 / frequency,
        sd=float(np.hypot(jackknife, PERIOD_SD)),
        log_period=mean(log_periods) - float(np.log(frequency)),
        log_torque=mean([np.log(torques) for torques in expected]),
        stretches=where,
        weights=weights,
        gain=_gain(list(kept.values())),
        speeds=_by_speed(resolved, frequency),
        half=coherent_power(chosen, frequency / 2) / power,
        third=coherent_power(chosen, frequency / 3) / power,
    )


def _local_ratio(stretch: Stretch, expected: Array, period: float) -> Array:
    """Torque over what is expected (k,), smoothed over some cycles of the teeth."""
    ratio = stretch.torque / expected
    width = max(1, round(LOCAL_CYCLES * period / float(np.median(np.abs(stretch.path)))))
    window = np.ones(min(width, len(ratio)))
    return np.asarray(
        np.convolve(ratio, window, "same") / np.convolve(np.ones_like(ratio), window, "same")
    )


def _ticks_per_cycle(signal: PhaseSignal) -> float:
    return len(signal.phase) / max(float(signal.phase[-1]), 1e-9)


def _windows(signal: PhaseSignal, frequency: float) -> Complex | None:
    """Amplitudes at one cycle, of Hann windows that begin half a cycle apart."""
    if _ticks_per_cycle(signal) / frequency < LEAST_TICKS:
        return None
    phase = signal.phase * frequency
    blocks = int(phase[-1] * SUBDIVISIONS) // HALF_CYCLE
    count, across = blocks * HALF_CYCLE, 2 * WINDOW_CYCLES
    if blocks < 2 * across + 2:
        return None
    index = np.floor(phase * SUBDIVISIONS).astype(np.int64)
    inside = (index >= 0) & (index < count)
    even = np.bincount(index[inside], signal.weight[inside], count) * frequency
    products = even.reshape(blocks, HALF_CYCLE) @ _WINDOW
    last = blocks - across + 1
    rows = sum(products[block : block + last, block] for block in range(across))
    return np.asarray(rows * (-1.0) ** np.arange(last))


def _window() -> Complex:
    """One cycle's Fourier weights under a Hann window, blind to a mean and a slope.

    Shape (half a cycle, half cycles), so that windows half a cycle apart share products.
    """
    size = WINDOW_CYCLES * SUBDIVISIONS
    ramp = (np.arange(size) - 0.5 * (size - 1)) / size
    weights = np.hanning(size + 1)[:-1] * np.exp(-2j * np.pi * np.arange(size) / SUBDIVISIONS)
    weights = weights - weights.mean() - ramp * (ramp @ weights) / (ramp @ ramp)
    return np.asarray(weights.reshape(-1, HALF_CYCLE).T)


_WINDOW = _window()


def _pairs(signal: PhaseSignal, frequency: float, apart: int = ONE_WINDOW) -> Complex | None:
    """Products of amplitudes ``apart`` half cycles: their angle is the phase that was gained."""
    amplitude = _windows(signal, frequency)
    if amplitude is None or len(amplitude) <= apart:
        return None
    return np.asarray(amplitude[apart:] * np.conj(amplitude[:-apart]))


def _weights(signal: PhaseSignal, pairs: Complex, frequency: float) -> Array:
    """What each segment (k,) adds to the mean frequency that ``pairs`` give.

    A pair shows the phase that is gained between the middles of its windows, half a cycle after the
    one before. It counts as much as in the sum: by its size over the stretch's mean.
    """
    begins = 0.5 * WINDOW_CYCLES + 0.5 * np.arange(len(pairs))
    ends = signal.phase[signal.ends] * frequency
    gained = np.clip((ends - begins[:, None]) / WINDOW_CYCLES, 0.0, 1.0)
    return np.asarray(np.diff(np.abs(pairs) @ gained) / np.abs(pairs).mean())


def _gain(pairs: Sequence[Complex]) -> float:
    """Squared sum of the pairs over what it would be if their phases were random."""
    scaled = [pair / np.abs(pair).mean() for pair in pairs]
    chance = OVERLAP * sum(float(np.sum(np.abs(pair) ** 2)) for pair in scaled)
    return float(abs(sum(complex(pair.sum()) for pair in scaled)) ** 2 / max(chance, 1e-300))


def coherent_power(signals: Sequence[PhaseSignal], frequency: float) -> float:
    """Power that keeps its phase, summed over strokes."""
    pairs = _pairs_of(signals, frequency)
    return max(float(sum(float(np.real(p.sum())) / len(p) for p in pairs)), 1e-300)


def _pairs_of(signals: Sequence[PhaseSignal], frequency: float) -> list[Complex]:
    return [p for s in signals if (p := _pairs(s, frequency)) is not None]


def _shown(signals: Sequence[PhaseSignal], frequency: float) -> float:
    """Gain at a frequency, 0 where the phase gains a part of a cycle between windows."""
    pairs = _pairs_of(signals, frequency)
    ahead = sum(float(np.real(p.sum())) / float(np.abs(p).mean()) for p in pairs)
    return _gain(pairs) if ahead > 0 else 0.0


def _coherence(signals: Sequence[PhaseSignal], frequency: float) -> float:
    """Pairs that keep their phase over one window and over one and a half, in units of a pair."""
    pairs = [
        pair
        for signal in signals
        for apart in (ONE_WINDOW, ONE_AND_A_HALF)
        if (pair := _pairs(signal, frequency, apart)) is not None
    ]
    return sum(float(np.real(pair.sum())) / float(np.abs(pair).mean()) for pair in pairs)


def _refined(signals: Sequence[PhaseSignal], frequency: float) -> float:
    for _ in range(4):
        pairs = _pairs_of(signals, frequency)
        if not pairs:
            return frequency
        sums = sum(p.sum() / max(float(np.abs(p).sum()), 1e-300) * len(p) for p in pairs)
        frequency *= 1.0 + float(np.angle(sums)) / (2 * np.pi * WINDOW_CYCLES)
    return frequency


def _strongest(signals: Sequence[PhaseSignal], frequency: float) -> float:
    """The frequency, or one that gains whole cycles more or less between two windows.

    The coherence decides where noise has more power at the wrong one, the power where a harmonic
    keeps its phase as well.
    """
    best, highest = frequency, -np.inf
    for _ in range(FURTHEST_ALIAS):
        for aside in (1.0 - 1.0 / WINDOW_CYCLES, 1.0, 1.0 + 1.0 / WINDOW_CYCLES):
            tried = _refined(signals, frequency * aside)
            score = max(_coherence(signals, tried), 0.0) * coherent_power(signals, tried)
            if score > highest:
                best, highest = tried, score
        if best == frequency:
            break
        frequency = best
    return best


def _fundamental(signals: Sequence[PhaseSignal], frequency: float) -> float:
    """The frequency, or a half or a third of it where that has enough power."""
    frequency = _strongest(signals, frequency)
    power = coherent_power(signals, frequency)
    for order in HARMONICS:
        lower = _refined(signals, frequency / order)
        near = abs(np.log(lower * order / frequency)) < SAME_PERIOD
        if near and coherent_power(signals, lower) > HARMONIC_POWER * power:
            return lower
    return frequency


def _jackknife(sums: Complex) -> float:
    count = len(sums)
    if count < 2:
        return 0.01
    left = np.angle(sums.sum() - sums) / (2 * np.pi * WINDOW_CYCLES)
    return float(np.sqrt((count - 1) / count * np.sum((left - left.mean()) ** 2)))


def _by_speed(
    signals: Sequence[PhaseSignal], frequency: float
) -> tuple[tuple[float, float, float], ...]:
    """Speed, ratio and coherence of strokes of one speed (within a quarter) together."""
    groups: list[list[PhaseSignal]] = []
    for signal in sorted(signals, key=lambda s: s.stroke_speed):
        if groups and signal.stroke_speed < 1.25 * groups[-1][0].stroke_speed:
            groups[-1].append(signal)
        else:
            groups.append([signal])
    rows = []
    for group in groups:
        pairs = _pairs_of(group, frequency)
        if pairs:
            total = sum(complex(p.sum()) for p in pairs)
            shift = float(np.angle(total)) / (2 * np.pi * WINDOW_CYCLES)
            speed = float(np.mean([s.stroke_speed for s in group]))
            rows.append((speed, 1.0 / (frequency * (1 + shift)), _gain(pairs)))
    return tuple(rows)
