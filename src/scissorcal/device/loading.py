"""Loading material: a person is asked, a simulator is commanded."""

from collections.abc import Callable

from scissorcal.device.motion import Motion
from scissorcal.device.recorder import Recorder
from scissorcal.errors import InputError
from scissorcal.kernel import Capability, ConfigKey, Identity

Confirm = Callable[[str], None]
"""Shows a request to a person and returns once it is done; raises to cancel."""


def is_simulator(identity: Identity) -> bool:
    """Whether the rig is virtual, and so loads and clears material by itself."""
    return bool(identity.capabilities & Capability.SIMULATOR)


class Loader:
    """Has the blades cleared, or a fresh sheet loaded.

    On a simulator it sets MATERIAL. Elsewhere it switches the motors off and calls ``confirm``
    with the request; InputError, before anything moves, if there is no ``confirm``.
    """

    def __init__(self, motion: Motion, recorder: Recorder, confirm: Confirm | None) -> None:
        self._motion = motion
        self._recorder = recorder
        self._confirm = confirm
        self.simulated = is_simulator(motion.identity)
        if not self.simulated and confirm is None:
            raise InputError(
                "This capture must ask a person to clear the blades and load material: pass a "
                "confirm callback that shows a sentence and returns when that is done."
            )

    def clear(self, request: str) -> None:
        """Have everything taken out from between the blades."""
        if self.simulated:
            self._motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
            self._motion.configure(ConfigKey.MATERIAL, 0.0)
        else:
            self._ask(request)

    def retract(self) -> None:
        """Before the carriage returns: a simulator's used sheet is taken out, a real one stays."""
        if self.simulated:
            self._motion.configure(ConfigKey.MATERIAL, 0.0)

    def load(self, request: str) -> None:
        """Have a fresh sheet put in, its near edge where advance + contact = 0."""
        if self.simulated:
            self._motion.configure(ConfigKey.MATERIAL, 1.0)
        else:
            self._ask(request)

    def _ask(self, request: str) -> None:
        assert self._confirm is not None
        with self._motion.paused():
            self._confirm(request)
        self._recorder.resume(request)
