"""Does the device brake when commands stop? At zero torque."""

from dataclasses import dataclass

import numpy as np

from scissorcal.device.probe.idle import CLEARINGS
from scissorcal.device.probe.talk import RELEASE, Answer, Stage, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import ConfigKey, StateFlag

LATER_S = 0.05
LONGEST_BRAKE_MS = 1000.0
"""As in the protocol: no device has a longer BRAKE_AFTER_MS, whatever it refuses."""


@dataclass(frozen=True)
class Watchdog:
    """What silence does.

    ``brake_after_ms`` is the value in force, as asked for where the device refuses it; ``refused``
    is why, empty where it takes the value. Commands were withheld for at most ``withheld_ms``;
    ``braked_ms`` is the silence after which it braked, None where it did not.
    """

    brake_after_ms: float
    refused: str
    withheld_ms: float
    braked_ms: float | None
    latched: bool
    lost_shown: bool
    lost_cleared: bool
    fault_cleared: bool


def watchdog(talk: Talk, brake_after_ms: float) -> Watchdog:
    """Enable the motors at zero torque, then withhold commands.

    ``brake_after_ms`` is set as BRAKE_AFTER_MS, and stays. A device that refuses it keeps another
    value, so commands are withheld for longer than any that the protocol allows.
    """
    refused, in_force = "", brake_after_ms
    try:
        in_force = talk.link.configure(ConfigKey.BRAKE_AFTER_MS, brake_after_ms)
    except DeviceError as error:
        refused = str(error)
    withheld_s = 1e-3 * (LONGEST_BRAKE_MS if refused else in_force) + LATER_S
    braked, latched, shown = talk.play(_silenced(talk, withheld_s))
    lost_cleared, fault_cleared = talk.play(_recovered(talk))
    return Watchdog(
        in_force,
        refused,
        1e3 * withheld_s,
        braked,
        latched,
        shown,
        lost_cleared,
        fault_cleared,
    )


def _silenced(talk: Talk, longest_s: float) -> Stage[tuple[float | None, bool, bool]]:
    """Withhold commands; return the silence until the brake (ms), and which flags showed."""
    state = yield RELEASE
    for _ in range(talk.ticks(LATER_S) + CLEARINGS):
        state = yield Answer(clear=bool(state.flags & StateFlag.FAULT_LATCHED))
        if not state.flags & StateFlag.FAULT_LATCHED and state.flags & StateFlag.MOTOR_ENABLED:
            break
    last, begin = talk.sequence, talk.mark()
    while talk.sequence - last < talk.ticks(longest_s):
        state = yield None
        braked = StateFlag.FAULT_LATCHED | StateFlag.COMMANDS_LOST
        if state.flags & braked:
            heard = talk.heard(begin)  # of several states at once the first tells when
            first = int(np.argmax((heard["flags"] & int(braked)) != 0))
            silent = (int(heard["sequence"][first]) - last) * talk.tick_s
            state = yield None
            shown = bool(state.flags & StateFlag.COMMANDS_LOST)
            return 1e3 * silent, bool(state.flags & StateFlag.FAULT_LATCHED), shown
    return None, False, False


def _recovered(talk: Talk) -> Stage[tuple[bool, bool]]:
    """Send commands again; return whether COMMANDS_LOST clears by them, the fault when asked."""
    state = yield RELEASE
    for _ in range(talk.ticks(LATER_S)):
        state = yield RELEASE
    lost_cleared = not state.flags & StateFlag.COMMANDS_LOST
    for _ in range(CLEARINGS):
        if not state.flags & StateFlag.FAULT_LATCHED:
            break
        state = yield RELEASE._replace(clear=True)
    return lost_cleared, not state.flags & StateFlag.FAULT_LATCHED
