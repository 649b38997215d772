"""Why the servo stops, each with a sentence that states the cause and the remedy."""

from enum import IntEnum


class StopReason(IntEnum):
    """Why a servo or a loop stopped; ``sentence`` states it with the remedy."""

    NONE = 0
    ASKED = 1
    SUPERVISOR_LOST = 2
    DEVICE_FAULT = 3
    ENCODER_FAULT = 4
    TRACKING_LOST = 5
    HANGUP = 6
    SILENCE = 7
    LINE_ERROR = 8
    BAD_BLOCK = 9
    IMPLAUSIBLE = 10
    DEVICE_CLOCK = 11
    OVERSPEED = 12
    RESTARTED = 13
    NOT_HOMED = 14
    NO_CONTOUR = 17
    HANDLE_HELD = 18
    PRESSED_AWAY = 19
    NO_SURFACE = 20
    PRESSED_TOO_HARD = 21
    PATH_LOST = 22
    CONTROL_REFUSED = 23
    TORQUE_HELD = 32
    OSCILLATION = 33
    RUNAWAY = 34
    OPENING_STANDS = 35
    ADVANCE_STANDS = 36
    MEASURED_REVERSED = 37
    MEASURED_DIFFERS = 38
    CLOCK_RATE = 39
    UNREADABLE = 40
    RUNAWAY_ADVANCE = 41
    STOP_ELSEWHERE = 42
    HELD_UP = 43

    @property
    def sentence(self) -> str:
        """What happened and what to look at, as a whole sentence."""
        return _STOP_SENTENCES[self]


_STOP_SENTENCES = {
    StopReason.NONE: "The loop has not stopped.",
    StopReason.ASKED: "The loop stopped because it was asked to.",
    StopReason.SUPERVISOR_LOST: (
        "The loop stopped because the heartbeat of its supervising process was missing. Check why "
        "that process hung or died, then start again."
    ),
    StopReason.DEVICE_FAULT: (
        "The device latched a fault that did not clear, or latched faults too often. Remove the "
        "cause; if the computer answers late, close programs that load it or raise "
        "rig.line.brake_after_ms; then start again."
    ),
    StopReason.ENCODER_FAULT: (
        "The device reports a fault of its encoder; check the encoder and its cable."
    ),
    StopReason.TRACKING_LOST: (
        "Blades or carriage did not follow the commanded motion; check for an obstacle, a stuck "
        "encoder or gains that are too weak."
    ),
    StopReason.HANGUP: "The port was closed or unplugged; plug the device in and start again.",
    StopReason.SILENCE: (
        "No STATE frame arrived for 1 s; check the device's power and the cable, then start again."
    ),
    StopReason.LINE_ERROR: "Reading or writing the port failed; check the port and start again.",
    StopReason.BAD_BLOCK: (
        "The loop refused its parameters: a limit, gain or table is not a finite number. Check the "
        "recipe's limits and rig.control."
    ),
    StopReason.IMPLAUSIBLE: (
        "4 of the last 20 frames had an opening beyond the device's stops, or an opening or "
        "advance that was not finite or leapt farther than any motion; check the encoders and "
        "their cables."
    ),
    StopReason.DEVICE_CLOCK: (
        "The device's clock (device_us) contradicted its sequence numbers in 8 of the last 20 "
        "frames: it stood still, counted down or leapt, or the sequence leapt. device_us must grow "
        "by tick_us with each number; restart the device, and correct its firmware if that does "
        "not help."
    ),
    StopReason.OVERSPEED: (
        "Above 30 rad/s (or 5 m/s): the blades moved faster than any capture or hand moves "
        "them; check that the motor and its encoder have the same sense, and that nothing is loose."
    ),
    StopReason.RESTARTED: (
        "The device restarted: its sequence numbers fell back. Check its power supply and cable, "
        "then start again."
    ),
    StopReason.NOT_HOMED: (
        "The device does not know the zero of its encoders (NOT_HOMED). Run 'scissorcal device "
        "home --device PORT' with the blades clear, then start again."
    ),
    StopReason.NO_CONTOUR: (
        "No new estimate of the surface came for too long, so the tip was lifted and the motors "
        "released. Check the camera or what else states the plate's pose, and start again."
    ),
    StopReason.HANDLE_HELD: (
        "A force acts on the handles, so the force at the tip cannot be known: nobody may hold the "
        "handles while the rig presses. Let go, and start again."
    ),
    StopReason.PRESSED_AWAY: (
        "The tip presses on something before it reaches the surface. Remove what it met, or check "
        "the plate's pose and the surface that the recipe states."
    ),
    StopReason.NO_SURFACE: (
        "The tip found nothing to press on where the surface should be. Put the plate in its "
        "place, or check its pose and the surface that the recipe states."
    ),
    StopReason.PRESSED_TOO_HARD: (
        "The tip pressed much harder than asked for. Check for an obstacle on the path and the "
        "plate's pose; a softer touch needs a slower path."
    ),
    StopReason.PATH_LOST: (
        "The tip fell behind its path. Check for an obstacle and a carriage that sticks, or take a "
        "slower path."
    ),
    StopReason.CONTROL_REFUSED: (
        "The tip stands where the axes cannot press on the surface, or a sensor sends no number. "
        "Choose a path nearer to the middle of the rig's reach, and check the sensors."
    ),
    StopReason.TORQUE_HELD: (
        "The motor's torque was at its limit for limits.held_at_limit_s. Check for an obstacle, "
        "or material that is too stiff for limits.torque_Nm; if the torque is meant, raise that "
        "key."
    ),
    StopReason.OSCILLATION: (
        "The blades swung to and fro, driven by the loop itself: commands act too late, or the "
        "gains or the rendered stiffness are too high for it, or the encoder is noisy. Run "
        "'scissorcal device doctor' to find what is late, or lower the gains in the recipe's "
        "rig.control."
    ),
    StopReason.HELD_UP: (
        "The blades swung to and fro because commands came late: this computer was held up by "
        "other work, or the device held its states back. Close programs that load this computer, "
        "then start again; 'scissorcal device doctor' measures how late answers are."
    ),
    StopReason.RUNAWAY: (
        "The blades sped up against the torque of their motor: motor or encoder has the wrong "
        "sense. Positive torque must open the blades and a wider opening count up: set "
        "rig.motor_sign to the other sign or swap two wires of the motor or of the encoder, then "
        "run 'scissorcal device probe'."
    ),
    StopReason.RUNAWAY_ADVANCE: (
        "The carriage sped up against the force of its motor: motor or encoder has the wrong "
        "sense. Positive force must advance it and the advance count up; "
        "swap two wires of one of the two."
    ),
    StopReason.STOP_ELSEWHERE: (
        "The device reports that the blades are at an end stop, more than 0.1 rad from those of "
        "its identity. "
        "Check scale and zero of the encoder, opening_min and opening_max of the device, and that "
        "nothing blocks the blades."
    ),
    StopReason.OPENING_STANDS: (
        "The opening did not change at all while the blades were driven. Check the encoder and its "
        "cable, that the motor is connected, and that nothing blocks the blades."
    ),
    StopReason.ADVANCE_STANDS: (
        "The advance did not change at all while the carriage was driven. Check its encoder, its "
        "motor and their cables, and that nothing blocks the carriage."
    ),
    StopReason.MEASURED_REVERSED: (
        "The measured motor torque has the opposite sign of the commanded one. motor_torque must "
        "be positive when it opens the blades: change its sign in the device."
    ),
    StopReason.MEASURED_DIFFERS: (
        "Measured over commanded motor torque was outside 0.7 to 1.4 for half a second. "
        "Check the scale of motor_torque, the motor's torque constant and its supply."
    ),
    StopReason.CLOCK_RATE: (
        "The device's clock (device_us) is off by more than 2 % of its ticks (tick_us) or 5 % of "
        "this computer's time; rates would be wrong by as much. Correct the device's timer or "
        "tick_us."
    ),
    StopReason.UNREADABLE: (
        "8 of the last 20 frames had a motor torque or handle force that was not finite. Check the "
        "sensors and their cables."
    ),
}
