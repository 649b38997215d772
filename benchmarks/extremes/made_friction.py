"""Recordings of empty motion with known friction, and the damage that sensors and clocks do.

The motion is prescribed and the law is written out here: nothing is shared with the model that is
fitted.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.recording import SAMPLE_DTYPE, Recording, Stroke

TICK_S = 1e-3
LOW, HIGH = 0.2, 0.85
"""Ends of the sweeps, rad."""

SPEEDS = (0.1, 0.3, 0.8, 1.5)
"""Speeds of the sweeps, rad/s; each is driven in both directions, twice."""

RAMP = 0.15
"""Share of a sweep in which it speeds up, and again in which it slows down."""


@dataclass(frozen=True)
class MadeFriction:
    """True values of the law inertia a + sign(w) coulomb + viscous w, SI, and of the sensors.

    ``step`` is the encoder's resolution (rad), ``noise`` the sd of the torque sensor (N m).
    """

    inertia: float = 2e-4
    coulomb_pos: float = 0.013
    coulomb_neg: float = 0.016
    viscous: float = 0.002
    step: float = 5e-5
    noise: float = 1e-3


@dataclass(frozen=True)
class Motion:
    """Opening (rad), its rate and acceleration, and the stroke of each sample, all (n,)."""

    opening: Array
    rate: Array
    acceleration: Array
    stroke: NDArray[np.int64]
    strokes: tuple[Stroke, ...]


def sweeps(speeds: tuple[float, ...] = SPEEDS, repeats: int = 2) -> Motion:
    """Closing and opening sweeps between ``LOW`` and ``HIGH`` at each speed (rad/s)."""
    parts: list[tuple[Array, Array, Array]] = []
    strokes: list[Stroke] = []
    for speed in speeds * repeats:
        for begin, end in ((HIGH, LOW), (LOW, HIGH)):
            parts.append(_sweep(begin, end, speed))
            index = len(strokes)
            strokes.append(Stroke(index, "closing" if end < begin else "opening", speed))
    opening, rate, acceleration = (np.concatenate(column) for column in zip(*parts, strict=True))
    stroke = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
    return Motion(opening, rate, acceleration, stroke, tuple(strokes))


def record(motion: Motion, truth: MadeFriction, rng: np.random.Generator) -> Recording:
    """What sensors without damage record of a motion."""
    level = np.where(motion.rate > 0.0, truth.coulomb_pos, -truth.coulomb_neg)
    drive = truth.inertia * motion.acceleration + level + truth.viscous * motion.rate
    samples = np.zeros(len(drive), SAMPLE_DTYPE)
    samples["sequence"] = np.arange(len(drive))
    samples["device_time_us"] = np.rint(np.arange(len(drive)) * TICK_S * 1e6)
    samples["host_time_ns"] = samples["device_time_us"] * 1000
    samples["opening"] = np.round(motion.opening / truth.step) * truth.step
    samples["motor_torque"] = drive + truth.noise * rng.standard_normal(len(drive))
    samples["stroke"] = motion.stroke
    return Recording(kind="friction", samples=samples, strokes=motion.strokes, source="made.mcap")


def changed(recording: Recording, **columns: Array) -> Recording:
    """The recording with whole columns of its samples replaced."""
    samples = recording.samples.copy()
    for name, values in columns.items():
        samples[name] = values
    return replace(recording, samples=samples)


def _sweep(begin: float, end: float, speed: float) -> tuple[Array, Array, Array]:
    """Opening, rate and acceleration of one sweep; the rate rises and falls as a sine squared."""
    ramp_s = RAMP * abs(end - begin) / speed
    steady_s = abs(end - begin) / speed - ramp_s
    time = np.arange(round((steady_s + 2 * ramp_s) / TICK_S)) * TICK_S + 0.5 * TICK_S
    way = np.sign(end - begin) * speed
    here = np.clip(np.minimum(time, steady_s + 2 * ramp_s - time) / ramp_s, 0.0, 1.0)
    rate = way * np.sin(0.5 * np.pi * here) ** 2
    rising = np.where(time < ramp_s, 1.0, np.where(time > steady_s + ramp_s, -1.0, 0.0))
    acceleration = way * rising * 0.5 * np.pi / ramp_s * np.sin(np.pi * here)
    # of sin^2: its integral over a ramp, exactly
    risen = 0.5 * ramp_s * (here - np.sin(np.pi * here) / np.pi)
    late = time > steady_s + ramp_s
    fast = np.clip(time - ramp_s, 0.0, steady_s)
    travelled = np.where(late, 0.5 * ramp_s + steady_s + 0.5 * ramp_s - risen, risen + fast)
    return begin + way * travelled, rate, acceleration
