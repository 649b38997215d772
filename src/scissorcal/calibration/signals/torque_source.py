"""Whether a recording's motor torque was measured, as its device states."""

import numpy as np

from scissorcal.errors import InputError
from scissorcal.kernel import Capability, StateFlag
from scissorcal.recording.recording import Recording

FIRST_VERSION = 2
"""Of the protocol in which a device can state it."""


def refuse_commanded_torque(recording: Recording) -> None:
    """Raise InputError where strokes were driven by a motor whose torque nobody measured.

    Strokes with the motors off are by the handle force, and the torque of a motor that is off is
    known. Devices of protocol version 1 cannot state it, and imports have no device. The force on
    a carriage is the commanded one in any case.
    """
    device = recording.device
    stated = int(device.get("protocol_version", 0)) >= FIRST_VERSION
    measured = int(device.get("capabilities", 0)) & Capability.TORQUE_MEASURED
    if not stated or measured or recording.kind == "friction-advance":
        return
    flags, stroke = recording.samples["flags"], recording.samples["stroke"]
    if np.any((flags & int(StateFlag.MOTOR_ENABLED) != 0) & (stroke >= 0)):
        raise InputError(
            f"{recording.source or 'The recording'} cannot be fitted: its device states that it "
            "does not measure motor_torque (it lacks the capability TORQUE_MEASURED), so the "
            "recording holds the commanded torque, in which friction and cut do not show. Give the "
            "rig a current sensor, or capture cuts by hand with a handle force sensor "
            "('scissorcal capture cut --hand')."
        )
