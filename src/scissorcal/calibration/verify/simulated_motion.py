"""Motion of a recording and the drive that it takes, for simulation."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.cut.path_motion import PathMotion, path_motion
from scissorcal.calibration.cut.path_work import built_friction, built_up
from scissorcal.calibration.signals.filtering import SMOOTH
from scissorcal.calibration.signals.segments import bridge
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.signals.weak_form import HELD
from scissorcal.model import FrictionLaw
from scissorcal.recording.recording import Recording
from scissorcal.recording.resolution import resolution_of

MOVED_HZ = 15.0
"""Motion up to here is kept however coarse an encoder is: excitations of the inertia end here."""
HALF_SD = 0.1325
"""Standard deviation of a Gaussian times the frequency at which it passes 1 / sqrt(2)."""
CARRIAGE_SD = 10.0


@dataclass(frozen=True)
class SmoothPiece:
    """A stretch of a recording without a gap; arrays (n,) by sample from ``start`` on.

    ``opening`` (rad) and ``advance`` (m) are without steps, ``load`` (N m) is what a hand takes,
    ``stroke`` numbers movements, the rest after one counted to it; ``sheet`` is -1 for none.
    ``error`` (rad) is that of the opening, ``held`` says that commands held the drive from one
    sample to the next.
    """

    start: int
    opening: Array
    advance: Array
    load: Array
    stroke: Integers
    sheet: Integers
    tick_s: float
    error: float
    held: bool


@dataclass(frozen=True)
class Motion:
    """A recording to be simulated: its pieces, and its channels' resolutions (NaN for none).

    Short gaps of ``recording`` are bridged; ``recorded`` (m,) are the samples that it had before.
    """

    recording: Recording
    recorded: Mask
    pieces: tuple[SmoothPiece, ...]
    opening_step: float
    advance_step: float
    torque_step: float

    def with_drive(self, drives: Sequence[Array], rng: np.random.Generator) -> Recording:
        """The recording with the same motion, quantised again, and with other drives.

        ``drives`` are by piece and sample (N m): motor less handle. The handle's force, labels and
        time stamps are kept, and so are gaps; samples outside the pieces stay as they were. The
        encoders' steps lie elsewhere each time: rounded at the same places, every simulation of
        one motion would have the same errors of position.
        """
        samples = self.recording.samples.copy()
        radius = self.recording.handle_radius_m
        hand = 0.0 if np.isnan(radius) else radius * np.asarray(samples["handle_force"])
        motor = np.asarray(samples["motor_torque"], dtype=np.float64).copy()
        at = dict(zip(("opening", "advance"), rng.random(2).tolist(), strict=True))
        for piece, drive in zip(self.pieces, drives, strict=True):
            span = slice(piece.start, piece.start + len(piece.opening))
            for name, path, step in (
                ("opening", piece.opening, self.opening_step),
                ("advance", piece.advance, self.advance_step),
            ):
                first = float(samples[name][piece.start]) + at[name] * step
                samples[name][span] = _stepped(path, first, step)
            added = hand if np.ndim(hand) == 0 else np.asarray(hand)[span]
            motor[span] = _stepped(drive + added, 0.0, self.torque_step)
        samples["motor_torque"] = motor
        return replace(self.recording, samples=samples[self.recorded])


def motion_of(
    recordings: tuple[Recording, ...], inertia: float, unseen_Nm: float
) -> tuple[Motion, ...]:
    """The smooth motion of recordings, as :func:`~.cut.path_motion.path_motion` finds it.

    ``inertia`` (kg m^2) is used to smooth the path. The most probable path keeps errors of the
    encoder's size, step / sqrt(12). Their accelerations times the inertia would be a torque that
    every simulation repeats and no encoder shows, so motion is kept up to the frequency at which
    that torque is as large as a noise of ``unseen_Nm`` (N m) a sample: it grows with the
    frequency's square.
    """
    bridged = [
        bridge(recording, np.ones(len(recording.samples), dtype=bool)) for recording in recordings
    ]
    filled = tuple(one.recording for one in bridged)
    found: dict[int, list[SmoothPiece]] = {index: [] for index in range(len(recordings))}
    for motion in path_motion(recordings, inertia):  # of filled ones, steps would seem finer
        shown = unseen_Nm * np.sqrt(12.0) / (inertia * motion.resolution)
        kept_Hz = max(float(np.sqrt(shown)) / (2.0 * np.pi), MOVED_HZ)
        smoothing = HALF_SD / kept_Hz / motion.tick_s
        start = int(np.searchsorted(bridged[motion.recording].source, motion.source[0]))
        found[motion.recording].append(_piece(motion, start, filled[motion.recording], smoothing))
    return tuple(
        Motion(
            one.recording,
            one.recorded,
            tuple(found[index]),
            _step(recordings[index], "opening"),
            _step(recordings[index], "advance"),
            _step(recordings[index], "motor_torque"),
        )
        for index, one in enumerate(bridged)
    )


def _piece(motion: PathMotion, start: int, recording: Recording, smoothing: float) -> SmoothPiece:
    span = slice(start, start + len(motion.opening))
    load = np.zeros(len(motion.opening))
    if not np.isnan(recording.handle_radius_m):
        force = np.asarray(recording.samples["handle_force"][span], dtype=np.float64)
        load = recording.handle_radius_m * force
    return SmoothPiece(
        start=start,
        opening=_smoothed(motion.opening, smoothing),
        advance=_smoothed(motion.advance, CARRIAGE_SD),
        load=load,
        stroke=_held(motion.stroke),
        sheet=motion.sheet,
        tick_s=motion.tick_s,
        held=bool(np.ptp(recording.samples["torque_command"][span]) > 0),
        error=float(np.median(motion.opening_sd)),
    )


def _smoothed(values: Array, sd: float) -> Array:
    """A path (n,) smoothed by a Gaussian of ``sd`` samples; its ends are continued by "
    "reflection."""
    from scipy.ndimage import gaussian_filter1d

    reach = min(int(4 * sd), len(values) - 1)
    before = 2.0 * values[0] - values[reach:0:-1]
    after = 2.0 * values[-1] - values[-2 : -reach - 2 : -1]
    wider = np.concatenate([before, values, after])
    return np.asarray(gaussian_filter1d(wider, sd)[reach : reach + len(values)])


def _held(stroke: Integers) -> Integers:
    """Labels (n,) that last until the next movement; 0 for none before, others from 1 on."""
    last = np.maximum.accumulate(np.where(stroke >= 0, np.arange(len(stroke)), -1))
    return np.where(last >= 0, stroke[np.maximum(last, 0)] + 1, 0)


def _step(recording: Recording, name: str) -> float:
    values = np.asarray(recording.samples[name], dtype=np.float64)
    return resolution_of(values) if np.ptp(values) > 0 else float("nan")


def _stepped(values: Array, origin: float, step: float) -> Array:
    if not np.isfinite(step):
        return values
    return np.asarray(origin + step * np.round((values - origin) / step))


@dataclass(frozen=True)
class DriveTruth:
    """A rig without its material.

    ``friction`` and ``offset`` (N m) are what the drive must overcome, ``cogging`` is (cosine,
    sine, periods per turn) of what it gives besides. ``load_share`` of the material's torque is
    added to friction. ``closing_offset`` and ``opening_offset`` (N m) are added to the
    material's torque by direction, ``stroke_sd`` (N m) is what single strokes differ by.
    ``delay_s`` is the delay of the torque measurement, ``noise`` that of each sample, ``fine_rad``
    the length over which friction builds up where its law lets it jump.
    """

    inertia: float
    friction: FrictionLaw
    noise: TorqueNoise
    offset: float = 0.0
    cogging: tuple[float, float, float] = (0.0, 0.0, 0.0)
    load_share: float = 0.0
    closing_offset: float = 0.0
    opening_offset: float = 0.0
    stroke_sd: float = 0.0
    delay_s: float = 0.0
    fine_rad: float = 0.0


def measured_drive(
    piece: SmoothPiece, truth: DriveTruth, material: Array, rng: np.random.Generator
) -> Array:
    """Drive (n,) measured at the samples of a piece, which moves as it did.

    ``material`` (n - 1,) is the material's mean torque over each tick, positive as it opens. The
    drive is taken as linear between samples, such that

        inertia * acceleration = drive - friction - offset - cogging + material

    holds exactly for means around each sample, as the second difference of the positions weighs
    them; a sample shows it a delay later. Dry friction builds up over the path's error at least,
    whose tremor would make it jump while the joint rests.
    """
    path, tick_s = piece.opening, piece.tick_s
    step = np.diff(path)
    middle = 0.5 * (path[1:] + path[:-1])
    law = truth.friction
    sense = np.sign(step)
    direction = built_up(path, sense, law, max(truth.fine_rad, piece.error))
    load = 0.5 * (piece.load[1:] + piece.load[:-1])
    dry = built_friction(law, middle, step / tick_s, load, direction)
    cosine, sine, number = truth.cogging
    drive = dry + truth.offset
    drive += cosine * np.cos(number * middle) + sine * np.sin(number * middle)
    drive -= material - truth.load_share * np.abs(material) * direction
    closing = 0.5 * (1.0 - sense)
    drive -= closing * truth.closing_offset + (1.0 - closing) * truth.opening_offset
    drive += _by_stroke(piece, truth.stroke_sd, rng)[:-1]
    around = _around(drive)
    around[1:-1] += truth.inertia * np.diff(piece.opening, 2) / tick_s**2
    nodes = _nodes(around, HELD if piece.held else SMOOTH)
    late = truth.delay_s / tick_s
    shown = (1.0 - late) * nodes + late * np.append(nodes[0], nodes[:-1])
    return np.asarray(shown + drawn_noise(truth.noise, len(path), tick_s, rng))


def drawn_noise(noise: TorqueNoise, count: int, tick_s: float, rng: np.random.Generator) -> Array:
    """Noise (count,): a white and an exponentially correlated part."""
    from scipy.signal import lfilter

    white = noise.white_Nm * rng.standard_normal(count)
    keep = float(np.exp(-tick_s / noise.slow_time_s))
    kicks = rng.standard_normal(count)
    kicks[1:] *= np.sqrt(1.0 - keep**2)
    return np.asarray(white + noise.slow_Nm * lfilter([1.0], [1.0, -keep], kicks))


def _around(by_tick: Array) -> Array:
    """Means (n,) around each sample of what is known by tick (n - 1,)."""
    return np.asarray(0.5 * (np.append(by_tick[0], by_tick) + np.append(by_tick, by_tick[-1])))


def _nodes(around: Array, neighbour: float) -> Array:
    """Samples (n,) of which neighbours weigh so much in the means ``around`` (n,) each."""
    from scipy.linalg import solveh_banded

    band = np.full((2, len(around)), neighbour)
    band[1] = 1.0 - 2.0 * neighbour
    band[1, [0, -1]] = 1.0 - neighbour
    return np.asarray(solveh_banded(band, around))


def _by_stroke(piece: SmoothPiece, sd: float, rng: np.random.Generator) -> Array:
    offsets = sd * rng.standard_normal(int(piece.stroke.max(initial=0)) + 1)
    return np.asarray(offsets[piece.stroke])
