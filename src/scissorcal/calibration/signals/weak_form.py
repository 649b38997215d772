"""Motion and drive weighed over short windows, so that filtering treats both sides alike."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from scissorcal.calibration.signals.filtering import BIN_S, Bins, low_pass, rate_floor
from scissorcal.calibration.signals.segments import (
    edge_samples,
    no_piece,
    pieces_of,
    sheets_of,
    stretches,
)
from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

HALF_AT = 0.365
"""Frequency times knot distance at which a quadratic B-spline passes half: sinc^3 = 1 / 2."""
RATE_BAND = 2.0
"""The rate that friction is taken at is low-passed at this many times the windows' cutoff."""
TURN_S = 5e-3
STICK_SLIP_S = 0.5
SWIFT = 8.0
SMOOTH = 1 / 12
HELD = 1 / 6
"""What a neighbouring sample counts in a mean over two ticks: of a signal that is smooth (Numerov
1924, doi:10.1093/mnras/84.8.592), and of one with corners at its samples, as a held drive has."""
LOADED = 0.1
"""A load counts from this share of the drive's standard deviation; below it is noise."""


@dataclass(frozen=True)
class Windows:
    """A recording as weighed by short windows, and the samples beneath.

    ``bins`` (n,) hold weighted means: of the drive, and of the acceleration exactly, by moving both
    derivatives from the position to the weight. ``opening``, ``rate``, ``load`` and ``drive`` (m,)
    are the samples (``load`` None where none was measured), for what is not linear in them:
    friction is taken at every sample and weighed by :meth:`average`, as the drive was. ``first``
    (n,) is where each window begins, ``weights`` (k,) its weights, ``starts`` where the pieces
    without a gap begin. ``slope`` (n,) is the time derivative of the weighed drive, ``tick_s`` the
    time between samples; ``held`` says that commands held the drive from one to the next.
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

    def average(self, values: Array) -> Array:
        """Weigh values of all samples, (m,) or (m, k), over each window: (n,) or (n, k)."""
        return np.asarray(self._weighing @ values)

    @cached_property
    def _weighing(self) -> "csr_array":
        """The windows' weights as a sparse matrix (n, m)."""
        from scipy.sparse import csr_array

        count, length = len(self.first), len(self.weights)
        places = (self.first[:, None] + np.arange(length)).ravel().astype(np.int32)
        ends = np.arange(count + 1, dtype=np.int32) * length
        return csr_array(
            (np.tile(self.weights, count), places, ends), shape=(count, len(self.rate))
        )

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
    recordings: tuple[Recording, ...], cutoff_Hz: float, usable: tuple[Mask, ...] | None = None
) -> Windows:
    """Weigh recordings over windows whose weights pass half at ``cutoff_Hz``.

    Each window is a quadratic B-spline. Against such a weight psi the equation of motion holds in
    its weak form,

        <psi, drive> = inertia <psi'', opening> + <psi, F(rate, opening)> + offset <psi, 1>,

    without any derivative of the position but the rate within F (Shinbrot 1957, Trans. ASME 79,
    547; Messenger and Bortz 2021, doi:10.1137/20M1343166). So nothing is smeared that is not
    smeared on both sides, and a window knows nothing of what lies outside it. ``bins.moving`` is
    false for windows that hold a rest: a stretch where the sign of the rate is not certain, unless
    it is a quick turn. ``usable`` has a mask of samples for each recording; windows that touch
    others are left out of ``moving`` too. Raises InputError where no piece is long enough.
    """
    if not recordings:
        raise InputError("There is no recording to fit: capture or import one first.")
    pieces: list[Windows] = []
    loaded = all(np.isfinite(recording.handle_radius_m) for recording in recordings)
    stroke_offset = samples = 0
    for index, recording in enumerate(recordings):
        good = np.ones(len(recording.samples), dtype=bool) if usable is None else usable[index]
        for low, high in pieces_of(recording):
            numbers = (index, stroke_offset, len(pieces))
            piece = _weigh_piece(recording, (low, high), cutoff_Hz, numbers, good[low:high])
            shifted = replace(piece, first=piece.first + samples, starts=piece.starts + samples)
            pieces.append(shifted)
            samples += high - low
        stroke_offset += len(recording.strokes)
    if not pieces:
        raise no_piece(recordings)
    if len({len(piece.weights) for piece in pieces}) > 1:
        raise InputError(
            "The recordings have different sampling rates; fit those of one rate together."
        )
    return _joined(pieces, loaded)


def next_cutoff(windows: Windows) -> float | None:
    """Cutoff in Hz of the next shorter windows over the same samples; None where none are."""
    knot = len(windows.weights) // 3
    return HALF_AT / (windows.tick_s * (knot - 1)) if knot > 1 else None


def _joined(pieces: list[Windows], loaded: bool) -> Windows:
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


def _weigh_piece(
    recording: Recording,
    piece: tuple[int, int],
    cutoff_Hz: float,
    numbers: tuple[int, int, int],
    usable: Mask,
) -> Windows:
    low, high = piece
    index, stroke_offset, number = numbers
    samples, time = recording.samples[low:high], recording.device_time_s[low:high]
    rate_Hz = (len(time) - 1) / (time[-1] - time[0])
    position = np.asarray(samples["opening"], dtype=np.float64)
    band_Hz = RATE_BAND * cutoff_Hz
    opening = low_pass(position, band_Hz, rate_Hz)
    rate = np.gradient(opening) * rate_Hz
    floor = rate_floor(position, band_Hz, rate_Hz)
    knot = max(1, round(HALF_AT * rate_Hz / cutoff_Hz))
    held = bool(np.ptp(samples["torque_command"]) > 0)
    weights, twice = _weights(knot, rate_Hz)
    driving = _widened(_spline(knot), HELD if held else SMOOTH)
    width = max(1, round(BIN_S * rate_Hz))
    edge = edge_samples(rate_Hz)
    first = np.arange(edge, len(time) - edge - len(weights), width)
    middle = first + len(weights) // 2

    def over(values: Array, kernel: Array, at: Integers) -> Array:
        return np.asarray(sliding_window_view(values, len(kernel))[at] @ kernel)

    drive = recording.drive_effort[low:high]
    stroke = np.asarray(samples["stroke"], dtype=np.int64)
    rests = _rests(rate, floor or np.inf, 1.0 / rate_Hz)
    spoilt = np.concatenate([[0], np.cumsum(rests | ~usable)])
    bins = Bins(
        time_s=time[middle],
        opening=over(opening, weights, first),
        rate=over(rate, weights, first),
        acceleration=over(position, twice, first),
        drive=over(drive, driving, first),
        advance=over(np.asarray(samples["advance"], dtype=np.float64), weights, first),
        moving=spoilt[first + len(weights)] == spoilt[first],
        series=np.full(len(first), number),
        recording=np.full(len(first), index),
        stroke=np.where(stroke[middle] >= 0, stroke[middle] + stroke_offset, -1),
        sheet=sheets_of(recording)[low:high][middle],
        bin_s=width / rate_Hz,
        rate_floor=floor,
    )
    hand = np.asarray(samples["handle_force"], dtype=np.float64)
    return Windows(
        bins=bins,
        opening=opening,
        rate=rate,
        load=low_pass(recording.handle_radius_m * hand, band_Hz, rate_Hz),
        drive=drive,
        first=first,
        weights=weights,
        starts=np.zeros(1, dtype=np.int64),
        slope=0.5 * rate_Hz * (over(drive, driving, first + 1) - over(drive, driving, first - 1)),
        tick_s=1.0 / rate_Hz,
        held=held,
    )


def _weights(knot: int, rate_Hz: float) -> tuple[Array, Array]:
    """Weights of a window, and of the position for its second derivative, both of equal length.

    A second difference of samples is the acceleration's mean over two ticks, exactly, so all else
    must be averaged over two ticks too: hence the widening of the B-spline.
    """
    second = np.zeros(2 * knot + 1)
    second[[0, knot, -1]] = np.array([1.0, -2.0, 1.0]) * (rate_Hz / knot) ** 2
    box = np.full(knot, 1.0 / knot)
    return _widened(_spline(knot), SMOOTH), np.convolve(box, second)


def _spline(knot: int) -> Array:
    box = np.full(knot, 1.0 / knot)
    return np.convolve(np.convolve(box, box), box)


def _widened(weights: Array, neighbour: float) -> Array:
    return np.convolve(weights, np.array([neighbour, 1.0 - 2.0 * neighbour, neighbour]))


def _rests(rate: Array, floor: float, tick_s: float) -> Mask:
    """Samples (m,) where the joint may have rested: the rate's sign is not certain.

    A turn is no rest: a reversal within ``TURN_S``, or a touch of zero between two moves
    if it is swift (within three such times the rate is ``SWIFT`` times the uncertain one) and
    stands alone. Touches that follow each other within ``STICK_SLIP_S`` are sticking and slipping.
    """
    certain = np.abs(rate) > floor
    low, high = stretches(~certain)
    apart = round(3 * TURN_S / tick_s)
    before, after = np.maximum(low - apart, 0), np.minimum(high - 1 + apart, len(rate) - 1)
    turns = ((high - low) * tick_s <= TURN_S) & (low > 0) & (high < len(rate))
    onward = turns & (rate[np.maximum(low - 1, 0)] * rate[np.minimum(high, len(rate) - 1)] > 0)
    swift = np.minimum(np.abs(rate[before]), np.abs(rate[after])) > SWIFT * floor
    gaps = np.diff(low[onward], prepend=-np.inf, append=np.inf) * tick_s
    alone = np.ones(len(low), dtype=bool)
    alone[onward] = np.minimum(gaps[:-1], gaps[1:]) > STICK_SLIP_S
    rests = ~certain
    for k in np.flatnonzero(turns & (~onward | (swift & alone))):
        rests[low[k] : high[k]] = False
    return rests
