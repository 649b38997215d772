"""The true arm and the material that it presses on: three axes, dry friction, late motors.

Its contact, friction and integration share nothing with the law's own model of them.
"""

import math
from operator import mul

import numpy as np

from scissorcal.aliases import Array

TICK_S = 1e-3
SUBSTEPS = 4
AXES = np.array([[0.9, 0.2, 0.1], [-0.1, 1.1, 0.2], [0.15, -0.2, 1.0]])
"""Place of the tip by the axes (m/m): oblique, so that the law's Jacobian matters."""
MASS_KG = np.array([1.0, 1.3, 0.8])
VISCOUS_N_S_PER_M = np.array([3.0, 4.0, 3.0])
COULOMB_N = np.array([0.2, 0.25, 0.15])
MOTOR_LAG_S = 1e-3
STEP_M = 0.5e-6
CONTACT_DAMPING_N_S_PER_M = 3.0
SLIP_M_PER_S = 1e-3

_ROWS, _COLUMNS = AXES.tolist(), AXES.T.tolist()
_MASSES, _VISCOUS, _COULOMBS = MASS_KG.tolist(), VISCOUS_N_S_PER_M.tolist(), COULOMB_N.tolist()


class Arm:
    """Places and rates of the three axes, in plain arithmetic: a tick takes 4 steps of it.

    ``tip`` is the tip's true place, ``reaction_N`` the true force along the normal.
    """

    def __init__(self, tip: Array, compliance_m_per_N: float, friction: float) -> None:
        self.tip = tip
        self.reaction_N = 0.0
        self._compliance = compliance_m_per_N
        self._friction = friction
        self._joints = np.linalg.solve(AXES, tip).tolist()
        self._rates = [0.0, 0.0, 0.0]
        self._effort = [0.0, 0.0, 0.0]
        self._waiting = [0.0, 0.0, 0.0]

    @property
    def measured(self) -> Array:
        """The axes' places (3,) by encoders."""
        return np.asarray(STEP_M * np.round(np.array(self._joints) / STEP_M))

    def tick(self, commanded: Array, depth: float, normal: Array, carried: Array) -> None:
        """Advance a tick under efforts that act one tick late.

        ``depth`` (m) is how far the tip stands below the unloaded surface at the tick's start,
        ``normal`` (3,) points outwards, ``carried`` (3,) is the material's velocity.
        """
        step = TICK_S / SUBSTEPS
        keep = math.exp(-step / MOTOR_LAG_S)
        wanted, self._waiting = self._waiting, commanded.tolist()
        out, drift = normal.tolist(), carried.tolist()
        joints, rates, effort = self._joints, self._rates, self._effort
        press = 0.0
        for _ in range(SUBSTEPS):
            away = [sum(map(mul, row, rates)) - d for row, d in zip(_ROWS, drift, strict=True)]
            rate = sum(map(mul, out, away))
            force = [0.0, 0.0, 0.0]
            press = 0.0
            if depth > 0.0:
                press = max(0.0, depth / self._compliance - CONTACT_DAMPING_N_S_PER_M * rate)
                slide = [a - rate * n for a, n in zip(away, out, strict=True)]
                speed = math.sqrt(sum(map(mul, slide, slide)))
                drag = self._friction * press * math.tanh(speed / SLIP_M_PER_S)
                share = drag / max(speed, 1e-12)
                force = [press * n - share * s for n, s in zip(out, slide, strict=True)]
            for i in range(3):
                effort[i] = wanted[i] + keep * (effort[i] - wanted[i])
                push = effort[i] - _VISCOUS[i] * rates[i] + sum(map(mul, _COLUMNS[i], force))
                free = rates[i] + step * push / _MASSES[i]
                held = step * _COULOMBS[i] / _MASSES[i]
                rates[i] = free - min(max(free, -held), held)
                joints[i] += step * rates[i]
            moved = [sum(map(mul, row, rates)) - d for row, d in zip(_ROWS, drift, strict=True)]
            depth -= step * sum(map(mul, out, moved))
        self.reaction_N = press
        self.tip = AXES @ np.array(joints)
