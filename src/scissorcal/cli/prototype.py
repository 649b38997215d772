"""``scissorcal prototype``"""

from pathlib import Path
from typing import Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, PlateCamera
from scissorcal.cli.output import Answer, command, note


@command
def prototype(
    device: Annotated[
        str,
        typer.Option(
            "--device",
            metavar="PORT|sim|none",
            help="The rig that the page may start: its serial port, or sim for a virtual one in "
            "real time. Whatever runs in another terminal is shown without it, too.",
        ),
    ] = "none",
    camera: PlateCamera = "none",
    package_path: Annotated[
        Path | None,
        typer.Option("--package", help="The package to show; the workspace's if not given."),
    ] = None,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Port of the page on this computer; 0: a free one."),
    ] = 0,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Print the address, and open no browser.")
    ] = False,
    folder: Folder = None,
) -> Answer:
    """Show the package in a browser: blades, sheet, torque, and what each parameter does.

    The page is served on this computer alone, to who has the address with its token, and fetches
    nothing from anywhere. It follows whatever the rig does, from the recording that is being
    written, and with --device it may start and stop commands: each asks on the page what it asks on
    the command line. Ctrl-C ends the server, and a command that the page started.

    \b
    Example:
      $ scissorcal prototype --device sim
      http://127.0.0.1:41733/?token=kZ3V...  (Ctrl-C ends it)
    """
    from scissorcal.workday.runs.prototype import prototype_server, serve

    workspace = open_workspace(folder)
    server = prototype_server(
        workspace, device=device, camera=camera, package_path=package_path, port=port
    )

    def ready(url: str) -> None:
        note(f"{url}  (Ctrl-C ends it)")
        if not no_open:
            _open(url)

    address = serve(server, ready)
    return Answer({"address": address, "device": device}, "the page is closed")


def _open(url: str) -> None:
    """Open the browser; where there is none, the address was printed."""
    import webbrowser

    if not webbrowser.open(url):
        note("No browser was found: open the address yourself.")
