"""Open the rig that a command names: a port, or a virtual rig started for the occasion."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.device.link import Link, PortLink

SIM = "sim"


@contextmanager
def open_rig(
    device: str, specimen: str | None, seed: int = 0, *, run: int = 0, realtime: bool = False
) -> "Iterator[Link]":
    """Open a link to ``device``; "sim" starts a virtual rig with ``specimen`` between its blades.

    The virtual rig runs in this process, in virtual time: as fast as the computer can, and never
    late. ``run`` numbers the runs of one ``seed``, so that each has another noise. With
    ``realtime`` it is as `open_port`. Raises InputError where there is no specimen to simulate,
    DeviceError where the rig cannot be reached.
    """
    if device != SIM or realtime:
        with open_port(device, specimen, seed) as port:
            yield port
        return
    import numpy as np

    from scissorcal.device.lockstep import LockstepLink

    with LockstepLink(_named(specimen), np.random.default_rng((seed, run))) as link:
        yield link


@contextmanager
def open_port(device: str, specimen: str | None, seed: int = 0) -> "Iterator[PortLink]":
    """Open the port ``device``; "sim" serves a virtual rig on a pseudo-terminal, in real time.

    It runs in a separate process, and ends with the block. Raises as `open_rig` does.
    """
    from scissorcal.device.link import open_link

    if device != SIM:
        with open_link(device) as link:
            yield link
        return
    from scissorcal.device.sim.process import SimProcess

    with SimProcess(_named(specimen), seed) as sim, open_link(sim.port) as link:
        yield link


def _named(specimen: str | None) -> str:
    if specimen is None:
        raise InputError(
            "The recipe names no specimen, so there is nothing to simulate: add "
            'specimen = "office-paper" at its top, or name a port with --device.'
        )
    return specimen
