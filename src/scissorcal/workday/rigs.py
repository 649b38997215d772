"""Open the rig that a command names: a port, or a virtual rig started for the occasion."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.device.link import PortLink

SIM = "sim"


@contextmanager
def open_rig(device: str, specimen: str | None, seed: int = 0) -> "Iterator[PortLink]":
    """Open a link to ``device``; "sim" starts a virtual rig with ``specimen`` between its blades.

    The virtual rig runs in a separate process, behind a real pseudo-terminal, and ends with
    the block. Raises InputError where there is no specimen to simulate, DeviceError where the rig
    cannot be reached.
    """
    from scissorcal.device.link import open_link

    if device != SIM:
        with open_link(device) as link:
            yield link
        return
    from scissorcal.device.sim.process import SimProcess

    if specimen is None:
        raise InputError(
            "The recipe names no specimen, so there is nothing to simulate: add "
            'specimen = "office-paper" at its top, or name a port with --device.'
        )
    with SimProcess(specimen, seed) as sim, open_link(sim.port) as link:
        yield link
