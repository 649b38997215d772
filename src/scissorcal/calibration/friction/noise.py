"""What the drive has beside the law: cogging and noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.moments import FIXED, MEASURED, StrokeMoments
from scissorcal.calibration.parameters import FittedParameter, in_words
from scissorcal.calibration.signals.segments import by_label, stretches
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


def cogging_notes(cogging: "Cogging", posterior: Posterior, joint: Joint) -> tuple[str, ...]:
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


FEWEST_PERIODS = 6
"""Periods within the recorded opening below which a ripple is the law's change with angle."""
MOST_PERIODS_PER_TURN = 5000.0
FALSE_ALARM = 1e-4
BACKGROUND = 40
"""Frequencies on either side, in units of the resolution, whose median is the background."""
MEDIAN_OF_EXPONENTIAL = float(np.log(2.0))
MARGIN = 3.0
"""Factor on the threshold for what is left of other structure: turns at equal places and counts
that beat with the ticks gave a line of up to 2.8 times the noise's threshold, by which two halves
agreed, in 5 of 475 simulated recordings without cogging."""
FINER = 8
SLOWEST = 0.1
STEADY = 0.7
"""Bins slower than this share of their stroke's speed are near a turn, which leaves marks at its
own place in the opening."""
NYQUIST = 0.45
"""Waves that pass in fewer bins than this allows would be mistaken for slow ones."""
FADE = 0.1
"""Share of the opening at either end over which residuals fade in."""
LEAST_HEARD = 1e-3
"""Share of the motion's weight below which a wave is not heard."""
LARGEST = 3.0
"""Residuals count up to so many robust standard deviations."""
CLASSES = 8
CANDIDATES = 5
NEIGHBOURS = 3.0
"""Lines that are tried, and the resolutions around one in which there is no other."""
SEEN = 3.0
"""Standard deviations of the noise that a wave must stand out by in each half."""
AGREEMENT = 0.5
"""Halves of the strokes whose waves differ by more than this share of their mean do not agree."""


@dataclass(frozen=True)
class Cogging:
    """The strongest line of the periodogram above its threshold; of all lines where none is.

    ``power`` is in units of the noise around it, whose mean is 1; ``threshold`` is what the largest
    of all frequencies exceeds by chance with a probability of ``FALSE_ALARM``.
    """

    periods_per_turn: float
    power: float
    threshold: float
    found: bool


NO_COGGING = Cogging(0.0, 0.0, np.inf, False)
"""Where none is looked for: a linear joint, or motion over too few periods."""


def find_cogging(moments: StrokeMoments) -> Cogging:
    """Search what a law's linear columns leave for a torque that is periodic in the opening.

    A periodogram over the opening, coherent over all strokes and both directions, weighed by what
    windows pass of a wave at each speed (Lomb 1976, doi:10.1007/BF00648343, for uneven places). The
    noise is not white in the opening: power is taken relative to the median of the frequencies
    around. Waves of fewer than six periods within the motion belong to the law's change with angle,
    those faster than windows pass at the slowest tenth of the motion are not looked for. Two halves
    of the strokes must agree on the wave, lest one stroke's event pass for one, and so must slow
    and fast strokes: an encoder's counts make waves with the ticks, and those move with the speed.
    """
    windows = moments.basis.windows
    opening, speed = windows.bins.opening, np.abs(windows.bins.rate)
    span = float(np.ptp(opening))
    knot_s = windows.tick_s * (len(windows.weights) // 3)
    slow = max(float(np.quantile(speed, SLOWEST)), 1e-12)
    least = 2.0 * np.pi * FEWEST_PERIODS / span
    most = min(2.0 * np.pi * 0.5 / (knot_s * slow), MOST_PERIODS_PER_TURN)
    resolution = 2.0 * np.pi / span
    if most < least + 4 * BACKGROUND * resolution:
        return NO_COGGING
    left = _steady(moments, _unexplained(moments))
    quarters = _quarters(moments)
    spectra = [_transform(windows, left, quarter, most, knot_s) for quarter in quarters]
    places = spectra[0][0]
    waves = np.sum([s[1] for s in spectra], axis=0)
    norms = np.sum([s[2] for s in spectra], axis=0)
    heard = norms > LEAST_HEARD * float(norms.max())
    power = np.where(heard, np.abs(waves) ** 2 / np.maximum(norms, 1e-300), 0.0)
    inside = np.flatnonzero((places >= least) & (places <= most) & heard)
    width = 2 * round(BACKGROUND * resolution / (places[1] - places[0])) + 1
    background = _background(power, width)
    relative = power[inside] / background[inside]
    count = (most - least) / resolution
    threshold = MARGIN * float(np.log(count / FALSE_ALARM))
    step = float(places[1] - places[0])

    def line(peak: int) -> Cogging:
        index = inside[peak]
        parts = [(s[1][index], s[2][index] / background[index]) for s in spectra]
        ways = ((0, 1, 2, 3), (0, 2, 1, 3))
        agree = all(_agree(parts[i], parts[j], parts[k], parts[n]) for i, j, k, n in ways)
        place = float(places[index] + step * _vertex(power[index - 1 : index + 2]))
        strong = bool(relative[peak] > threshold)
        return Cogging(place, float(relative[peak]), threshold, strong and agree)

    first = line(int(np.argmax(relative)))
    found = first
    for _ in range(CANDIDATES):
        if found.found or found.power < threshold:
            break
        relative[np.abs(places[inside] - found.periods_per_turn) < NEIGHBOURS * resolution] = 0.0
        found = line(int(np.argmax(relative)))
    return found if found.found else first


def _quarters(moments: StrokeMoments) -> list[NDArray[np.bool_]]:
    """Bins (n,) of slow and of fast strokes, every other one of each: slow, slow, fast, fast."""
    speed = np.abs(moments.basis.windows.bins.rate)
    usual = [float(np.median(speed[here])) for here in by_label(moments.strokes).values()]
    order = moments.labels[np.argsort(usual, kind="stable")]
    middle = len(order) // 2
    groups = (order[:middle:2], order[1:middle:2], order[middle::2], order[middle + 1 :: 2])
    return [np.isin(moments.strokes, group) for group in groups]


def _agree(*parts: tuple[complex, float]) -> bool:
    """Whether the waves of the first two quarters, and of the others, are one wave.

    Each is a sum and its norm over the noise, so that sum / norm has the variance 1 / norm.
    """
    halves = []
    for (one, first), (other, second) in (parts[:2], parts[2:]):
        norm = max(first + second, 1e-300)
        halves.append(((one + other) / norm, norm))
    (a, first), (b, second) = halves
    noise = np.sqrt(1.0 / first + 1.0 / second)
    seen = min(abs(a) * np.sqrt(first), abs(b) * np.sqrt(second)) > SEEN
    return bool(seen and abs(a - b) < AGREEMENT * abs(a + b) / 2.0 + SEEN * noise)


def _unexplained(moments: StrokeMoments) -> Array:
    """Residual (n,) of the columns that need no scale, each with its own factor."""
    products = moments.products(FIXED, FIXED).sum(axis=0)
    slope = moments.products(FIXED, MEASURED).sum(axis=0)[:, 0]
    size = np.sqrt(np.diag(products))
    used = np.flatnonzero(size > 0)
    inner = products[np.ix_(used, used)] / np.outer(size[used], size[used])
    solution = np.linalg.solve(inner + 1e-9 * np.eye(len(used)), slope[used] / size[used])
    return np.asarray(moments.measured - moments.basis.fixed[:, used] @ (solution / size[used]))


def _steady(moments: StrokeMoments, left: Array) -> Array:
    """Residuals (n,) of steady motion without outliers, faded at the ends, 0 elsewhere."""
    bins = moments.basis.windows.bins
    speed = np.abs(bins.rate)
    place = np.searchsorted(moments.labels, moments.strokes)
    usual = np.array([float(np.median(speed[at])) for at in by_label(moments.strokes).values()])
    steady = speed > STEADY * usual[place]
    size = float(np.median(np.abs(left[steady]))) / 0.6745 if np.any(steady) else 0.0
    low, span = float(bins.opening.min()), float(np.ptp(bins.opening))
    share = (bins.opening - low) / span
    fade = np.clip(np.minimum(share, 1.0 - share) / FADE, 0.0, 1.0)
    window = np.sin(0.5 * np.pi * fade) ** 2
    clipped = np.clip(left, -LARGEST * size, LARGEST * size)
    return np.asarray(np.where(steady, clipped * window, 0.0))


def _transform(
    windows: Windows, left: Array, chosen: NDArray[np.bool_], most: float, knot_s: float
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Frequencies, sums of residuals times waves as far as windows pass them, and their norms."""
    opening, speed = windows.bins.opening, np.abs(windows.bins.rate)
    low, span, bin_s = float(opening.min()), float(np.ptp(opening)), windows.bins.bin_s
    cell = 2.0 * np.pi / (8.0 * most)
    count = 1 << int(np.ceil(np.log2(FINER * span / cell)))
    places = 2.0 * np.pi * np.arange(count // 2 + 1) / (count * cell)
    waves: NDArray[Any] = np.zeros(len(places), dtype=np.complex128)
    norms = np.zeros(len(places))
    bounds = np.quantile(speed, np.linspace(0.0, 1.0, CLASSES + 1))
    group = np.clip(np.searchsorted(bounds, speed, side="right") - 1, 0, CLASSES - 1)
    index = np.floor((opening - low) / cell).astype(np.int64)
    for one in range(CLASSES):
        here = chosen & (group == one)
        if not np.any(here):
            continue
        sums = np.bincount(index[here], left[here], minlength=count)
        heard_Hz = places * float(np.mean(speed[here])) / (2.0 * np.pi)
        passed = np.where(heard_Hz * bin_s < NYQUIST, np.sinc(heard_Hz * knot_s) ** 3, 0.0)
        waves += passed * np.fft.rfft(sums[:count])
        norms += passed**2 * float(np.sum(left[here] ** 2))
    return places, waves * np.exp(-1j * places * low), norms


def _background(power: Array, width: int) -> Array:
    """Mean power (k,) of the noise around each frequency, from medians."""
    from scipy.ndimage import median_filter

    median = median_filter(power, size=width, mode="nearest")
    return np.asarray(np.maximum(median, 1e-300) / MEDIAN_OF_EXPONENTIAL)


def _vertex(three: Array) -> float:
    """Place of the vertex of a parabola through three even points, in steps from the middle."""
    bend = three[0] - 2.0 * three[1] + three[2]
    return float(np.clip(0.5 * (three[0] - three[2]) / bend, -0.5, 0.5)) if bend < 0 else 0.0
