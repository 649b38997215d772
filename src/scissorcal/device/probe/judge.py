"""Verdicts of the probe. A check that fails is a refusal: nothing further may move.

A check that is not evaluated but has a value is a warning; what is subtracted or only widens an
interval refuses nothing. Every limit has its reason beside it.
"""

import math

from scissorcal.device.motion import STOP_MARGIN_RAD
from scissorcal.device.probe.idle import JITTER_RAD, Idle
from scissorcal.device.probe.lag import Lag
from scissorcal.device.probe.measured_torque import Follow
from scissorcal.device.probe.watchdog import Watchdog
from scissorcal.kernel import Capability, Identity
from scissorcal.verdicts import Verdict, judge, not_evaluated

LINE, SENSORS, MOTORS = "probe.line", "probe.sensors", "probe.motors"

CLOCK_LIMIT = 0.01
"""Rates follow the clock, and inertia its square: 1 % of rate is 2 % of inertia, which is what the
friction fit's interval is wide."""
LOST_LIMIT_PERCENT = 2.0
"""At 1 kHz three frames in a row are then lost every 2 min; each holds a torque three times too
long."""
RADIUS_MM = (5.0, 500.0)
"""No handle of scissors is shorter or longer: beyond it a unit is wrong."""
RADIUS_SHARE = 0.02
FORCE_ZERO_N = 0.05
"""At a radius of 60 mm, 3 mN m: a fifth of the friction of office scissors. It is subtracted."""
FORCE_NOISE_N = 0.5
TORQUE_ZERO_SHARE = 0.01
"""Of the motor's limit: what current sensors are specified for."""
TORQUE_NOISE_SHARE = 0.05
JITTER_STEPS = 1.0
"""An encoder without noise stays within a step."""
STEP_RATIO = 1.5
"""Halfway, in ratio, to the next count of an encoder that is counted by half or double."""
DEFAULT_BRAKE_MS = 10.0
"""BRAKE_AFTER_MS of a device that was never told another (docs/protocol.md)."""
GAIN_SD = 0.1
GAIN_WARNING, GAIN_LIMIT = 0.05, 0.2
"""Torque in a fit errs as the gain does: 5 % is most of a recipe's tolerance of 7 %, 20 % is no
calibration of any current sensor but a wrong scale."""


def judge_idle(found: Idle, identity: Identity, radius_mm: float) -> list[Verdict]:
    """Verdicts on the idle second; ``radius_mm`` is the recipe's handle radius."""
    verdicts = [_numbers(found), _no_fault(found), _within_stops(found, identity)]
    verdicts += _clock(found, identity)
    verdicts += [_lost(found), _jitter(found, identity)]
    verdicts += [*_zeros(found, identity), _radius(identity, radius_mm)]
    return [verdict for verdict in verdicts if verdict is not None]


def judge_watchdog(found: Watchdog, lag: Lag, tick_ms: float) -> list[Verdict]:
    """Verdicts on silence."""
    verdicts = []
    if found.refused:
        why = (
            f"{found.refused} What it does without commands was judged by this value all the same."
        )
        verdicts.append(not_evaluated(MOTORS, "watchdog value", why))
    return verdicts + _brakes(found, max(lag.ticks) * tick_ms, tick_ms)


def judge_follow(found: Follow) -> Verdict:
    """Verdict on measured against commanded torque."""
    gain, sd = found.gain.mean, found.gain.sd
    check, limit = "measured torque", GAIN_LIMIT
    if found.constant:
        why = (
            "motor_torque never changed, whatever was commanded: the device must send the torque "
            "that its motor exerts (measured, or at least what its amplifier was told)."
        )
        return Verdict(MOTORS, check, "fail", 1.0, limit, why)
    if not sd <= GAIN_SD:
        why = (
            "The gain of motor_torque could not be told: its noise is too large, or this computer "
            "stalled too often to hold a torque."
        )
        return not_evaluated(MOTORS, check, why, limit)
    off = abs(gain - 1.0)
    if abs(gain) < limit:
        why = (
            f"motor_torque does not follow the command (gain {gain:.2f} +- {sd:.2f}) although the "
            "blades move: check the current sensor and that the firmware sends its reading."
        )
        return Verdict(MOTORS, check, "fail", off, limit, why)
    if gain < -3.0 * sd and abs(gain) > limit:
        why = (
            f"motor_torque has the opposite sign of the command (gain {gain:.2f}): turn its sign "
            "round in the device's firmware. Positive torque opens the blades."
        )
        return Verdict(MOTORS, check, "fail", off, limit, why)
    said = f"motor_torque is {gain:.3f} +- {sd:.3f} times the command"
    bad = (
        f"{said}: its scale or the motor's torque constant is wrong. Correct it in the device's "
        "firmware: every torque of a fit errs by this factor."
    )
    if off > limit + 3.0 * sd:
        return Verdict(MOTORS, check, "fail", off, limit, bad)
    if off > GAIN_WARNING + 3.0 * sd:
        return not_evaluated(MOTORS, check, bad, GAIN_LIMIT, off)
    return Verdict(MOTORS, check, "pass", off, limit, f"{said}.")


def judge_step(seen: float, stated: float) -> Verdict:
    """Verdict on the encoder's step as seen against the identity's."""
    check = "encoder step"
    if not math.isfinite(seen) or not stated > 0.0:
        why = "The readings do not show the encoder's step."
        return not_evaluated(SENSORS, check, why, STEP_RATIO)
    ratio = seen / stated
    said = f"The opening changes in steps of {seen:.3g} rad; the device states {stated:.3g} rad"
    if 1.0 / STEP_RATIO <= ratio <= STEP_RATIO:
        return Verdict(SENSORS, check, "pass", ratio, STEP_RATIO, f"{said}.")
    why = f"{said}: correct opening_resolution in the firmware, or how it counts the encoder."
    if ratio < 1.0:
        return not_evaluated(SENSORS, check, why, STEP_RATIO, ratio)
    return Verdict(SENSORS, check, "fail", ratio, STEP_RATIO, why)


def _numbers(found: Idle) -> Verdict:
    count = len(found.not_finite)
    bad = (
        f"{', '.join(found.not_finite)}: not a number. Check this sensor and its cable; the motors "
        "stay off."
    )
    return judge(SENSORS, "numbers", count, 0, "All fields are numbers.", bad)


def _no_fault(found: Idle) -> Verdict:
    faults = float(found.fault_stays) + float(found.encoder_fault)
    bad = (
        "The device reports a fault of its encoder; check the encoder and its cable."
        if found.encoder_fault
        else "The device has latched a fault that 100 commands with CLEAR_FAULT did not clear: "
        "remove its cause (emergency stop, motor supply, temperature) or restart the device."
    )
    return judge(MOTORS, "faults", faults, 0, "No fault stands.", bad)


def _within_stops(found: Idle, identity: Identity) -> Verdict:
    low, high = identity.opening_min, identity.opening_max
    beyond = max(low - found.opening_low, found.opening_high - high, 0.0)
    at = found.opening_high if found.opening_high - high > low - found.opening_low else 0.0
    at = at or found.opening_low
    good = f"The opening lies between the stops that the device states ({low:.3g} to {high:.3g})."
    bad = (
        f"The opening is {at:.3g} rad, beyond the stops that the device states ({low:.3g} to "
        f"{high:.3g}): home the encoder, or correct its scale or the stops in the firmware."
    )
    if math.isnan(beyond):
        beyond, bad = math.inf, "The opening is no number."
    return judge(SENSORS, "stops", beyond, STOP_MARGIN_RAD, good, bad)


def _clock(found: Idle, identity: Identity) -> list[Verdict]:
    ratio, check = found.clock_ratio, "clock by tick"
    tick = identity.tick_us
    if found.clock_stands:
        why = "The device's clock (device_us) stands still: restart the device."
        return [Verdict(LINE, check, "fail", 1.0, CLOCK_LIMIT, why)]
    said = f"device_us grows by {ratio * tick:.4g} a frame and the device states tick_us = {tick}"
    bad = f"{said}: correct one of them in its firmware."
    if abs(ratio - 1e-3) < 1e-4:
        bad = f"{said}: it counts milliseconds. device_us must count microseconds."
    elif 1e-4 < abs(ratio - 1e3) < 50.0:
        bad = f"{said}: it counts nanoseconds. device_us must count microseconds."
    elif abs(found.host_ratio - 1.0) < CLOCK_LIMIT:
        bad = f"{said}: by this computer's clock device_us is right, so tick_us is wrong."
    verdicts = [judge(LINE, check, abs(ratio - 1.0), CLOCK_LIMIT, f"{said}.", bad)]
    host, error = found.host_ratio, found.host_ratio_se
    good = f"The device's clock is off by {100 * (host - 1.0):+.2f} % by this computer's."
    if identity.capabilities & Capability.SIMULATOR:
        why = f"{good} A virtual rig's clock follows how busy its computer is."
        return [*verdicts, not_evaluated(LINE, "clock by host", why, CLOCK_LIMIT)]
    off = max(abs(host - 1.0) - 3.0 * error, 0.0) if math.isfinite(host) else math.inf
    bad = (
        f"The device's clock is off by {100 * (host - 1.0):+.2f} % by this computer's, or its "
        "ticks are longer or shorter than it states: rates and inertia err with it. Check its "
        "timer's frequency."
    )
    return [*verdicts, judge(LINE, "clock by host", off, CLOCK_LIMIT, good, bad)]


def _lost(found: Idle) -> Verdict:
    share = 100.0 * (found.lost_share + found.garbled_share * (found.lost_share == 0.0))
    good = (
        f"{100 * found.lost_share:.2g} % of the frames were lost, "
        f"{100 * found.garbled_share:.2g} % garbled, {100 * found.duplicate_share:.2g} % repeated."
    )
    bad = (
        f"{good} Use a shorter or shielded cable, a lower baud rate or another adapter; "
        "'scissorcal device doctor' measures the port."
    )
    return judge(LINE, "lost frames", share, LOST_LIMIT_PERCENT, good, bad)


def _jitter(found: Idle, identity: Identity) -> Verdict:
    step = identity.opening_resolution
    steps = found.jitter_rad / step if step else 0.0
    said = (
        f"The opening jitters by {1e3 * found.jitter_rad:.2g} mrad (sd, {steps:.2g} encoder steps) "
        "with the motors off"
    )
    remedy = "shield the encoder's cable, check its supply, or average its readings in the firmware"
    if found.swings:
        why = f"{said}, and the blades did not rest: whether the encoder does is not told."
        return not_evaluated(SENSORS, "encoder jitter", why, JITTER_RAD, found.jitter_rad)
    if found.jitter_rad > JITTER_RAD:
        why = f"{said}: {remedy}, and check that nobody moves the handles."
        return Verdict(SENSORS, "encoder jitter", "fail", found.jitter_rad, JITTER_RAD, why)
    if steps > JITTER_STEPS:
        why = f"{said}. Rates are averaged for longer, and slow ones are not used: {remedy}."
        return not_evaluated(SENSORS, "encoder jitter", why, JITTER_RAD, found.jitter_rad)
    return Verdict(SENSORS, "encoder jitter", "pass", found.jitter_rad, JITTER_RAD, f"{said}.")


def _zeros(found: Idle, identity: Identity) -> list[Verdict]:
    zero = found.torque_zero
    said = (
        f"motor_torque shows {1e3 * zero.mean:.3g} +- {1e3 * zero.sd:.2g} mN m with the motors off"
    )
    warn = f"{said}, which is subtracted. Zero its current sensor."
    most = TORQUE_ZERO_SHARE * identity.torque_limit
    verdicts = [_warned("torque zero", abs(zero.mean), most, f"{said}.", warn)]
    noise, most = found.torque_noise, TORQUE_NOISE_SHARE * identity.torque_limit
    said = f"motor_torque has a noise of {1e3 * noise:.3g} mN m (sd)"
    bad = f"{said}: shield its sensor, or filter it before it is sampled."
    verdicts.append(judge(SENSORS, "torque noise", noise, most, f"{said}.", bad))
    if not identity.capabilities & Capability.HANDLE_FORCE_SENSOR:
        return verdicts
    zero, noise = found.force_zero, found.force_noise
    said = f"handle_force shows {zero.mean:.3g} +- {zero.sd:.2g} N with nobody at the handles"
    warn = f"{said}, which is subtracted. Zero the sensor, or check that nobody held the handles."
    verdicts.append(_warned("force zero", abs(zero.mean), FORCE_ZERO_N, f"{said}.", warn))
    said = f"handle_force has a noise of {noise:.3g} N (sd)"
    bad = f"{said}: shield its sensor, or filter it before it is sampled."
    if noise == 0.0:
        why = (
            "handle_force never changed, though the device states a sensor: it is not connected. "
            "Connect it, or take HANDLE_FORCE_SENSOR out of the capabilities."
        )
        verdicts.append(Verdict(SENSORS, "force noise", "fail", 0.0, FORCE_NOISE_N, why))
    else:
        verdicts.append(judge(SENSORS, "force noise", noise, FORCE_NOISE_N, f"{said}.", bad))
    return verdicts


def _radius(identity: Identity, recipe_mm: float) -> Verdict:
    stated, check = 1e3 * identity.handle_radius, "handle radius"
    said = f"The device states a handle radius of {stated:.4g} mm, the recipe {recipe_mm:.4g} mm"
    low, high = RADIUS_MM
    off = abs(stated - recipe_mm) / recipe_mm
    if not low <= stated <= high:
        why = f"{said}: no handle is so long. handle_radius is in metres; correct the firmware."
        return Verdict(SENSORS, check, "fail", off, RADIUS_SHARE, why)
    if off > RADIUS_SHARE:
        why = (
            f"{said}, {off:.0%} apart. Measure it, and correct rig.handle_radius_mm or the "
            "firmware: forces at the handles are wrong by as much."
        )
        return not_evaluated(SENSORS, check, why, RADIUS_SHARE, off)
    return Verdict(SENSORS, check, "pass", off, RADIUS_SHARE, f"{said}.")


def _warned(check: str, value: float, limit: float, good: str, warn: str) -> Verdict:
    """A verdict that passes or warns."""
    if value <= limit:
        return Verdict(SENSORS, check, "pass", value, limit, good)
    return not_evaluated(SENSORS, check, warn, limit, value)


def _brakes(found: Watchdog, late: float, tick_ms: float) -> list[Verdict]:
    asked = max(found.brake_after_ms, DEFAULT_BRAKE_MS if found.refused else 0.0)
    most = 2.0 * asked + late
    if found.braked_ms is None:
        why = (
            "The device did not brake although commands were withheld for "
            f"{found.withheld_ms:.4g} ms with ENABLE in force: its watchdog is deaf. Without it a "
            "computer that hangs leaves the last torque on; correct the firmware "
            "(docs/protocol.md, Watchdog)."
        )
        return [Verdict(MOTORS, "watchdog", "fail", None, most, why)]
    said = f"Without commands the device brakes after {found.braked_ms:.4g} ms"
    bad = f"{said}, {asked:.4g} ms were set: correct its watchdog."
    if found.refused:
        bad = (
            f"{said}; it refuses BRAKE_AFTER_MS, and {asked:.4g} ms are due: correct its watchdog, "
            "or set rig.line.brake_after_ms to what it does if that is meant."
        )
    verdicts = [judge(MOTORS, "watchdog", found.braked_ms, most, f"{said}.", bad)]
    missing = [
        sentence
        for sentence, there in (
            ("it latches no fault", found.latched),
            ("it does not show COMMANDS_LOST", found.lost_shown),
            ("COMMANDS_LOST stays when commands return", found.lost_cleared),
        )
        if not there
    ]
    if missing:
        why = f"{said}, but {', '.join(missing)} (docs/protocol.md, Watchdog)."
        verdicts.append(not_evaluated(MOTORS, "watchdog flags", why, 0, len(missing)))
    good = "A fault clears by CLEAR_FAULT."
    bad = (
        "The fault that the watchdog latched does not clear by 100 commands with CLEAR_FAULT: "
        "correct the firmware (docs/protocol.md, Faults), or restart the device."
    )
    verdicts.append(judge(MOTORS, "fault clears", float(not found.fault_cleared), 0, good, bad))
    return verdicts
