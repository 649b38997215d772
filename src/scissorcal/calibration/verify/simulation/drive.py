"""The drive torque that a rig with known parameters would have measured along a motion."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.path import built_friction, built_up
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.calibration.signals.weak_form import HELD
from scissorcal.calibration.signals.window_length import SMOOTH
from scissorcal.calibration.verify.simulation.motion import SmoothPiece
from scissorcal.model import FrictionLaw


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
