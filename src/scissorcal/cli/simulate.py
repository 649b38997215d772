"""``scissorcal device simulate``"""

from typing import Annotated

import typer

from scissorcal.cli.options import Seed
from scissorcal.cli.output import Answer, command, note, stdout_is_for_json
from scissorcal.cli.terminal import echo


@command
def simulate(
    specimen: Annotated[
        str, typer.Argument(help="A built-in specimen, or a .toml file.")
    ] = "office-paper",
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="KIND=VALUE",
            help="drop=0.01, garble=0.01 (shares of frames), delay=16 (ms), unplug=5 or "
            "stuck-encoder=5 (seconds after streaming begins); may be repeated.",
        ),
    ] = None,
    seed: Seed = 0,
) -> Answer:
    """Serve a virtual rig with SPECIMEN between its blades, until interrupted.

    The port's path is the first line on stdout (on stderr with --json, where stdout has one object
    at the end).

    \b
    Example:
      $ scissorcal device simulate office-paper --seed 1
      /dev/pts/0
    """
    from scissorcal.device.sim.sensors import parse_faults
    from scissorcal.device.sim.server import serve
    from scissorcal.device.sim.specimen import load_specimen

    announced: list[str] = []

    def announce(path: str) -> None:
        announced.append(path)
        echo(path, err=stdout_is_for_json())
        note("Serving a virtual rig; interrupt (Ctrl-C) to end it.")

    loaded = load_specimen(specimen)
    ended = serve(loaded, seed, parse_faults(faults or []), announce)
    why = "unplugged, as its fault said" if ended.unplugged else "ended"
    text = f"{why} after {ended.ticks} ticks; the machine held it up {ended.stalls} times"
    result = {
        "port": announced[0],
        "specimen": loaded.name,
        "ticks": ended.ticks,
        "stalls": ended.stalls,
        "unplugged": ended.unplugged,
    }
    return Answer(result, text)
