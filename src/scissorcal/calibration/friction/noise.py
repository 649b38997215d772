"""Residuals of a fitted friction law: noise by sample, offsets by stroke."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.friction.cogging import Cogging
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.result import FittedParameter, in_words
from scissorcal.calibration.signals.segments import stretches
from scissorcal.calibration.signals.torque_noise import TorqueNoise, torque_noise
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.inference import Posterior
from scissorcal.kernel import presliding_path
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.recording.recording import Joint

FLOOR_SDS = 3.0
"""Standard deviations of the rate's noise that the rate floor stands for."""


def sample_noise(
    law: FrictionExperiment, point: Array, idle_white: float = 0.0
) -> TorqueNoise | None:
    """Noise of the drive at its samples, from what a law leaves of steady motion at ``point`` (p,).

    The law is evaluated at every sample that a moving window holds; where too little is left, the
    noise is None. ``idle_white`` is the white noise that the sensors show at rest.
    """
    windows = law.windows
    values = law.layout.natural(point)
    friction = FrictionLaw.of_fit(values, float(law.key["angle_center"]))
    state = None
    if "presliding_length" in values:
        length = float(values["presliding_length"])
        ends = [*windows.starts[1:].tolist(), len(windows.opening)]
        pieces = zip(windows.starts.tolist(), ends, strict=True)
        state = np.concatenate([presliding_path(windows.opening[a:b], length) for a, b in pieces])
    load = 0.0 if windows.load is None else windows.load
    expected = friction_torque(friction, windows.opening, windows.rate, load, state)
    expected = expected + float(values.get("offset", np.asarray(0.0)))
    periods = float(law.key.get("cogging_periods_per_turn", 0.0))
    if periods:
        phase = periods * windows.opening
        expected = expected + values["cogging_cos"] * np.cos(phase)
        expected = expected + values["cogging_sin"] * np.sin(phase)
    late = float(values.get("delay", np.asarray(0.0)))
    ahead = late / windows.tick_s + (0.5 if windows.held else 0.0)
    drive = windows.drive + ahead * np.diff(windows.drive, append=windows.drive[-1])
    left, momentum = drive - expected, float(values["inertia"]) * windows.rate
    low, high = _moving(windows)
    pairs = list(zip(low.tolist(), high.tolist(), strict=True))
    return torque_noise(
        tuple(left[a:b] for a, b in pairs),
        windows.tick_s,
        tuple(momentum[a:b] for a, b in pairs),
        float(values["inertia"]) * windows.bins.rate_floor / FLOOR_SDS,
        idle_white,
    )


def stroke_offsets(
    residuals: Array, strokes: NDArray[np.int64], windows: Windows, noise: TorqueNoise | None
) -> float:
    """Scatter of strokes' mean residuals beyond what the noise explains, as a standard deviation.

    ``residuals`` and ``strokes`` (n,) are by bin of ``windows``. The variance that the noise gives
    a stroke's mean is taken off each square; what is left is never below zero. NaN where the noise
    is not known, or there are fewer than three strokes.
    """
    labels, place, counts = np.unique(strokes, return_inverse=True, return_counts=True)
    if noise is None or len(labels) < 3:
        return float("nan")
    means = np.bincount(place, residuals) / counts
    tick_s = windows.tick_s
    ticks = np.maximum(np.round(counts * windows.bins.bin_s / tick_s).astype(int), 1)
    explained = np.array([noise.variance_of_mean(int(n), tick_s) for n in ticks])
    if not np.all(explained > 0.0):  # without noise, all scatter of the means is the strokes'
        return float(np.sqrt(np.mean(means**2)))
    weights = 1.0 / explained
    excess = (weights @ (means**2 - explained)) / weights.sum()
    return float(np.sqrt(max(excess, 0.0)))


def noise_diagnostics(noise: TorqueNoise | None) -> dict[str, Any]:
    """The noise under the names that a cut's fit reads; empty where it is not known."""
    if noise is None:
        return {}
    return {
        "noise_white_Nm": noise.white_Nm,
        "noise_white_error_Nm": noise.white_error_Nm,
        "noise_slow_Nm": noise.slow_Nm,
        "noise_slow_error_Nm": noise.slow_error_Nm,
        "noise_slow_time_s": noise.slow_time_s,
        "noise_slow_time_error_s": noise.slow_time_error_s,
    }


def cogging_notes(cogging: Cogging, posterior: Posterior, joint: Joint) -> tuple[str, ...]:
    """A note on cogging, if any was found."""
    if not cogging.found:
        return ()
    columns = [posterior.names.index(f"cogging_{wave}") for wave in ("cos", "sin")]
    size = np.hypot(*posterior.draws[:, columns].T)
    return (
        f"Cogging of {in_words(**FittedParameter.summary_of(size))} {joint.effort_unit} repeats "
        f"{cogging.periods_per_turn:.1f} times a turn of the opening (power {cogging.power:.0f} "
        f"times the noise, limit {cogging.threshold:.0f}). The fit removes it; it belongs to the "
        "rig, so packages do not render it.",
    )


def _moving(windows: Windows) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Bounds of the stretches of samples that moving windows hold, none across a gap or a turn."""
    held = np.zeros(len(windows.opening), dtype=bool)
    width = max(1, round(windows.bins.bin_s / windows.tick_s))
    begin = windows.first + (len(windows.weights) - width) // 2
    held[(begin[:, None] + np.arange(width)).ravel()] = True
    held[windows.starts[1:]] = False
    held[1:] &= np.sign(windows.rate[1:]) == np.sign(windows.rate[:-1])
    return stretches(held)
