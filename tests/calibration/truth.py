"""Truth for recovery tests: prescribed motion through exact laws, written apart from the package.

Everything here is scalar and brute-force on purpose: heights by bisection, the crack by small
steps, so that nothing is shared with what is under test.
"""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.recording import SAMPLE_DTYPE, Recording, Stroke

RATE_HZ = 1000


@dataclass(frozen=True)
class Truth:
    inertia: float = 2.0e-4
    coulomb_pos: float = 0.013
    coulomb_neg: float = 0.016
    viscous: float = 0.002
    edge_offset: float = -0.008
    taper: float = math.radians(2.0)
    force: float = 0.66
    exponent: float = 1.6
    reference: float = 1.5e-4
    fracture_energy: float = 0.5
    kappa: float = 1.0
    upper_face: float = 5e-5
    noise: float = 1e-3
    rho: float = 0.9
    damping: float = 0.0

    def height(self, x: float, beta: float) -> tuple[float, float]:
        low, high = -0.05, 0.3
        sine, cosine = math.sin(beta), math.cos(beta)
        offset, rise = self.edge_offset, math.tan(self.taper)
        for _ in range(60):
            s = 0.5 * (low + high)
            if s * cosine - (offset + s * rise) * sine < x:
                low = s
            else:
                high = s
        return s * sine + (offset + s * rise) * cosine, math.tan(beta + self.taper)

    def response(self, delta: float) -> float:
        return self.force * (delta / self.reference) ** self.exponent if delta > 0 else 0.0

    def cut(self, theta: float, x: float) -> tuple[float, float]:
        """Torque at the pivot and the driving force of the crack."""
        phi, slope = self.height(x, theta / 2)
        g = self.response(self.upper_face - phi)
        return g * (x + phi * slope), 2 * g * slope

    def damped(self, theta: float, x: float, omega: float) -> float:
        """Factor on the force while the edge over ``x`` sinks in, by finite differences."""
        dt = 1e-6
        later, before = (self.height(x, (theta + s * omega * dt) / 2)[0] for s in (0.5, -0.5))
        return max(1.0 + self.damping * (before - later) / dt, 0.0)

    def opening_at_drive(self, start: float, end: float, x: float) -> float:
        """Opening between ``start`` and ``end`` at which the crack starts from ``x``."""
        share = _bisect(
            lambda t: self.cut(start + t * (end - start), x)[1] > self.fracture_energy, 1.0
        )
        return start + share * (end - start)

    def contact_at_arrest(self, theta: float, x: float) -> float:
        """Contact at which a crack that runs from ``x`` stops."""
        arrest = self.kappa * self.fracture_energy
        return x + _bisect(lambda d: self.cut(theta, x + d)[1] < arrest, 0.08)


@dataclass(frozen=True)
class TwoSlopes(Truth):
    """A response that stiffens at a knee: no power law and no exponential."""

    knee: float = 5e-4
    steeper: float = 3.5

    def response(self, delta: float) -> float:
        if delta <= 0:
            return 0.0
        if delta <= self.knee:
            return self.force * (delta / self.reference) ** self.exponent
        return (
            self.force
            * (self.knee / self.reference) ** self.exponent
            * (delta / self.knee) ** self.steeper
        )


def sweep(low: float, high: float, speed: float) -> np.ndarray:
    """Opening from ``low`` to ``high``: constant speed with rounded ends."""
    count = int(abs(high - low) / speed * RATE_HZ * 1.15) + 40
    u = np.linspace(0, 1, count)
    ramp = 0.1
    v = np.clip(np.minimum(u / ramp, (1 - u) / ramp), 0, 1)
    v = v * v * (3 - 2 * v)
    path = np.concatenate([[0], np.cumsum(0.5 * (v[1:] + v[:-1]))])
    return low + (high - low) * path / path[-1]


def make_recording(
    kind: str,
    opening: list[np.ndarray],
    advance: list[float],
    strokes: list[Stroke],
    truth: Truth,
    rng: np.random.Generator,
    cuts: bool,
) -> Recording:
    theta, x_n, labels = _joined(opening, advance)
    omega = np.gradient(theta) * RATE_HZ
    acceleration = np.gradient(omega) * RATE_HZ
    level = np.where(omega > 0, truth.coulomb_pos, truth.coulomb_neg)
    drive = truth.inertia * acceleration + np.sign(omega) * level + truth.viscous * omega
    if cuts:
        drive = drive - _cut_torque(theta, x_n, _sheets(labels, strokes), truth)
    noise = rng.standard_normal(len(theta)) * truth.noise * math.sqrt(1 - truth.rho**2)
    coloured = np.empty_like(noise)
    state = 0.0
    for i, e in enumerate(noise):
        state = truth.rho * state + e
        coloured[i] = state
    samples = np.zeros(len(theta), SAMPLE_DTYPE)
    samples["sequence"] = np.arange(len(theta))
    samples["device_time_us"] = np.arange(len(theta)) * 1000
    samples["host_time_ns"] = samples["device_time_us"] * 1000
    step = 5e-5
    samples["opening"] = np.round(theta / step) * step
    samples["advance"] = x_n
    samples["motor_torque"] = drive + coloured
    samples["stroke"] = labels
    return Recording(
        kind=kind,
        samples=samples,
        strokes=tuple(strokes),
        source=f"{kind}.mcap",
        content_hash=f"{kind}-{rng.integers(2**62)}",
    )


def _joined(opening, advance):
    """All strokes, with unlabelled moves between where the advance differs."""
    theta, x_n, labels = [], [], []
    for k, (part, place) in enumerate(zip(opening, advance, strict=True)):
        if k and advance[k - 1] != place:
            u = np.clip(np.linspace(-0.1, 1.1, 300), 0, 1)
            theta.append(np.full(300, part[0]))
            x_n.append(advance[k - 1] + (place - advance[k - 1]) * u * u * (3 - 2 * u))
            labels.append(np.full(300, -1))
        theta.append(part)
        x_n.append(np.full(len(part), place))
        labels.append(np.full(len(part), k))
    return np.concatenate(theta), np.concatenate(x_n), np.concatenate(labels)


def _sheets(labels, strokes):
    sheets, current = [], -1
    for label in labels.tolist():
        current = strokes[label].sheet if label >= 0 else current
        sheets.append(current)
    return sheets


def _cut_torque(theta, x_n, sheets, truth: Truth) -> np.ndarray:
    torque = np.zeros_like(theta)
    rate = np.gradient(theta) * RATE_HZ
    crack, sheet, before = 0.0, None, float(theta[0])
    for i, (angle, advance) in enumerate(zip(theta.tolist(), x_n.tolist(), strict=True)):
        if sheets[i] != sheet:
            sheet, crack = sheets[i], 0.0
        torque[i], driven = truth.cut(angle, crack - advance)
        while driven > truth.fracture_energy:
            there = angle
            if truth.kappa < 1:
                there = truth.opening_at_drive(before, angle, crack - advance)
            crack = advance + truth.contact_at_arrest(there, crack - advance)
            before = there
            torque[i], driven = truth.cut(angle, crack - advance)
            if truth.kappa >= 1:
                break
        if truth.damping > 0.0 and torque[i] > 0.0:
            torque[i] *= truth.damped(angle, crack - advance, float(rate[i]))
        before = angle
    return torque


def _bisect(reached, high: float) -> float:
    """Least value in [0, high] at which ``reached`` turns true."""
    low = 0.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if reached(middle):
            high = middle
        else:
            low = middle
    return high


SPEEDS = (0.05, 0.12, 0.3, 0.7, 1.5)
QUICK = SPEEDS[1:]
"""Without the slowest sweeps, which take 60 % of the time: where no law of low speeds is told."""


def friction_recording(
    truth: Truth, rng: np.random.Generator, speeds: tuple[float, ...] = SPEEDS
) -> Recording:
    low, high = 0.2, 0.85
    opening, strokes = [], []
    for speed in speeds * 2:
        for a, b, kind in ((high, low, "closing"), (low, high, "opening")):
            strokes.append(Stroke(len(strokes), kind, speed))
            opening.append(sweep(a, b, speed))
    t = np.arange(8000) / RATE_HZ
    wave = high - 0.1 * (1 - np.cos(2 * np.pi * (1 + 0.35 * t) * t))
    strokes.append(Stroke(len(strokes), "excitation"))
    opening.append(wave)
    return make_recording("friction", opening, [0.0] * len(opening), strokes, truth, rng, False)


def cut_recording(truth: Truth, rng: np.random.Generator, sheets: int = 3) -> Recording:
    low, high = 0.22, 0.85
    opening, advance, strokes = [], [], []
    speeds = (0.1, 0.25, 0.6)
    for sheet in range(sheets):
        for k in range(4):
            speed = speeds[(sheet + k) % 3]
            for a, b, kind, v in ((high, low, "closing", speed), (low, high, "opening", 1.0)):
                strokes.append(Stroke(len(strokes), kind, v, sheet))
                opening.append(sweep(a, b, v))
                advance.append(-0.018 + 0.034 * k)
    return make_recording("cut", opening, advance, strokes, truth, rng, True)


def loaded_cut_recording(truth: Truth, rng: np.random.Generator, sheets: int = 3) -> Recording:
    """Cuts whose strokes all end just before the crack would run: at its phase of highest force.

    That is where blades that yield come to rest, and it is the worst for whoever takes a resting
    crack to stand where it settles on average.
    """
    low, high = 0.22, 0.85
    opening, advance, strokes = [], [], []
    speeds = (0.1, 0.25, 0.6)
    for sheet in range(sheets):
        crack = 0.0
        for k in range(4):
            speed, x_n = speeds[(sheet + k) % 3], -0.018 + 0.034 * k
            before = high
            for angle in np.linspace(high, low, 800).tolist():
                while truth.cut(angle, crack - x_n)[1] > truth.fracture_energy:
                    there = truth.opening_at_drive(before, angle, crack - x_n)
                    crack = x_n + truth.contact_at_arrest(there, crack - x_n)
                    before = there
                before = angle
            runs = truth.opening_at_drive(low, low - 0.05, crack - x_n)
            bottom = low + 0.9 * (runs - low)
            for a, b, kind, v in ((high, bottom, "closing", speed), (bottom, high, "opening", 1.0)):
                strokes.append(Stroke(len(strokes), kind, v, sheet))
                opening.append(sweep(a, b, v))
                advance.append(x_n)
    return make_recording("cut", opening, advance, strokes, truth, rng, True)


def press_recording(truth: Truth, rng: np.random.Generator, presses: int = 6) -> Recording:
    """Presses at several contacts, to about the same indentation, in which nothing is cut."""
    opening, advance, strokes = [], [], []
    speeds, high = (0.1, 0.25, 0.6), 0.75
    for k in range(presses):
        place = 0.02 + 0.005 * (k % 3)
        closed = _bisect(
            lambda t, x=place: truth.height(x, (high - t) / 2)[0] < truth.upper_face - 1.2e-3, high
        )
        for a, b, kind in ((high, high - closed, "closing"), (high - closed, high, "opening")):
            strokes.append(Stroke(len(strokes), kind, speeds[k % 3], k))
            opening.append(sweep(a, b, speeds[k % 3]))
            advance.append(-place)
    return make_recording("cut", opening, advance, strokes, truth, rng, True)
