"""Why a device latched a fault or a servo stopped: the first cause first, with its remedy."""

from scissorcal.kernel import FaultCause, StopReason

LATE_STOPS = (
    StopReason.DEVICE_FAULT,
    StopReason.SILENCE,
    StopReason.TRACKING_LOST,
    StopReason.OVERSPEED,
    StopReason.OSCILLATION,
    StopReason.HELD_UP,
    StopReason.CLOCK_RATE,
    StopReason.SUPERVISOR_LOST,
)
"""Stops that a loop brings about that this computer did not run in time."""


def stop_sentence(reason: StopReason, cause: int, held_up_s: float) -> str:
    """Say why a servo stopped.

    ``cause`` is that of the last fault, ``held_up_s`` the longest time, shortly before the stop, in
    which this computer did not run the loop.

    >>> stop_sentence(StopReason.DEVICE_FAULT, FaultCause.HEAT, 0.0)[:38]
    'Motor or driver is too hot (cause HEAT'
    """
    sentence = reason.sentence
    if reason is StopReason.DEVICE_FAULT and cause:
        often = cause == FaultCause.WATCHDOG
        why = "The fault did not clear, or came too often." if often else "Such a fault ends a run."
        sentence = f"{fault_sentence(cause)} {why}"
    by_itself = reason is StopReason.DEVICE_FAULT and cause not in (0, FaultCause.WATCHDOG)
    if reason not in LATE_STOPS or by_itself or not held_up_s:
        return sentence
    return (
        f"This computer did not run the servo loop for {1e3 * held_up_s:.0f} ms: other work or a "
        "stopped process held it up. Close programs that load this computer, and start again. What "
        f"followed: {sentence}"
    )


_SENTENCES = {
    FaultCause.WATCHDOG: (
        "The device braked because no command reached it within rig.line.brake_after_ms "
        "(cause WATCHDOG): close programs that load this computer, or raise that key."
    ),
    FaultCause.ENCODER: (
        "The device does not trust its encoder (cause ENCODER): check the encoder, its magnet or "
        "disc, and its cable; then home the device again."
    ),
    FaultCause.STOP_BUTTON: (
        "The stop button of the rig is pressed (cause STOP_BUTTON): make sure that nothing is in "
        "the blades' way, and release it."
    ),
    FaultCause.CURRENT: (
        "The motor's current exceeded the device's limit (cause CURRENT): look for blades that are "
        "blocked and for a short circuit in the motor's wires, or lower limits.torque_Nm."
    ),
    FaultCause.HEAT: (
        "Motor or driver is too hot (cause HEAT): let it cool down, and lower limits.torque_Nm or "
        "rest between captures."
    ),
    FaultCause.SPEED: (
        "The blades moved faster than the device allows (cause SPEED): check that motor and "
        "encoder have the same sense and that the coupling is tight."
    ),
    FaultCause.SUPPLY: (
        "The supply's voltage left the device's range (cause SUPPLY): check the power supply and "
        "its wires; a supply that cannot take current back rises when the blades brake."
    ),
    FaultCause.DRIVER: (
        "The motor's driver reports a fault (cause DRIVER): check its supply and the motor's "
        "wires, switch the device off and on, and start again."
    ),
}


def fault_sentence(cause: int) -> str:
    """Say what latched a fault and what to do; empty where the device stated no cause.

    >>> fault_sentence(FaultCause.HEAT)[:36]
    'Motor or driver is too hot (cause HE'
    """
    if cause == FaultCause.NONE:
        return ""
    known = {int(one): sentence for one, sentence in _SENTENCES.items()}
    unknown = (
        f"The device latched a fault of a cause that this scissorcal does not know ({cause}): look "
        "it up in the manual of the device, or update scissorcal."
    )
    return known.get(cause, unknown)
