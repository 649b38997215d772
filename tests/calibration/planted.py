"""What a day's rig has beside its friction, planted into raw samples; nothing of the critic's."""

import dataclasses

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recording import Recording

FRICTION_Nm = 0.016
SMOOTH = 15
SOFT = 0.01


def planted(recording: Recording, what: str, rng: np.random.Generator) -> Recording:
    """A recording with one thing planted: torque that the motor bore besides, or a reading's error.

    ``drift``: friction that rises by 30 % over the recording. ``ripple``: 1.2 mN m, twice over the
    range. ``eccentricity``: the opening is misread by 2 mrad, four times over the range. ``second
    minimum``: friction falls by 4 mN m around 0.3 rad/s. ``hysteresis``: a quarter of friction
    builds up over 0.15 rad.
    """
    samples = recording.samples.copy()
    opening = np.asarray(samples["opening"], dtype=np.float64)
    second = np.asarray(samples["device_time_us"], dtype=np.float64) * 1e-6
    share = (second - second[0]) / (second[-1] - second[0])
    rate = np.convolve(np.gradient(opening) / 1e-3, np.full(SMOOTH, 1.0 / SMOOTH), "same")
    way = np.tanh(rate / SOFT)
    low, high = float(opening.min()), float(opening.max())
    place, phase = 2.0 * np.pi * (opening - low) / (high - low), rng.uniform(0.0, 2.0 * np.pi)
    if what == "drift":
        samples["motor_torque"] += 0.3 * FRICTION_Nm * (share - 0.5) * way
    elif what == "ripple":
        samples["motor_torque"] += 1.2e-3 * np.sin(2.0 * place + phase)
    elif what == "eccentricity":
        samples["opening"] = opening + 2e-3 * np.sin(4.0 * place + phase)
    elif what == "second minimum":
        speed = np.log(np.maximum(np.abs(rate), 1e-3) / 0.3)
        samples["motor_torque"] -= 4e-3 * np.exp(-((speed / 0.4) ** 2)) * way
    elif what == "hysteresis":
        samples["motor_torque"] += 0.25 * FRICTION_Nm * _built_up(opening, 0.15)
    else:
        raise ValueError(what)
    return dataclasses.replace(recording, samples=samples)


def _built_up(opening: Array, length: float) -> Array:
    """Dahl's state along a path, step by step."""
    state, found = 0.0, np.zeros(len(opening))
    for index, step in enumerate(np.diff(opening, prepend=opening[0]).tolist()):
        state += (np.sign(step) - state) * min(1.0, abs(step) / length)
        found[index] = state
    return found
