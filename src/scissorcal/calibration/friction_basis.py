"""A friction law weighed over windows: columns that its parameters multiply."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.model import presliding_state
from scissorcal.model.terms import TERMS, Motion, evaluate

Array = NDArray[np.float64]

SPACING = 0.1
"""Distance of nodes in the logarithm of a scale; interpolation then errs by 1e-4 at most."""


class FrictionBasis:
    """Friction at every sample, weighed as the drive was, for any parameters of one law.

    Equals ``windows.average(friction_torque(law, samples))`` and costs a fraction of it: what is
    linear in its parameters is weighed once, and what depends on a scale (Stribeck's speed,
    Dahl's length) is weighed at nodes of that scale and interpolated.
    """

    def __init__(
        self, windows: Windows, angle_center: float, *, angle: bool, terms: tuple[str, ...] = ()
    ) -> None:
        """``angle`` has friction depend on the place, ``terms`` are named ones that it adopted."""
        self.windows = windows
        away = windows.opening - angle_center
        self._count = 3 if angle else 1
        self._powers = np.stack([np.ones_like(away), away, away**2][: self._count], axis=1)
        rate, sign = windows.rate, np.sign(windows.rate)
        self._sign, self._speed = sign, np.abs(rate)
        forward, backward = (rate > 0).astype(float), (rate < 0).astype(float)
        load = np.zeros_like(rate) if windows.load is None else windows.load
        self._sides = np.stack([forward, backward, np.abs(load)], axis=1)
        motion = Motion(windows.opening, rate, np.zeros_like(rate), load)
        levels = tuple(name for name in terms if TERMS[name].of_rate_only)
        others = tuple(name for name in terms if not TERMS[name].of_rate_only)
        self.terms = (levels, others)
        speeds = np.stack([forward * rate, backward * rate], axis=1)
        fixed = [sign[:, None] * self._sides, speeds, evaluate(levels, motion)]
        self._fixed = self._weigh(np.concatenate(fixed, axis=1))
        self._others = windows.average(
            np.concatenate([load[:, None], evaluate(others, motion)], axis=1)
        )
        self._stribeck = _Nodes(self._stribeck_at)
        self._lag = _Nodes(self._lag_at)

    def __call__(self, values: Mapping[str, Array]) -> Array:
        """Friction (n,) from a law's parameters by name; those it lacks are zero."""

        def level(name: str) -> float:
            return float(values.get(name, 0.0))

        def side(name: str) -> list[float]:
            return [level(name) or level(name + suffix) for suffix in ("_pos", "_neg")]

        dry = [*side("coulomb"), level("load_share")]
        levels, others = self.terms
        place = np.array([1.0, level("angle_slope"), level("angle_curvature")])[: self._count]
        fixed = np.array([*dry, *side("viscous"), *(level(name) for name in levels)])
        gains = np.array([level("load_gain"), *(level(name) for name in others)])
        total = self._fixed @ np.outer(fixed, place).ravel() + self._others @ gains
        if level("stribeck"):
            total += self._stribeck(level("stribeck_rate")) @ (level("stribeck") * place)
        if level("presliding_share"):
            late = -level("presliding_share") * np.outer(dry, place).ravel()
            total += self._lag(level("presliding_length")) @ late
        return np.asarray(total)

    def _stribeck_at(self, rate: float) -> Array:
        return self._weigh((self._sign * np.exp(-((self._speed / rate) ** 2)))[:, None])

    def _lag_at(self, length: float) -> Array:
        """What dry friction still lacks after a reversal, relative to its level."""
        windows = self.windows
        ends = [*windows.starts[1:].tolist(), len(windows.opening)]
        state = np.concatenate(
            [
                presliding_state(windows.opening[low:high], length)
                for low, high in zip(windows.starts.tolist(), ends, strict=True)
            ]
        )
        return self._weigh((self._sign - state)[:, None] * self._sides)

    def _weigh(self, columns: Array) -> Array:
        """Columns (m, k) times the powers of the place, weighed: (n, k * powers)."""
        products = columns[:, :, None] * self._powers[:, None, :]
        return self.windows.average(products.reshape(len(columns), -1))


class _Nodes:
    """Arrays that depend smoothly on a positive scale, worked out at nodes when first needed."""

    def __init__(self, at: Callable[[float], Array]) -> None:
        self.at = at
        self.known: dict[int, Array] = {}
        self.last: tuple[float, Array] | None = None

    def __call__(self, scale: float) -> Array:
        """Cubic interpolation (Lagrange) in the logarithm of ``scale``."""
        if self.last is None or self.last[0] != scale:
            self.last = (scale, self._interpolated(scale))
        return self.last[1]

    def _interpolated(self, scale: float) -> Array:
        place = float(np.log(scale)) / SPACING
        low = int(np.floor(place))
        t = place - low
        result = self._node(low - 1) * (-t * (t - 1) * (t - 2) / 6)
        result += self._node(low) * ((t + 1) * (t - 1) * (t - 2) / 2)
        result += self._node(low + 1) * (-(t + 1) * t * (t - 2) / 2)
        result += self._node(low + 2) * ((t + 1) * t * (t - 1) / 6)
        return result

    def _node(self, index: int) -> Array:
        if index not in self.known:
            self.known[index] = self.at(float(np.exp(index * SPACING)))
        return self.known[index]
