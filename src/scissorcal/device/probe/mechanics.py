"""Inertia, friction and delay from small swings; gain and lag of the measured torque.

Both are linear regressions at a given delay, and the delay is found by trying many. While the
blades move one way, m theta'' = u(t - d) - c - b theta' integrates twice to

    theta = theta_0 + w_0 t + (1/m) I[u](t - d) - (c/m) t^2 / 2 - (b/m) J[theta - theta_0]

whose right side is linear in theta_0, w_0 (per swing), 1/m, c/m (per direction) and b/m, with J the
integral and I the twofold integral of the steps that the commands are. The opening is not
differentiated, so its noise is the encoder's alone. Errors are those of a jackknife over swings,
which also sees what the law leaves out, where they exceed the regression's.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.probe.idle import correlation_time
from scissorcal.kernel import StateFlag
from scissorcal.recording.probe import Estimate

Array = NDArray[np.float64]

DELAYS = np.linspace(-2e-3, 20e-3, 56)
"""Delays that are tried (s). Beyond 20 ms the watchdog of a device brakes; below 0 as a device may
measure late in its tick."""
MOTOR_LAGS = np.array([0.0, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3])
"""Time constants of the motor that are tried (s). The delay stated is that of the best, plus the
delay that goes with it."""
LAGS = np.linspace(0.0, 20e-3, 101)
HELD_S = 0.01
LEAST_HELD = 40
LEAST_SAMPLES = 6
LEAST_SWINGS = 3
VISCOUS_SD = 0.01
"""Prior sd of the viscous friction (N m s/rad): five times that of the scissors we know. The small
swings hardly show it, and without a prior it would trade against dry friction."""


@dataclass(frozen=True)
class LeftOut:
    """Standard deviations of what the law leaves out: friction that falls with speed or follows
    the opening, and cogging; and of what short swings of light blades confuse (lag and inertia).
    """

    inertia: float
    dry: float
    viscous: float
    delay_s: float


LEFT_OUT = LeftOut(inertia=0.025, dry=0.02, viscous=1e-3, delay_s=1e-4)
"""Shares of inertia and dry friction; N m s/rad; s. Errors on 20 virtual rigs with all of these:
+0.5 +- 0.9 % of the inertia, +0.3 +- 1.6 % of dry friction, 0.01 +- 0.03 ms of delay. On 16 rigs of
another construction: inertia within 1 % in 14 and 5 % in the worst (1e-4 kg m^2 behind a motor of
2 ms), viscous friction within 0.9 mN m s/rad, delay within 0.24 ms."""


@dataclass(frozen=True)
class Swing:
    """The part of a pulse in which the blades move one way.

    ``t`` (s, by the device's clock from the pulse's begin) and ``opening`` (rad) of the states of
    this part; ``at`` and ``torque`` of all answers of the pulse: when the state was measured that
    each of them answers, and what it commands (N m). ``way`` is 1 or -1.
    """

    t: Array
    opening: Array
    at: Array
    torque: Array
    way: int


@dataclass(frozen=True)
class Mechanics:
    """Inertia (kg m^2), dry friction (N m, mean and each way), viscous friction, delay (s)."""

    inertia: Estimate
    coulomb: Estimate
    coulomb_opening: float
    coulomb_closing: float
    viscous: Estimate
    delay: Estimate
    residual_rad: float


@dataclass(frozen=True)
class Follow:
    """How the measured torque follows the commanded one: gain and lag (s), the answer's tick in."""

    gain: Estimate
    lag_s: float
    constant: bool


def swing_of(heard: NDArray[np.void], moved: float) -> Swing | None:
    """Find where the blades move in a pulse; None where that is too short."""
    t = (heard["device_us"] - heard["device_us"][0]) * 1e-6
    opening = heard["opening"]
    start, end = opening[0], opening[-1]
    way = 1 if end > start else -1
    gone = way * (opening - start)
    inside = np.flatnonzero((gone > 0.5 * moved) & (gone < abs(end - start) - 0.5 * moved))
    if len(inside) < LEAST_SAMPLES:
        return None
    part = slice(int(inside[0]), int(inside[-1]) + 1)
    answered = heard["answer_flags"] >= 0
    return Swing(t[part], opening[part], t[answered], heard["torque"][answered], way)


def mechanics(swings: list[Swing], noise_rad: float) -> Mechanics | None:
    """Fit all swings together; None where they are too few or fit no positive inertia."""
    if len(swings) < LEAST_SWINGS or len({swing.way for swing in swings}) < 2:
        return None
    pushed = [(swing, _twofold(swing)) for swing in swings]
    whole = _Regression(pushed, noise_rad, MOTOR_LAGS)
    values = whole.physical
    if values is None:
        return None
    best = whole.lag_index
    slices = [(swing, push[:, best : best + 1]) for swing, push in pushed]
    without = [[one for one in slices if one is not out] for out in slices]
    left = [
        _Regression(some, noise_rad, MOTOR_LAGS[best : best + 1])
        for some in without
        if len(some) >= 2
    ]
    kept = np.array([(*one.physical, one.delay) for one in left if one.physical is not None])
    if len(kept) < LEAST_SWINGS:
        return None
    n = len(kept)
    jackknife = np.sqrt((n - 1) / n * ((kept - kept.mean(axis=0)) ** 2).sum(axis=0))
    sd = np.maximum(jackknife, np.append(whole.physical_sd(), whole.delay_sd))
    inertia, opening, closing, viscous = (float(value) for value in values)
    dry_share = LEFT_OUT.dry * 0.5 * (opening + closing)
    dry = Estimate(0.5 * (opening + closing), math.hypot(sd[1] / 2, sd[2] / 2, dry_share))
    return Mechanics(
        Estimate(inertia, math.hypot(sd[0], LEFT_OUT.inertia * inertia)),
        dry,
        opening,
        closing,
        Estimate(viscous, math.hypot(sd[3], LEFT_OUT.viscous)),
        Estimate(whole.delay, math.hypot(sd[4], LEFT_OUT.delay_s)),
        math.sqrt(whole.variance),
    )


def follow(parts: list[NDArray[np.void]], zero: float) -> Follow:
    """Compare the measured torque with the commanded one: gain where it is held, lag everywhere.

    The gain takes only states before which the command stood for 10 ms, so that no lag of the motor
    bends it.
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
    held = np.concatenate([_held(part) for part in parts])
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


class _Regression:
    """The linear fit at each of many delays and lags, and its solution at the best ones.

    Each swing comes with the twofold integrals of its torque (`_twofold`). Only one column depends
    on delay and lag, so the rest is projected out once.
    """

    def __init__(self, swings: list[tuple[Swing, Array]], noise_rad: float, lags: Array) -> None:
        count = len(swings)
        rows, right, pushes = [], [], []
        for index, (swing, push) in enumerate(swings):
            t = swing.t - swing.t[0]
            row = np.zeros((len(t), 3 + 2 * count))
            row[:, 0 if swing.way > 0 else 1] = -0.5 * swing.way * t**2
            row[:, 2] = -_integral(t, swing.opening - swing.opening[0])
            row[:, 3 + 2 * index] = 1.0
            row[:, 4 + 2 * index] = t
            rows.append(row)
            right.append(swing.opening - swing.opening[0])
            pushes.append(push)
        others, target = np.vstack(rows), np.concatenate(right)
        every = np.concatenate(pushes)
        tried = every.reshape(len(every), -1)
        costs, over = _costs(np.delete(others, 2, axis=1), target, tried)
        prior = np.zeros((1, others.shape[1]))
        prior[0, 2] = noise_rad / max(VISCOUS_SD * abs(over[int(np.argmin(costs))]), 1e-9)
        others = np.vstack([others, prior])
        target = np.append(target, 0.0)
        every = np.concatenate([every, np.zeros((1, *every.shape[1:]))])
        costs, _ = _costs(others, target, every.reshape(len(every), -1))
        lag = int(np.argmin(costs)) // len(DELAYS)
        self.lag_index = lag
        pushed = every[:, lag]
        delay, bend = _least(costs.reshape(len(lags), -1)[lag])
        at = np.array([np.interp(delay, DELAYS, line) for line in pushed])
        matrix = np.column_stack([at, others])
        self._solution, self._inverse = _solve(matrix, target)
        if self._solution[3] < 0.0:  # dry friction that falls with speed; no damping is negative
            matrix[:, 3] = 0.0
            delay, bend = _least(_costs(np.delete(others, 2, axis=1), target, pushed)[0])
            matrix[:, 0] = [np.interp(delay, DELAYS, line) for line in pushed]
            self._solution, _ = _solve(matrix, target)
            self._solution[3] = 0.0
        rest = target - matrix @ self._solution
        freedom = max(1, len(target) - matrix.shape[1] - 1)
        self.variance = max(float(rest @ rest) / freedom, noise_rad**2)
        self.delay = delay + float(lags[lag])
        self.delay_sd = math.sqrt(2.0 * self.variance / bend)
        over = self._solution[0]
        self.physical = None
        if over > 0.0:
            self.physical = np.array([1.0, *self._solution[1:4]]) / over

    def physical_sd(self) -> Array:
        """Standard deviations of inertia, dry friction each way, viscous, to first order."""
        covariance = self.variance * self._inverse[:4, :4]
        over = self._solution[0]
        jacobian = np.diag([-1.0 / over**2, 1.0 / over, 1.0 / over, 1.0 / over])
        jacobian[1:, 0] = -self._solution[1:4] / over**2
        return np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))


def _costs(others: Array, target: Array, pushed: Array) -> tuple[Array, Array]:
    """Sum of squares and coefficient of the delayed column, for each delay."""
    scale = np.maximum(np.sqrt((others**2).sum(axis=0)), 1e-300)
    q, _ = np.linalg.qr(others / scale)
    left = target - q @ (q.T @ target)
    seen = pushed - q @ (q.T @ pushed)
    power = np.maximum((seen**2).sum(axis=0), 1e-300)
    along = seen.T @ left
    return float(left @ left) - along**2 / power, along / power


def _twofold(swing: Swing) -> Array:
    """Twofold integral of the torque from the swing's begin: (times, MOTOR_LAGS, DELAYS).

    A step of the command at time 0 acts as 1 - exp(-s / lag), whose twofold integral is
    F(s) = s^2 / 2 - lag s + lag^2 (1 - exp(-s / lag)); what it did before the begin is taken off.
    """
    steps = np.diff(swing.torque, prepend=0.0)
    changes = steps != 0.0
    begun = swing.at[changes, None] + DELAYS[None, :]
    before = np.maximum(swing.t[0] - begun, 0.0)
    since = np.maximum(swing.t[:, None, None] - begun[None, :, :], before)
    found = [
        np.einsum("tad,a->td", _grown(since, before, float(lag)), steps[changes])
        for lag in MOTOR_LAGS
    ]
    return np.asarray(np.stack(found, axis=1), dtype=np.float64)


def _grown(since: Array, before: Array, lag: float) -> Array:
    """F(since) less its tangent at ``before``."""
    if lag == 0.0:
        return np.asarray(0.5 * (since - before) ** 2)
    fading = np.exp(-before / lag)
    rest = fading * (1.0 - (since - before) / lag) - np.exp(-since / lag)
    return np.asarray(0.5 * (since - before) ** 2 + lag**2 * rest)


def _least(costs: Array) -> tuple[float, float]:
    """Where the cost is least, by a parabola through its neighbours, and its second derivative."""
    best = min(max(int(np.argmin(costs)), 1), len(DELAYS) - 2)
    before, at, after = costs[best - 1 : best + 2]
    step = float(DELAYS[1] - DELAYS[0])
    bend = max(float(before - 2.0 * at + after), 1e-300) / step**2
    shift = 0.5 * float(before - after) / (bend * step)
    return float(DELAYS[best]) + min(max(shift, -step), step), bend


def _commanded(part: NDArray[np.void], lag: float) -> Array:
    """The commanded torque ``lag`` (s) before each state, a line between the answers."""
    answered = part["answer_flags"] >= 0
    t = part["device_us"] * 1e-6
    command = np.interp(t - lag, t[answered], part["torque"][answered])
    return np.asarray(command, dtype=np.float64)


def _held(part: NDArray[np.void]) -> NDArray[np.bool_]:
    """Where the motors were on and the command had stood for HELD_S."""
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
    return np.asarray(on & (since > HELD_S))


def _integral(t: Array, values: Array) -> Array:
    """Integral from the first time on, by trapezia."""
    pieces = 0.5 * (values[1:] + values[:-1]) * np.diff(t)
    return np.concatenate([[0.0], np.cumsum(pieces)])


def _solve(matrix: Array, target: Array) -> tuple[Array, Array]:
    """Least squares with scaled columns; the solution and the inverse of the normal matrix."""
    scale = np.sqrt((matrix**2).sum(axis=0))
    scale[scale == 0.0] = 1.0
    scaled = matrix / scale
    inverse = np.linalg.pinv(scaled.T @ scaled, hermitian=True)
    solution = inverse @ (scaled.T @ target)
    return solution / scale, inverse / np.outer(scale, scale)
