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
