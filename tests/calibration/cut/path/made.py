"""Recordings of a known motion against a known torque: the drive that it takes, exactly."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.recording import SAMPLE_DTYPE, Recording, Stroke

RATE_HZ = 1000
INERTIA = 2e-4
COULOMB = 0.014


@dataclass(frozen=True)
class Made:
    """A recording with the truth behind it, (n,) each."""

    recording: Recording
    opening: Array
    rate: Array


def swing(
    seconds: float = 8.0, low: float = 0.25, high: float = 0.8, beats_Hz: float = 0.4
) -> Array:
    """An opening that swings, with a faster ripple so that no speed is constant."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    way = 0.5 * (1.0 + np.cos(2 * np.pi * beats_Hz * t))
    return low + (high - low) * way + 2e-3 * np.sin(2 * np.pi * 7.0 * t)


def record(
    opening: Array,
    material: Callable[[Array], Array],
    *,
    step_rad: float = 1e-6,
    noise: Callable[[int], Array] | None = None,
    late_ticks: float = 0.0,
    stroke: NDArray[np.int64] | None = None,
    strokes: tuple[Stroke, ...] = (),
    advance: Array | None = None,
    inertia: float = INERTIA,
    coulomb: float = COULOMB,
) -> Made:
    """Record an opening (n,) against ``material``, torque (n,) from the opening (n,), in N m.

    The drive is what inertia, Coulomb friction and the material ask for at each tick, measured
    ``late_ticks`` late; the encoder has steps of ``step_rad``.
    """
    rate = np.gradient(opening) * RATE_HZ
    drive = inertia * np.gradient(rate) * RATE_HZ + coulomb * np.sign(rate) - material(opening)
    ticks = np.arange(len(opening))
    drive = np.interp(ticks - late_ticks, ticks, drive)
    if noise is not None:
        drive = drive + noise(len(opening))
    samples = np.zeros(len(opening), SAMPLE_DTYPE)
    samples["sequence"] = ticks
    samples["device_time_us"] = ticks * (1_000_000 // RATE_HZ)
    samples["host_time_ns"] = samples["device_time_us"] * 1000
    samples["opening"] = np.round(opening / step_rad) * step_rad
    samples["advance"] = 0.0 if advance is None else advance
    samples["motor_torque"] = drive
    samples["stroke"] = -1 if stroke is None else stroke
    return Made(
        Recording(
            kind="cut", samples=samples, strokes=strokes, source="made.mcap", content_hash="made"
        ),
        opening,
        rate,
    )
