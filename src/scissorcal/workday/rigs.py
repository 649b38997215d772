"""Open the rig that a command names: a port, or a virtual rig started for the occasion."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING

from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.device.link import Link, PortLink
    from scissorcal.device.session import Operator, RigSession
    from scissorcal.recipe.schema import Line, Recipe
    from scissorcal.workday.options import RigOptions

SIM = "sim"


@contextmanager
def open_session(
    recipe: "Recipe",
    rig: "RigOptions",
    operator: "Operator | None" = None,
    *,
    recipe_toml: str = "",
    run: int = 0,
    world: "AbstractContextManager[Link] | None" = None,
) -> "Iterator[RigSession]":
    """Open the rig that ``rig`` names, for everything that is done there until the block ends.

    ``recipe_toml`` is the recipe's text, ``run`` as in `open_rig`; ``world`` is the rig of a
    simulated world, which takes the place of the device. Raises as `open_rig` does.
    """
    from scissorcal.device.session import Operator, RigSession

    line = line_of(recipe, rig.baud)
    opened = world or open_rig(
        rig.device, recipe.specimen, rig.seed, run=run, realtime=rig.realtime, line=line
    )
    with opened as link:
        if world:
            _set_line(link, line)
        yield RigSession(link, recipe, operator or Operator(), recipe_toml=recipe_toml)


@contextmanager
def open_rig(
    device: str,
    specimen: str | None,
    seed: int = 0,
    *,
    run: int = 0,
    realtime: bool = False,
    line: "Line | None" = None,
) -> "Iterator[Link]":
    """Open a link to ``device``; "sim" starts a virtual rig with ``specimen`` between its blades.

    The virtual rig runs in this process, in virtual time: as fast as the computer can, and never
    late. ``run`` numbers the runs of one ``seed``, so that each has another noise. With
    ``realtime`` it is as `open_port`. ``line`` has the baud rate, and how long the device waits for
    commands until it brakes; without it the rate is the default and the device keeps its own time.
    Raises InputError where there is no specimen to simulate, or ``realtime`` is asked of a port;
    DeviceError where the rig cannot be reached.
    """
    if device != SIM and realtime:
        raise InputError(
            f"--realtime is for --device sim: {device} is a port, and always runs in real time. "
            "Leave it out."
        )
    if device != SIM or realtime:
        with open_port(device, specimen, seed, line=line) as port:
            yield port
        return
    import numpy as np

    from scissorcal.device.lockstep import LockstepLink

    with LockstepLink(_named(specimen), np.random.default_rng((seed, run))) as link:
        _set_line(link, line)
        yield link


@contextmanager
def open_port(
    device: str, specimen: str | None, seed: int = 0, *, line: "Line | None" = None
) -> "Iterator[PortLink]":
    """Open the port ``device``; "sim" serves a virtual rig on a pseudo-terminal, in real time.

    It runs in a separate process, and ends with the block. Raises as `open_rig` does.
    """
    from scissorcal.device.link import DEFAULT_BAUD, open_link

    if device != SIM:
        with open_link(device, line.baud if line else DEFAULT_BAUD) as link:
            _set_line(link, line)
            yield link
        return
    from scissorcal.device.sim.process import SimProcess

    with SimProcess(_named(specimen), seed) as sim, open_link(sim.port) as link:
        _set_line(link, line)
        yield link


def _named(specimen: str | None) -> str:
    if specimen is None:
        raise InputError(
            "The recipe names no specimen, so there is nothing to simulate: add "
            'specimen = "office-paper" at its top, or name a port with --device.'
        )
    return specimen


def _set_line(link: "Link", line: "Line | None") -> None:
    """Tell the device how long it waits for commands until it brakes; nothing without a line."""
    from scissorcal.kernel import ConfigKey

    if line is not None:
        link.configure(ConfigKey.BRAKE_AFTER_MS, line.brake_after_ms)


def line_of(recipe: "Recipe", baud: int | None) -> "Line":
    """The recipe's line, at another baud rate where one is given."""
    line = recipe.rig.line
    return line if baud is None else line.model_copy(update={"baud": baud})
