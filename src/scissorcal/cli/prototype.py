"""``scissorcal prototype``"""

import os
import threading
from pathlib import Path
from typing import Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import PLATE_CAMERA, Folder, options_of
from scissorcal.cli.output import Answer, command, note
from scissorcal.workday.options import PrototypeOptions

ADDRESS_FILE = "prototype-address.html"
_OPENED_s = 1.0
"""For a browser that is being opened while the server ends."""
_LEADS_TO = (
    '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0; url={url}"><a href="{url}">The page of the package</a>'
)


_OPTIONS = {
    "device": typer.Option(
        "--device",
        metavar="PORT|sim|none",
        help="The rig that the page may start: its serial port, or sim for a virtual one in "
        "real time. Whatever runs in another terminal is shown without it, too.",
    ),
    "camera": PLATE_CAMERA,
    "package_path": typer.Option(
        "--package", help="The package to show; the workspace's if not given."
    ),
    "port": typer.Option(
        min=0, max=65535, help="Port of the page on this computer; 0: a free one."
    ),
}


@command
@options_of(_OPTIONS)
def prototype(
    options: PrototypeOptions,
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
    server = prototype_server(workspace, options)

    opener = workspace.root / ADDRESS_FILE
    opening: list[threading.Thread] = []

    def ready(url: str) -> None:
        note(f"{url}  (Ctrl-C ends it)")
        if not no_open:  # beside the server: a browser may ask for the page before it returns
            opening.append(threading.Thread(target=_open, args=(url, opener), daemon=True))
            opening[0].start()

    try:
        address = serve(server, ready)
    finally:
        for thread in opening:
            thread.join(_OPENED_s)
            opener.unlink(missing_ok=True)
    return Answer({"address": address, "device": options.device}, "the page is closed")


def _open(url: str, opener: Path) -> None:
    """Open the browser by a file that leads to the address and that only its owner may read.

    The words of a command, and with them the token, can be read by every user of a computer.
    """
    import webbrowser

    try:
        opener.unlink(missing_ok=True)
        with os.fdopen(os.open(opener, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(_LEADS_TO.format(url=url))
        opened = webbrowser.open(opener.as_uri())
    except OSError:  # such as a workspace that may not be written to
        opened = False
    if not opened:
        note("No browser was opened: open the address yourself.")
