"""What the servo watches while motors drive the blades, and the lag that it counts."""

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from scissorcal.aliases import Integers
from scissorcal.kernel._kernel import lib
from scissorcal.kernel.stop_reason import StopReason

_FIRST = int(lib.SC_STOP_WATCHED)
_COUNT = int(lib.SC_WATCHES)
_LEAST = {"stop_low": -math.pi, "stop_high": -math.pi, "handle_zero": -math.inf}


@dataclass(frozen=True, kw_only=True)
class WatchConfig:
    """Thresholds of the watches, SI units and radians; 0 switches one off, and is the default.

    ``held_s``: torque at its limit for so long, less the time below it since. ``swing_rate``,
    ``swing_torque``, ``swing_Hz``: three swings in a row of at least this amplitude (rad/s), change
    of torque (N m) and frequency, that the motor's torque feeds; of a tracked reference, its own
    rate is subtracted. ``swing_inertia`` (kg m^2) and ``swing_delay_ticks``, until a command acts,
    are the rig's: with inertia 0 all such swings count. Where a command was later than usual by
    ``held_up_ticks`` meanwhile, the stop is HELD_UP.
    ``runaway_rate``, ``runaway_speed``: blades (rad/s) or carriage (m/s) speed up by so much
    against their motor's effort. ``stop_margin``: the device says it is at a stop, so far (rad)
    from ``stop_low`` and ``stop_high``. ``still_rad``, ``still_m``: the reference moves so far
    while the measured place stays exactly the same, the opening under a torque of at least
    ``still_torque`` (N m). Without a reference: torques of motor and hand differ by ``rest_torque``
    (N m) and by ``rest_share`` of the smaller of the two, and the opening stays exactly the same
    for half a second; it needs ``handle_radius`` (m), 0 without a force sensor, which shows
    ``handle_zero`` (N) without a hand. ``jitter_s``: the opening stays the same so long, of an
    encoder that jitters.
    ``least_ratio``, ``most_ratio``: measured over commanded torque, where torques of at least
    ``ratio_torque`` (N m) act. ``clock_share``, ``host_clock_share``: device clock against its
    ticks, and against this computer. Raises ValueError for a number that is not finite or below 0,
    where it is no place and no zero.
    """

    held_s: float = 0.0
    swing_rate: float = 0.0
    swing_torque: float = 0.0
    swing_Hz: float = 0.0
    swing_inertia: float = 0.0
    swing_delay_ticks: float = 0.0
    held_up_ticks: float = 0.0
    runaway_rate: float = 0.0
    runaway_speed: float = 0.0
    still_rad: float = 0.0
    still_m: float = 0.0
    still_torque: float = 0.0
    rest_torque: float = 0.0
    rest_share: float = 0.0
    jitter_s: float = 0.0
    least_ratio: float = 0.0
    most_ratio: float = 0.0
    ratio_torque: float = 0.0
    clock_share: float = 0.0
    host_clock_share: float = 0.0
    stop_low: float = 0.0
    stop_high: float = 0.0
    stop_margin: float = 0.0
    handle_radius: float = 0.0
    handle_zero: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            least = _LEAST.get(field.name, 0.0)
            if not (math.isfinite(value) and value >= least):
                raise ValueError(
                    f"watch.{field.name} = {value}: give a finite number from {least:.4g} on."
                )
        if self.ratio_torque > 0 and not self.least_ratio < 1 < self.most_ratio:
            raise ValueError("least_ratio must be below 1 and most_ratio above 1.")


NO_WATCHES = WatchConfig()


def largest_seen(watch: Any) -> dict[str, float]:
    """The largest value that each watch has seen as a share of its threshold, by its stop."""
    return {
        StopReason(_FIRST + index).name.lower(): float(watch.worst[index])
        for index in range(_COUNT)
    }


@dataclass(frozen=True, eq=False)
class LagCounts:
    """Ticks of the device by their lag and by the mode in force then.

    ``counts[mode, i]`` ticks had a lag of i + 1 ticks, the last column also all longer ones;
    ``held[mode]`` ticks had no new command since the tick before; ``worst[mode]`` is the longest
    lag, 0 where there was none.
    """

    counts: Integers
    held: Integers
    worst: Integers

    @classmethod
    def of(cls, lag: Any) -> "LagCounts":
        """Copy what a C struct ``sc_lag`` has now."""
        rows = ([list(row) for row in lag.count], list(lag.held), list(lag.worst))
        return cls(*(np.array(values, dtype=np.int64) for values in rows))


@dataclass(frozen=True, kw_only=True)
class PassivityConfig:
    """How rendered energy is watched, in SI units and radians.

    ``is_measured``: states hold the torque that the motor exerts, and work is booked with it.
    ``rig_damping`` and ``rig_coulomb`` are the rig's own friction, which takes what the loop
    creates. ``handle_radius`` (m) turns the force that a sensor of the hand measures into torque; 0
    without a sensor. Beyond ``margin_J`` the controller adds at most ``most_damping`` (0 for none).
    Rendered friction builds up over ``friction_width`` (rad) after a reversal; 0 lets it grow with
    the rate.
    Raises ValueError for a number that is not finite or below 0.
    """

    is_measured: bool = False
    rig_damping: float = 0.0
    rig_coulomb: float = 0.0
    margin_J: float = 0.0
    most_damping: float = 0.0
    handle_radius: float = 0.0
    friction_width: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                raise ValueError(f"{field.name} = {value} is not usable: give a number from 0 on.")


UNWATCHED_ENERGY = PassivityConfig()
"""Books alone, with the commanded torque."""


@dataclass(frozen=True)
class EnergyLedger:
    """Joules since the start; all but ``delivered_J`` while rendering.

    ``delivered_J``: work of the motors on the mechanism, by measured torque where the device
    measures it. The model's energies, as far as the ramp has engaged it: stored in the material
    now, taken by the cut (kappa J_c h dX), lost by arresting cracks, taken by rendered friction.
    ``engaged_J`` is what the ramp put into pressed material, ``limited_J`` the work that limits
    kept back, ``injected_J`` (negative) what the passivity controller took, ``late_J`` the rest:
    work beyond the commands, by holding, delay and lag. ``hand_J``: work of the hand while the
    motors are on, 0 without a sensor of its force. ``plate_J``: what who moves a plate of estimated
    pose put into its material.
    """

    delivered_J: float
    stored_J: float
    fracture_J: float
    arrest_J: float
    friction_J: float
    engaged_J: float = 0.0
    limited_J: float = 0.0
    late_J: float = 0.0
    injected_J: float = 0.0
    hand_J: float = 0.0
    plate_J: float = 0.0

    @property
    def absorbed_J(self) -> float:  # noqa: N802  (J is the unit)
        """What the model took for good."""
        return self.fracture_J + self.arrest_J + self.friction_J

    @property
    def created_J(self) -> float:  # noqa: N802
        """Energy delivered beyond what the model accounts for; above 0: not passive.

        For runs that only rendered: tracking a reference delivers work as well.
        """
        came = self.engaged_J + self.limited_J + self.plate_J
        return self.delivered_J + self.stored_J + self.absorbed_J - came

    @property
    def rig_J(self) -> float:  # noqa: N802
        """What hand and motors gave to the rig, whose friction takes it: below 0 is impossible."""
        return self.hand_J + self.delivered_J

    @property
    def unbooked_J(self) -> float:  # noqa: N802
        """What the books leave unexplained: the sampling of the model's torque between frames."""
        return self.created_J - self.late_J - self.injected_J
