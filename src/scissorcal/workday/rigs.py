"""Open the rig that a command names: a port, or a virtual rig started for the occasion."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.device.link import Link, PortLink
    from scissorcal.recipe.schema import Line, Recipe

SIM = "sim"


@contextmanager
def open_rig(
    device: str, specimen: str | None, seed: int = 0, *, line: "Line | None" = None
) -> "Iterator[PortLink]":
    """Open a link to ``device``; "sim" starts a virtual rig with ``specimen`` between its blades.

    The virtual rig runs in a separate process, behind a real pseudo-terminal, and ends with
    the block. ``line`` has the baud rate, and how long the device waits for commands until it
    brakes; without it the rate is the default and the device keeps its own time. Raises InputError
    where there is no specimen to simulate, DeviceError where the rig cannot be reached.
    """
    from scissorcal.device.link import DEFAULT_BAUD, open_link

    if device != SIM:
        with open_link(device, line.baud if line else DEFAULT_BAUD) as link:
            set_line(link, line)
            yield link
        return
    from scissorcal.device.sim.process import SimProcess

    if specimen is None:
        raise InputError(
            "The recipe names no specimen, so there is nothing to simulate: add "
            'specimen = "office-paper" at its top, or name a port with --device.'
        )
    with SimProcess(specimen, seed) as sim, open_link(sim.port) as link:
        set_line(link, line)
        yield link


def set_line(link: "Link", line: "Line | None") -> None:
    """Tell the device how long it waits for commands until it brakes; nothing without a line."""
    from scissorcal.kernel import ConfigKey

    if line is not None:
        link.configure(ConfigKey.BRAKE_AFTER_MS, line.brake_after_ms)


def line_of(recipe: "Recipe", baud: int | None) -> "Line":
    """The recipe's line, at another baud rate where one is given."""
    line = recipe.rig.line
    return line if baud is None else line.model_copy(update={"baud": baud})
