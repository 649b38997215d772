"""Start the servo on a link, whichever kind of link it is."""

from collections.abc import Sequence

from scissorcal.device.link import Link, PortLink
from scissorcal.device.lockstep_motion import Exchanging, LockstepMotion
from scissorcal.device.motion import BLOCK_S, Motion
from scissorcal.device.port_motion import PortMotion
from scissorcal.kernel import ControlConfig, ModelTables, Piece, ServoConfig

SPARE_S = 30.0
"""Room in the shared memory beyond the longest reference, for the approach to its start."""


def open_motion(
    link: Link,
    config: ServoConfig,
    tables: ModelTables | None = None,
    *,
    longest_reference: int = 0,
    every_s: float = BLOCK_S,
    control: ControlConfig | None = None,
    pieces: Sequence[Piece] | None = None,
) -> Motion:
    """Start the servo on a link: in a separate process on a port, in this process in virtual time.

    ``tables`` are needed to render, ``longest_reference`` (ticks) to track or to follow a path,
    ``control`` to press on a surface; ``pieces`` replace the uniform sheet. Samples come in blocks
    of about ``every_s``. It starts idle, with the rig's position known. A fault that the device has
    latched is cleared.

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
        return LockstepMotion(link, config, tables, every_s, control, pieces)
    if not isinstance(link, PortLink):
        raise TypeError(f"A {type(link).__name__} is neither a port nor a lockstep link.")
    capacity = longest_reference + round(SPARE_S * 1e6 / config.tick_us)
    return PortMotion(link, config, tables, capacity, every_s, control, pieces)
