"""Options that several commands share, as types of their parameters."""

from pathlib import Path
from typing import Annotated, Literal

import typer

Folder = Annotated[
    Path | None,
    typer.Option(
        "--workspace",
        "-w",
        file_okay=False,
        help="The workspace, or a folder in it; the current folder if not given.",
    ),
]

Seed = Annotated[
    int,
    typer.Option(
        "--seed",
        min=0,
        help="Seed of all random numbers. A further capture of one seed in a workspace has other "
        "noise.",
    ),
]

Device = Annotated[
    str,
    typer.Option(
        "--device",
        metavar="PORT|sim",
        help='Serial port of the rig, such as /dev/ttyUSB0, or "sim" for a virtual rig.',
    ),
]

Baud = Annotated[
    int | None,
    typer.Option("--baud", min=9600, max=12_000_000, help="Baud rate, if not the recipe's."),
]

Realtime = Annotated[
    bool,
    typer.Option(
        "--realtime",
        help="Serve the virtual rig on a pseudo-terminal, in real time; otherwise --device sim "
        "runs in virtual time.",
    ),
]

Yes = Annotated[
    bool,
    typer.Option("--yes", help="Ask no questions: the blades are clear, or material is loaded."),
]

TrustedKey = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Public keys (OpenSSH, one a line) that must have signed the package and its review.",
    ),
]

Images = Annotated[
    list[Path] | None,
    typer.Option("--image", "-i", help="A photograph; repeat the option for each."),
]

MoreImages = Annotated[
    list[Path] | None,
    typer.Argument(metavar="FILE", help="More photographs: what --image *.jpg expands to."),
]


Axis = Annotated[
    Literal["opening", "advance"],
    typer.Option(
        "--axis",
        help="Whose friction: that of the blades' opening, or that of the sledge along the cut.",
    ),
]


PlateCamera = Annotated[
    str,
    typer.Option(
        "--camera",
        metavar="NUMBER|sim|none",
        help="A camera by its number that follows the plate while it runs, sim: a rendered plate "
        "(with --device sim), or none.",
    ),
]


def positive(value: float | None) -> float | None:
    """Accept a number above zero, or none; for options of which 0 makes no sense."""
    if value is not None and not value > 0.0:
        raise typer.BadParameter(f"{value:g} is not above 0.")
    return value
