"""Logs of a made joint: motion given in closed form, effort by its equation, and files of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

RATE_HZ = 1000.0


@dataclass(frozen=True)
class MadeJoint:
    """A turning joint: inertia (kg m^2), friction (N m), constant effort, and late sensor (s)."""

    inertia: float = 2e-3
    coulomb: float = 0.05
    viscous: float = 0.01
    offset: float = 0.01
    delay_s: float = 0.0
    noise: float = 2e-3

    def log(self, speeds: tuple[float, ...], seed: int, ramp_s: float = 0.1) -> np.ndarray:
        """Rows of time, angle and torque: strokes of 1 rad to and fro at each speed in turn."""
        rng = np.random.default_rng(seed)
        angles, rates, accelerations, at = [], [], [], 0.0
        for stroke in range(8):
            speed = speeds[(stroke // 2) % len(speeds)] * (1.0 if stroke % 2 == 0 else -1.0)
            lasts = abs(1.0 / speed)
            time = np.arange(int(lasts * RATE_HZ)) / RATE_HZ
            up, down = np.clip(time / ramp_s, 0, 1), np.clip((lasts - time) / ramp_s, 0, 1)
            rise, fall = (x * x * (3 - 2 * x) for x in (up, down))
            rate = speed * rise * fall
            slope = 6 * (up * (1 - up) * fall - rise * down * (1 - down)) / ramp_s
            angles.append(at + (np.cumsum(rate) - rate / 2) / RATE_HZ)
            at += float(rate.sum()) / RATE_HZ
            rates.append(rate)
            accelerations.append(speed * slope)
        angle, rate, acceleration = map(np.concatenate, (angles, rates, accelerations))
        torque = self.inertia * acceleration + self.coulomb * np.sign(rate)
        torque += self.viscous * rate + self.offset
        time = np.arange(len(angle)) / RATE_HZ
        torque = np.interp(time - self.delay_s, time, torque)
        torque += rng.normal(0.0, self.noise, len(time))
        return np.column_stack([time, np.round(angle / 1e-5) * 1e-5, torque])


def write(path: Path, rows: np.ndarray, headings: str = "time_s,angle_deg,torque [mN m]") -> Path:
    """Write rows (n, 3) in s, rad and N m as a log in s, deg and mN m."""
    shown = rows * np.array([1.0, np.degrees(1.0), 1e3])
    np.savetxt(path, shown, "%.6f", ",", header=headings, comments="")
    return path
