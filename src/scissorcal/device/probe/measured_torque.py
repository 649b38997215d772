"""Gain and lag of the measured torque against the commanded one."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.probe.idle import correlation_time
from scissorcal.kernel import StateFlag
from scissorcal.recording.probe import Estimate

LAGS = np.linspace(0.0, 20e-3, 101)
HELD_S = 0.01
"""After the delay: five time constants of a motor of 2 ms."""
LEAST_HELD = 40


@dataclass(frozen=True)
class Follow:
    """How the measured torque follows the commanded one: gain and lag (s), the answer's tick in."""

    gain: Estimate
    lag_s: float
    constant: bool


def follow(parts: list[NDArray[np.void]], zero: float, late_s: float) -> Follow:
    """Compare the measured torque with the commanded one: gain where it is held, lag everywhere.

    The gain takes only states before which the command stood for HELD_S and the delay ``late_s``,
    so that no lag of the motor bends it.
    """
    measured = np.concatenate([part["motor_torque"] for part in parts]) - zero
    usable = np.isfinite(measured)
    constant = not usable.any() or float(np.ptp(measured[usable])) == 0.0
    costs = []
    for lag in LAGS:
        command = np.concatenate([_commanded(part, lag) for part in parts])[usable]
        power = max(float(command @ command), 1e-30)
        gain = float(command @ measured[usable]) / power
        costs.append(float(np.sum((measured[usable] - gain * command) ** 2)))
    held = np.concatenate([_held(part, HELD_S + late_s) for part in parts])
    command = np.concatenate([_commanded(part, 0.0) for part in parts])
    inside = usable & held & (command != 0.0)
    if np.count_nonzero(inside) < LEAST_HELD:
        return Follow(Estimate(math.nan, math.nan), float(LAGS[int(np.argmin(costs))]), constant)
    x, y = command[inside], measured[inside]
    gain = float(x @ y / (x @ x))
    rest = y - gain * x
    independent = max(4.0, len(rest) / (2.0 * correlation_time(rest)))
    sd = math.sqrt(float(rest @ rest) / independent / float(x @ x))
    return Follow(Estimate(gain, sd), float(LAGS[int(np.argmin(costs))]), constant)


def _commanded(part: NDArray[np.void], lag: float) -> Array:
    """The commanded torque ``lag`` (s) before each state, a line between the answers."""
    answered = part["answer_flags"] >= 0
    t = part["device_us"] * 1e-6
    command = np.interp(t - lag, t[answered], part["torque"][answered])
    return np.asarray(command, dtype=np.float64)


def _held(part: NDArray[np.void], held_s: float) -> NDArray[np.bool_]:
    """Where the motors were on and the command had stood for ``held_s``."""
    on = (part["flags"] & int(StateFlag.MOTOR_ENABLED)) != 0
    t = part["device_us"] * 1e-6
    answered = np.flatnonzero(part["answer_flags"] >= 0)  # of several at once only the newest is
    if len(answered) == 0:
        return np.zeros(len(t), dtype=bool)
    changes = answered[np.flatnonzero(np.diff(part["torque"][answered]) != 0.0) + 1]
    if len(changes) == 0:
        return np.asarray(on)
    before = np.searchsorted(changes, np.arange(len(t)), side="right") - 1
    since = np.where(before >= 0, t - t[changes[np.maximum(before, 0)]], np.inf)
    return np.asarray(on & (since > held_s))
