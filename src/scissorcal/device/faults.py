"""Why a device latched a fault: a sentence with the remedy for each cause that it may state."""

from scissorcal.kernel import FaultCause

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
