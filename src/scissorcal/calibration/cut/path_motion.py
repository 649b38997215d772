"""The motion of a recording by sample, and its runs of one direction through one sheet."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.signals.segments import Bridged, bridge, sheets_of
from scissorcal.recording.recording import Recording
from scissorcal.recording.resolution import resolution_of

STRIDES = (1, 2, 4, 8, 16)
CLEAR = 3.0
"""The change of torque is measured at the shortest stride at which its differences exceed those of
the encoder's steps by this factor."""
WALK_S, WALK_ROUNDS = 0.03, 6
"""The change of torque is also measured over this time (two oscillations at 80 Hz of blades that
the material holds at a turn) in these rounds of smoothing. On a virtual rig of 20,000 counts a turn
positions were wrong there by 187 urad with one walk for all, by 91, 64, 59, 57, 56, 56 urad after
each round."""
WALKS = 9
"""Number of sizes of the walk at which the rate's error is computed."""
FINEST_STEP = 1e-7
"""Encoder step in rad (m) that is assumed where positions show none."""
LEAST_PLACE_SD_M = 1e-6
"""Error of a place along the cut where the carriage's encoder shows no coarser steps."""
STILL_S, STILL_STEPS, STILL_RAD_PER_S = 0.02, 4.0, 0.01
"""Blades rest while they turn, over this time, by fewer encoder steps or more slowly than these, a
tenth of the slowest stroke's rate. Slower than four steps in 20 ms they may
move back at 30 Hz by less than a step, which is unresolved."""
RATE_WEIGHTS = np.array([-1.0, 8.0, 0.0, -8.0, 1.0]) / 12.0
"""Of five neighbouring positions, the last one first: exact for a polynomial of fourth degree."""
BRIDGED_S = 0.003
"""Invalid samples between usable ones no farther apart than this are replaced by the line between
those: a torque that swings at 45 Hz, the fastest that a capture's control makes, leaves that line
by at most (pi 45 Hz 3 ms)^2 / 2 = 9 % of its amplitude, on a few samples of a segment."""
HELD = 0.5
"""Share of a tick by which a torque that follows its command is measured late, less the delay."""


@dataclass(frozen=True)
class PathMotion:
    """One stretch of a recording whose gaps are short; arrays (n,) by sample.

    ``source`` are the samples' places in the recording (:func:`~.signals.segments.bridge`).
    ``opening`` (rad) and ``rate`` (rad/s) are smoothed, ``advance`` (m) is as measured. ``drive``
    (N m) is the mean drive from each sample to the next, had it been measured without delay;
    ``drive_step`` its change over that tick, by which a delay of one tick would lower it.
    ``torque`` (N m) is what the drive and the acceleration leave unexplained at each sample, from
    unsmoothed positions: rough, but with nothing filtered out. ``usable`` is false where a sensor's
    samples are invalid or missing for longer than BRIDGED_S, ``standing`` true where the blades do
    not turn.
    ``opening_sd`` and ``rate_sd`` (n,) are the errors of opening and rate, ``resolution`` the
    encoder's step, ``advance_sd`` (m) the error of a place along the cut.
    """

    recording: int
    source: Integers
    time_s: Array
    opening: Array
    rate: Array
    advance: Array
    drive: Array
    drive_step: Array
    torque: Array
    stroke: Integers
    sheet: Integers
    usable: Mask
    standing: Mask
    tick_s: float
    inertia: float
    opening_sd: Array
    rate_sd: Array
    resolution: float
    advance_sd: float


def path_motion(
    recordings: tuple[Recording, ...], inertia: float, usable: tuple[Mask, ...] | None = None
) -> tuple[PathMotion, ...]:
    """Smooth the motion of recordings, one stretch after the other; short gaps are bridged.

    ``inertia`` (kg m^2) relates position and drive; the unexplained torque is modelled as a random
    walk. The most probable positions follow the measured drive exactly, and the encoder within its
    resolution (a Kalman smoother, Rauch, Tung and Striebel 1965, doi:10.2514/3.3166, solved as one
    banded system). The walk's size comes from the data: a fine encoder is hardly smoothed, a coarse
    one more, and less where the torque changes fast, as while blades oscillate on the material.
    """
    motions: list[PathMotion] = []
    offset = 0
    for index, recording in enumerate(recordings):
        good = np.ones(len(recording.samples), dtype=bool) if usable is None else usable[index]
        bridged = bridge(recording, good)
        sheets = sheets_of(bridged.recording)
        motions += [_piece(bridged, index, b, inertia, sheets, offset) for b in bridged.pieces]
        offset += len(recording.strokes)
    return tuple(motions)


def _piece(
    bridged: Bridged,
    index: int,
    bounds: tuple[int, int],
    inertia: float,
    sheets: Integers,
    stroke_offset: int,
) -> PathMotion:
    part = slice(*bounds)
    recording, recorded = bridged.recording, bridged.recorded[part]
    samples, time = recording.samples[part], recording.device_time_s[part]
    tick_s = float((time[-1] - time[0]) / (len(time) - 1))
    position = np.asarray(samples["opening"], dtype=np.float64)
    advance = np.asarray(samples["advance"], dtype=np.float64)
    measured = np.asarray(recording.drive_effort[part], dtype=np.float64)
    measured, good = _without_brief(measured, bridged.usable[part], round(BRIDGED_S / tick_s))
    good &= ~_beside(~recorded & ~good, len(RATE_WEIGHTS) // 2)
    step = np.append(np.diff(measured), 0.0)
    drive = measured + HELD * step
    encoder_step = resolution_of(position[recorded])
    resolution = encoder_step if np.isfinite(encoder_step) else FINEST_STEP
    model = _Dynamics(position, drive, tick_s, inertia, resolution)
    walk = _local_walk(model, _torque_walk(model))
    smooth = model.most_probable(walk)
    rough = np.zeros_like(position)
    mean_drive = 0.5 * (drive[1:-1] + drive[:-2])
    rough[1:-1] = inertia * np.diff(position, 2) / tick_s**2 - mean_drive
    stroke = np.asarray(samples["stroke"], dtype=np.int64)
    return PathMotion(
        recording=index,
        source=bridged.source[part],
        time_s=time,
        opening=smooth,
        rate=_rate(smooth, tick_s),
        advance=advance,
        drive=drive,
        drive_step=step,
        torque=rough,
        stroke=np.where(stroke >= 0, stroke + stroke_offset, -1),
        sheet=sheets[part],
        usable=good,
        standing=_standing(smooth, tick_s, resolution),
        tick_s=tick_s,
        inertia=inertia,
        opening_sd=_error(model, walk, np.ones(1)),
        rate_sd=_error(model, walk, RATE_WEIGHTS[::-1] / tick_s),
        resolution=resolution,
        advance_sd=_place_sd(advance[recorded]),
    )


def _without_brief(measured: Array, usable: Mask, most_ticks: int) -> tuple[Array, Mask]:
    """Values (n,) with brief invalid stretches replaced, and which of them can be used then."""
    good = np.flatnonzero(usable)
    if len(good) < 2:
        return measured, usable
    apart = np.diff(good)
    whole, at = usable.copy(), np.searchsorted(good, np.arange(len(usable)), side="right") - 1
    inside = (at >= 0) & (at < len(apart))
    whole[inside] |= apart[at[inside]] <= most_ticks
    line = np.interp(np.arange(len(usable)), good, measured[good])
    return np.where(whole & ~usable, line, measured), whole


def _beside(here: Mask, reach: int) -> Mask:
    """Samples (n,) at most ``reach`` from a marked one: their rate is taken from its position."""
    near = np.convolve(here, np.ones(2 * reach + 1))[reach : len(here) + reach]
    return np.asarray(near > 0.5)


def _rate(opening: Array, tick_s: float) -> Array:
    """Rate (n,) by five points: three lose 7 % of what blades swing by at 100 Hz and 1 kHz."""
    rate = np.gradient(opening)
    rate[2:-2] = np.convolve(opening, RATE_WEIGHTS, mode="valid")
    return np.asarray(rate / tick_s)


def _standing(opening: Array, tick_s: float, resolution: float) -> Mask:
    """Where the opening stays within a few steps over a window around each sample."""
    half = max(1, round(0.5 * STILL_S / tick_s))
    padded = np.pad(opening, half, mode="edge")
    moved = np.abs(padded[2 * half :] - padded[: -2 * half])
    limit = max(STILL_STEPS * resolution, STILL_RAD_PER_S * 2 * half * tick_s)
    return np.asarray(moved < limit)


def _place_sd(advance: Array) -> float:
    step = resolution_of(advance) if np.ptp(advance) > 0 else float("nan")
    return max(LEAST_PLACE_SD_M, step / np.sqrt(12.0)) if np.isfinite(step) else LEAST_PLACE_SD_M


def turning_points(opening: Array, least: ArrayLike) -> list[int]:
    """Samples at which the opening turns, leaving out turns that are undone within ``least``.

    ``least`` is one number or has (n,).
    """
    turns: list[int] = []
    apart = np.broadcast_to(least, len(opening)).tolist()
    low = high = 0
    direction = 0
    for index, value in enumerate(opening.tolist()):
        if direction >= 0 and value > opening[high]:
            high = index
        if direction <= 0 and value < opening[low]:
            low = index
        if direction >= 0 and value < opening[high] - apart[index]:
            turns.append(high)
            direction, low = -1, index
        elif direction <= 0 and value > opening[low] + apart[index]:
            turns.append(low)
            direction, high = 1, index
    return turns


@dataclass(frozen=True)
class _Dynamics:
    """Positions (n,) and the drive (n,) that, with the inertia, ties them together."""

    position: Array
    drive: Array
    tick_s: float
    inertia: float
    resolution: float

    def change(self, path: Array) -> Array:
        """Change (n - 3,) from sample to sample of the torque that a path leaves unexplained."""
        gain = self.inertia / self.tick_s**2
        return np.asarray(gain * np.diff(path, 3) - self.known)

    @property
    def known(self) -> Array:
        """Change (n - 3,) of the drive."""
        return np.diff(0.5 * (self.drive[1:-1] + self.drive[:-2]))

    def band(self, walk: Array) -> Array:
        """Banded precision (4, n) of the positions, upper form, for a walk (n - 3,) in N m."""
        row, weight = self.row, walk**-2
        band = np.zeros((4, len(walk) + 3))
        for a in range(4):
            for b in range(a, 4):
                band[3 - (b - a), b : b + len(walk)] += row[a] * row[b] * weight
        band[3] += 12.0 / self.resolution**2
        return band

    @property
    def row(self) -> Array:
        """What four neighbouring positions add to the change of torque."""
        return np.array([-1.0, 3.0, -3.0, 1.0]) * self.inertia / self.tick_s**2

    def most_probable(self, walk: Array) -> Array:
        """Positions (n,) of highest probability for a walk (n - 3,)."""
        from scipy.linalg import solveh_banded

        right = self.position * 12.0 / self.resolution**2
        pulled = self.known / walk**2
        for a in range(4):
            right[a : a + len(pulled)] += self.row[a] * pulled
        return np.asarray(solveh_banded(self.band(walk), right))


def _torque_walk(model: _Dynamics) -> float:
    """Standard deviation (N m) by which the unexplained torque changes from sample to sample."""
    walk = 0.0
    for stride in STRIDES:
        places = model.position[::stride]
        count = len(places)
        if count < 16:
            break
        mean = np.add.reduceat(model.drive, np.arange(0, len(model.drive), stride))[:count] / stride
        gain = model.inertia / (stride * model.tick_s) ** 2
        change = gain * np.diff(places, 3) - np.diff(0.5 * (mean[1:-1] + mean[:-2]))
        mean_square = float(np.mean(change**2))
        steps = gain**2 * 20.0 * model.resolution**2 / 12.0
        walk = float(np.sqrt(max(mean_square - steps, 0.2 * mean_square) / stride))
        if mean_square > CLEAR * steps:
            break
    return max(walk, 1e-12)


def _local_walk(model: _Dynamics, least: float) -> Array:
    """Walk (n - 3,) by which the torque changes about each sample, and no less than on the whole.

    What a smoothed path leaves of the change shows where the walk is larger; a path that is
    smoothed by that leaves more, until both agree.
    """
    walk = np.full(len(model.position) - 3, least)
    width = min(max(3, round(WALK_S / model.tick_s)), len(walk))
    for _ in range(WALK_ROUNDS):
        squares = np.cumsum(np.append(0.0, model.change(model.most_probable(walk)) ** 2))
        mean = (squares[width:] - squares[:-width]) / width
        before = width // 2
        local = np.pad(mean, (before, len(walk) - len(mean) - before), mode="edge")
        walk = np.maximum(least, np.sqrt(np.maximum(local, 0.0)))
    return walk


def _error(model: _Dynamics, walk: Array, of: Array, count: int = 401) -> Array:
    """Error (n,) of a sum ``of`` smoothed neighbours, as if each had the walk of all of them."""
    from scipy.linalg import solveh_banded

    weights = np.zeros(count)
    half = len(of) // 2
    weights[count // 2 - half : count // 2 + half + 1] = of
    low, high = np.log(walk.min()), np.log(walk.max())
    sizes = np.linspace(low, high, WALKS if high > low else 1)
    errors = []
    for size in np.exp(sizes):
        band = model.band(np.full(count - 3, size))
        errors.append(float(np.sqrt(weights @ solveh_banded(band, weights))))
    inside = np.interp(np.log(walk), sizes, errors)
    return np.concatenate([inside[:1], inside, inside[-1:], inside[-1:]])


TURN_RAD = 3e-3
"""A turn that is reversed within this angle is a tremor."""
FEWEST_SEGMENTS = 5


@dataclass(frozen=True)
class Run:
    """Samples ``low`` to ``high`` of a motion between two turns of the blades."""

    motion: int
    sheet: int
    low: int
    high: int

    def closing(self, motion: PathMotion) -> bool:
        return bool(motion.opening[self.high] < motion.opening[self.low])


def find_runs(motions: tuple[PathMotion, ...]) -> list[Run]:
    """Stretches between turns on each sheet, in order of time."""
    runs: list[Run] = []
    for index, motion in enumerate(motions):
        bounds = np.flatnonzero(np.diff(motion.sheet)) + 1
        edges = [0, *bounds.tolist(), len(motion.sheet)]
        for low, high in pairwise(edges):
            sheet = int(motion.sheet[low])
            if sheet < 0 or high - low < 2 * FEWEST_SEGMENTS:
                continue
            turns = [low + t for t in turning_points(motion.opening[low:high], TURN_RAD)]
            ends = [low, *turns, high - 1]
            runs += [
                Run(index, sheet, a, b) for a, b in pairwise(ends) if b - a >= 2 * FEWEST_SEGMENTS
            ]
    return sorted(runs, key=lambda run: (motions[run.motion].recording, run.motion, run.low))


def split(path: Array, low: int, high: int, step: float) -> Integers:
    """Samples from ``low`` on, each ``step`` further along the path than the last."""
    if not step > 0.0:
        raise ValueError(f"segments need a positive length, not {step}")
    away = np.sign(path[high] - path[low]) * (path[low : high + 1] - path[low])
    farthest = np.maximum.accumulate(away)
    ends, at = [low], 0.0
    while True:
        index = int(np.searchsorted(farthest, at + step))
        if index >= len(away):
            return np.array(ends, dtype=np.int64)
        ends.append(low + index)
        at = float(away[index])
