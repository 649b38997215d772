"""Verdicts of the probe. A check that fails is a refusal: nothing further may move.

A check that is not evaluated but has a value is a warning; what is subtracted or only widens an
interval refuses nothing. Every limit has its reason beside it.
"""

import math

from scissorcal.device.faults import fault_sentence
from scissorcal.device.motion import STOP_MARGIN_RAD
from scissorcal.device.probe.clipping import Follow
from scissorcal.device.probe.idle import JITTER_RAD, Idle
from scissorcal.device.probe.lag import Lag, Watchdog
from scissorcal.device.probe.talk import LINE, MOTORS, SENSORS
from scissorcal.kernel import Capability, Identity
from scissorcal.verdicts import STATED, TORQUE, Check, Verdict

CLOCK_LIMIT = 0.01
"""Rates follow the clock, and inertia its square: 1 % of rate is 2 % of inertia, which is what the
friction fit's interval is wide."""
RADIUS_MM = (5.0, 500.0)
"""No handle of scissors is shorter or longer: beyond it a unit is wrong."""
TORQUE_ZERO_SHARE = 0.01
"""Of the motor's limit: what current sensors are specified for."""
TORQUE_NOISE_SHARE = 0.05
JITTER_STEPS = 1.0
"""An encoder without noise stays within a step."""
DEFAULT_BRAKE_MS = 10.0
"""BRAKE_AFTER_MS of a device that was never told another (docs/protocol.md)."""
GAIN_SD = 0.1
GAIN_WARNING, GAIN_LIMIT = 0.05, 0.2
"""Torque in a fit errs as the gain does: 5 % is most of a recipe's tolerance of 7 %, 20 % is no
calibration of any current sensor but a wrong scale."""
FAULTS = Check("probe.motors faults", f"{MOTORS}: faults that do not clear", at_most=0.0)
WATCHDOG_VALUE = Check("probe.motors watchdog value", f"{MOTORS}: if BRAKE_AFTER_MS can be set")
WATCHDOG = Check(
    "probe.motors watchdog", f"{MOTORS}: silence after which the device brakes, ms", at_most=STATED
)
WATCHDOG_FLAGS = Check(
    "probe.motors watchdog flags", f"{MOTORS}: flags that are missing", at_most=0.0
)
FAULT_CLEARS = Check("probe.motors fault clears", f"{MOTORS}: 1 if it does not", at_most=0.0)
MEASURED_TORQUE = Check(
    "probe.motors measured torque", f"{TORQUE}measured over commanded, less 1", at_most=GAIN_LIMIT
)
NUMBERS = Check("probe.sensors numbers", f"{SENSORS}: fields that are no number", at_most=0.0)
STOPS = Check(
    "probe.sensors stops", f"{SENSORS}: opening beyond stated stops, rad", at_most=STOP_MARGIN_RAD
)
ENCODER_JITTER = Check(
    "probe.sensors encoder jitter", f"{SENSORS}: sd of the opening at rest, rad", at_most=JITTER_RAD
)
ENCODER_STEP = Check(
    "probe.sensors encoder step", f"{SENSORS}: step seen over step stated", at_most=1.5
)
"""Halfway, in ratio, to the next count of an encoder that is counted by half or double."""
TORQUE_ZERO = Check("probe.sensors torque zero", f"{SENSORS}: subtracted, N m", at_most=STATED)
TORQUE_NOISE = Check("probe.sensors torque noise", f"{SENSORS}: sd, N m", at_most=STATED)
FORCE_ZERO = Check("probe.sensors force zero", f"{SENSORS}: subtracted, N", at_most=0.05)
"""At a radius of 60 mm, 3 mN m: a fifth of the friction of office scissors. It is subtracted."""
FORCE_NOISE = Check("probe.sensors force noise", f"{SENSORS}: sd, N", at_most=0.5)
HANDLE_RADIUS = Check(
    "probe.sensors handle radius", f"{SENSORS}: device's over recipe's, less 1", at_most=0.02
)
CLOCK_BY_TICK = Check(
    "probe.line clock by tick",
    f"{LINE}: device_us a frame over tick_us, less 1",
    at_most=CLOCK_LIMIT,
)
CLOCK_BY_HOST = Check(
    "probe.line clock by host",
    f"{LINE}: device clock over this computer's, less 1",
    at_most=CLOCK_LIMIT,
)
LOST_FRAMES = Check("probe.line lost frames", f"{LINE}: frames lost or garbled, %", at_most=2.0)
"""At 1 kHz three frames in a row are then lost every 2 min; each holds a torque three times too
long."""


def judge_idle(found: Idle, identity: Identity, radius_mm: float) -> list[Verdict]:
    """Verdicts on the idle second; ``radius_mm`` is the recipe's handle radius."""
    verdicts = [_numbers(found), _no_fault(found), _within_stops(found, identity)]
    verdicts += _clock(found, identity)
    verdicts += [_lost(found), _jitter(found, identity)]
    verdicts += [*_zeros(found, identity), _radius(identity, radius_mm)]
    return verdicts


def judge_watchdog(found: Watchdog, lag: Lag, tick_ms: float) -> list[Verdict]:
    """Verdicts on silence."""
    verdicts = []
    if found.refused:
        why = (
            f"{found.refused} What it does without commands was judged by this value all the same."
        )
        verdicts.append(WATCHDOG_VALUE.not_evaluated(why))
    return verdicts + _brakes(found, max(lag.ticks) * tick_ms, tick_ms)


def judge_follow(found: Follow) -> Verdict:
    """Verdict on measured against commanded torque."""
    gain, sd = found.gain.mean, found.gain.sd
    limit = MEASURED_TORQUE.threshold
    if found.constant:
        why = (
            "motor_torque never changed, whatever was commanded: the device must send the torque "
            "that its motor exerts (measured, or at least what its amplifier was told)."
        )
        return MEASURED_TORQUE.verdict("fail", 1.0, why)
    if not sd <= GAIN_SD:
        why = (
            "The gain of motor_torque could not be told: its noise is too large, or this computer "
            "stalled too often to hold a torque."
        )
        return MEASURED_TORQUE.not_evaluated(why)
    off = abs(gain - 1.0)
    if abs(gain) < limit:
        why = (
            f"motor_torque does not follow the command (gain {gain:.2f} +- {sd:.2f}) although the "
            "blades move: check the current sensor and that the firmware sends its reading."
        )
        return MEASURED_TORQUE.verdict("fail", off, why)
    if gain < -3.0 * sd and abs(gain) > limit:
        why = (
            f"motor_torque has the opposite sign of the command (gain {gain:.2f}): turn its sign "
            "round in the device's firmware. Positive torque opens the blades."
        )
        return MEASURED_TORQUE.verdict("fail", off, why)
    said = f"motor_torque is {gain:.3f} +- {sd:.3f} times the command"
    bad = (
        f"{said}: its scale or the motor's torque constant is wrong. Correct it in the device's "
        "firmware: every torque of a fit errs by this factor."
    )
    if off > limit + 3.0 * sd:
        return MEASURED_TORQUE.verdict("fail", off, bad)
    if off > GAIN_WARNING + 3.0 * sd:
        return MEASURED_TORQUE.not_evaluated(bad, off)
    return MEASURED_TORQUE.verdict("pass", off, f"{said}.")


def judge_step(seen: float, stated: float) -> Verdict:
    """Verdict on the encoder's step as seen against the identity's."""
    if not math.isfinite(seen) or not stated > 0.0:
        why = "The readings do not show the encoder's step."
        return ENCODER_STEP.not_evaluated(why)
    ratio = seen / stated
    said = f"The opening changes in steps of {seen:.3g} rad; the device states {stated:.3g} rad"
    if 1.0 / ENCODER_STEP.threshold <= ratio <= ENCODER_STEP.threshold:
        return ENCODER_STEP.verdict("pass", ratio, f"{said}.")
    why = f"{said}: correct opening_resolution in the firmware, or how it counts the encoder."
    if ratio < 1.0:
        return ENCODER_STEP.not_evaluated(why, ratio)
    return ENCODER_STEP.verdict("fail", ratio, why)


def _numbers(found: Idle) -> Verdict:
    count = len(found.not_finite)
    bad = (
        f"{', '.join(found.not_finite)}: not a number. Check this sensor and its cable; the motors "
        "stay off."
    )
    return NUMBERS.judge(count, "All fields are numbers.", bad)


def _no_fault(found: Idle) -> Verdict:
    faults = float(found.fault_stays) + float(found.encoder_fault)
    bad = (
        "The device reports a fault of its encoder; check the encoder and its cable."
        if found.encoder_fault
        else "The device has latched a fault that 100 commands with CLEAR_FAULT did not clear: "
        "remove its cause (emergency stop, motor supply, temperature) or restart the device."
    )
    if found.fault_cause:
        bad = f"{fault_sentence(found.fault_cause)} 100 commands with CLEAR_FAULT did not clear it."
    return FAULTS.judge(faults, "No fault stands.", bad)


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
    return STOPS.judge(beyond, good, bad)


def _clock(found: Idle, identity: Identity) -> list[Verdict]:
    ratio, tick = found.clock_ratio, identity.tick_us
    if found.clock_stands:
        why = "The device's clock (device_us) stands still: restart the device."
        return [CLOCK_BY_TICK.verdict("fail", 1.0, why)]
    said = f"device_us grows by {ratio * tick:.4g} a frame and the device states tick_us = {tick}"
    bad = f"{said}: correct one of them in its firmware."
    if abs(ratio - 1e-3) < 1e-4:
        bad = f"{said}: it counts milliseconds. device_us must count microseconds."
    elif 1e-4 < abs(ratio - 1e3) < 50.0:
        bad = f"{said}: it counts nanoseconds. device_us must count microseconds."
    elif abs(found.host_ratio - 1.0) < CLOCK_LIMIT:
        bad = f"{said}: by this computer's clock device_us is right, so tick_us is wrong."
    verdicts = [CLOCK_BY_TICK.judge(abs(ratio - 1.0), f"{said}.", bad)]
    host, error = found.host_ratio, found.host_ratio_se
    good = f"The device's clock is off by {100 * (host - 1.0):+.2f} % by this computer's."
    if identity.capabilities & Capability.SIMULATOR:
        why = f"{good} A virtual rig's clock follows how busy its computer is."
        return [*verdicts, CLOCK_BY_HOST.not_evaluated(why)]
    off = max(abs(host - 1.0) - 3.0 * error, 0.0) if math.isfinite(host) else math.inf
    bad = (
        f"The device's clock is off by {100 * (host - 1.0):+.2f} % by this computer's, or its "
        "ticks are longer or shorter than it states: rates and inertia err with it. Check its "
        "timer's frequency."
    )
    return [*verdicts, CLOCK_BY_HOST.judge(off, good, bad)]


def _lost(found: Idle) -> Verdict:
    share = 100.0 * (found.lost_share + found.garbled_share * (found.lost_share == 0.0))
    good = (
        f"{100 * found.lost_share:.2g} % of the frames were lost, "
        f"{100 * found.garbled_share:.2g} % garbled, {100 * found.duplicate_share:.2g} % repeated."
    )
    if found.held_up_s:
        good += (
            f" This computer did not listen for up to {1e3 * found.held_up_s:.0f} ms; what was "
            "lost by that is not counted."
        )
    bad = (
        f"{good} Use a shorter or shielded cable, a lower baud rate or another adapter; "
        "'scissorcal device doctor' measures the port."
    )
    return LOST_FRAMES.judge(share, good, bad)


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
        return ENCODER_JITTER.not_evaluated(why, found.jitter_rad)
    if found.jitter_rad > JITTER_RAD:
        why = f"{said}: {remedy}, and check that nobody moves the handles."
        return ENCODER_JITTER.verdict("fail", found.jitter_rad, why)
    if steps > JITTER_STEPS:
        why = f"{said}. Rates are averaged for longer, and slow ones are not used: {remedy}."
        return ENCODER_JITTER.not_evaluated(why, found.jitter_rad)
    return ENCODER_JITTER.verdict("pass", found.jitter_rad, f"{said}.")


def _zeros(found: Idle, identity: Identity) -> list[Verdict]:
    zero = found.zeros["motor_torque"]
    said = (
        f"motor_torque shows {1e3 * zero.mean:.3g} +- {1e3 * zero.sd:.2g} mN m with the motors off"
    )
    warn = f"{said}, which is subtracted. Zero its current sensor."
    most = TORQUE_ZERO_SHARE * identity.torque_limit
    verdicts = [_warned(TORQUE_ZERO, abs(zero.mean), most, f"{said}.", warn)]
    noise, most = found.noises["motor_torque"], TORQUE_NOISE_SHARE * identity.torque_limit
    said = f"motor_torque has a noise of {1e3 * noise:.3g} mN m (sd)"
    bad = f"{said}: shield its sensor, or filter it before it is sampled."
    verdicts.append(TORQUE_NOISE.judge(noise, f"{said}.", bad, threshold=most))
    if not identity.capabilities & Capability.HANDLE_FORCE_SENSOR:
        return verdicts
    zero, noise = found.zeros["handle_force"], found.noises["handle_force"]
    said = f"handle_force shows {zero.mean:.3g} +- {zero.sd:.2g} N with nobody at the handles"
    warn = f"{said}, which is subtracted. Zero the sensor, or check that nobody held the handles."
    verdicts.append(_warned(FORCE_ZERO, abs(zero.mean), FORCE_ZERO.threshold, f"{said}.", warn))
    said = f"handle_force has a noise of {noise:.3g} N (sd)"
    bad = f"{said}: shield its sensor, or filter it before it is sampled."
    if noise == 0.0:
        why = (
            "handle_force never changed, though the device states a sensor: it is not connected. "
            "Connect it, or take HANDLE_FORCE_SENSOR out of the capabilities."
        )
        verdicts.append(FORCE_NOISE.verdict("fail", 0.0, why))
    else:
        verdicts.append(FORCE_NOISE.judge(noise, f"{said}.", bad))
    return verdicts


def _radius(identity: Identity, recipe_mm: float) -> Verdict:
    stated = 1e3 * identity.handle_radius
    said = f"The device states a handle radius of {stated:.4g} mm, the recipe {recipe_mm:.4g} mm"
    low, high = RADIUS_MM
    off = abs(stated - recipe_mm) / recipe_mm
    if not low <= stated <= high:
        why = f"{said}: no handle is so long. handle_radius is in metres; correct the firmware."
        return HANDLE_RADIUS.verdict("fail", off, why)
    if off > HANDLE_RADIUS.threshold:
        why = (
            f"{said}, {off:.0%} apart. Measure it, and correct rig.handle_radius_mm or the "
            "firmware: forces at the handles are wrong by as much."
        )
        return HANDLE_RADIUS.not_evaluated(why, off)
    return HANDLE_RADIUS.verdict("pass", off, f"{said}.")


def _warned(check: Check, value: float, limit: float, good: str, warn: str) -> Verdict:
    """A verdict that passes or warns."""
    if value <= limit:
        return check.verdict("pass", value, good, threshold=limit)
    return check.not_evaluated(warn, value, threshold=limit)


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
        return [WATCHDOG.verdict("fail", None, why, threshold=most)]
    said = f"Without commands the device brakes after {found.braked_ms:.4g} ms"
    bad = f"{said}, {asked:.4g} ms were set: correct its watchdog."
    if found.refused:
        bad = (
            f"{said}; it refuses BRAKE_AFTER_MS, and {asked:.4g} ms are due: correct its watchdog, "
            "or set rig.line.brake_after_ms to what it does if that is meant."
        )
    verdicts = [WATCHDOG.judge(found.braked_ms, f"{said}.", bad, threshold=most)]
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
        verdicts.append(WATCHDOG_FLAGS.not_evaluated(why, len(missing)))
    good = "A fault clears by CLEAR_FAULT."
    bad = (
        "The fault that the watchdog latched does not clear by 100 commands with CLEAR_FAULT: "
        "correct the firmware (docs/protocol.md, Faults), or restart the device."
    )
    verdicts.append(FAULT_CLEARS.judge(float(not found.fault_cleared), good, bad))
    return verdicts
