"""What a fit of a joint says: inertia, friction and delay with what the law leaves out."""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.probe.joint_values import NAMES, joint_of
from scissorcal.kernel.joint import Joint
from scissorcal.recording.probe import Estimate, Posterior

LEFT_OUT = 0.05
"""Share of inertia and dry friction that the law leaves out: on 60 rigs of another friction law the
median error of inertia was 3 %, where the pushes alone claimed 1 to 4 % (decision 175). Where
residuals are larger than what the law is known to leave out, so is this."""
LEFT_OUT_STOP = 0.1
"""The same where blades fall back to a stop, so that they go 2 to 40 mrad off it: on 32 rigs whose
stop damps otherwise the rms error of inertia was 8 %, the largest 20 %."""
LEFT_OUT_VISCOUS = 1e-3
"""The same of viscous friction (N m s/rad): swings of 1 rad/s and less hardly show it."""
LEFT_OUT_S = 2e-4
"""The same of the delay: friction that builds up otherwise looks like torque that comes later."""


@dataclass(frozen=True)
class JointFit:
    """Posterior of the joint, close to normal in ``values`` (`NAMES`) with ``covariance``.

    ``misfit`` is the mean square of the residuals in units of their errors. ``strange`` names
    values that lie STRANGE_SDS prior standard deviations out or at a bound. ``stop`` is that of
    the prior, ``way`` (rad) the longest that a push went: friction that builds up over more of it
    was not seen.
    """

    values: Array
    covariance: Array
    misfit: float
    strange: tuple[str, ...]
    stop: int = 0
    way: float = math.inf

    def sd(self, name: str) -> float:
        """Standard deviation of a value, as `NAMES` has it."""
        at = NAMES.index(name)
        return math.sqrt(max(float(self.covariance[at, at]), 0.0))

    def value(self, name: str) -> float:
        """Mean of a value, as `NAMES` has it."""
        return float(self.values[NAMES.index(name)])

    @property
    def joint(self) -> Joint:
        """The joint at the mean."""
        return joint_of(self.values, self.stop)

    @property
    def posterior(self) -> Posterior:
        """As a probe's result carries it."""
        rows = tuple(tuple(float(f"{value:.4g}") for value in row) for row in self.covariance)
        return Posterior(NAMES, tuple(float(f"{value:.7g}") for value in self.values), rows)

    @property
    def inertia(self) -> Estimate:
        left_out = (LEFT_OUT_STOP if self.stop else LEFT_OUT) * self._beyond_law
        return _of_log(self.value("log_inertia"), math.hypot(self.sd("log_inertia"), left_out))

    @property
    def coulomb(self) -> Estimate:
        """What friction the longest push met: of the law's, the share that builds up within it."""
        names = ("log_coulomb", "log_slow", "slow_logit")
        at = [NAMES.index(name) for name in names]
        share, left = self.joint.slow_share, 1.0 - self.built_up
        by_slow = -left * self.way / self.joint.slow if left > 0.0 else 0.0
        gradient = np.array([1.0, by_slow / self.built_up, -left * (1.0 - share) / self.built_up])
        variance = float(gradient @ self.covariance[np.ix_(at, at)] @ gradient)
        mean = self.value("log_coulomb") + math.log(self.built_up)
        left_out = LEFT_OUT * self._beyond_law
        return _of_log(mean, math.hypot(math.sqrt(max(variance, 0.0)), left_out))

    @property
    def _beyond_law(self) -> float:
        return max(1.0, math.sqrt(self.misfit))

    @property
    def built_up(self) -> float:
        """Share of the law's friction that acts at the end of the longest push."""
        joint = self.joint
        return 1.0 - joint.slow_share * math.exp(-self.way / joint.slow)

    @property
    def viscous(self) -> Estimate:
        found = _of_log(self.value("log_viscous"), self.sd("log_viscous"))
        return Estimate(found.mean, math.hypot(found.sd, LEFT_OUT_VISCOUS))

    @property
    def delay(self) -> Estimate:
        """From a measurement to the torque that answers it: delay and lag of the motor."""
        lag = math.exp(self.value("log_lag"))
        i, j = NAMES.index("delay"), NAMES.index("log_lag")
        c = self.covariance
        variance = max(float(c[i, i] + 2.0 * lag * c[i, j] + lag**2 * c[j, j]), 0.0)
        return Estimate(self.value("delay") + lag, math.hypot(math.sqrt(variance), LEFT_OUT_S))


def _of_log(mean: float, sd: float) -> Estimate:
    return Estimate(math.exp(mean), math.exp(mean) * sd)
