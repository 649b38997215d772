"""How a virtual rig finds the zero of its encoder: slowly, towards the closing stop."""

import math

from scissorcal.device.sim.rig import TICK_S, VirtualRig
from scissorcal.kernel import HOME_CAUSE, HomeResult

SPEED_rad_per_s = 0.3
TORQUE_SHARE = 0.3
"""Largest torque of homing, as a share of the motor's limit."""
INTEGRAL_per_s = 20.0
STILL_S = 0.25
TIMEOUT_S = 20.0


class Homing:
    """The zero of a virtual rig's encoder.

    ``homed`` says whether it is known, ``active`` whether the device looks for it. Until it is
    known, openings count from where the blades stood at power-on.
    """

    _last: float
    _began: float
    _held: float
    _still_s: float
    _passed_s: float

    def __init__(self, rig: VirtualRig, homed: bool) -> None:
        self._rig = rig
        self.homed = homed
        self.active = False
        self._result = HomeResult.NOT_TRIED
        self._zero = 0.0 if homed else rig.opening
        mechanism = rig.specimen.mechanism
        self._low = math.radians(mechanism.opening_range_deg[0])
        self._step = rig.specimen.sensors.opening_step_rad
        self._largest = TORQUE_SHARE * rig.specimen.motor.torque_limit_Nm
        # a quarter of what brakes the blades within one tick: stable with a delay of a tick or two
        self._damping = mechanism.inertia_kg_m2 / (4.0 * TICK_S)
        self._begin_at(0.0)

    def start(self) -> None:
        """Begin to look for the zero; the old one counts no more."""
        self.homed, self.active = False, True
        self._result = HomeResult.NOT_TRIED
        self._begin_at(self._rig.opening)

    def stop(self, result: HomeResult = HomeResult.STOPPED) -> None:
        """Stop looking, for this reason."""
        self._result = result if self.active else self._result
        self.active = False

    @property
    def cause(self) -> int:
        """What a STATE says of a search that ended without a zero, 0 without one."""
        ended = not (self.homed or self.active) and self._result is not HomeResult.NOT_TRIED
        return HOME_CAUSE + self._result if ended else 0

    def opening(self, measured: float) -> float:
        """The opening (rad) as the device states it, of a measured place of the blades."""
        return measured - self._zero

    def torque(self) -> float:
        """Torque (N m) of the next tick; ends the search at the stop, or after TIMEOUT_S."""
        place = self._rig.opening
        rate = (place - self._last) / TICK_S
        self._last = place
        error = -SPEED_rad_per_s - rate
        most = self._largest
        self._held = min(
            max(self._held + self._damping * INTEGRAL_per_s * error * TICK_S, -most), most
        )
        self._still_s = self._still_s + TICK_S if abs(rate) < 0.1 * SPEED_rad_per_s else 0.0
        self._passed_s += TICK_S
        if self._still_s >= STILL_S and self._held <= -most:
            self.homed, self.active = True, False
            self._zero = place - self._low
        elif self._passed_s >= TIMEOUT_S:
            moved = abs(place - self._began) > self._step
            self.stop(HomeResult.TIMED_OUT if moved else HomeResult.JAMMED)
        return min(max(self._held + self._damping * error, -most), most) if self.active else 0.0

    def _begin_at(self, place: float) -> None:
        self._last = self._began = place
        self._held = self._still_s = self._passed_s = 0.0
