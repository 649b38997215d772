"""The plate is put in its place: a person is asked, a simulator is commanded."""

from scissorcal.device.loading import Confirm, is_simulator
from scissorcal.device.motion import Motion
from scissorcal.device.session import RigSession
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey

PLATE = 2.0
"""MATERIAL that puts a virtual rig's plate in."""
REQUEST_FIRST = (
    "Put the plate in its place, below the blades, and keep hands off the handles and away from "
    "the blades: once the plate's pose is known, they open, move over the plate and press on it."
)
REQUEST = (
    "Put the plate in its place, and keep hands off the handles and away from the blades: they "
    "open, move over the plate and press on it."
)


def ask_for_plate(session: RigSession) -> None:
    """Have a person put the plate in before a camera looks for it; a simulator does so by itself.

    Nothing moves meanwhile. InputError where nobody can be asked.
    """
    refuse_nobody(session)
    if not session.simulated:
        assert session.operator.confirm is not None
        session.operator.confirm(REQUEST_FIRST)


def put_plate(motion: Motion, confirm: Confirm | None) -> None:
    """Have the plate put in while a motion waits with its motors off."""
    if is_simulator(motion.identity):
        motion.configure(ConfigKey.MATERIAL, PLATE)
        return
    assert confirm is not None
    with motion.paused():
        confirm(REQUEST)


def refuse_nobody(session: RigSession) -> None:
    """InputError where a person must be asked, and none can be."""
    if not session.simulated and session.operator.confirm is None:
        raise InputError(
            "A person must be asked to put the plate in its place: pass a confirm callback that "
            "shows a sentence and returns when that is done."
        )
