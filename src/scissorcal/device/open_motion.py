"""Start the servo on a link, whichever kind of link it is."""

from scissorcal.device.link import Link, PortLink
from scissorcal.device.lockstep_motion import Exchanging, LockstepMotion
from scissorcal.device.motion import BLOCK_S, IDLE, LoopTask, Motion
from scissorcal.device.port_motion import PortMotion
from scissorcal.kernel import ServoConfig


def open_motion(
    link: Link, config: ServoConfig, task: LoopTask = IDLE, *, every_s: float = BLOCK_S
) -> Motion:
    """Start the servo on a link: in a separate process on a port, in this process in virtual time.

    Samples come in blocks of about ``every_s``. It starts idle, with the rig's position known. A
    fault that the device has latched is cleared.

    >>> import numpy as np
    >>> from scissorcal.device.lockstep import LockstepLink
    >>> link = LockstepLink("office-paper", np.random.default_rng(1))
    >>> limits = ServoConfig(torque_limit=1, torque_slew=200, force_limit=0, force_slew=0)
    >>> with open_motion(link, limits) as motion:
    ...     samples = np.concatenate(list(motion.idle(0.2)))
    >>> len(samples), bool(samples["torque_command"].any())
    (200, False)
    """
    if isinstance(link, Exchanging):
        return LockstepMotion(link, config, task, every_s)
    if not isinstance(link, PortLink):
        raise TypeError(f"A {type(link).__name__} is neither a port nor a lockstep link.")
    return PortMotion(link, config, task, every_s)
