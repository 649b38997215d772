"""What may be wrong with a device: each fault by name, as a person would say it."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Faults:
    """What is wrong; by default nothing. Times (s) count from the first STREAM; inf is never."""

    motor_sign: float = 1.0
    encoder_sign: float = 1.0
    encoder_scale: float = 1.0
    encoder_zero_rad: float = 0.0
    encoder_noise_rad: float = 0.0
    torque_gain: float = 1.0
    """Of the motor; the device measures what it commands its amplifier, not what it gives."""
    measured_gain: float = 1.0
    measured_zero_Nm: float = 0.0
    measured_frozen: bool = False
    force_gain: float = 1.0
    force_zero_N: float = 0.0
    force_dead: bool = False
    advance_motor_sign: float = 1.0
    advance_encoder_sign: float = 1.0
    stated_tick_us: int | None = None
    tick_us: int = 1000
    clock_gain: float = 1.0
    clock_stands_at_s: float = math.inf
    clock_down_at_s: float = math.inf
    clock_random_at_s: float = math.inf
    stamps_wrong_at_s: float = math.inf
    """From then on every third stamp is of another time."""
    sequence_leaps_at_s: float = math.inf
    """From then on every second STATE has 40 ticks more than passed."""
    stated_radius_m: float | None = None
    stated_resolution_rad: float | None = None
    delay_to_host_s: float = 0.0
    delay_to_device_s: float = 0.0
    late_every_s: float = math.inf
    late_for_s: float = 0.0
    drop_share: float = 0.0
    garble_share: float = 0.0
    duplicate_share: float = 0.0
    unplugged_at_s: float = math.inf
    silent_at_s: float = math.inf
    repeats_at_s: float = math.inf
    """From then on the last STATE is sent again and again, sequence and all."""
    frozen_at_s: float = math.inf
    """From then on the measurements stand, sequence and clock go on."""
    encoder_stuck_at_s: float = math.inf
    advance_stuck_at_s: float = math.inf
    nan_opening_at_s: float = math.inf
    nan_opening_every: int = 1
    nan_torque_at_s: float = math.inf
    beyond_stops_at_s: float = math.inf
    leap_at_s: float = math.inf
    leap_rad: float = 0.25
    restarts_at_s: float = math.inf
    encoder_fault_at_s: float = math.inf
    fault_at_s: float = math.inf
    fault_stays: bool = False
    fault_cause: int = 8
    """Of the fault at ``fault_at_s``, as a device of version 2 states it."""
    not_homed: bool = False
    home_finds: bool = True
    torque_measured: bool = True
    watchdog_deaf: bool = False
    clips: bool = True
    refuses_brake_after: bool = False
    brake_after_ms: float = 10.0
    """At power-on."""
    motor_lag_s: float = 0.0005
    dry_Nm: float = 0.012
    inertia: float = 6e-4
    jammed_at_rad: float | None = None
    no_sheet: bool = False


FAULTS = {
    "none": Faults(),
    "motor reversed": Faults(motor_sign=-1.0),
    "encoder reversed": Faults(encoder_sign=-1.0),
    "motor and encoder reversed": Faults(motor_sign=-1.0, encoder_sign=-1.0),
    "encoder counted by half": Faults(encoder_scale=0.5),
    "encoder counted double": Faults(encoder_scale=2.0),
    "encoder zero off by 0.1 rad": Faults(encoder_zero_rad=0.1),
    "encoder noisy": Faults(encoder_noise_rad=2e-3),
    "encoder step misstated": Faults(stated_resolution_rad=2.0 * math.pi / 1e6),
    "motor torque half": Faults(torque_gain=0.5),
    "motor torque double": Faults(torque_gain=2.0),
    "measured torque reversed": Faults(measured_gain=-1.0),
    "measured torque half": Faults(measured_gain=0.5),
    "measured torque frozen": Faults(measured_frozen=True),
    "measured torque zero off by 20 mN m": Faults(measured_zero_Nm=0.02),
    "force reversed": Faults(force_gain=-1.0),
    "force zero off by 0.05 N": Faults(force_zero_N=0.05),
    "force zero off by 2 N": Faults(force_zero_N=2.0),
    "force sensor dead": Faults(force_dead=True),
    "carriage motor reversed": Faults(advance_motor_sign=-1.0),
    "carriage encoder reversed": Faults(advance_encoder_sign=-1.0),
    "carriage encoder stuck": Faults(advance_stuck_at_s=2.0),
    "tick twice as long as stated": Faults(tick_us=2000, stated_tick_us=1000, clock_gain=1.0),
    "clock in milliseconds": Faults(clock_gain=1e-3),
    "clock 5 % fast": Faults(clock_gain=1.05),
    "clock stands": Faults(clock_stands_at_s=2.0),
    "clock counts down": Faults(clock_down_at_s=2.0),
    "clock random": Faults(clock_random_at_s=2.0),
    "every third stamp wrong": Faults(stamps_wrong_at_s=2.0),
    "sequence leaps": Faults(sequence_leaps_at_s=2.0),
    "handle radius misstated": Faults(stated_radius_m=60.0),
    "0.2 ms late": Faults(delay_to_host_s=0.0001, delay_to_device_s=0.0001),
    "1 ms late": Faults(delay_to_host_s=0.0005, delay_to_device_s=0.0005),
    "3 ms late": Faults(delay_to_host_s=0.0015, delay_to_device_s=0.0015),
    "5 ms late": Faults(delay_to_host_s=0.0025, delay_to_device_s=0.0025),
    "3 ms late, light blades": Faults(
        delay_to_host_s=0.0015, delay_to_device_s=0.0015, inertia=2e-4
    ),
    "500 Hz": Faults(tick_us=2000),
    "2 kHz": Faults(tick_us=500),
    "4 kHz": Faults(tick_us=250),
    "stalls of 30 ms each second": Faults(late_every_s=1.0, late_for_s=0.03),
    "5 % of frames lost": Faults(drop_share=0.05),
    "5 % of frames garbled": Faults(garble_share=0.05),
    "20 % of frames duplicated": Faults(duplicate_share=0.2),
    "unplugged": Faults(unplugged_at_s=2.0),
    "silent": Faults(silent_at_s=2.0),
    "repeats one frame": Faults(repeats_at_s=2.0),
    "measurements frozen": Faults(frozen_at_s=2.0),
    "encoder stuck": Faults(encoder_stuck_at_s=2.0),
    "opening NaN": Faults(nan_opening_at_s=2.0),
    "every second opening NaN": Faults(nan_opening_at_s=2.0, nan_opening_every=2),
    "motor torque NaN": Faults(nan_torque_at_s=2.0),
    "opening beyond the stops": Faults(beyond_stops_at_s=2.0),
    "one leap of 0.25 rad": Faults(leap_at_s=2.0),
    "restarts": Faults(restarts_at_s=2.0),
    "encoder fault": Faults(encoder_fault_at_s=2.0),
    "one fault latched": Faults(fault_at_s=2.0),
    "fault that stays": Faults(fault_at_s=2.0, fault_stays=True),
    "watchdog deaf": Faults(watchdog_deaf=True),
    "torque not clipped": Faults(clips=False),
    "BRAKE_AFTER_MS refused": Faults(refuses_brake_after=True),
    "watchdog deaf, BRAKE_AFTER_MS refused": Faults(refuses_brake_after=True, watchdog_deaf=True),
    "blades jam": Faults(jammed_at_rad=0.45),
    "no sheet": Faults(no_sheet=True),
}
