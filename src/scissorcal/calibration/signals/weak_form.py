"""Weak form: motion and drive weighted over short windows, with the same filter for both."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.signals.filtering import (
    BIN_S,
    HALF_AT,
    SMOOTH,
    Bins,
    Motion,
    knot_samples,
    longer_knot,
    low_pass,
    position_error,
    rate_floor,
    second_derivative,
    spline,
    steps_variance,
    widened,
)
from scissorcal.calibration.signals.segments import bridge, no_piece, sheets_of, usual_tick
from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

WINDOWS_AT_ONCE = 8192
"""Windows that are weighed together: their samples, a third of a megabyte a column, stay in the
processor's cache, and columns of all samples are never in memory together."""
MOST_LEFT_OUT = 3
"""Even windows are all weighed, for what is kept of them, where these are a third at least."""
RATE_BAND = 2.0
"""The rate in the friction law is low-passed at this many times the cutoff."""
HELD = 1 / 6
"""Weight of a neighbouring sample in a mean over two ticks of a signal with corners at its samples,
as a held drive has."""
LOADED = 0.1
"""A load counts from this share of the drive's standard deviation; below it is noise."""


@dataclass(frozen=True)
class Windows:
    """A recording weighted by short windows, and its samples.

    ``bins`` (n,) hold weighted means: of the drive, and of the acceleration exactly, by moving both
    derivatives from the position to the weight. ``opening``, ``rate``, ``load`` and ``drive`` (m,)
    are the samples (``load`` None where none was measured), for what is not linear in them:
    friction is taken at every sample and weighed by :meth:`average`, as the drive was. ``first``
    (n,) is where each window begins, ``weights`` (k,) its weights, ``starts`` where the pieces
    without a gap begin. ``slope`` (n,) is the time derivative of the weighed drive, ``tick_s`` the
    time between samples; ``held`` says that commands held the drive from one to the next,
    ``lengthening`` how many times longer the encoder asked windows to be than the cutoff.
    ``step`` is the largest of the encoder in any recording, 0 where none is to be seen.
    """

    bins: Bins
    opening: Array
    rate: Array
    load: Array | None
    drive: Array
    first: Integers
    weights: Array
    starts: Integers
    slope: Array
    tick_s: float
    held: bool
    lengthening: float = 1.0
    step: float = 0.0

    @property
    def encoder_share(self) -> float:
        """Share of the encoder's steps in the acceleration's mean square over these windows."""
        twice = second_derivative(len(self.weights) // 3, 1.0 / self.tick_s)
        error = steps_variance(twice, self.step)
        square = float(np.mean(self.bins.acceleration**2))
        return error / square if 0.0 < error < square else float(error > 0.0)

    @property
    def half_at(self) -> float:
        """Frequency in Hz at which the weights pass half."""
        return HALF_AT / (self.tick_s * (len(self.weights) // 3))

    def average(self, values: Array) -> Array:
        """Weigh values of all samples (m,) over each window: (n,)."""
        return np.asarray(self.averages(lambda here: (values[here],))[0])

    def averages(self, columns: Callable[[slice], Sequence[Array]]) -> Array:
        """Weigh several columns over each window: (columns, n).

        ``columns`` (samples) gives them at a stretch of samples, a block of windows at a time, so
        that columns which are worked out from the samples take no memory for all of them.
        """
        averages = np.empty((len(columns(slice(0, 0))), len(self.first)))
        for low in range(0, len(self.first), WINDOWS_AT_ONCE):
            windows = slice(low, low + WINDOWS_AT_ONCE)
            first = self.first[windows]
            samples = slice(int(first[0]), int(first[-1]) + len(self.weights))
            over = _over(first - samples.start, self.weights)
            for row, column in zip(averages, columns(samples), strict=True):
                row[windows] = over(column)
        return averages

    @property
    def bears_load(self) -> bool:
        """Whether the passive end bears a load that a friction law can depend on."""
        if self.load is None:
            return False
        load, drive = self.average(self.load), self.bins.drive
        least = LOADED * float(np.std(drive))
        return bool(np.std(load) > least and np.std(drive + load) > least)

    def where(self, keep: Mask) -> "Windows":
        """Return the windows that ``keep`` (n,) selects, over the same samples."""
        return replace(
            self, bins=self.bins.where(keep), first=self.first[keep], slope=self.slope[keep]
        )


def weigh(
    recordings: tuple[Recording, ...],
    cutoff_Hz: float,
    usable: tuple[Mask, ...] | None = None,
    *,
    window_Hz: float | None = None,
) -> Windows:
    """Weigh recordings over windows whose weights pass half at ``cutoff_Hz``, or below it.

    Each window is a quadratic B-spline. Against such a weight psi the equation of motion holds in
    its weak form,

        <psi, drive> = inertia <psi'', opening> + <psi, F(rate, opening)> + offset <psi, 1>,

    without any derivative of the position but the rate within F (Shinbrot 1957, Trans. ASME 79,
    547; Messenger and Bortz 2021, doi:10.1137/20M1343166). So nothing is smeared that is not
    smeared on both sides, and a window knows nothing of what lies outside it. Windows are longer
    than the cutoff asks for where the encoder's steps would else be a part of psi''
    (:func:`~.filtering.longer_knot`); ``window_Hz`` is where they pass half, if that is to be
    prescribed. The rate within F keeps the band of ``cutoff_Hz`` all the same. Short gaps are
    bridged (:func:`~.segments.bridge`): ``first`` and the samples are then those of the bridged
    recordings, and windows that touch a gap are left out of ``moving``.

    ``bins.moving`` is false for windows that hold a rest or a turn: a sample where the sign of the
    rate is not certain, or changes. When a turn was is known to a fraction of the low-pass only,
    and friction jumps there by twice its level. ``usable`` has a mask of samples for each
    recording; windows that touch others are left out of ``moving`` too. Raises InputError where no
    piece is long enough.
    """
    if not recordings:
        raise InputError("There is no recording to fit: capture or import one first.")
    loaded = all(np.isfinite(recording.handle_radius_m) for recording in recordings)
    parts: list[tuple[int, tuple[int, int], Motion]] = []
    filled: list[Recording] = []
    for index, recording in enumerate(recordings):
        good = np.ones(len(recording.samples), dtype=bool) if usable is None else usable[index]
        bridged = bridge(recording, good)
        filled.append(bridged.recording)
        error = position_error(np.asarray(recording.samples["opening"], dtype=np.float64))
        for low, high in bridged.pieces:
            motion = _motion(
                bridged.recording, (low, high), cutoff_Hz, bridged.usable[low:high], error
            )
            parts.append((index, (low, high), motion))
    if not parts:
        raise no_piece(recordings)
    motions = [motion for _, _, motion in parts]
    asked = _common_knot(recordings, window_Hz or cutoff_Hz)
    knot = asked if window_Hz else longer_knot(motions, asked)
    strokes = np.cumsum([0, *(len(recording.strokes) for recording in recordings)]).tolist()
    pieces: list[Windows] = []
    samples = 0
    for number, ((index, (low, high), _), motion) in enumerate(zip(parts, motions, strict=True)):
        numbers = (index, strokes[index], number)
        piece = _weigh_piece(filled[index], (low, high), motion, knot, cutoff_Hz, numbers)
        shifted = replace(piece, first=piece.first + samples, starts=piece.starts + samples)
        pieces.append(shifted)
        samples += high - low
    step = max((motion.step for motion in motions if np.isfinite(motion.step)), default=0.0)
    return replace(_joined(pieces, loaded), lengthening=knot / asked, step=step)


def _over(first: Integers, weights: Array) -> Callable[[Array], Array]:
    """Weigh values (k,) over the windows that begin at ``first`` (n,), ascending.

    Windows that begin every so many samples are products of a matrix, whose rows are the samples
    between two beginnings, with the weights in columns of as many: a third of the time.
    """
    step, last = int(np.gcd.reduce(first)), int(first[-1])
    if step < 2 or last > MOST_LEFT_OUT * step * len(first):
        return lambda values: np.asarray(sliding_window_view(values, len(weights))[first] @ weights)
    columns = -(-len(weights) // step)
    parts = np.zeros((columns, step))
    parts.reshape(-1)[: len(weights)] = weights
    count = last // step + 1
    rows, place = np.zeros((count + columns - 1, step)), first // step

    def over(values: Array) -> Array:
        rows.reshape(-1)[: len(values)] = values
        shares = parts @ rows.T
        total = shares[0, :count].copy()
        for column in range(1, columns):
            total += shares[column, column : column + count]
        return total[place]

    return over


def next_cutoff(windows: Windows) -> float | None:
    """Cutoff in Hz of the next shorter windows over the same samples; None where none are."""
    knot = len(windows.weights) // 3
    return HALF_AT / (windows.tick_s * (knot - 1)) if knot > 1 else None


def _common_knot(recordings: tuple[Recording, ...], cutoff_Hz: float) -> int:
    """Knot distance in samples of windows over all recordings.

    Raises InputError where rates differ by so much that it would differ by half a sample.
    """
    timed = [recording for recording in recordings if len(recording.samples) > 1]
    rates = [1.0 / usual_tick(one) for one in timed]
    knot = knot_samples(cutoff_Hz, max(rates))
    if max(rates) - min(rates) > 0.5 * min(rates) / knot:
        listed = ", ".join(
            f"{one.source or 'a recording'}: {rate:.4g} Hz"
            for one, rate in zip(timed, rates, strict=True)
        )
        raise InputError(
            f"The recordings have different sampling rates ({listed}); fit those of one rate "
            "together."
        )
    return knot_samples(cutoff_Hz, float(np.median(rates)))


def _joined(pieces: list[Windows], loaded: bool) -> Windows:
    if len(pieces) == 1:
        return pieces[0] if loaded else replace(pieces[0], load=None)

    def together(name: str) -> Array:
        return np.concatenate([getattr(piece, name) for piece in pieces])

    arrays = {
        f.name: np.concatenate([getattr(piece.bins, f.name) for piece in pieces])
        for f in fields(Bins)
        if f.name not in ("bin_s", "rate_floor")
    }
    floor = max(piece.bins.rate_floor for piece in pieces)
    return Windows(
        bins=Bins(**arrays, bin_s=pieces[0].bins.bin_s, rate_floor=floor),
        opening=together("opening"),
        rate=together("rate"),
        load=together("load") if loaded else None,
        drive=together("drive"),
        first=np.concatenate([piece.first for piece in pieces]),
        weights=pieces[0].weights,
        starts=np.concatenate([piece.starts for piece in pieces]),
        slope=together("slope"),
        tick_s=pieces[0].tick_s,
        held=all(piece.held for piece in pieces),
    )


def _motion(
    recording: Recording,
    piece: tuple[int, int],
    cutoff_Hz: float,
    usable: Mask,
    error: tuple[float, float],
) -> Motion:
    low, high = piece
    time = recording.device_time_s[low:high]
    rate_Hz = float((len(time) - 1) / (time[-1] - time[0]))
    position = np.asarray(recording.samples["opening"][low:high], dtype=np.float64)
    band_Hz = RATE_BAND * cutoff_Hz
    opening = low_pass(position, band_Hz, rate_Hz)
    rate = np.gradient(opening) * rate_Hz
    step, sd = error
    floor = rate_floor(sd, band_Hz, rate_Hz)
    turns = _turns(rate, floor if np.ptp(position) > 0.0 else np.inf)
    return Motion(position, step, opening, rate, floor, turns, ~usable, rate_Hz)


def _weigh_piece(
    recording: Recording,
    piece: tuple[int, int],
    motion: Motion,
    knot: int,
    cutoff_Hz: float,
    numbers: tuple[int, int, int],
) -> Windows:
    low, high = piece
    index, stroke_offset, number = numbers
    samples, time = recording.samples[low:high], recording.device_time_s[low:high]
    opening, rate, rate_Hz = motion.opening, motion.rate, motion.rate_Hz
    held = bool(np.ptp(samples["torque_command"]) > 0)
    weights, twice = widened(spline(knot), SMOOTH), second_derivative(knot, rate_Hz)
    driving = widened(spline(knot), HELD if held else SMOOTH)
    first = motion.places(len(weights))
    middle = first + len(weights) // 2

    def over(values: Array, kernel: Array, at: Integers) -> Array:
        return np.asarray(sliding_window_view(values, len(kernel))[at] @ kernel)

    drive = recording.drive_effort[low:high]
    stroke = np.asarray(samples["stroke"], dtype=np.int64)
    bins = Bins(
        time_s=time[middle],
        opening=over(opening, weights, first),
        rate=over(rate, weights, first),
        acceleration=over(motion.position, twice, first),
        drive=over(drive, driving, first),
        advance=over(np.asarray(samples["advance"], dtype=np.float64), weights, first),
        moving=motion.moving(first, len(weights)),
        series=np.full(len(first), number),
        recording=np.full(len(first), index),
        stroke=np.where(stroke[middle] >= 0, stroke[middle] + stroke_offset, -1),
        sheet=sheets_of(recording)[low:high][middle],
        bin_s=max(1, round(BIN_S * rate_Hz)) / rate_Hz,
        rate_floor=motion.floor,
    )
    hand = np.asarray(samples["handle_force"], dtype=np.float64)
    return Windows(
        bins=bins,
        opening=opening,
        rate=rate,
        load=low_pass(recording.handle_radius_m * hand, RATE_BAND * cutoff_Hz, rate_Hz),
        drive=drive,
        first=first,
        weights=weights,
        starts=np.zeros(1, dtype=np.int64),
        slope=0.5 * rate_Hz * (over(drive, driving, first + 1) - over(drive, driving, first - 1)),
        tick_s=1.0 / rate_Hz,
        held=held,
    )


def _turns(rate: Array, floor: float) -> Mask:
    """Samples (m,) where the rate's sign is not certain, or has just changed."""
    uncertain = np.abs(rate) <= floor
    uncertain[1:] |= rate[1:] * rate[:-1] <= 0.0
    return np.asarray(uncertain)
