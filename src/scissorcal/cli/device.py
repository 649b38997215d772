"""``scissorcal device``"""

from pathlib import Path
from typing import Annotated, Literal

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.options import RIG, Baud, Device, Folder, Seed, Yes, options_of
from scissorcal.cli.output import Answer, command, note, stdout_is_for_json
from scissorcal.cli.progress import progress
from scissorcal.cli.terminal import echo
from scissorcal.workday.options import RigOptions

_COMMANDS = {
    "list": ("scissorcal.cli.device:list_", "The serial ports of this machine."),
    "doctor": ("scissorcal.cli.device:doctor", "Measure port, timer and scheduler; name remedies."),
    "probe": ("scissorcal.cli.device:probe", "Check a rig before its motors run."),
    "home": ("scissorcal.cli.device_home:home", "Have a device find the zero of its encoders."),
    "simulate": ("scissorcal.cli.device:simulate", "Serve a virtual rig on a pseudo-terminal."),
    "bridge": ("scissorcal.cli.device:bridge", "Serve a motor controller on a pseudo-terminal."),
}


@group(_COMMANDS)
def device() -> None:
    """Find, check or simulate a rig.

    \b
    Example:
      $ scissorcal device list
      /dev/ttyS0
      sim (a virtual rig; every --device takes it)
    """


@command
def list_() -> Answer:
    """List the serial ports of this machine.

    \b
    Example:
      $ scissorcal device list
      /dev/ttyS0
      sim (a virtual rig; every --device takes it)
    """
    from scissorcal.device.ports import known_ports

    ports = known_ports()
    lines = [*(ports or ["no serial port"]), "sim (a virtual rig; every --device takes it)"]
    return Answer({"ports": ports}, "\n".join(lines))


@command
def doctor(
    device: Device,
    seconds: Annotated[
        float, typer.Option(min=0.2, max=600.0, help="How long to listen to the rig.")
    ] = 5.0,
    seed: Seed = 0,
    baud: Baud = None,
) -> Answer:
    """Measure the port, the timer and the scheduler, and name the remedy for what is wrong.

    No motor is enabled. The virtual rig is served on a pseudo-terminal, in real time.

    \b
    Example:
      $ scissorcal device doctor --device sim
      scissorcal-sim, serial office-paper, firmware 1, one frame each 1 ms
      ...
    """
    from scissorcal.device.doctor import examine
    from scissorcal.recipe.schema import Line
    from scissorcal.workday.rigs import open_port

    line = Line(baud=baud) if baud else Line()
    with open_port(device, "office-paper", seed, line=line) as link:
        identity = link.identity
        with progress() as tell:
            found = examine(link, seconds, tell)
    text = (
        f"{identity.name}, serial {identity.serial}, firmware {identity.firmware_version}, "
        f"one frame each {identity.tick_us * 1e-3:g} ms\n"
        f"On this computer, as loaded as now: rig.line.brake_after_ms = {found.brake_after_ms:g}"
    )
    result = {"identity": identity._asdict(), "measurements": found.measurements}
    result["brake_after_ms"] = found.brake_after_ms
    return Answer(result, text, found.verdicts)


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
            help="drop=0.01, garble=0.01 (shares of frames), delay=16 (ms), unplug=5, "
            "stuck-encoder=5 or heat=5 (seconds after streaming begins; heat, current, speed, "
            "supply, driver and stop-button latch a fault), not-homed=1, unmeasured-torque=1, "
            "protocol=1; may be repeated.",
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


@command
def bridge(
    controller: Annotated[
        Literal["moteus"], typer.Argument(help="The controller: moteus, by its maker's client.")
    ],
    board: Annotated[
        Path,
        typer.Option("--board", dir_okay=False, help="A TOML file with the rig's constants."),
    ],
) -> Answer:
    """Serve a motor controller as a device of scissorcal, until interrupted.

    The firmware's core runs in this process: limits, watchdog, faults and stops are its own, and
    each tick makes one exchange with the controller. The port's path is the first line on stdout
    (on stderr with --json, where stdout has one object at the end). docs/bridge.md has the
    constants, and how to write the class for another controller. Not yet run on hardware.

    \b
    Example:
      $ scissorcal device bridge moteus --board board.toml
      /dev/pts/0
    """
    from scissorcal.device.bridge import read_board, serve_bridge
    from scissorcal.device.moteus import open_moteus

    constants, options = read_board(board)
    opened = open_moteus(constants.torque_limit, options)
    announced: list[str] = []

    def announce(path: str) -> None:
        announced.append(path)
        echo(path, err=stdout_is_for_json())
        note(f"Serving {controller} {constants.serial}; interrupt (Ctrl-C) to end it.")

    ended = serve_bridge(constants, opened, announce)
    text = f"ended after {ended.ticks} ticks; the machine held it up {ended.stalls} times"
    result = {"port": announced[0], "ticks": ended.ticks, "stalls": ended.stalls}
    return Answer(result, text)


@command
@options_of(RIG)
def probe(
    rig: RigOptions,
    recipe: Annotated[
        Path | None,
        typer.Option(
            "--recipe", dir_okay=False, help="A recipe file, where there is no workspace."
        ),
    ] = None,
    yes: Yes = False,
    folder: Folder = None,
) -> Answer:
    """Check a rig before its motors run: line, sensors, watchdog, signs, delay, inertia, friction.

    It asks for the blades to be closed and opened by hand, motors off, listens for a second, then
    pushes them each way and lets them swing, within rig.probe. Keep the space between the blades
    empty and let go of the handles when asked. What it finds is kept in device-probe.json; captures
    and renderings probe by themselves where that is missing or old. What no motor may run with is
    refused with its cause, and what it cannot determine with what to do (exit code 4).

    \b
    Example:
      $ scissorcal device probe --device sim
      No fault found.
    \b
      The rig as it was probed: scissorcal-sim office-paper, probed at 2026-11-22T09:15:00+00:00.
                        value
        torque zero     0.033 +- 0.067 (-0.077 to 0.143) mN m
        ...
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.cli.opening import open_workspace
    from scissorcal.device.probe.probe import ProbeRefusedError
    from scissorcal.recipe.load import load_recipe
    from scissorcal.report import panel_text
    from scissorcal.report.subjects.closing import rig_panel
    from scissorcal.workday.runs.probe import probe_device

    workspace = None if recipe else open_workspace(folder)
    given = workspace.recipe() if workspace else load_recipe(recipe or Path())
    try:
        with LiveView(ask=not yes) as view:
            result = probe_device(given, rig, view.operator, workspace=workspace)
    except ProbeRefusedError as error:
        note(panel_text(rig_panel(error.result)))
        raise
    files = [workspace.probe_path] if workspace else []
    text = f"No fault found.\n\n{panel_text(rig_panel(result))}"
    return Answer(result.as_dict(), text, result.verdicts, files)
